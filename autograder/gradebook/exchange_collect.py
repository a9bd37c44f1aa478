"""Collecting from nbgrader's exchange, where anybody in the class may have put anything."""

import contextlib
import errno
import logging
import os
import re
import secrets
import stat
from collections import defaultdict
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from nbgrader.exchange.default.collect import ExchangeCollect
from nbgrader.utils import ignore_patterns, parse_utc
from traitlets import Bool

from autograder.gradebook import ends, members
from autograder.gradebook.course_folder import known_user, user_name
from autograder.gradebook.late import LatePolicy
from course.foundation import storage
from course.foundation.times import MINUTES
from course.foundation.untrusted import read_regular

MOST_FILES, MOST_BYTES = 200, 100 << 20  # of one submission
MOST_ENTRIES, DEEPEST = 2000, 20  # files and folders that are visited, and nested folders
MOST_TOLD = 20  # files of a member that are named, of those left out and of those that bear another name
TIMESTAMP, SECRETS = "timestamp.txt", "submission_secret.txt"
SECRET = re.compile(r"[\w-]{16,200}")
CONFIGURATION = re.compile(r"(nbgrader|jupyter\w*|ipython\w*)_config\.(py|json)", re.IGNORECASE)
SLOW = timedelta(minutes=2)  # that a hand-in may take before its time is doubted
GROUP_FOLDER, GROUP_FILE = 0o2770, 0o660  # what the group may do in a course folder that it shares
NO_TIME = datetime(1970, 1, 1)  # in nbgrader's form: UTC, without a time zone
FULL = (errno.ENOSPC, errno.EDQUOT)
OF_THE_DISK = (*FULL, errno.EIO, errno.EROFS)  # errors that are not about one file that a student has handed in


class Few:
    """Warnings of one kind: the first `MOST_TOLD` as they come, and at the end the number of the others."""

    def __init__(self, log: logging.Logger | logging.LoggerAdapter[Any]):
        self._log, self._number = log, 0

    def tell(self, text: str, *about: object) -> None:
        """Warn, unless there have been enough."""
        self._number += 1
        if self._number <= MOST_TOLD:
            self._log.warning(text, *about)

    def end(self, text: str, about: str) -> None:
        """Warn once more, about whom and of how many, if some were not told."""
        if self._number > MOST_TOLD:
            self._log.warning(text, about, self._number - MOST_TOLD)


