"""The record that `autograder collect` keeps of each hand-in, so that its page can be returned to the sender.

`SUBMITTED/.origins/STUDENT/ASSIGNMENT.jsonl` has a line of JSON, the fields of `Source`, for each hand-in that was laid
out there, the present one last.  It is outside the students' folders, so students cannot write it.
"""

import contextlib
import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from course.foundation import storage

ORIGINS = ".origins"
AMONG = ".among-hand-ins"  # in ORIGINS, if the folder around the submissions is one that they were collected from

# The ways in which the time of a hand-in is known.
KNOWN = "known"  # from its receipt or nbgrader: it is in `timestamp.txt`
ON_TIME = "on time"  # the platform marks late hand-ins, and has not marked this one; the time itself is unknown
UNKNOWN = "unknown"  # the times in an archive are those of the download


@dataclass(frozen=True)
class Source:
    """The origin of a hand-in."""

    platform: str  # a key of `platforms.PLATFORMS`, or "" for an archive of `course hand-in` or a folder
    name: str  # of the student there
    user: str  # the student's number there
    file: str  # the name of the handed-in file there; "" for several files
    upload: int = 0  # the platform's number of the upload
    late: bool = False  # marked as late by the platform
    at: str = ""  # the time that orders hand-ins, in ISO 8601; the time of handing in only if KNOWN
    time: str = ""  # KNOWN, ON_TIME or UNKNOWN; "" if collected by an older version


def add(submitted: Path, student: str, assignment: str, source: Source) -> None:
    """Record the origin of the submission that is laid out now, unless it is already recorded."""
    known = read(submitted, student, assignment)
    if known and known[-1].platform and not source.platform:  # its page is returned by the platform anyway
        source = replace(known[-1], at=source.at, time=source.time)
    if known[-1:] == [source]:
        return
    path = _path(submitted, student, assignment)
    path.parent.mkdir(parents=True, exist_ok=True)
    # ASCII escapes also cover file names on the disk that are not UTF-8.
    lines = (json.dumps(asdict(each)).encode() + b"\n" for each in [*known, source])
    storage.replace(path, lines, storage.PRIVATE)


def time_of(submitted: Path, student: str, assignment: str) -> str:
    """Return how the time of the laid-out submission is known: KNOWN, ON_TIME or UNKNOWN; "" if not recorded."""
    return next((source.time for source in reversed(read(submitted, student, assignment))), "")


def read(submitted: Path, student: str, assignment: str) -> list[Source]:
    """Return the origins of a student's hand-ins, the laid-out one last; empty if unknown."""
    found = []
    with contextlib.suppress(OSError):
        for line in _path(submitted, student, assignment).read_bytes().splitlines():
            with contextlib.suppress(ValueError, TypeError):  # edited by hand
                found.append(Source(**json.loads(line)))
    return found


def people(came: list[Source]) -> list[str]:
    """Return the numbers of those whose hand-ins came from the same platform as the last one."""
    return sorted({source.user for source in came if source.platform == came[-1].platform}) if came else []


def among_hand_ins(submitted: Path) -> Path:
    """Return the file that notes that the folder around `submitted` has hand-ins, and may have students' files."""
    return submitted / ORIGINS / AMONG


def _path(submitted: Path, student: str, assignment: str) -> Path:
    return submitted / ORIGINS / student / f"{assignment}.jsonl"
