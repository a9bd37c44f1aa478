"""Digests of the installed code: a worker on another machine must grade with the same code as the coordinator."""

import hashlib
from collections.abc import Iterator, Mapping
from pathlib import Path

from autograder.paths import COURSE, HIDDEN, PACKAGE

CODE = {".action", ".cmake", ".html", ".msg", ".py", ".srv", ".txt", ".xml"}  # suffixes: leaves out editors' files
SHOWN = 3  # differing files that are named


def digests() -> dict[str, str]:
    """The digest of each file of `autograder` and `course`, by its path below them.

    The hidden suites are left out: they are sent with each submission.
    """
    return {
        f"{package.name}/{path.relative_to(package)}": hashlib.sha256(path.read_bytes()).hexdigest()
        for package in (PACKAGE, COURSE)
        for path in _files(package)
    }


def difference(mine: Mapping[str, str], theirs: Mapping[str, str]) -> str:
    """Return how a worker's digests differ from the coordinator's, in words; "" when they do not."""
    names = sorted(name for name in mine.keys() | theirs.keys() if mine.get(name) != theirs.get(name))
    told = []
    for name in names[:SHOWN]:
        if name not in theirs:
            told.append(f"{name} is missing there")
        elif name not in mine:
            told.append(f"{name} is missing here")
        else:
            told.append(f"{name} differs")
    if len(names) > SHOWN:
        told.append(f"and so on, {len(names)} files in all")
    return ", ".join(told)


def _files(package: Path) -> Iterator[Path]:
    for path in package.rglob("*"):
        apart = "__pycache__" in path.parts or path.is_relative_to(HIDDEN)
        if path.suffix in CODE and not apart and path.is_file():
            yield path
