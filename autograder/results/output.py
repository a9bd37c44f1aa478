"""An output folder that never loses results: results.jsonl, the students' pages, and the instructor's details.

One coordinator writes at a time.  A result counts when its line in results.jsonl is on the disk; feedback and gradebook
can be made from it again, so an interrupted batch can be resumed.  A submission that is graded again has two lines
until the folder is closed, or opened the next time; then the older line moves to history.jsonl.
"""

import contextlib
import fcntl
import json
import os
from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import TypeVar

from autograder.errors import UsageError
from autograder.records import INFRASTRUCTURE_ERROR, Report
from autograder.results import feedback
from autograder.submissions import listing
from course.foundation import storage

RESULTS = "results.jsonl"
HISTORY = "history.jsonl"  # results replaced by newer ones
DETAILS = "details.jsonl"  # for instructors only
ASKED = ".asked.json"  # the submissions that gradings into the folder were asked for

Read = TypeVar("Read")


@dataclass(frozen=True)
class Basis:
    """The inputs that a result was made from; while they are unchanged, grading again would give nothing new."""

    submitted: str  # the folder with STUDENT/ASSIGNMENT/FILES
    suite: str  # the digest of the exercise
    files: str  # the digest of the handed-in files

    def is_replaced(self, key: tuple[str, str]) -> bool:
        """Return True if other files of that student and exercise are in the folder now; False if none are."""
        return (
            listing.is_handed_in(Path(self.submitted), *key)
            and listing.digest(listing.read(Path(self.submitted), *key)) != self.files
        )


class Output:
    """The folder that results are written to; only one process at a time can have it open."""

    def __init__(self, folder: Path, resume: bool):
        """Open the folder; raises UsageError when it is in use or read-only, or has results and `resume` is not set."""
        self.folder = folder
        try:
            folder.mkdir(storage.PRIVATE_FOLDER, parents=True, exist_ok=True)
            self._lock = lock(folder / ".lock", f"another grading is writing to {folder}")
        except OSError as error:
            raise UsageError(f"cannot write to {folder}: {error.strerror}") from None
        self.done = read_results(folder)
        if self.done and not resume:
            raise UsageError(f"{folder} already has results: give --resume to continue, or another folder")
        self._retire()
        self._results = _appending(folder / RESULTS)
        self._details = _appending(folder / DETAILS)
        for report in self.done.values():
            if not self._feedback(report).exists():
                self._write_feedback(report)

    def __enter__(self) -> "Output":
        return self

    def __exit__(self, *exception: object) -> None:
        os.close(self._results)
        os.close(self._details)
        with contextlib.suppress(OSError):  # otherwise done when the folder is opened next
            self._retire()
        os.close(self._lock)

    def left(self, found: list[tuple[str, str]]) -> list[tuple[str, str]]:
        """Return the found submissions that have no result, or only an infrastructure error."""
        return [key for key in found if key not in self.done or self.done[key].status == INFRASTRUCTURE_ERROR]

    def asks(self, found: Iterable[tuple[str, str]]) -> None:
        """Remember what is to be graded, so that an unfinished grading is seen later."""
        keys = sorted({*_asked(self.folder), *found})
        storage.replace(self.folder / ASKED, json.dumps(keys).encode(), storage.PRIVATE)

    def write(self, report: Report, basis: Basis) -> None:
        """Append the instructor's details and then the result, both synced to disk, and write the student's page."""
        who = {"student": report.student, "assignment": report.assignment, "seed": report.seed}
        _append(self._details, {**who, "details": report.details, **asdict(basis)})
        _append(self._results, report.public())
        self.done[report.student, report.assignment] = report
        self._write_feedback(report)

    def move(self, moved: Mapping[tuple[str, str], Basis]) -> None:
        """Note that results were made from the same files as lie elsewhere now: later commands look for them there."""
        last = {(entry["student"], entry["assignment"]): entry for entry in _read_details(self.folder)} if moved else {}
        for key, basis in moved.items():
            _append(self._details, last[key] | asdict(basis))

    def _retire(self) -> None:
        """Move replaced results to the history, and remove an incomplete last line."""
        path = self.folder / RESULTS
        if not path.exists():
            return
        lines = [line for line in path.read_bytes().splitlines(keepends=True) if line.endswith(b"\n")]
        latest = {
            (result["student"], result["assignment"]): number for number, result in enumerate(map(json.loads, lines))
        }
        kept = sorted(latest.values())
        if kept == list(range(len(lines))) and sum(map(len, lines)) == path.stat().st_size:
            return
        history = _appending(self.folder / HISTORY)
        for number in sorted({*range(len(lines))} - {*kept}):
            _write_all(history, lines[number])
        os.fsync(history)
        os.close(history)
        storage.replace(path, (lines[number] for number in kept), storage.PRIVATE)

    def _feedback(self, report: Report) -> Path:
        return self.folder / "feedback" / report.student / f"{report.assignment}.html"

    def _write_feedback(self, report: Report) -> None:
        target = self._feedback(report)
        target.parent.mkdir(parents=True, exist_ok=True)
        storage.replace(target, feedback.page(report).encode(errors="replace"))


