"""Run in an instructor's box: reads the students as JSON and enters them in the gradebook of the course folder."""

import json
import sys
from pathlib import Path

from nbgrader.api import Gradebook

from autograder.gradebook import database


def main(course: Path, students: dict[str, dict[str, str]]) -> None:
    """Enter each student with id and names; a student without a first and last name is shown by the id."""
    database.read_version_in_process()
    with Gradebook(f"sqlite:///{course.resolve() / 'gradebook.db'}") as book:
        for student, names in students.items():
            shown = names if any(names.values()) else {"first_name": "", "last_name": student}
            book.update_or_create_student(student, **shown)
    database.share(course / "gradebook.db")


if __name__ == "__main__":
    main(Path(sys.argv[1]), json.load(sys.stdin))
