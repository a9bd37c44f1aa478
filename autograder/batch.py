"""Grading a folder of submissions: who is to be graded, and the reports as they come."""

import hashlib
import os
import secrets
from collections.abc import Iterable, Iterator
from pathlib import Path

from . import exercises, submission
from .output import Origin, UsageError
from .records import Report, Submission


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


def grade(client, submitted: Path, seeds: dict[tuple[str, str], int], patience: float,
          unsafe: bool) -> Iterator[tuple[Report, Origin]]:
    """Grade the (student, assignment) pairs in `seeds`, each with its seed; reports come in the order they are done.

    `client` is what `cluster.local` or `cluster.remote` gives; None will do when there is nothing to grade.
    """
    if not seeds:
        return
    from . import cluster  # takes a second to load
    digests = {name: exercises.pack(name).digest for name in {assignment for _, assignment in seeds}}
    origins = {}

    def handed_in() -> Iterator[tuple[Submission, int]]:
        for key, seed in seeds.items():
            found = read(submitted, *key)
            origins[key] = Origin(str(submitted.resolve()), digests[key[1]], digest(found))
            yield found, seed

    for report in cluster.grade(client, handed_in(), patience, unsafe):
        yield report, origins.pop((report.student, report.assignment))


def digest(handed_in: Submission) -> str:
    """Tells one content of a submission from another."""
    return hashlib.sha256(repr((sorted(handed_in.files.items()), handed_in.problems)).encode()).hexdigest()


def draw(found: Iterable[tuple[str, str]], seed: int | None) -> dict[tuple[str, str], int]:
    """A seed for each submission: the given one, or a new one."""
    return {key: secrets.randbits(32) if seed is None else seed for key in found}
