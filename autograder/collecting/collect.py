"""`autograder collect`: finds what students handed in, and lays it out as `STUDENT/ASSIGNMENT/FILES`.

Nothing is lost: of several hand-ins the newest on time is laid out, and the others are kept in `.others` beside the
students, where the grader does not look.  What cannot be placed is named, and stays where it is.
"""

import contextlib
import hashlib
import os
import re
import shutil
import tempfile
import zlib
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from autograder.collecting import provenance
from autograder.collecting.bundles import Bundle, bundles, files_of
from autograder.collecting.bundles import receipt as read_receipt
from autograder.collecting.provenance import Source
from autograder.collecting.roster import Roster, folder_name
from autograder.errors import Unplaced, UsageError
from autograder.platforms import Origin, users_are_global
from autograder.submissions import exercises, reading
from course.foundation.untrusted import one_line, shortened
from course.hand_in import RECEIPT

OTHERS = ".others"  # hand-ins that do not count
TIME = "%Y-%m-%d %H:%M:%S UTC"
VERIFIED, NONE = "verified", "none"
SAME_SECOND = re.compile(r"\d{8}T\d{6}Z-(\d{1,2})\.zip$")  # how `course hand-in` calls a further one of a second
SOON = timedelta(minutes=5)  # that a clock may be ahead by


@dataclass(frozen=True)
class HandedIn:
    """One hand-in, and what is known of it."""

    source: str  # where it was found, for messages
    packed: dict[str, bytes]  # compressed: a class must fit into memory, also when one of it hands in zeros
    student: str
    assignment: str
    at: datetime
    came: Source  # from where, and whose it is there
    download: str = ""
    receipt: str = NONE  # VERIFIED, NONE, or what is wrong with it
    ahead: datetime | None = None  # what its time says, when that lies in the future

    @property
    def files(self) -> dict[str, bytes]:
        """Return what was handed in."""
        return {name: zlib.decompress(content) for name, content in self.packed.items()}

    @property
    def remark(self) -> str:
        """Return what an instructor should know of it."""
        reasons = {
            f"its receipt {self.receipt}": self.receipt not in (VERIFIED, NONE),
            "the platform marks it late": self.came.late,
            f"a wrong clock: its time, {self.ahead:%Y-%m-%d %H:%M} UTC, has not come yet" if self.ahead else "": True,
        }
        return "; ".join(reason for reason, holds in reasons.items() if reason and holds)


@dataclass
class Collection:
    """The result of collecting."""

    laid_out: list[HandedIn]
    kept: list[HandedIn]  # in `.others`
    unplaced: list[str]  # a line each


def collect(
    sources: Iterable[Path], into: Path, roster: Roster | None = None, due: datetime | None = None
) -> Collection:
    """Lay out what is found in `sources`: archives, folders of them, and bulk downloads of Canvas and Moodle.

    With a `roster`, who is not in it is not laid out; neither is who cannot be told from somebody else.  Of several
    hand-ins the newest until `due` counts, or the newest of all when none was on time.  Raises UsageError for a source
    that is not there.
    """
    unplaced: list[str] = []
    found: dict[tuple[str, str], list[HandedIn]] = defaultdict(list)
    for source in sources:
        for bundle in bundles(source, unplaced):
            try:
                handed_in = _identify(bundle, roster)
            except Unplaced as error:
                unplaced.append(f"{bundle.source}: {error.args[0]}")
            else:
                found[handed_in.student, handed_in.assignment].append(handed_in)
    into.mkdir(parents=True, exist_ok=True)
    result = Collection([], [], unplaced)
    for key in sorted(found):
        if why := _several_people(found[key], provenance.read(into, *key), roster):
            unplaced += [f"{each.source}: {why}" for each in found[key]]
            continue
        best, *others = sorted(found[key], key=lambda each: _rank(each, due), reverse=True)
        if _place(best, into, due):
            result.laid_out.append(best)
        else:
            others.insert(0, best)
        for other in others:
            _keep(other, into)
            result.kept.append(other)
    return result


def _rank(handed_in: HandedIn, due: datetime | None) -> tuple[tuple[bool, datetime], int, int]:
    again = SAME_SECOND.search(handed_in.source)
    return _weight(handed_in.at, due), handed_in.came.upload, int(again[1]) if again else 1


