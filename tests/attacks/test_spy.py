"""The program that looks around finds what there is to find: what it does not find in a grading is not there."""

import itertools
import subprocess
import sys
from pathlib import Path

import pytest

from autograder.sandbox import sandbox

from .programs import REPOSITORY, SPY

PREFIX = Path(sys.prefix)
# Where Python is, when the checkout is in its user's home: as root in a container, or as an ordinary user.
PLACES = [PREFIX, Path("/root/course/.venv"), Path("/home/ada/course/.venv")]
# A file that should not be seen, what the spy asks about, and options of bubblewrap that are needed before.
LEAKS = {
    "root's file, beside the way to Python": ("/root/secret.txt", "path", []),
    "a file of the checkout, beside Python": ("{checkout}/notes.txt", "path", []),
    "the passwords": ("/etc/shadow", "path", []),
    "a socket's folder": ("/run/socket", "path", []),
    "the suite in the checkout": ("{checkout}/autograder/hidden/calculator/suite.py", "files", []),
    "results among Python's own files": ("{prefix}/etc/results.jsonl", "files", ["--tmpfs", "{prefix}/etc"]),
    "a gradebook": ("/srv/gradebook.db", "files", []),
    "another student's program": ("/home/bob/answer.py", "files", []),
    "the grader, to import": ("/home/student/autograder/__init__.py", "imports", []),
}


def way_to(path: Path) -> list[str]:
    """Options of bubblewrap that make the folders which `path` is in."""
    return [word for folder in [*reversed(path.parents)][1:] for word in ("--perms", "0755", "--dir", str(folder))]


def look_around(confinement: str, prefix: Path, leak: str = "", needed: list[str] | None = None) -> str:
    """Return what the spy says in a sandbox where Python is at `prefix` and the file `leak` can be seen."""
    names = {"checkout": prefix.parent, "prefix": prefix}
    with sandbox.Sandbox(
        confinement, {"spy.py": SPY.replace(repr(str(REPOSITORY)), repr(str(prefix.parent))).encode()}
    ) as made:
        command = made.command(["spy.py"], domain=0)
        if prefix != PREFIX:
            at = command.index(str(PREFIX))  # where it is really, and then where it is seen
            command[at + 1 :] = [word.replace(str(PREFIX), str(prefix)) for word in command[at + 1 :]]
            begin = at - 1 - len(way_to(PREFIX))
            assert command[begin : at - 1] == way_to(PREFIX)
            command[begin : at - 1] = way_to(prefix)
        more = [word.format(**names) for word in needed or []]
        if leak:
            path = Path(leak.format(**names))
            more += [*way_to(path), "--perms", "0444", "--ro-bind-data", made._memory(b"secret = 1"), str(path)]
        end = next(at for at, words in enumerate(itertools.pairwise(command)) if words == ("--remount-ro", "/"))
        command = [*sandbox.CONFINEMENTS[confinement], *command[:end], *more, *command[end:]]
        done = subprocess.run(command, pass_fds=made.descriptors, capture_output=True, text=True, timeout=60)
    assert "SPY" in done.stdout, done.stderr
    return done.stdout.strip()


@pytest.mark.parametrize("prefix", PLACES, ids=str)
def test_it_holds_python_and_the_way_to_it_for_no_leak(confinement, prefix):
    assert look_around(confinement, prefix) == "SPY held"


@pytest.mark.parametrize("prefix", PLACES, ids=str)
@pytest.mark.parametrize("leak", LEAKS)
def test_it_finds(confinement, leak, prefix):
    path, question, needed = LEAKS[leak]
    said = look_around(confinement, prefix, path, needed)
    assert f"{question}=" in said, said
