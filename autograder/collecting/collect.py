"""`autograder collect`: finds what students handed in, and lays it out as `STUDENT/ASSIGNMENT/FILES`.

Nothing is lost: of several hand-ins the newest on time is laid out, and the others are kept in `.others` beside the
students, where the grader does not look.  What cannot be placed is named, and stays where it is.
"""

import contextlib
import hashlib
import json
import os
import re
import shutil
import tempfile
from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path, PurePosixPath
from typing import Any

from autograder.collecting.archives import BadArchive, Member, flat, members
from autograder.collecting.origins import Origin, Roster, folder_name, origin
from autograder.errors import UsageError
from autograder.submissions import exercises, notebook, reading
from course.hand_in import RECEIPT

OTHERS = ".others"  # hand-ins that do not count
TIME = "%Y-%m-%d %H:%M:%S UTC"
VERIFIED, NONE = "verified", "none"
MAX_SOURCE = 4_000_000_000  # bytes of one archive


@dataclass(frozen=True)
class HandedIn:
    """One hand-in, and what is known of it."""

    source: str  # where it was found, for messages
    files: dict[str, bytes]
    student: str
    assignment: str
    at: datetime
    receipt: str = NONE  # VERIFIED, NONE, or what is wrong with it
    late: bool = False  # marked so by the platform
    upload: int = 0

    @property
    def remark(self) -> str:
        """What an instructor should know of it."""
        marks = [] if self.receipt in (VERIFIED, NONE) else [f"its receipt {self.receipt}"]
        return "; ".join([*marks, *(["the platform marks it late"] if self.late else [])])


@dataclass
class Collection:
    """What came of it."""

    laid_out: list[HandedIn]
    kept: list[HandedIn]  # in `.others`
    unplaced: list[str]  # a line each


@dataclass(frozen=True)
class Bundle:
    """Files that belong together: one archive, or what one student uploaded."""

    source: str
    members: list[Member]
    origin: Origin | None
    at: datetime


def collect(
    sources: Iterable[Path], into: Path, roster: Roster | None = None, due: datetime | None = None
) -> Collection:
    """Lay out what is found in `sources`: archives, folders of them, and bulk downloads of Canvas and Moodle.

    With a `roster`, who is not in it is not laid out.  Of several hand-ins the newest until `due` counts, or the newest
    of all when none was on time.  Raises UsageError for a source that is not there.
    """
    unplaced: list[str] = []
    found: dict[tuple[str, str], list[HandedIn]] = defaultdict(list)
    for source in sources:
        for bundle in _bundles(source, unplaced):
            try:
                handed_in = _identify(bundle, roster)
            except LookupError as error:
                unplaced.append(f"{bundle.source}: {error.args[0]}")
            else:
                found[handed_in.student, handed_in.assignment].append(handed_in)
    into.mkdir(parents=True, exist_ok=True)
    result = Collection([], [], unplaced)
    for key in sorted(found):
        best, *others = sorted(found[key], key=lambda each: _rank(each, due), reverse=True)
        if _place(best, into, due):
            result.laid_out.append(best)
        else:
            others.insert(0, best)
        for other in others:
            _keep(other, into)
            result.kept.append(other)
    return result


def _rank(handed_in: HandedIn, due: datetime | None) -> tuple[tuple[bool, datetime], int]:
    return _weight(handed_in.at, due), handed_in.upload


def _weight(at: datetime, due: datetime | None) -> tuple[bool, datetime]:
    """What is compared of two hand-ins: on time counts more than late, and then newer more than older."""
    return due is None or at <= due, at


# What is there.


def _bundles(source: Path, unplaced: list[str]) -> Iterator[Bundle]:
    """What belongs together in a source."""
    if source.is_dir():
        for student, assignment in _laid_out_already(source):
            yield _folder(source / student / assignment, student)
        for path in sorted(source.iterdir()):
            if path.is_file() and not path.is_symlink() and path.suffix.lower() == ".zip":
                yield from _archive(path, unplaced)
    elif source.is_file():
        yield from _archive(source, unplaced)
    else:
        raise UsageError(f"there is no file or folder {source}")


