"""A folder of submissions, laid out as `<student>/<assignment>/<files>`."""

import hashlib
import os
from collections.abc import Iterable
from pathlib import Path

from autograder.errors import UsageError
from autograder.records import Submission
from autograder.submissions import exercises, reading
from course.foundation.untrusted import one_line

JUNK = {"__MACOSX", "@eaDir"}  # left by archives and file servers


def find(submitted: Path, assignment: str | None, students: Iterable[str]) -> list[tuple[str, str]]:
    """The (student, assignment) pairs in a folder of submissions, in order; raises UsageError when there are none."""
    if not submitted.is_dir():
        raise UsageError(f"there is no folder {submitted}")
    known = exercises.names() if assignment is None else [exercises.load(assignment).name]
    present = folders(submitted)
    chosen = list(students) or present
    if missing := sorted(set(chosen) - set(present)):
        raise UsageError(f"no folder in {submitted} for student {missing[0]!r}")
    found = [(student, name) for student in chosen for name in known if is_handed_in(submitted, student, name)]
    if not found:
        what = f"{assignment} of " if assignment else ""
        hints = [
            hint for hint in overlooked(submitted) if not students or hint.partition("/")[0].partition(":")[0] in chosen
        ]
        nothing = f"nothing to grade: {submitted} has no submission {what}in the form STUDENT/ASSIGNMENT/FILES"
        raise UsageError("; ".join([nothing, *hints]))
    return found


def folders(submitted: Path) -> list[str]:
    """Return the names of the students' folders, in order."""
    return [entry.name for entry in _entries(submitted) if entry.is_dir() and _is_text(entry.name)]


def is_handed_in(submitted: Path, student: str, assignment: str) -> bool:
    """Return True if a student's submission is there; so is a link or a file in its place, refused when it is read."""
    return os.path.lexists(submitted / student / assignment)


def _entries(submitted: Path) -> list[os.DirEntry]:
    """Return the entries of the folder of submissions, by name, without those left by archives and file servers."""
    return sorted(
        (entry for entry in os.scandir(submitted) if not entry.name.startswith(".") and entry.name not in JUNK),
        key=lambda entry: entry.name,
    )


def _is_text(name: str) -> bool:
    """Return True if a name is UTF-8; any other encoding cannot be written into results or the gradebook."""
    try:
        name.encode()
    except UnicodeEncodeError:
        return False
    return True


def overlooked(submitted: Path) -> list[str]:
    """Return a line for the instructor about each entry that `find` ignores but that looks like a submission."""
    hints = [
        f"{entry.name}: left out, because its name begins with a full stop"
        for entry in os.scandir(submitted)
        if entry.name.startswith(".") and any(os.path.isdir(Path(entry, name)) for name in exercises.names())
    ]
    for entry in _entries(submitted):
        if not entry.is_dir():
            hints.append(f"{entry.name}: not a student's folder")
            continue
        if not _is_text(entry.name):
            hints.append(f"{os.fsencode(entry.name)!r}: not a name in UTF-8: rename the folder")
            continue
        inside = sorted(os.listdir(entry))
        near = {
            name: known for name in inside for known in exercises.names() if name != known and name.lower() == known
        }
        hints += [f"{entry.name}/{name}: is that {known}?" for name, known in near.items() if known not in inside]
        if not near and any(name.endswith((".py", ".ipynb", ".srv", ".zip")) for name in inside):
            hints.append(f"{entry.name}: files that are not in the folder of an exercise")
    return [one_line(hint) for hint in hints]


def read(submitted: Path, student: str, assignment: str) -> Submission:
    """Read one submission of the folder."""
    if (submitted / student).is_symlink():
        return Submission(student, assignment, problems=[f"{student} is a link: hand in the folder itself."])
    return reading.read(submitted / student / assignment, student, assignment, exercises.load(assignment).files)


def digest(handed_in: Submission) -> str:
    """A hash of a submission's content."""
    return hashlib.sha256(repr((sorted(handed_in.files.items()), handed_in.problems)).encode()).hexdigest()