def _several_people(found: list[HandedIn], before: list[Source], roster: Roster | None) -> str:
    """Return why these hand-ins under one name seem to be of several people; '' when they do not.

    A platform's number tells people apart: Canvas's everywhere, Moodle's within one download of an assignment.
    """
    numbers: dict[tuple[str, str], set[str]] = defaultdict(set)
    everywhere = [("", each) for each in before]
    for download, came in [*((each.download, each.came) for each in found), *everywhere]:
        if came.platform and not (roster and roster.has(came.user)):
            numbers[came.platform, "" if users_are_global(came.platform) else download].add(came.user)
    for (platform, download), users in numbers.items():
        if len(users) > 1 and (download or users_are_global(platform)):
            who = " and ".join(sorted(users))
            name = found[0].came.name
            return f"{platform} has several called {name!r}, {who}: name each in the roster, with the number"
    return ""


def _weight(at: datetime, due: datetime | None) -> tuple[bool, datetime]:
    """Return what is compared of two hand-ins: on time counts more than late, and then newer more than older."""
    return due is None or at <= due, at


# Whose it is, and what.


def _identify(bundle: Bundle, roster: Roster | None) -> HandedIn:
    """Return who handed a bundle in, for which exercise, and when; raises Unplaced, which says what is not known."""
    files = {str(member.path): member.content for member in bundle.members if len(member.path.parts) == 1}
    receipt = read_receipt(files.pop(RECEIPT, None))
    assignment = _assignment(files, receipt)
    names = bundle.origin.names if bundle.origin else (str(receipt.get("student") or ""),)
    if not any(names):
        raise Unplaced("nothing tells who handed it in")
    student = roster.find(names) if roster else folder_name(names[-1])
    if not student:
        raise Unplaced(f"{shortened(names[-1])!r} cannot be the name of a folder")
    wanted = exercises.load(assignment).taken
    at, state = bundle.at, NONE
    if receipt:
        state = _verify(receipt, files, student, roster)
        claimed = _time(receipt.get("handed_in"))
        if state == VERIFIED and claimed and claimed <= bundle.at:
            at = claimed
    now = datetime.now(UTC)
    ahead = at if at > now + SOON else None
    came = bundle.origin or Origin(names, bundle.source)
    return HandedIn(
        bundle.source,
        {name: zlib.compress(content, 1) for name, content in files.items() if name in wanted},
        student,
        assignment,
        min(at, now).replace(microsecond=0),
        Source(came.platform, came.names[-1], came.names[0], came.file, came.upload, came.late),
        bundle.download,
        state,
        ahead,
    )


def _assignment(files: dict[str, bytes], receipt: dict[str, Any]) -> str:
    """The exercise that has these files: the receipt's, or the one that most of them belong to."""
    owned = {name: exercises.load(name).taken for name in exercises.names()}
    claimed = receipt.get("assignment")
    if isinstance(claimed, str) and claimed not in owned:
        raise Unplaced(f"its receipt says {claimed[:100]!r}, which is not an exercise in this course")
    if isinstance(claimed, str) and owned[claimed] & files.keys():
        return claimed
    best = max(owned, key=lambda name: len(owned[name] & files.keys()), default="")
    if not best or not owned[best] & files.keys():
        shown = ", ".join(map(shortened, sorted(files)[:5])) or "no file"
        raise Unplaced(f"it has no file of an exercise of this course, but {shown}")
    return best


def _verify(receipt: dict[str, Any], files: dict[str, bytes], student: str, roster: Roster | None) -> str:
    """VERIFIED, or what is wrong with a receipt."""
    listed = receipt.get("files")
    if not isinstance(listed, dict):
        return "cannot be read"
    for name, entry in listed.items():
        digest = entry.get("sha256") if isinstance(entry, dict) else None
        if name not in files or hashlib.sha256(files[name]).hexdigest() != digest:
            return f"does not match {shortened(name)}"
    if more := sorted(files.keys() - listed.keys()):
        return f"does not list {shortened(more[0])}"
    if roster:
        with contextlib.suppress(Unplaced):  # a login name need not be in the roster
            if (owner := roster.find((str(receipt.get("student")),))) != student:
                return f"is made out to {owner}"
    return VERIFIED


def _time(text: object) -> datetime | None:
    try:
        found = datetime.fromisoformat(str(text))
        return found.astimezone(UTC) if found.tzinfo else None
    except (ValueError, OverflowError):
        return None


