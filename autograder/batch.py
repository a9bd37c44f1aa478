"""Grading a folder of submissions: who is to be graded, and an output folder that never loses what it holds.

One coordinator writes at a time.  A result counts when its line in results.jsonl is on the disk; feedback and gradebook
follow from it and can be made again, so a batch that was killed resumes where it stood.
"""

import fcntl
import json
import os
from collections.abc import Iterable, Iterator
from pathlib import Path

from . import exercises, feedback, submission
from .records import INFRASTRUCTURE_ERROR, Report, Submission

RESULTS, DETAILS = "results.jsonl", "details.jsonl"  # the second for instructors alone


class UsageError(Exception):
    """The command cannot be carried out as given; the message is one line for the person who gave it."""


def find(submitted: Path, assignment: str | None, students: Iterable[str]) -> list[tuple[str, str]]:
    """The (student, assignment) pairs in a folder laid out as `<student>/<assignment>/<files>`, in order."""
    if not submitted.is_dir():
        raise UsageError(f"there is no folder {submitted}")
    known = exercises.names() if assignment is None else [exercises.load(assignment).name]
    present = sorted(entry.name for entry in os.scandir(submitted)
                     if not entry.name.startswith(".") and entry.is_dir())
    chosen = list(students) or present
    if missing := sorted(set(chosen) - set(present)):
        raise UsageError(f"no folder in {submitted} for student {missing[0]!r}")
    # lexists: what is a link or a file in the place of the folder was handed in, and is refused when it is read.
    found = [(student, name) for student in chosen for name in known if os.path.lexists(submitted / student / name)]
    if not found:
        what = f"{assignment} of " if assignment else ""
        raise UsageError(f"nothing to grade: {submitted} holds no submission {what}in the form STUDENT/ASSIGNMENT/FILES")
    return found


def read(submitted: Path, student: str, assignment: str) -> Submission:
    """One submission of the folder."""
    if (submitted / student).is_symlink():
        return Submission(student, assignment, problems=[f"{student} is a link: hand in the folder itself."])
    return submission.read(submitted / student / assignment, student, assignment, exercises.load(assignment).files)


class Output:
    """The folder that results are written to; open in one process at a time."""

    def __init__(self, folder: Path, resume: bool):
        """Raises UsageError when there are results already and `resume` is not set, or when it is in use."""
        self.folder = folder
        self._path = folder / RESULTS
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._lock = os.open(folder / ".lock", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        except OSError as error:
            raise UsageError(f"cannot write to {folder}: {error.strerror}") from None
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise UsageError(f"another grading is writing to {folder}") from None
        self.done = {(report.student, report.assignment): report for report in read_results(self._path)}
        if self.done and not resume:
            raise UsageError(f"{folder} holds results already: give --resume to go on, or another folder")
        self._file = open(self._path, "ab")  # noqa: SIM115  # __exit__ closes it
        self._file.truncate(_whole_lines(self._path))
        descriptor = os.open(folder / DETAILS, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC, 0o600)
        self._details = open(descriptor, "ab")  # noqa: SIM115
        self._details.truncate(_whole_lines(folder / DETAILS))
        for report in self.done.values():
            if not self._feedback(report).exists():
                self._write_feedback(report)

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        self._file.close()
        self._details.close()
        os.close(self._lock)

    def left(self, found: list[tuple[str, str]]) -> list[tuple[str, str]]:
        """Of the submissions found, those that have no lasting result."""
        return [key for key in found if key not in self.done or self.done[key].status == INFRASTRUCTURE_ERROR]

    def write(self, report: Report) -> None:
        """Append a result, for good, the instructor's details before it, and write the student's page."""
        self._details.write(json.dumps({"student": report.student, "assignment": report.assignment, "seed": report.seed,
                                        "details": report.details}).encode() + b"\n")
        self._details.flush()
        self._file.write(json.dumps(report.public()).encode() + b"\n")
        self._file.flush()
        os.fsync(self._file.fileno())
        self.done[report.student, report.assignment] = report
        self._write_feedback(report)

    def _feedback(self, report: Report) -> Path:
        return self.folder / "feedback" / report.student / f"{report.assignment}.html"

    def _write_feedback(self, report: Report) -> None:
        target = self._feedback(report)
        target.parent.mkdir(parents=True, exist_ok=True)
        draft = target.with_suffix(".part")
        draft.write_bytes(feedback.page(report).encode(errors="replace"))
        draft.replace(target)


def read_results(path: Path) -> Iterator[Report]:
    """The reports in a results.jsonl, in the order written; a line cut off by a kill is left out."""
    if path.exists():
        with open(path, "rb") as file:
            for line in file:
                if line.endswith(b"\n"):
                    yield Report.from_fields(json.loads(line))


def _whole_lines(path: Path) -> int:
    """The bytes up to the end of the last whole line."""
    return path.read_bytes().rfind(b"\n") + 1
