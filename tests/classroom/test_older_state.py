"""A class that an older version of the course has kept is taken up by this one: its state is what that has written."""

import json
from datetime import UTC, datetime, timedelta

import pytest
from nbgrader.api import Gradebook

from autograder.classroom import accounts, assignments, course_files, deadlines, hub, servers
from autograder.classroom.plan import SETTINGS, Classroom
from autograder.gradebook import ends

# As the first version that had classes wrote it; none of today's other files of the state was there.
FIRST = """{
 "folder": "FOLDER",
 "members": [
  {
   "name": "ada",
   "instructor": false
  },
  {
   "name": "bob",
   "instructor": false
  },
  {
   "name": "teacher",
   "instructor": true
  }
 ],
 "ip": "127.0.0.1",
 "port": 8721,
 "certificate": "",
 "key": "",
 "passwords": "pam",
 "prefix": "PREFIX",
 "limits": {
  "memory": 3221225472,
  "tasks": 1000,
  "cores": 2.0,
  "kernel_idle": 3600,
  "server_idle": 7200
 }
}"""
USERS = '["PREFIXstaff", "PREFIXada", "PREFIXbob", "PREFIXteacher"]'
PROCESS = '{"pid": 4194303, "born": 17, "groups": []}'  # of the hub and of a server, both long gone
# As the version wrote it that first had dates, in which the end was for the table alone.
DATES = """{
 "parameters": {
  "release": "2026-11-02T08:00:00+00:00",
  "due": "2026-11-20T23:59:00+00:00",
  "until": "2026-11-27T23:59:00+00:00"
 }
}"""
IN_FORMGRADER = datetime(2026, 11, 21, 12)  # the due date that an instructor has set there since
NOW = datetime(2026, 11, 22, tzinfo=UTC)


@pytest.mark.matrix  # no class of the first version is known to run
def test_the_state_of_the_first_version_is_taken_up(quiet):
    accounts.make(quiet)
    for name, text in {
        SETTINGS: FIRST,
        "accounts.json": USERS,
        "hub.json": PROCESS,
        "servers/ada.json": PROCESS,
    }.items():
        (quiet.state / name).write_text(text.replace("FOLDER", str(quiet.folder)).replace("PREFIX", quiet.prefix))
    classroom = Classroom.load(quiet.folder)
    assert [(member.name, member.instructor) for member in classroom.members] == [
        ("ada", False),
        ("bob", False),
        ("teacher", True),
    ]
    assert hub.running(classroom) is None and not servers.started(classroom)["ada"].alive
    servers.forget(classroom, "ada", servers.started(classroom)["ada"])
    assert accounts.missing(classroom) == [] and accounts.make(classroom) == []  # its users are known for its own

    course_files.make_shared(classroom)  # as `up` does
    course_files.release(classroom, ["parameters"])  # it had been released before there were dates
    deadlines.publish(classroom)
    (row,) = (row for row in assignments.table(classroom, NOW) if row.name == "parameters")
    assert (row.state, row.dates) == (assignments.OPEN, assignments.Dates())

    # The dates of the next version, and a due date that was changed by hand.
    (classroom.state / assignments.DATES).write_text(DATES)
    (classroom.state / deadlines.PUBLISHED).unlink()
    url = f"sqlite:///{classroom.grading / 'gradebook.db'}"
    with Gradebook(url) as book:
        book.update_or_create_assignment("parameters", duedate=IN_FORMGRADER)
    deadlines.publish(classroom)
    assert ends.read(classroom.grading) == {"parameters": datetime(2026, 11, 27, 23, 59, tzinfo=UTC)}
    with Gradebook(url) as book:
        assert book.find_assignment("parameters").duedate == IN_FORMGRADER
    told = json.loads((classroom.exchange / "ros2" / assignments.OWN / "ada.json").read_text())
    assert told["parameters"] == {"due": "2026-11-21T12:00:00+00:00", "until": "2026-11-27T23:59:00+00:00"}
    (row,) = (row for row in assignments.table(classroom, NOW + timedelta(days=6)) if row.name == "parameters")
    assert row.state == assignments.OVER
    classroom.save()
    assert Classroom.load(quiet.folder) == classroom
    assert {*json.loads((classroom.state / "accounts.json").read_text())} == {
        classroom.staff,
        *map(classroom.user, classroom.members),
    }
