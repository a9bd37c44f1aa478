"""The roster of the class, a CSV file with the columns `student` and, for instructors, `role`.

Formgrader shows the names in the columns `first_name` and `last_name`, if there are any.
"""

import re
from dataclasses import dataclass
from pathlib import Path

from autograder.errors import UsageError
from autograder.submissions.roster import table

INSTRUCTOR = "instructor"
ROLES = ("", "student", INSTRUCTOR)
LONGEST = 24  # characters of a name: with the prefix it must fit into the 32 of a Unix user
STAFF = "staff"  # with the class's prefix, the name of its instructors' group
STAFF_LABEL = "instructors"  # in the host name at which instructors come in, where students share an address
NAME = re.compile(r"[a-z][a-z0-9_-]*")


@dataclass(frozen=True)
class Member:
    """A student or instructor of the class."""

    name: str
    instructor: bool = False
    first_name: str = ""
    last_name: str = ""


def read(path: Path, instructors: list[str]) -> list[Member]:
    """Return the members in a roster, and `instructors`, who need not be in it; raises UsageError."""
    members = {}
    for number, line in table(path):
        name, role = (line.get("student") or "").strip(), (line.get("role") or "").strip().lower()
        why = wrong(name)
        if why:
            raise UsageError(f"{path}, line {number}: {why}")
        if name in members:
            raise UsageError(f"{path}, line {number}: {name!r} is listed twice")
        if role not in ROLES:
            raise UsageError(f"{path}, line {number}: the role {role!r} is neither 'student' nor 'instructor'")
        names = ((line.get(column) or "").strip() for column in ("first_name", "last_name"))
        members[name] = Member(name, role == INSTRUCTOR, *names)
    for name in instructors:
        if why := wrong(name):
            raise UsageError(f"--instructor: {why}")
        members[name] = Member(name, True)
    if not members:
        raise UsageError(f"{path} contains no students")
    if not any(member.instructor for member in members.values()):
        raise UsageError(f"there is no instructor: give one with --instructor, or a column 'role' in {path}")
    return list(members.values())


def wrong(name: str) -> str:
    """Return why a name cannot be used for a member's Unix user; '' if it can."""
    if not NAME.fullmatch(name):
        return f"{name!r} is not a valid Unix user name: write a lower-case letter first, then letters, digits, - and _"
    if name == STAFF:
        return f"{name!r} is what the instructors' group is called: choose another name"
    if name == STAFF_LABEL:  # with host names, a page of this student's would get the cookies of another class there
        return f"{name!r} is in the address at which instructors log in: choose another name"
    if len(name) > LONGEST:
        return f"{name!r} is longer than {LONGEST} letters"
    return ""
