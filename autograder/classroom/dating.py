"""Run in an instructor's box: enters due dates, read as JSON, in the gradebook of nbgrader's course folder."""

import json
import sys
from datetime import UTC, datetime
from pathlib import Path

from nbgrader.api import Gradebook

from autograder.gradebook import database


def main(course: Path, due: dict[str, str]) -> None:
    """Enter each exercise's due date, in UTC as nbgrader has it."""
    database.read_version_in_process()
    with Gradebook(f"sqlite:///{course.resolve() / 'gradebook.db'}") as book:
        for name, time in due.items():
            at = datetime.fromisoformat(time).astimezone(UTC).replace(tzinfo=None)
            book.update_or_create_assignment(name, duedate=at)


if __name__ == "__main__":
    main(Path(sys.argv[1]), json.load(sys.stdin))
