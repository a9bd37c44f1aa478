"""The configuration of a course folder: a program, which runs with all rights of whoever gives the command.

It is found beside the folder of submissions, where an archive that somebody has unpacked may have put a student's file
of that name.  So it is run only in a course folder, and only if it belongs to whoever runs it.
"""

import functools
import logging
import os
import pwd
import stat
from pathlib import Path

from autograder.errors import UsageError
from autograder.results.targets import CONFIGURATION, GRADEBOOK, SOURCE
from autograder.submissions import provenance

MADE = (SOURCE, GRADEBOOK)  # `autograder release` makes both in a course folder, and so does nbgrader
log = logging.getLogger(__name__)


def around(submitted: Path) -> Path | None:
    """Return the course folder that contains a folder of submissions; None without a configuration that may be run.

    One that may not be run is named in a warning.
    """
    course = submitted.resolve().parent
    if not (course / CONFIGURATION).exists():
        return None
    if why := _not_of_a_course(course, submitted) or _foreign(course):
        _warn(f"{course / CONFIGURATION} is not run: {why}")
        return None
    return course


def has_gradebook(submitted: Path) -> bool:
    """Return True if the scores of a folder of submissions belong into the folder around it."""
    if around(submitted):
        return True
    return (submitted.resolve().parent / GRADEBOOK).exists() and not provenance.among_hand_ins(submitted).exists()


def expect_own(course: Path) -> None:
    """Raise UsageError when the configuration of the named course folder belongs to another user."""
    if why := _foreign(course):
        raise UsageError(f"{course / CONFIGURATION} is not run: {why}")


def _not_of_a_course(course: Path, submitted: Path) -> str:
    """Return why the folder is not taken for a course folder; '' if it is."""
    noted = provenance.among_hand_ins(submitted)
    if noted.exists():
        return (
            f"hand-ins were collected from {course}, and it may be a student's. If it is the course's own, move the "
            f"hand-ins to another folder, and delete {noted}"
        )
    if not any((course / name).exists() for name in MADE):
        return (
            f"beside it is neither {' nor '.join(MADE)}, as in a course folder, and it may be a student's. If it is "
            f"the course's own, make the folder {course / MADE[0]}"
        )
    return ""


def _foreign(course: Path) -> str:
    """Return why the configuration is not that of whoever gives the command; '' if it is.

    Instructors of a class share a folder that others cannot write to: there it may be that of any of them.
    """
    path, folder = course / CONFIGURATION, course.stat()
    own = {0, os.geteuid()}
    if os.geteuid() == 0:
        own.add(int(os.environ.get("SUDO_UID", "0")))
    others = {path.stat().st_uid, path.lstat().st_uid} - own
    open_to = folder.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    shared = folder.st_uid in own and open_to == stat.S_IWGRP and folder.st_gid in {os.getegid(), *os.getgroups()}
    if not others or shared:
        return ""
    return f"it belongs to {user_name(others.pop())}. If it is the course's own, give the command as that user"


def user_name(user: int | None) -> str:
    """Return the name of a user of this machine, or else the number."""
    return (known_user(user) if user is not None else "") or f"user id {user}"


def known_user(user: int) -> str:
    """Return the name of a user of this machine; '' if there is none with this number."""
    try:
        return pwd.getpwuid(user).pw_name
    except KeyError:
        return ""


@functools.cache
def _warn(line: str) -> None:
    """Give a warning once, although a command looks for the configuration several times."""
    log.warning("%s", line)
