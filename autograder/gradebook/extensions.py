"""Extensions given by `autograder extend`: more time for a student, for one exercise or for all.

They are in `extensions.json` in nbgrader's course folder: by student, then by exercise or "*" for all, a number of days
or a time as in `LatePolicy.extensions`.  Of several due dates the latest counts.
"""

import difflib
import json
from collections.abc import Iterable
from datetime import datetime
from pathlib import Path

from autograder.errors import UsageError
from autograder.gradebook import shared_file
from autograder.results.targets import SOURCE
from autograder.submissions import exercises, roster
from course.foundation.times import MINUTES

FILE = "extensions.json"
ALL = "*"  # stands for all exercises
LONGEST = 3660.0  # days
CLOSE = 0.75  # from 0 to 1: how like another a name is that may be meant

Given = dict[str, dict[str, float | str]]  # by student and exercise


def read(course: Path) -> Given:
    """Return the extensions of a course folder; raises UsageError when the file is invalid."""
    try:
        return parse(shared_file.read(course / FILE), course / FILE)
    except FileNotFoundError:
        return {}
    except ValueError as error:  # a pipe, say
        raise UsageError(f"{course / FILE} cannot be read: {error}. Delete it, and extend again") from None


def parse(content: bytes, path: Path) -> Given:
    """Return the extensions in a file's content, {} when it is empty; raises UsageError as `read` does."""
    try:
        given = shared_file.from_json(content) if content else {}
        days = [day for of_one in given.values() for day in of_one.values() if not isinstance(day, str)]
        if not all(abs(day) <= LONGEST for day in days):
            raise ValueError(f"an extension of more than {LONGEST:g} days")
        return {
            str(student): {str(name): day if isinstance(day, str) else float(day) for name, day in of_one.items()}
            for student, of_one in given.items()
        }
    except (ValueError, TypeError, AttributeError) as error:
        raise UsageError(f"{path} cannot be read: {error}. Correct it, or delete it and extend again") from None


def listed(given: Given) -> list[tuple[str, str, str]]:
    """Return student, exercise (or ALL), and the extension in words, for each extension."""
    return [
        (student, name, f"until {more}" if isinstance(more, str) else f"{more:g} {'day' if more == 1 else 'days'} more")
        for student, of_one in given.items()
        for name, more in of_one.items()
    ]


def change(course: Path, students: Iterable[str], exercise: str | None, extension: float | datetime | None) -> Given:
    """Give `students` more days, or time until a date, or take extensions back (None); return all extensions.

    Taking back for ALL takes back those for single exercises, too.  Raises UsageError when `course` is not a course
    folder, the exercise does not exist, or the extension is longer than LONGEST.
    """
    if not (course / "nbgrader_config.py").exists():
        raise UsageError(f"{course} is not a course folder: `autograder release --course` makes one")
    if exercise and exercise not in {*exercises.names(), *released(course)}:
        known = ", ".join(sorted({*exercises.names(), *released(course)}))
        raise UsageError(f"there is no exercise '{exercise}'; there are: {known}")
    if isinstance(extension, int | float) and not abs(extension) <= LONGEST:
        raise UsageError(f"an extension is at most {LONGEST:g} days")
    students = list(students)
    if not all(student.strip() for student in students):
        raise UsageError("the name of a student is empty")
    more = f"{extension:{MINUTES} %Z}" if isinstance(extension, datetime) else extension
    with shared_file.alone(course):
        given = read(course)
        for student in students:
            of_one = given.setdefault(student, {})
            if more is not None:
                of_one[exercise or ALL] = more
            elif exercise:
                of_one.pop(exercise, None)
            else:
                of_one.clear()
        kept = {student: of_one for student, of_one in sorted(given.items()) if of_one}
        shared_file.write(course / FILE, json.dumps(kept, indent=1, ensure_ascii=False))
    return kept


def unknown(course: Path, students: Iterable[str]) -> dict[str, str]:
    """Return those students who are not in the course, each with the name of one that may be meant, or ''.

    In the course are those of the roster that is kept beside the submissions, without one those who have handed in:
    then only a student is unknown whose name is nearly one of theirs.
    """
    submitted = course / "submitted"
    known = roster.of_class(submitted, None)
    names = known.students if known else {path.name for path in submitted.glob("[!.]*") if path.is_dir()}
    found = {}
    for student in {*students} - names:
        alike = difflib.get_close_matches(student.casefold(), {name.casefold() for name in names}, 1, CLOSE)
        meant = min((name for name in names if name.casefold() in alike), default="")
        if known or meant:
            found[student] = meant
    return found


def released(course: Path) -> list[str]:
    """Return the assignments in a course folder, also those that are not exercises of this course."""
    return [path.name for path in (course / SOURCE).glob("*") if path.is_dir()]


def of(given: Given, student: str, exercise: str) -> list[float | str]:
    """Return the extensions that apply to a student's hand-in."""
    of_one = given.get(student, {})
    return [of_one[name] for name in (ALL, exercise) if name in of_one]
