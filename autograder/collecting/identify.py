"""Identification of a hand-in: its student, its exercise, its time, and the files that count."""

import contextlib
import hashlib
import re
import zlib
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from pathlib import PurePosixPath
from typing import Any

from autograder.collecting.bundles import UNREADABLE, Bundle, is_other_archive
from autograder.collecting.bundles import receipt as read_receipt
from autograder.errors import Unplaced
from autograder.platforms import Origin, marks_late
from autograder.submissions import exercises, reading
from autograder.submissions.provenance import KNOWN, ON_TIME, UNKNOWN, Source
from autograder.submissions.roster import Roster, folder_name
from course.foundation.times import MINUTES
from course.foundation.untrusted import shortened
from course.hand_in import FORMAT, RECEIPT

TIME = "%Y-%m-%d %H:%M:%S UTC"
VERIFIED, NONE = "verified", "none"
SOON = timedelta(minutes=5)  # a clock may be ahead by as much
OURS = {RECEIPT, reading.TIMESTAMP, "submission_secret.txt"}  # files that the course and nbgrader add to a hand-in
LEFT_BY_TOOLS = {"__pycache__"}  # folders that nobody hands in on purpose
LISTED = 5  # file names in one line
# The names that browsers and file managers give to a copy: `relay (1).py`, `relay copy.py`, `Copy of relay.py`.
COPY = re.compile(r"(?:copy of )?(.+?)(?: ?\((\d{1,3})\)|(?: -)? copy(?: \(?\d{1,3}\)?)?)?(\.[a-z]+)", re.IGNORECASE)


@dataclass(frozen=True)
class HandedIn:
    """One hand-in, and what is known about it."""

    source: str  # the place where it was found, for messages
    packed: dict[str, bytes]  # compressed: a class must fit into memory, even if somebody hands in megabytes of zeros
    student: str
    assignment: str
    at: datetime  # orders hand-ins: the time of handing in if KNOWN, otherwise the latest possible one
    came: Source  # its origin
    download: str = ""
    receipt: str = NONE  # VERIFIED, NONE, or what is wrong with it
    signed: str = ""  # the name in the receipt
    ahead: datetime | None = None  # the hand-in's own time, if it is in the future
    notes: list[str] = field(default_factory=list)  # further remarks for the instructor
    not_taken: list[str] = field(default_factory=list)  # names of files that do not belong to the exercise

    @property
    def files(self) -> dict[str, bytes]:
        """Return the files handed in, unpacked."""
        return {name: zlib.decompress(content) for name, content in self.packed.items()}

    @property
    def when(self) -> str:
        """Return the time of handing in as text, as far as it is certain."""
        if self.came.time == KNOWN:
            return f"{self.at:{TIME}}"
        if self.came.time == ON_TIME:
            return f"on time, as {self.came.platform} says"
        return "time unknown"

    @property
    def remark(self) -> str:
        """Return what an instructor should know about the hand-in."""
        reasons = {
            f"its receipt {self.receipt}": self.receipt not in (VERIFIED, NONE),
            "the platform marks it late": self.came.late,
            f"a wrong clock: its time, {self.ahead:{MINUTES}} UTC, is in the future" if self.ahead else "": True,
        }
        return "; ".join([*(reason for reason, holds in reasons.items() if reason and holds), *self.notes])