class RegularCollect(ExchangeCollect):
    """Collects the regular files of submissions; what cannot be collected is named, and does not stop the others.

    A submission is that of the student whom its folder names, if that student has put it there, or the person who
    collects, or root (with nbgrader's `check_owner` off: anybody).  What came after the end of the exercise, and after
    its student's extension, is not collected.

    nbgrader's own class stops at a pipe, a folder of more than 100 MB or a name without a time, and then collects
    nothing of the students who follow.  It copies what links lead to, for example a solution that only the instructor
    may read.  On a full disk it leaves a part of a submission, and takes that for a collected one afterwards.
    """

    by_owner = Bool(
        False,
        help="Assign each submission to the owner of its folder; always on where the course folder lists the members.",
    ).tag(config=True)

    _members: Mapping[int, str] | None = None  # by user id; None where there is no class: any user of this machine
    _end: datetime | None = None  # of the exercise, without an extension

    def _path_to_record(self, path: str) -> dict[str, Any]:
        record: dict[str, Any] = {"filename": os.path.basename(path), "timestamp": NO_TIME, "username": ""}
        try:
            user, changed = os.lstat(path).st_uid, _changed(path)
        except OSError:  # it was there a moment ago
            return record | {"owner": None, "order": NO_TIME}
        with contextlib.suppress(ValueError, OverflowError):  # not a time: sorts as the oldest
            record = super()._path_to_record(path)
        claimed = record["timestamp"]
        record |= {"owner": user, "order": changed if _to_come(claimed) else claimed}
        if not self.by_owner:
            return record
        owner = self._member(user)
        if owner and owner != record["username"]:
            self._taken[owner].tell("%s belongs to %s, and is collected as theirs", shown(path), owner)
        return record | {"username": owner}

    def init_src(self) -> None:
        """Find the submissions: only folders, not anything else that somebody has put there."""
        self._members = members.read(Path(self.coursedir.root))
        self.by_owner = self.by_owner or self._members is not None
        if self.by_owner:
            self.check_owner = False  # would tell of a name that does not count
        self._end = ends.read(Path(self.coursedir.root)).get(self.coursedir.assignment_id)
        self._policy = LatePolicy(config=self.config)
        self._taken: dict[str, Few] = defaultdict(lambda: Few(self.log))  # by owner: what bears another name
        self._forged = False
        self._left: dict[int | None, Few] = defaultdict(lambda: Few(self.log))  # by owner: what does not count
        super().init_src()
        for owner, few in self._taken.items():
            few.end("%s: %d more belong to them, and are collected as theirs", owner)
        for user, few in self._left.items():
            few.end("%s: %d more were left out", user_name(user))
        if self._forged:
            self.log.warning(
                "Is a student's name in this course not that of a Unix user? c.ExchangeCollect.check_owner = False "
                "collects by the names of the folders alone; then anybody can hand in for anybody"
            )
        records: list[dict[str, Any]] = self.src_records  # type: ignore[has-type]
        newest: dict[str, dict[str, Any]] = {}
        for record in sorted(records, key=self._in_time):  # nbgrader repeats a student if others are between
            if not self._why_not(record):
                newest[record["username"]] = record
        self.src_records = [record for record in newest.values() if self._is_readable(record["username"])]

    def _is_readable(self, student: str) -> bool:
        """Return False, and say so, if nbgrader could not read the time of what was collected before of a student."""
        folder = self.coursedir.format_path(self.coursedir.submitted_directory, student, self.coursedir.assignment_id)
        time = Path(folder, TIMESTAMP)
        try:
            if os.path.lexists(time) and (text := small_text(time)) != "":
                parse_utc(text or "unreadable")
        except (ValueError, OverflowError):
            self.log.warning("%s is not a time: remove that folder, and collect again", shown(str(time)))
            return False
        return True

    def _sort_by_timestamp(self, records: list[dict[str, Any]]) -> list[dict[str, Any]]:
        """Sort a student's hand-ins that count, the newest first: nbgrader takes the first.

        A time that is still to come does not keep a hand-in the newest: then that of the folder's last change counts.
        """
        counted = []
        for record in sorted(records, key=lambda record: record["order"], reverse=True):
            self._forged |= self._is_forged(record)
            if why := self._why_not(record):
                self._left[record["owner"]].tell("%s was left out: %s", shown(self._path(record)), why)
            else:
                counted.append(record)
        return counted or records[:1]  # `init_src` leaves it out

    def _member(self, user: int) -> str:
        """Return the name of the member with this user id; '' when there is no such member."""
        return known_user(user) if self._members is None else self._members.get(user, "")

    def _is_forged(self, record: dict[str, Any]) -> bool:
        """Return True if a hand-in was put there by somebody who cannot hand in for the student whom it names."""
        return (
            self.check_owner
            and record["owner"] not in (0, os.geteuid())
            and user_name(record["owner"]) != record["username"]
        )

    def _path(self, record: dict[str, Any]) -> str:
        return os.path.join(self.inbound_path, record["filename"])

    def _why_not(self, record: dict[str, Any]) -> str:
        """Return why a hand-in is not collected; '' if it is."""
        path = self._path(record)
        if not is_folder(path):
            return "it is not a folder"
        if self.by_owner and not record["username"]:
            return "its owner is no longer in the class; it is collected once they are again"
        if not self.by_owner and not (record["username"] and record["filename"].isprintable()):
            return "its name is not one that nbgrader gives, STUDENT+EXERCISE+TIME"
        if self._is_forged(record):
            named, owner = record["username"], user_name(record["owner"])
            forged = f"it names {named}, but belongs to {owner}: ask {owner} why"
            return f"{forged}. If it is {named}'s work, {named} has to hand it in"
        if not os.access(path, os.R_OK | os.X_OK, effective_ids=True):
            return "no permission to read it: ask its owner to change that, or to remove it"
        return self._too_late(record, path)

    def _end_for(self, student: str) -> datetime | None:
        """Return the end of the exercise for a student, with their extension; None if it has no end."""
        if not self._end:
            return None
        return self._policy.moved(self._end.replace(tzinfo=None), student, self.coursedir.assignment_id)

    def _too_late(self, record: dict[str, Any], path: str) -> str:
        """Return why a hand-in is too late to be collected; '' if it is not."""
        over = self._end_for(record["username"])
        claimed = record["timestamp"] if record["timestamp"] != NO_TIME else _changed(path)
        if not over or claimed <= over:
            return ""
        return (
            f"the exercise ended at {over:{MINUTES}} UTC, and {record['username']} handed in at {claimed:{MINUTES}} UTC"
        )

    def _in_time(self, record: dict[str, Any]) -> tuple[bool, Any]:
        """Return the sort key of a hand-in; late ones that do not count come first."""
        late = bool(self.before_duedate and self.duedate and record["timestamp"] > self.duedate)
        return not late, record["order"]

    def copy_files(self) -> None:
        """Lay out each submission, whole or not at all; one that is there whole stays until the new one is.

        Ends at once with nbgrader's ExchangeError on a full disk, and after the last one if another could not be laid
        out.
        """
        exercise, course = self.coursedir.assignment_id, self.coursedir.course_id
        if not self.src_records:
            self.log.warning("No submissions of '%s' for course '%s' to collect", exercise, course)
            return
        self.log.info("Processing %d submissions of '%s' for course '%s'", len(self.src_records), exercise, course)
        failed = []
        for record in self.src_records:
            student, path = record["username"], self._path(record)
            target = Path(self.coursedir.format_path(self.coursedir.submitted_directory, student, exercise))
            if not self._is_wanted(record, target):
                newest = "No newer submission to collect"
                known = newest if self.update else "Submission already exists, use --update to update"
                self.log.info("%s: %s %s", known, student, exercise)
                continue
            self.log.info("%s submission: %s %s", "Updating" if target.is_dir() else "Collecting", student, exercise)
            try:
                with storage.folder(target) as draft:
                    self.do_copy(path, str(draft))
            except OSError as error:
                if error.errno in FULL:
                    self.fail(
                        f"the disk with {shown(str(target.parent))} is full ({error.strerror}): {student} was not "
                        "collected, nor were those after them. Free some space there, and collect again"
                    )
                self.log.error("%s %s was not collected: %s: %s", student, exercise, target, error.strerror)
                failed.append(student)
        if failed:
            self.fail(f"{', '.join(failed)}: not collected. Correct what is said above, and collect again")

    def _is_wanted(self, record: dict[str, Any], target: Path) -> bool:
        """Return True if a hand-in is to be laid out, as nbgrader decides it."""
        if not target.is_dir():
            return True
        there = self.coursedir.get_existing_timestamp(str(target))
        other = there != record["timestamp"]
        newer = there is None or record["timestamp"] > there or (other and _to_come(there))
        return bool((self.update and newer) or (self.before_duedate and other))

    def do_copy(self, src: str, dest: str, log: object = None) -> None:
        """Copy the regular files; logs those that are left out as too large or unreadable.

        Raises OSError when the disk cannot take them.
        """
        Path(dest).mkdir(parents=True, exist_ok=True)
        files, space, seen, left = MOST_FILES, MOST_BYTES, 0, Few(self.log)
        unwanted = ignore_patterns(self.coursedir.ignore, self.coursedir.include)
        largest = space
        if not self.by_owner:
            space, largest = 1000 * self.coursedir.max_dir_size, 1000 * self.coursedir.max_file_size
        changed = NO_TIME
        with contextlib.suppress(OSError):  # it has just disappeared
            changed = _changed(src)
        for folder, below, names, descriptor in _walk(src):
            seen += 1 + len(names)
            if seen > MOST_ENTRIES:
                self.log.warning("%s and what follows were left out: there are too many files", shown(folder))
                break
            if folder.count(os.sep) - src.count(os.sep) >= DEEPEST:
                self.log.warning("%s was left out: its folders are nested too deeply", shown(folder))
                below.clear()
            ignored = set() if self.by_owner else set(unwanted(folder, [*below, *names]))
            if folder == src:
                ignored |= {TIMESTAMP, SECRETS} & set(below)  # nbgrader expects files of these names
            below[:] = [name for name in below if name not in ignored]
            for name in sorted(set(names) - ignored):
                copy = Path(dest, os.path.relpath(folder, src), name)
                try:
                    if CONFIGURATION.fullmatch(name):
                        raise OSError("commands run beside it would execute it")
                    size, written = copy_file(name, descriptor, copy, min(space, largest) if files else 0)
                    space, files, changed = space - size, files - 1, max(changed, written)
                except OSError as error:
                    if error.errno in OF_THE_DISK:
                        raise
                    why = "it is a link" if error.errno == errno.ELOOP else error.strerror or error
                    left.tell("%s was left out: %s", shown(os.path.join(folder, name)), why)
        left.end("%s: %d more were left out", shown(src))
        self._complete(src, Path(dest), changed)
        if self.coursedir.groupshared and not self.by_owner:
            for folder, _, names in os.walk(dest):
                os.chmod(folder, stat.S_IMODE(os.stat(folder).st_mode) | GROUP_FOLDER)
                for name in names:
                    os.chmod(Path(folder, name), stat.S_IMODE(os.stat(Path(folder, name)).st_mode) | GROUP_FILE)

    def _complete(self, src: str, copy: Path, changed: datetime) -> None:
        """Add the two files without which nbgrader would stop the whole class, if a student has left them out."""
        record = self._path_to_record(src)
        claimed, over = record["timestamp"], self._end_for(record["username"])
        if (small_text(copy / TIMESTAMP) or "").partition(".")[0] != f"{claimed:%Y-%m-%d %H:%M:%S}":
            storage.replace(copy / TIMESTAMP, f"{claimed:%Y-%m-%d %H:%M:%S.%f} UTC".encode())
        if not SECRET.fullmatch(small_text(copy / SECRETS) or ""):
            storage.replace(copy / SECRETS, secrets.token_hex(64).encode())
        if _to_come(claimed):
            self.log.warning(
                "%s says %s, which is still to come: a later hand-in counts in its place", shown(src), claimed
            )
        after = ", after the end" if over and changed > over else ""
        if self.by_owner and (after or changed - claimed > SLOW):
            self.log.warning(
                "%s says %s, but was last changed at %s%s", shown(src), claimed, changed.replace(microsecond=0), after
            )


