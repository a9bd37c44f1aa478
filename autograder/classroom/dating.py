"""Run in an instructor's box: reads dates as JSON, enters them in nbgrader's course folder, and prints all dates.

Due dates go into the gradebook and ends into `ends.json`.  Prints, as JSON, the due dates and ends for everybody, and
those of students with an extension.
"""

import json
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from nbgrader.api import Gradebook

from autograder.errors import UsageError
from autograder.gradebook import address, database, ends
from autograder.gradebook.late import LatePolicy, course_config
from autograder.results.targets import GRADEBOOK
from course.hand_in import DUE, UNTIL

Dates = dict[str, dict[str, str]]  # by exercise: DUE and UNTIL, in ISO 8601; "" for an UNTIL that was removed


def enter(course: Path, new: Dates, dates: Dates) -> Dates:
    """Enter the exercises' `new` dates, and return `dates` with the due dates in the gradebook, in UTC.

    Somebody may have changed them in Formgrader.
    """
    database.read_version_in_process()
    with Gradebook(address.url(course.resolve() / GRADEBOOK)) as book:
        for name, each in new.items():
            if each.get(DUE):
                book.update_or_create_assignment(name, duedate=_utc(each[DUE]))
        due = {one.name: one.duedate.replace(tzinfo=UTC).isoformat() for one in book.assignments if one.duedate}
    over = {name: each[UNTIL] for name, each in new.items() if UNTIL in each}
    ends.change(course, {name: datetime.fromisoformat(time) if time else ends.NONE for name, time in over.items()})
    return {name: each | ({DUE: due[name]} if name in due else {}) for name, each in dates.items()}


def own(course: Path, dates: Dates, students: list[str]) -> dict[str, Dates]:
    """Return the dates of students that differ from everybody's, by student."""
    policy = LatePolicy(config=course_config(course / "submitted"))
    found: dict[str, Dates] = {}
    for student in students:
        for name, each in dates.items():
            for which, time in each.items():
                moved = policy.moved(_utc(time), student, name)
                if moved != _utc(time):
                    found.setdefault(student, {}).setdefault(name, {})[which] = moved.replace(tzinfo=UTC).isoformat()
    return found


def main(course: Path, asked: dict[str, Any]) -> None:
    """Enter the dates asked for, and print all dates; a mistake in the configuration ends it with one line."""
    try:
        dates = enter(course, asked["enter"], asked["dates"])
        print(json.dumps([dates, own(course, dates, asked["students"])]))
    except UsageError as error:
        sys.exit(str(error))


def _utc(time: str) -> datetime:
    return datetime.fromisoformat(time).astimezone(UTC).replace(tzinfo=None)


if __name__ == "__main__":
    main(Path(sys.argv[1]), json.load(sys.stdin))
