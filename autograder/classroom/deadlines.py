"""Writes the due dates and ends of exercises to the gradebook and to a file for each student.

No other student can read that file in the exchange, because it includes the student's extensions.
"""

import hashlib
import json
import os
from collections.abc import Collection
from typing import Any

from autograder.classroom import accounts, assignments, course_files
from autograder.classroom.plan import COURSE_ID, Classroom
from course.foundation import storage
from course.hand_in import DUE, UNTIL

PUBLISHED = "told.json"  # in `Classroom.state`: what the files there were made of
SOURCES = ("extensions.json", "nbgrader_config.py")  # of nbgrader's course folder: who has more time


def publish(classroom: Classroom, enter: Collection[str] = ()) -> None:
    """Enter changed dates, and those of `enter`, in nbgrader's course folder; write each student's file.

    Raises ClassroomError, also for a mistake in the course folder's configuration.
    """
    known, published = _inputs(classroom), _published(classroom)
    dates, before = known["dates"], (published or {}).get("dates", {})
    entered = {name: each for name, each in dates.items() if name in {*enter} or before.get(name) != each}
    ended = [name for name in entered if before.get(name, {}).get(UNTIL) and UNTIL not in entered[name]]
    entered |= {name: entered[name] | {UNTIL: ""} for name in ended}
    if not entered and known == published:
        return
    if published is None:  # from an older version: due dates may have been changed in Formgrader
        entered = {name: each if name in {*enter} else each | {DUE: ""} for name, each in entered.items()}
    own: dict[str, dict[str, dict[str, str]]] = {}
    if dates:
        students = sorted(known["students"])
        asked = {"enter": entered, "dates": dates, "students": students}
        dates, own = course_files.enter_dates(classroom, asked)
    folder = classroom.exchange / COURSE_ID / assignments.OWN  # root's, in a folder of root's
    folder.mkdir(exist_ok=True)
    folder.chmod(0o711)
    for path in folder.iterdir():
        if path.stem not in known["students"]:
            path.unlink()
    for student, group in known["students"].items():
        theirs = {name: each | own.get(student, {}).get(name, {}) for name, each in dates.items()}
        path = folder / f"{student}.json"
        storage.replace(path, json.dumps(theirs).encode(), storage.PRIVATE)
        os.chown(path, 0, group)
        path.chmod(0o640)
    storage.replace(classroom.state / PUBLISHED, json.dumps(known).encode(), storage.PRIVATE)


def out_of_date(classroom: Classroom) -> bool:
    """Return True if the students' files are out of date."""
    return _inputs(classroom) != _published(classroom)


def _inputs(classroom: Classroom) -> dict[str, Any]:
    """Return the data that the students' files are made from: dates, students, and digests of the extensions."""
    there, known = course_files.released(classroom), assignments.read(classroom)
    dates = {
        name: {which: time for which, time in ((DUE, each.due), (UNTIL, each.until)) if time}
        for name, each in ((name, known.get(name, assignments.Dates())) for name in sorted(there))
    }
    students = {member.name: accounts.ids(classroom, member)[1] for member in classroom.students}
    more = [hashlib.sha256(course_files.read_grading(classroom, name)).hexdigest() for name in SOURCES]
    return {"dates": dates, "students": students, "more": more}


def _published(classroom: Classroom) -> Any:
    path = classroom.state / PUBLISHED
    return json.loads(path.read_text()) if path.exists() else None
