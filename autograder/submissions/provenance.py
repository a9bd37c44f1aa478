"""The record that `autograder collect` keeps of each hand-in, so that its page can go back to whom it came from.

`SUBMITTED/.origins/STUDENT/ASSIGNMENT.jsonl` has a line of JSON for each hand-in that was laid out there, the last one
for what is there now: the fields of `Source`.  It lies outside of the students' folders, where they write nothing.
"""

import contextlib
import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from course.foundation import storage

ORIGINS = ".origins"

# Who vouches for the time of a hand-in.
KNOWN = "known"  # its receipt, or nbgrader: it is in `timestamp.txt`
ON_TIME = "on time"  # the platform, which marks what is late and has not marked this; it says no time
UNKNOWN = "unknown"  # nobody: an archive's own times are those of the download


@dataclass(frozen=True)
class Source:
    """The origin of a hand-in."""

    platform: str  # a key of `platforms.PLATFORMS`, or "" for an archive of `course hand-in` or a folder
    name: str  # of the student there
    user: str  # the student's number there
    file: str  # what was handed in was called so there; "" for several files
    upload: int = 0  # the platform's number of the upload
    late: bool = False  # marked so by the platform
    at: str = ""  # the time by which hand-ins are put in order, in ISO 8601; not that of handing in unless KNOWN
    time: str = ""  # KNOWN, ON_TIME or UNKNOWN; "" when an older version has collected it


def add(submitted: Path, student: str, assignment: str, source: Source) -> None:
    """Remember where the submission that is laid out now came from; what is known already is not said twice."""
    known = read(submitted, student, assignment)
    if known and known[-1].platform and not source.platform:  # its page goes back by the platform all the same
        source = replace(known[-1], at=source.at, time=source.time)
    if known[-1:] == [source]:
        return
    path = _path(submitted, student, assignment)
    path.parent.mkdir(parents=True, exist_ok=True)
    # Not every name of a file on the disk is UTF-8: such characters are escaped, too.
    lines = (json.dumps(asdict(each)).encode() + b"\n" for each in [*known, source])
    storage.replace(path, lines, storage.PRIVATE)


def time_of(submitted: Path, student: str, assignment: str) -> str:
    """Return who vouches for the time of the submission that is laid out: KNOWN, ON_TIME or UNKNOWN; "" if unsaid."""
    return next((source.time for source in reversed(read(submitted, student, assignment))), "")


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
