"""Run in an instructor's box: enters the students, read as JSON, in the gradebook of nbgrader's course folder."""

import json
import sys
from pathlib import Path

from nbgrader.api import Gradebook

from autograder.gradebook import database


def main(course: Path, students: dict[str, dict[str, str]]) -> None:
    """Enter each student by the name in the class; whoever has no other name is called by that one."""
    database.read_version_in_process()
    with Gradebook(f"sqlite:///{course.resolve() / 'gradebook.db'}") as book:
        for student, names in students.items():
            shown = names if any(names.values()) else {"first_name": "", "last_name": student}
            book.update_or_create_student(student, **shown)
    database.share(course / "gradebook.db")


if __name__ == "__main__":
    main(Path(sys.argv[1]), json.load(sys.stdin))