def identify(
    bundle: Bundle, roster: Roster | None = None, expected: str | None = None, due: datetime | None = None
) -> HandedIn:
    """Find out who handed in a bundle, for which exercise, and when; raises Unplaced, which says what is unknown.

    With `expected`, a hand-in of another exercise has no place.
    """
    files = {str(member.path): member.content for member in bundle.members if len(member.path.parts) == 1}
    deeper = [str(member.path) for member in bundle.members if len(member.path.parts) > 1]
    said = files.pop(RECEIPT, None)
    receipt = read_receipt(said)
    state = VERIFIED if receipt else NONE
    handed_in, notes = named_as_asked(files)
    assignment = _assignment(handed_in, deeper, receipt, expected)
    student, guess = _student(bundle, receipt, roster, assignment)
    wanted = exercises.load(assignment).taken
    at, time = bundle.at, UNKNOWN
    if receipt:
        state = _verify(receipt, files, student, assignment, roster)
        claimed = _time(receipt.get("handed_in"))
        doubt = _why_not_believed(claimed, bundle.at)
        if state == VERIFIED and claimed and not doubt:
            at, time = claimed, KNOWN
        elif state == VERIFIED:
            notes = [*notes, doubt]
    elif bundle.stamped:
        time = KNOWN
    came = bundle.origin or Origin((student,), bundle.source)
    if time == KNOWN and came.late and due and at <= due:
        time = UNKNOWN  # the receipt has the time when the archive was made, but the platform says that it came late
        notes = [*notes, f"its receipt says {at:{TIME}}"]
    elif time == UNKNOWN and marks_late(came.platform) and not came.late:
        time = ON_TIME
    now = datetime.now(UTC)
    ahead = at if at > now + SOON else None
    time = UNKNOWN if ahead and time == KNOWN else time
    at = min(at, now).replace(microsecond=0)
    names = bundle.origin.names if bundle.origin else (str(receipt.get("student") or student),)
    return HandedIn(
        bundle.source,
        {name: zlib.compress(content, 1) for name, content in handed_in.items() if name in wanted},
        student,
        assignment,
        at,
        Source(
            came.platform,
            _readable(names[-1]),
            _readable(names[0]),
            _readable(came.file),
            came.upload,
            came.late,
            f"{at:%Y-%m-%dT%H:%M:%SZ}",
            time,
        ),
        bundle.download,
        state,
        str(receipt.get("student") or ""),
        ahead,
        [*guess, *notes],
        _not_taken([*(handed_in.keys() - wanted), *deeper, *bundle.left]),
    )


def _readable(name: str) -> str:
    """Return the name with anything that is not UTF-8 replaced: names on a disk or in a receipt can contain that."""
    return name.encode("utf-8", "replace").decode()


def named_as_asked(files: dict[str, bytes]) -> tuple[dict[str, bytes], list[str]]:
    """Return the files under the names that the exercises ask for, and a note on each file that was renamed.

    A browser names a second download of relay.py `relay (1).py`.
    """
    asked = {name.casefold(): name for exercise in exercises.names() for name in exercises.load(exercise).taken}
    copies: dict[str, list[tuple[int, str]]] = defaultdict(list)
    for name in files:
        if name not in asked.values() and (parts := COPY.fullmatch(name)):
            meant = asked.get(f"{parts[1]}{parts[3]}".casefold())
            if meant:
                copies[meant].append((int(parts[2] or 0), name))
    result, notes = dict(files), []
    for meant, found in sorted(copies.items()):
        _, last = max(found)
        if meant in files:
            notes.append(f"{meant} counts, and {shortened(last)} does not: is that right?")
        else:
            result[meant] = result.pop(last)
            notes.append(f"{shortened(last)} is used as {meant}")
    return result, notes


def _not_taken(names: Iterable[str]) -> list[str]:
    """Return the names of files that were handed in and do not count, without programs' leftovers."""
    kept = []
    for name in sorted(names):
        parts = PurePosixPath(name).parts
        if not (name in OURS or any(part.startswith(".") or part in LEFT_BY_TOOLS for part in parts)):
            kept.append(shortened(name))
    return kept if len(kept) <= LISTED else [*kept[:LISTED], f"{len(kept) - LISTED} more"]


def _student(bundle: Bundle, receipt: dict[str, Any], roster: Roster | None, assignment: str) -> tuple[str, list[str]]:
    """Return the student of a bundle, and a note if that is only likely; raises Unplaced."""
    names = bundle.origin.names if bundle.origin else (str(receipt.get("student") or ""),)
    if any(names):
        of_platform = bool(bundle.origin and bundle.origin.platform)
        student = roster.find(names, of_platform) if roster else folder_name(names[-1])
        if bundle.origin and bundle.origin.others:
            users = " or ".join((bundle.origin.names[0], *bundle.origin.others))
            raise Unplaced(f"its name could mean user {users}, so it is not assigned to {student}")
        if not student:
            raise Unplaced(f"{shortened(names[-1])!r} cannot be the name of a folder")
        return student, []
    for name in bundle.likely if roster else ():
        for likely in (name, re.sub(rf"[-_ ]*{assignment}[-_ ]*", "", name, flags=re.IGNORECASE)):
            with contextlib.suppress(Unplaced):
                student = roster.find((likely,)) if roster else ""
                return student, [
                    f"it does not say who handed it in; assigned to {student} by its name {shortened(name)!r}"
                ]
    how = "" if roster else "; with --roster, a file or folder named after a student is assigned to that student"
    said = "its receipt cannot be read, so it does" if receipt == UNREADABLE else "it does"
    raise Unplaced(f"{said} not say who handed it in{how}")


