"""The record that `autograder collect` keeps of each hand-in, so that its page can go back to whom it came from.

`SUBMITTED/.origins/STUDENT/ASSIGNMENT.jsonl` has a line of JSON for each hand-in that was laid out there, the last one
for what is there now: the fields of `Source`.  It lies outside of the students' folders, where they write nothing.
"""

import contextlib
import json
from dataclasses import asdict, dataclass
from pathlib import Path

from course.foundation import storage

ORIGINS = ".origins"


@dataclass(frozen=True)
class Source:
    """The origin of a hand-in."""

    platform: str  # a key of `platforms.PLATFORMS`, or "" for an archive of `course hand-in` or a folder
    name: str  # of the student there
    user: str  # the student's number there
    file: str  # what was handed in was called so there; "" for several files
    upload: int = 0  # the platform's number of the upload
    late: bool = False  # marked so by the platform


def add(submitted: Path, student: str, assignment: str, source: Source) -> None:
    """Remember where the submission that is laid out now came from; what is known already is not said twice."""
    known = read(submitted, student, assignment)
    if known[-1:] == [source] or (known and not source.platform and known[-1].platform):
        return
    path = _path(submitted, student, assignment)
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = (json.dumps(asdict(each), ensure_ascii=False).encode() + b"\n" for each in [*known, source])
    storage.replace(path, lines, storage.PRIVATE)


def read(submitted: Path, student: str, assignment: str) -> list[Source]:
    """Return the origins of a student's hand-ins, that of the one laid out now last; empty when unknown."""
    found = []
    with contextlib.suppress(OSError):
        for line in _path(submitted, student, assignment).read_bytes().splitlines():
            with contextlib.suppress(ValueError, TypeError):  # edited by hand
                found.append(Source(**json.loads(line)))
    return found


def _path(submitted: Path, student: str, assignment: str) -> Path:
    return submitted / ORIGINS / student / f"{assignment}.jsonl"
