"""The ends of exercises: a hand-in after the end, moved by the student's extension, is not collected.

They are in `ends.json` of nbgrader's course folder: for each exercise a time in ISO 8601, with its zone.
"""

import json
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path

from autograder.errors import UsageError
from autograder.gradebook import shared_file
from autograder.submissions.times import parse_time

FILE = "ends.json"
NONE = "none"  # instead of a time: removes the end


def parse(text: str) -> datetime | str:
    """Return the end given on a command line, or NONE; raises UsageError."""
    return NONE if text.strip().lower() == NONE else parse_time(text)


def read(course: Path) -> dict[str, datetime]:
    """Return the ends of a course folder, in UTC; raises UsageError when the file is invalid."""
    try:
        known = shared_file.from_json(shared_file.read(course / FILE))
        return {str(name): datetime.fromisoformat(time).astimezone(UTC) for name, time in known.items()}
    except FileNotFoundError:
        return {}
    except (ValueError, TypeError, AttributeError, OverflowError) as error:
        raise UsageError(
            f"{course / FILE} cannot be read: {error}. Correct it, or delete it and release again"
        ) from None


def change(course: Path, ends: Mapping[str, datetime | str | None]) -> None:
    """Set the ends of some exercises, or remove them (NONE); None leaves an exercise unchanged.

    Raises OSError and UsageError.
    """
    known = read(course)
    kept = {name: time for name, time in known.items() if ends.get(name) != NONE}
    new = kept | {name: time for name, time in ends.items() if isinstance(time, datetime)}
    if new == known:
        return
    text = json.dumps({name: time.astimezone(UTC).isoformat() for name, time in sorted(new.items())}, indent=1)
    shared_file.write(course / FILE, text)