def _laid_out_already(source: Path) -> Iterator[tuple[str, str]]:
    for student in sorted(source.iterdir()):
        if student.is_dir() and not student.is_symlink() and not student.name.startswith("."):
            for name in exercises.names():
                if (student / name).is_dir() and not (student / name).is_symlink():
                    yield student.name, name


def _folder(folder: Path, student: str) -> Bundle:
    found = [Member(PurePosixPath(path.name), content, _changed(path)) for path, content in _files(folder)]
    at = max((member.changed for member in found), default=_changed(folder))
    return Bundle(str(folder), found, Origin((student,), ""), at)


def _files(folder: Path) -> Iterator[tuple[Path, bytes]]:
    """The ordinary files of a folder.  What else is there is not taken along: the grader names what is missing."""
    for path in sorted(folder.iterdir()) if folder.is_dir() else ():
        with contextlib.suppress(OSError, ValueError):
            yield path, reading.read_file(path, notebook.MAX_BYTES)


def _archive(path: Path, unplaced: list[str]) -> Iterator[Bundle]:
    try:
        if path.stat().st_size > MAX_SOURCE:
            raise BadArchive(f"larger than {MAX_SOURCE / 1e9:.0f} GB")
        inside = members(path.read_bytes())
    except BadArchive as error:
        unplaced.append(f"{path.name}: {error.args[0]}")
        return
    except OSError as error:
        unplaced.append(f"{path.name}: cannot be read ({error.strerror})")
        return
    if not any(origin(member.path) or member.path.suffix.lower() == ".zip" for member in inside):
        yield Bundle(path.name, flat(inside), origin(PurePosixPath(path.name)), _changed(path))
        return
    loose: dict[tuple[str, ...], list[tuple[Member, Origin]]] = defaultdict(list)
    for member in inside:
        where, whose = f"{path.name}, {member.path}", origin(member.path)
        if member.path.suffix.lower() == ".zip":
            try:
                yield Bundle(where, flat(members(member.content)), whose, member.changed)
            except BadArchive as error:
                unplaced.append(f"{where}: {error.args[0]}")
        elif whose:
            loose[whose.names].append((member, whose))
        else:
            unplaced.append(f"{where}: no platform names a file so")
    for uploaded in loose.values():
        yield _uploaded(path.name, uploaded)


def _uploaded(source: str, uploaded: list[tuple[Member, Origin]]) -> Bundle:
    """The files that one student uploaded one by one; of a file that is there twice the later one."""
    newest: dict[str, Member] = {}
    for member, whose in sorted(uploaded, key=lambda each: each[1].upload):
        newest[whose.file] = replace(member, path=PurePosixPath(whose.file))
    last = max((whose for _, whose in uploaded), key=lambda whose: whose.upload)
    late = any(whose.late for _, whose in uploaded)
    found = list(newest.values())
    at = max(member.changed for member in found)
    return Bundle(f"{source}, files of {last.names[-1]}", found, replace(last, file="", late=late), at)


def _changed(path: Path) -> datetime:
    return datetime.fromtimestamp(path.stat().st_mtime, UTC)


# Whose it is, and what.


def _identify(bundle: Bundle, roster: Roster | None) -> HandedIn:
    """Who handed a bundle in, for which exercise, and when; raises LookupError, which says what is not known."""
    files = {str(member.path): member.content for member in bundle.members if len(member.path.parts) == 1}
    receipt = _receipt(files.pop(RECEIPT, None))
    assignment = _assignment(files, receipt)
    names = bundle.origin.names if bundle.origin else (str(receipt.get("student") or ""),)
    if not any(names):
        raise LookupError("nothing tells who handed it in")
    student = roster.find(names) if roster else folder_name(names[-1])
    if not student:
        raise LookupError(f"{names[-1]!r} cannot be the name of a folder")
    wanted = exercises.load(assignment).taken
    at, state = bundle.at, NONE
    if receipt:
        state = _verify(receipt, files, student, roster)
        claimed = _time(receipt.get("handed_in"))
        if state == VERIFIED and claimed and claimed <= bundle.at:
            at = claimed
    return HandedIn(
        bundle.source,
        {name: content for name, content in files.items() if name in wanted},
        student,
        assignment,
        at.replace(microsecond=0),
        state,
        bool(bundle.origin and bundle.origin.late),
        bundle.origin.upload if bundle.origin else 0,
    )