def _assignment(files: dict[str, bytes], deeper: list[str], receipt: dict[str, Any], expected: str | None) -> str:
    """Return the exercise of these files: the receipt's, or the one that most files belong to; raises Unplaced."""
    owned = {name: exercises.load(name).taken for name in exercises.names()}
    claimed = receipt.get("assignment")
    if isinstance(claimed, str) and claimed not in owned:
        raise Unplaced(f"its receipt says {claimed[:100]!r}, which is not an exercise in this course")
    found = claimed if isinstance(claimed, str) and owned[claimed] & files.keys() else None
    if found is None:
        count = {name: len(owned[name] & files.keys()) for name in owned}
        found = max(owned, key=lambda name: (count[name], name == expected), default=None)
        if found is None or not count[found]:
            raise Unplaced(_nothing(files, deeper))
    if expected not in (None, found):
        raise Unplaced(f"it is a hand-in of {found}, not of {expected}")
    return found


def _nothing(files: dict[str, bytes], deeper: list[str]) -> str:
    """Return why the files, and those `deeper` in folders, belong to no exercise."""
    if packed := [name for name in sorted(files) if is_other_archive(name)]:
        return f"{shortened(packed[0])} is a kind of archive that cannot be opened: unpack it, and pack it as .zip"
    if deeper and not files:
        return f"its files, such as {shortened(deeper[0])}, are in a folder, and only files beside the receipt count"
    if not files:
        return "it has no files"
    return f"it has no file for an exercise of this course, only {', '.join(map(shortened, sorted(files)[:LISTED]))}"


def _verify(
    receipt: dict[str, Any], files: dict[str, bytes], student: str, assignment: str, roster: Roster | None
) -> str:
    """Return VERIFIED, or what is wrong with the receipt."""
    listed, form, claimed = receipt.get("files"), receipt.get("format"), receipt.get("assignment")
    if not isinstance(listed, dict) or not isinstance(claimed, str):
        return "cannot be read"
    if type(form) is not int or form != FORMAT:
        return f"has a format that this version of the course does not write: {form!r:.20}"
    for name, entry in listed.items():
        digest = entry.get("sha256") if isinstance(entry, dict) else None
        if name not in files or hashlib.sha256(files[name]).hexdigest() != digest:
            return f"does not match {shortened(name)}"
    if more := sorted(files.keys() - listed.keys()):
        return f"does not list {shortened(more[0])}"
    if claimed != assignment:
        return f"is of {claimed}"
    return _foreign(str(receipt.get("student")), student, roster) if roster else VERIFIED


def _foreign(signed: str, student: str, roster: Roster) -> str:
    """Return VERIFIED, or whose receipt this is if it has the name of another student."""
    with contextlib.suppress(Unplaced):  # a login name need not be in the roster
        if (owner := roster.find((signed,))) != student:
            return f"names {owner}"
    return VERIFIED


def compared(handed_in: HandedIn, roster: Roster) -> HandedIn:
    """Return a hand-in whose receipt is compared with the names in a roster: another student's is not believed."""
    found = _foreign(handed_in.signed, handed_in.student, roster)
    if handed_in.receipt != VERIFIED or found == VERIFIED:
        return handed_in
    came = handed_in.came
    time = ON_TIME if marks_late(came.platform) and not came.late else UNKNOWN
    return replace(handed_in, receipt=found, came=replace(came, time=time))


def _why_not_believed(claimed: datetime | None, latest: datetime) -> str:
    """Return why a receipt's time is not believed; `latest` is that of its archive or files.  '' if it is."""
    if claimed is None:
        return "the time in its receipt cannot be read"
    if claimed < reading.EARLIEST:
        return f"the time in its receipt, {claimed.isoformat(' ')}, is too long ago"
    if claimed > datetime.now(UTC) + SOON:
        return f"the time in its receipt, {claimed:{TIME}}, is in the future"
    if claimed > latest:
        return f"the time in its receipt, {claimed:{TIME}}, is after that of its archive, {latest:{TIME}}"
    return ""


def _time(text: object) -> datetime | None:
    try:
        found = datetime.fromisoformat(str(text))
        return found.astimezone(UTC) if found.tzinfo else None
    except (ValueError, OverflowError):
        return None
