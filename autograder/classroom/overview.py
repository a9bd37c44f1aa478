"""Run by the hub for the instructors' page: prints the state of each exercise, and who has more time, as JSON.

It forks children that act as an instructor; a process with threads, such as the hub, should not fork.
"""

import json
import sys
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from autograder.classroom import assignments, course_files
from autograder.classroom.plan import Classroom
from autograder.errors import UsageError
from autograder.gradebook import extensions


def overview(classroom: Classroom, now: datetime) -> dict[str, Any]:
    """Return what the page shows, an unreadable file of extensions included; raises AutograderError."""
    rows = [
        asdict(row)
        | {what: assignments.said(time) for what, time in asdict(row.dates).items()}
        | {"open": row.state not in (assignments.DRAFT, assignments.DATED)}
        for row in assignments.table(classroom, now)
    ]
    path, given, unreadable = classroom.grading / extensions.FILE, extensions.Given(), ""
    try:
        given = extensions.parse(course_files.read_grading(classroom, path.name), path)
    except UsageError as error:
        unreadable = str(error)
    keys = ("student", "exercise", "more")
    return {
        "rows": rows,
        "command": classroom.command("release NAME --at TIME --due TIME --until TIME"),
        "extensions": [dict(zip(keys, each, strict=True)) for each in extensions.listed(given)],
        "unreadable": unreadable,
        "students": {each.name: f"{each.first_name} {each.last_name}".strip() for each in classroom.students},
    }


if __name__ == "__main__":
    print(json.dumps(overview(Classroom.load(Path(sys.argv[1])), datetime.now(UTC))))
