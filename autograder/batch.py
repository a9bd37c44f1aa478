"""Grading a folder of submissions: who is to be graded, and the reports as they come."""

import hashlib
import os
import secrets
from collections.abc import Iterable, Iterator
from pathlib import Path

from . import exercises, submission
from .output import Origin, UsageError
from .records import Report, Submission

JUNK = {"__MACOSX", "@eaDir"}  # what archives and file servers leave


def find(submitted: Path, assignment: str | None, students: Iterable[str]) -> list[tuple[str, str]]:
    """The (student, assignment) pairs in a folder laid out as `<student>/<assignment>/<files>`, in order."""
    if not submitted.is_dir():
        raise UsageError(f"there is no folder {submitted}")
    known = exercises.names() if assignment is None else [exercises.load(assignment).name]
    present = [entry.name for entry in _entries(submitted) if entry.is_dir()]
    chosen = list(students) or present
    if missing := sorted(set(chosen) - set(present)):
        raise UsageError(f"no folder in {submitted} for student {missing[0]!r}")
    # lexists: what is a link or a file in the place of the folder was handed in, and is refused when it is read.
    found = [(student, name) for student in chosen for name in known if os.path.lexists(submitted / student / name)]
    if not found:
        what = f"{assignment} of " if assignment else ""
        hints = [hint for hint in overlooked(submitted) if not students or hint.partition("/")[0].partition(":")[0] in chosen]
        nothing = f"nothing to grade: {submitted} holds no submission {what}in the form STUDENT/ASSIGNMENT/FILES"
        raise UsageError("; ".join([nothing, *hints]))
    return found


def _entries(submitted: Path) -> list[os.DirEntry]:
    """What was handed in, by name."""
    return sorted((entry for entry in os.scandir(submitted) if not entry.name.startswith(".") and entry.name not in JUNK),
                  key=lambda entry: entry.name)


def overlooked(submitted: Path) -> list[str]:
    """What somebody may have handed in, and `find` does not see: a line each, for the instructor."""
    hints = []
    for entry in _entries(submitted):
        if not entry.is_dir():
            hints.append(f"{entry.name}: not a student's folder")
            continue
        inside = sorted(os.listdir(entry))
        near = {name: known for name in inside for known in exercises.names() if name != known and name.lower() == known}
        hints += [f"{entry.name}/{name}: is that {known}?" for name, known in near.items() if known not in inside]
        if not near and any(name.endswith((".py", ".ipynb", ".srv", ".zip")) for name in inside):
            hints.append(f"{entry.name}: files, but no folder of an exercise around them")
    return hints


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
    origins = {}

    def handed_in() -> Iterator[tuple[Submission, int]]:
        for key, seed in seeds.items():
            found = read(submitted, *key)
            origins[key] = Origin(str(submitted.resolve()), exercises.pack(key[1]).digest, digest(found))
            yield found, seed

    for report in cluster.grade(client, handed_in(), patience, unsafe):
        yield report, origins.pop((report.student, report.assignment))


def outdated(origin: Origin, key: tuple[str, str]) -> bool:
    """Whether a result is by another suite or of other files than there are now; what is gone was not handed in again."""
    now = current(origin, key)
    return origin.suite != now.suite or origin.files != now.files and os.path.lexists(Path(origin.submitted, *key))


def current(origin: Origin, key: tuple[str, str]) -> Origin:
    """What a result would be made from now."""
    return Origin(origin.submitted, exercises.pack(key[1]).digest, digest(read(Path(origin.submitted), *key)))


def digest(handed_in: Submission) -> str:
    """Tells one content of a submission from another."""
    return hashlib.sha256(repr((sorted(handed_in.files.items()), handed_in.problems)).encode()).hexdigest()


def draw(found: Iterable[tuple[str, str]], seed: int | None) -> dict[tuple[str, str], int]:
    """A seed for each submission: the given one, or a new one."""
    return {key: secrets.randbits(32) if seed is None else seed for key in found}