# Where it goes.


def _place(handed_in: HandedIn, into: Path, due: datetime | None) -> bool:
    """Lay a hand-in out; False when one that counts more is there already."""
    target = into / handed_in.student / handed_in.assignment
    if os.path.lexists(target):
        files, at = _laid_out(target)
        same = files == handed_in.files
        if same and at and handed_in.ahead:
            return True  # collected before: it does not become newer by that
        if at and _weight(at, due) >= _weight(handed_in.at, due):
            if same and at == handed_in.at:
                provenance.add(into, handed_in.student, handed_in.assignment, handed_in.came)
                return True
            return False
        _move_away(target, into, at)
    target.parent.mkdir(parents=True, exist_ok=True)
    provenance.add(into, handed_in.student, handed_in.assignment, handed_in.came)
    _write(handed_in, target, into)
    return True


def _laid_out(target: Path) -> tuple[dict[str, bytes], datetime | None]:
    """The files of a submission that is laid out, and its time."""
    files = {path.name: content for path, content in files_of(target)}
    try:
        text = files.pop(reading.TIMESTAMP, b"").decode().strip()
        return files, datetime.strptime(text, TIME).replace(tzinfo=UTC)
    except ValueError:
        return files, None


def _keep(handed_in: HandedIn, into: Path) -> None:
    """Keep a hand-in that does not count; one that is kept already is not kept twice."""
    folder = into / OTHERS / handed_in.student / handed_in.assignment
    folder.mkdir(parents=True, exist_ok=True)
    digest = hashlib.sha256(repr(sorted(handed_in.files.items())).encode()).hexdigest()[:8]
    target = folder / f"{handed_in.at:%Y%m%dT%H%M%SZ}-{digest}"
    if not target.exists():
        _write(handed_in, target, into)


def _move_away(target: Path, into: Path, at: datetime | None) -> None:
    folder = into / OTHERS / target.parent.name / target.name
    folder.mkdir(parents=True, exist_ok=True)
    stem = f"{at:%Y%m%dT%H%M%SZ}" if at else "no-time"
    number = next(number for number in range(10_000) if not (folder / f"{stem}-{number}").exists())
    target.rename(folder / f"{stem}-{number}")


def _write(handed_in: HandedIn, target: Path, into: Path) -> None:
    """Write a hand-in's folder, whole or not at all."""
    draft = Path(tempfile.mkdtemp(prefix=".part-", dir=into))
    try:
        draft.chmod(0o755)
        for name, content in handed_in.files.items():
            (draft / name).write_bytes(content)
        (draft / reading.TIMESTAMP).write_text(f"{handed_in.at:{TIME}}\n", encoding="ascii")
        draft.rename(target)
    except BaseException:
        shutil.rmtree(draft, ignore_errors=True)
        raise


def describe(collection: Collection) -> str:
    """Return what came of a collection, in lines for the instructor."""
    lines = []
    for title, handed_in in (("Laid out:", collection.laid_out), ("Kept, but not counted:", collection.kept)):
        lines += [title] * bool(handed_in)
        for each in handed_in:
            verified = ", receipt verified" if each.receipt == VERIFIED else ""
            look = f"  LOOK: {each.remark}" if each.remark else ""
            lines.append(
                one_line(f"  {each.student}/{each.assignment}, {each.at:{TIME}}{verified} ({each.source}){look}")
            )
    lines += ["Could not be placed:"] * bool(collection.unplaced)
    lines += [one_line(f"  {line}") for line in collection.unplaced]
    count, students = len(collection.laid_out), len({each.student for each in collection.laid_out})
    return "\n".join([*lines, f"{count} submissions of {students} students; {len(collection.unplaced)} not placed."])


def parse_due(text: str) -> datetime:
    """A due date as `2026-11-20 23:59 UTC`, or with an offset; raises UsageError for a time without a zone."""
    try:
        due = datetime.fromisoformat(re.sub(r"\s*(UTC|Z)$", "+00:00", text.strip()))
    except ValueError:
        raise UsageError(f"{text!r} is not a time: write it as '2026-11-20 23:59 UTC'") from None
    if due.tzinfo is None:
        raise UsageError(f"{text!r} has no time zone: write '{text} UTC', or an offset as in '{text}+01:00'")
    return due.astimezone(UTC)