class OwnersCollect(RegularCollect):
    """Collects submissions by the owner of their folder, whatever the folder's name says.

    What belongs to nobody whom this machine knows, as after a student has left the class, is not collected.
    """

    by_owner = Bool(True).tag(config=True)


def _to_come(time: datetime) -> bool:
    """Return True if a time, UTC in nbgrader's form, is later than now by more than clocks differ."""
    return time > datetime.now(UTC).replace(tzinfo=None) + SLOW


def _changed(path: str | int) -> datetime:
    """Return the change time (ctime, UTC) of a file, or of a folder's list of files; the owner cannot set it back.

    `path` may be the descriptor of an open file.
    """
    known = os.stat(path) if isinstance(path, int) else os.lstat(path)
    return datetime.fromtimestamp(known.st_ctime, UTC).replace(tzinfo=None)


def shown(path: str) -> str:
    """Return a path with its unusual characters escaped, so that it is safe in a log."""
    return path if path.isprintable() else ascii(path)


def is_folder(path: str) -> bool:
    """Return True if the path is a folder, not a link to one."""
    try:
        return stat.S_ISDIR(os.lstat(path).st_mode)
    except OSError:
        return False


def _walk(folder: str) -> Iterator[tuple[str, list[str], list[str], int]]:
    """Walk a folder as `os.fwalk` does, without links; yields nothing if the folder cannot be opened."""
    with contextlib.suppress(OSError):
        os.close(os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW))
        yield from os.fwalk(folder, follow_symlinks=False)


def small_text(path: Path) -> str | None:
    """Return the content of a small ASCII file; None for anything else."""
    try:
        return read_regular(path, 1000).decode("ascii").strip()
    except (OSError, ValueError):
        return None


def copy_file(name: str, folder: int, copy: Path, most: int) -> tuple[int, datetime]:
    """Copy a regular file of at most `most` bytes from an open folder.

    Returns its size and its change time after the copy, because it may be written to while it is read.  Raises OSError.
    """
    flags = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
    with open(os.open(name, flags, dir_fd=folder), "rb") as source:
        known = os.fstat(source.fileno())
        if not stat.S_ISREG(known.st_mode):
            raise OSError("it is not a file")
        if known.st_nlink > 1:
            raise OSError("it is a hard link, and may belong to somebody else")
        if known.st_size > most:
            raise OSError("the submission is too large")
        copy.parent.mkdir(parents=True, exist_ok=True)
        content = source.read(known.st_size)
        changed = _changed(source.fileno())
        copy.write_bytes(content)
    return known.st_size, changed
