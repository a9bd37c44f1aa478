"""The messages for each wrong answer: `messages/EXERCISE.toml`, which a person has compared with the mistakes.

It has a table for each wrong answer, with the message of the first hidden test that it loses, and perhaps of others:

    ["relay asks twice"]
    relay_asks_each_time = "Each call of /relay must be one request to /add_two_ints, ... and has sent ... requests."

`...` stands for one number or word that was drawn or measured, and a message may go on after the end.  A list has the
messages of which one must come, for a wrong answer that is told otherwise from time to time.
"""

import re
import tomllib
from pathlib import Path

FOLDER = Path(__file__).with_name("messages")


def names() -> list[str]:
    """The exercises that have a table."""
    return sorted(file.stem for file in FOLDER.glob("*.toml"))


def table(exercise: str) -> dict[str, dict[str, list[str]]]:
    """Return what is told, by wrong answer and hidden test (without "test_"); empty when nothing is written down."""
    file = FOLDER / f"{exercise}.toml"
    written = tomllib.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    return {
        name: {test: [said] if isinstance(said, str) else said for test, said in told.items()}
        for name, told in written.items()
    }


def fits(pattern: str, message: str) -> bool:
    """Return True if a message is the one that is written down."""
    return re.match(".*?".join(map(re.escape, pattern.split("..."))), message, re.DOTALL) is not None


def others(exercise: str, name: str, told: dict[str, str]) -> dict[str, str]:
    """Return which of the messages that a wrong answer was `told`, by test, are not those that are written down."""
    known = table(exercise).get(name, {})
    return {
        test: message
        for test, message in told.items()
        if test in known and not any(fits(pattern, message) for pattern in known[test])
    }


def open_places(pattern: str) -> int:
    """Return how many numbers or words of a message are left open: a range, `... to ...`, is one.

    Dots behind a letter, for a plural, and those that a program or a command has, such as `Lift.Result(...)`, are none.
    """
    return len(re.findall(r"(?<![\w(=.])(?<!--ros-args )\.\.\.", pattern.replace("... to ...", "...")))