def lock(path: Path, busy: str) -> int:
    """Return the descriptor of a file, made if needed, that one process at a time can have: until it closes it or ends.

    Raises UsageError with the message `busy` while another process has it, and OSError.
    """
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, storage.PRIVATE)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        os.close(descriptor)
        if isinstance(error, BlockingIOError):
            raise UsageError(busy) from None
        raise
    return descriptor


def read_results(folder: Path) -> dict[tuple[str, str], Report]:
    """Return the last report of each submission, in the order first written; ignores an incomplete last line.

    Raises UsageError when a line cannot be read.
    """
    return {(report.student, report.assignment): report for report in _read_lines(folder / RESULTS, Report.from_fields)}


def ungraded(
    folder: Path, submitted: Path, done: Container[tuple[str, str]], others: Iterable[tuple[str, str]]
) -> list[tuple[str, str]]:
    """Return the submissions that are there and have no result, `done` being those that have one.

    They are looked for among those that a grading into the folder was asked for, and `others`.
    """
    expected = {*_asked(folder), *others}
    return sorted(key for key in expected if key not in done and listing.is_handed_in(submitted, *key))


def _asked(folder: Path) -> list[tuple[str, str]]:
    with contextlib.suppress(OSError, ValueError):
        return [(student, assignment) for student, assignment in json.loads((folder / ASKED).read_bytes())]
    return []


def read_with_details(
    folder: Path, student: str | None = None, assignment: str | None = None
) -> Iterator[tuple[Report, dict[str, str]]]:
    """Return the last report of each submission, or of one student's or assignment's, with the details by test.

    Raises UsageError when there is none.
    """
    found = read_results(folder)
    chosen = {
        key: report for key, report in found.items() if student in (None, key[0]) and assignment in (None, key[1])
    }
    if not chosen:
        which = " of that student and assignment" if found else f": it has no {RESULTS}, or an empty one"
        raise UsageError(f"no results in {folder}{which}")
    details = {
        (entry["student"], entry["assignment"], entry["seed"]): entry["details"] for entry in _read_details(folder)
    }
    for key, report in chosen.items():
        yield report, details.get((*key, report.seed), {})


def bases(folder: Path, lost: bool = False) -> dict[tuple[str, str], Basis]:
    """Return the inputs of each result of an output folder.

    Raises UsageError when a folder of submissions does not exist any more, unless `lost` allows it.
    """
    known = {field.name for field in fields(Basis)}
    found = {
        (entry["student"], entry["assignment"]): Basis(**{name: entry[name] for name in known})
        for entry in _read_details(folder)
        if known <= entry.keys()
    }
    gone = sorted(place for place in {basis.submitted for basis in found.values()} if not Path(place).is_dir())
    if gone and not lost:
        raise UsageError(f"the submissions of {folder} are no longer in {gone[0]}")
    return found


def submitted(folder: Path) -> Path:
    """Return the folder of the submissions that were graded into an output folder, the last one if there are several.

    Raises UsageError when there are no results, or that folder is gone.
    """
    places = [basis.submitted for basis in bases(folder, lost=True).values()]
    if not places:
        raise UsageError(f"no results in {folder}")
    if not Path(places[-1]).is_dir():
        raise UsageError(f"the submissions of {folder} are no longer in {places[-1]}")
    return Path(places[-1])


def _read_details(folder: Path) -> Iterator[dict]:
    """Yield the instructor's details, in the order written; raises UsageError when a line cannot be read."""

    def entry(fields: dict) -> dict:
        if lacking := {"student", "assignment", "seed", "details"} - fields.keys():
            raise ValueError(f"without {', '.join(sorted(lacking))}")
        return fields

    yield from _read_lines(folder / DETAILS, entry)


def _read_lines(path: Path, made_of: Callable[[dict], Read]) -> Iterator[Read]:
    """Yield what is made of each line's fields, without an incomplete last line; nothing when there is no file.

    Raises UsageError when a line cannot be read.
    """
    with contextlib.ExitStack() as stack:
        try:
            file = stack.enter_context(open(path, "rb"))
        except FileNotFoundError:
            return
        for number, line in enumerate(file, start=1):
            if not line.endswith(b"\n"):
                return
            try:
                record = json.loads(line.decode())
                if not isinstance(record, dict):
                    raise ValueError(f"{type(record).__name__} instead of a record")
                read = made_of(record)
            except (ValueError, RecursionError) as error:
                raise UsageError(
                    f"{path}, line {number}, is damaged or of another version of the grader ({error}). Use the version "
                    "that wrote it, or remove that line: `autograder grade` with --resume grades the submission again"
                ) from None
            yield read


def _appending(path: Path) -> int:
    """Open a file for appending after its last complete line; only this user may read the file."""
    descriptor = os.open(path, os.O_RDWR | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC, storage.PRIVATE)
    os.ftruncate(descriptor, path.read_bytes().rfind(b"\n") + 1)
    return descriptor


def _append(descriptor: int, record: dict) -> None:
    """Write a line and sync it to disk, or write nothing at all."""
    size = os.fstat(descriptor).st_size
    try:
        _write_all(descriptor, json.dumps(record).encode() + b"\n")
        os.fsync(descriptor)
    except OSError:
        os.ftruncate(descriptor, size)
        raise


def _write_all(descriptor: int, content: bytes) -> None:
    while content:
        content = content[os.write(descriptor, content) :]