def _assignment(files: dict[str, bytes], receipt: dict[str, Any]) -> str:
    """The exercise that has these files: the receipt's, or the one that most of them belong to."""
    owned = {name: exercises.load(name).taken for name in exercises.names()}
    claimed = receipt.get("assignment")
    if claimed in owned and owned[claimed] & files.keys():
        return str(claimed)
    best = max(owned, key=lambda name: len(owned[name] & files.keys()), default="")
    if not best or not owned[best] & files.keys():
        shown = ", ".join(sorted(files)[:5]) or "no file"
        raise LookupError(f"it has no file of an exercise of this course, but {shown}")
    return best


def _receipt(content: bytes | None) -> dict[str, Any]:
    try:
        found = json.loads(content) if content is not None else {}
    except (ValueError, RecursionError):
        return {"files": None}
    return found if isinstance(found, dict) else {"files": None}


def _verify(receipt: dict[str, Any], files: dict[str, bytes], student: str, roster: Roster | None) -> str:
    """VERIFIED, or what is wrong with a receipt."""
    listed = receipt.get("files")
    if not isinstance(listed, dict):
        return "cannot be read"
    for name, entry in listed.items():
        digest = entry.get("sha256") if isinstance(entry, dict) else None
        if name not in files or hashlib.sha256(files[name]).hexdigest() != digest:
            return f"does not match {name}"
    if more := sorted(files.keys() - listed.keys()):
        return f"does not list {more[0]}"
    if roster:
        with contextlib.suppress(LookupError):  # a login name need not be in the roster
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
        if at and _weight(at, due) >= _weight(handed_in.at, due):
            return same and at == handed_in.at
        _move_away(target, into, at)
    target.parent.mkdir(parents=True, exist_ok=True)
    _write(handed_in, target, into)
    return True


def _laid_out(target: Path) -> tuple[dict[str, bytes], datetime | None]:
    """The files of a submission that is laid out, and its time."""
    files = {path.name: content for path, content in _files(target)}
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
    """What came of a collection, in lines for the instructor."""
    lines = []
    for title, handed_in in (("Laid out:", collection.laid_out), ("Kept, but not counted:", collection.kept)):
        lines += [title] * bool(handed_in)
        for each in handed_in:
            verified = ", receipt verified" if each.receipt == VERIFIED else ""
            look = f"  LOOK: {each.remark}" if each.remark else ""
            lines.append(f"  {each.student}/{each.assignment}, {each.at:{TIME}}{verified} ({each.source}){look}")
    lines += ["Could not be placed:"] * bool(collection.unplaced)
    lines += [f"  {line}" for line in collection.unplaced]
    count, students = len(collection.laid_out), len({each.student for each in collection.laid_out})
    return "\n".join([*lines, f"{count} submissions of {students} students; {len(collection.unplaced)} not placed."])


def parse_due(text: str) -> datetime:
    """A due date as `2026-11-20 23:59 UTC`, or with an offset; raises UsageError for a time without a zone."""
    try:
        due = datetime.fromisoformat(re.sub(r"\s*(UTC|Z)$", "+00:00", text.strip()))
    except ValueError:
        raise UsageError(f"{text!r} is no time: write it as '2026-11-20 23:59 UTC'") from None
    if due.tzinfo is None:
        raise UsageError(f"{text!r} has no time zone: write '{text} UTC', or an offset as in '{text}+01:00'")
    return due.astimezone(UTC)
