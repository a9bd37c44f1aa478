"""Run in an instructor's box: reads the students as JSON and enters them in the gradebook of the course folder."""

import json
import sys
from pathlib import Path

from nbgrader.api import Gradebook

from autograder.gradebook import address, database, members
from autograder.results.targets import GRADEBOOK


def main(course: Path, students: dict[str, dict[str, str]], known: dict[str, str]) -> None:
    """Enter each student with id and names, and note the members by user id.

    A student without a first and last name is shown by the id.
    """
    members.write(course, {int(user): name for user, name in known.items()})
    database.read_version_in_process()
    with Gradebook(address.url(course.resolve() / GRADEBOOK)) as book:
        for student, names in students.items():
            shown = names if any(names.values()) else {"first_name": "", "last_name": student}
            book.update_or_create_student(student, **shown)
    database.share(course / GRADEBOOK)


if __name__ == "__main__":
    asked = json.load(sys.stdin)
    main(Path(sys.argv[1]), asked["students"], asked["members"])
