"""Bundles of files to collect: each bundle holds the files that one student handed in together."""

import contextlib
import json
import tempfile
from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path, PurePath, PurePosixPath
from typing import Any, TypeVar

from autograder.collecting.archives import (
    MAX_CLASS,
    MAX_CLASS_FILES,
    MAX_STUDENT,
    ArchivedFile,
    Packed,
    contents,
    flat,
    members,
    members_of,
    opened,
)
from autograder.errors import RefusedFile, UsageError
from autograder.platforms import Origin, origin
from autograder.submissions import exercises, notebook, reading
from course.errors import BadArchive
from course.foundation.untrusted import Allowance, shortened
from course.hand_in import RECEIPT

File = TypeVar("File", ArchivedFile, Packed)
WRAPPED = 3  # archives around each other


@dataclass(frozen=True)
class Loose:
    """A file that a browser has unpacked, and that has not been read yet."""

    path: PurePosixPath
    changed: datetime
    _file: Path

    def unpack(self, allowance: Allowance) -> ArchivedFile:
        """Read it; raises BadArchive."""
        try:
            content = reading.read_file(self._file, MAX_STUDENT)
        except OSError as error:
            raise BadArchive(f"cannot be read ({error.strerror})") from None
        except RefusedFile as error:
            raise BadArchive(str(error)) from None
        allowance.spend(len(content))
        return ArchivedFile(self.path, content, self.changed)


@dataclass(frozen=True)
class Bundle:
    """Files that belong together: one archive, or what one student uploaded."""

    source: str  # where it was found, for messages
    download: str  # the archive or folder that was given, in which a platform's numbers tell students apart
    members: list[ArchivedFile]
    origin: Origin | None
    at: datetime


def bundles(source: Path, unplaced: list[str]) -> Iterator[Bundle]:
    """Yield what belongs together in a source; what cannot be read gets a line in `unplaced`.

    Raises UsageError for a source that is not there.
    """
    if source.is_dir():
        for student, assignment in _laid_out_already(source):
            try:
                yield _folder(source / student / assignment, student, source)
            except BadArchive as error:
                unplaced.append(f"{source / student / assignment}: {error.args[0]}")
        for path in sorted(source.iterdir()):
            if path.is_file() and not path.is_symlink() and _is_archive(path):
                yield from _archive(path, unplaced)
        yield from _downloaded(source, unplaced)
    elif source.is_file():
        yield from _archive(source, unplaced)
    else:
        raise UsageError(f"there is no file or folder {source}")


@contextlib.contextmanager
def unpacked(path: Path, assignment: str) -> Iterator[Path]:
    """A folder, for as long as it is needed, with the files of an exercise that an archive has.

    Raises UsageError, also for what says that it is of another exercise.
    """
    try:
        allowance = Allowance(MAX_STUDENT)
        with opened(path) as file:
            inside = _unwrapped(members(file, allowance), allowance)
    except BadArchive as error:
        raise UsageError(f"{path}: {error.args[0]}") from None
    wanted = exercises.load(assignment).taken
    with tempfile.TemporaryDirectory(prefix="handed-in-") as folder:
        for member in inside:
            if str(member.path) == RECEIPT and (claimed := receipt(member.content).get("assignment")) != assignment:
                other = claimed if claimed in exercises.names() else "not an exercise in this course"
                raise UsageError(f"{path} is a hand-in of {other}, not of {assignment}")
            if str(member.path) in wanted:
                (Path(folder) / member.path.name).write_bytes(member.content)
        yield Path(folder)


def receipt(content: bytes | None) -> dict[str, Any]:
    """Return what the receipt of a hand-in says; empty when there is none, without files when it cannot be read."""
    try:
        found = json.loads(content) if content is not None else {}
    except (ValueError, RecursionError):
        return {"files": None}
    return found if isinstance(found, dict) else {"files": None}


def _laid_out_already(source: Path) -> Iterator[tuple[str, str]]:
    for student in sorted(source.iterdir()):
        ours = not student.name.startswith(".") and not _named_by_platform(student)
        if ours and student.is_dir() and not student.is_symlink():
            for name in exercises.names():
                if (student / name).is_dir() and not (student / name).is_symlink():
                    yield student.name, name


def _folder(folder: Path, student: str, source: Path) -> Bundle:
    allowance = Allowance(MAX_STUDENT)
    found = []
    for path, content in files_of(folder):
        allowance.spend(len(content))
        found.append(ArchivedFile(PurePosixPath(path.name), content, _changed(path)))
    at = max((member.changed for member in found), default=_changed(folder))
    return Bundle(str(folder), str(source), found, Origin((student,), ""), at)


def files_of(folder: Path) -> Iterator[tuple[Path, bytes]]:
    """The ordinary files of a folder.  What else is there is not taken along: the grader names what is missing."""
    for path in sorted(folder.iterdir()) if folder.is_dir() else ():
        with contextlib.suppress(OSError, RefusedFile):
            yield path, reading.read_file(path, notebook.MAX_BYTES)


def _downloaded(source: Path, unplaced: list[str]) -> Iterator[Bundle]:
    """A bulk download that a browser has unpacked: files, or folders of students, with a platform's names."""
    found = []
    for path in sorted(source.iterdir()):
        if path.is_symlink() or not _named_by_platform(path) or (path.is_file() and _is_archive(path)):
            continue
        for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
            if not file.is_symlink() and file.is_file():
                found.append(Loose(PurePosixPath(file.relative_to(source)), _changed(file), file))
    yield from _of_platform(source.name, found, unplaced)


def _named_by_platform(path: Path) -> bool:
    return bool(origin(PurePosixPath(path.name, "file") if path.is_dir() else PurePosixPath(path.name)))


def _is_archive(path: PurePath) -> bool:
    return path.suffix.lower() == ".zip"


def _archive(path: Path, unplaced: list[str]) -> Iterator[Bundle]:
    """The bundle of one student's archive, or those of a bulk download.

    What a platform named after a student is that student's, whatever the names in it say.
    """
    whose = origin(PurePosixPath(path.name))
    allowance = Allowance(MAX_STUDENT)
    try:
        with opened(path) as file:
            if not whose:
                found = list(contents(file))
                packed = [each for each in found if isinstance(each, Packed)]
                if any(origin(each.path) for each in packed) or len(_archives_in(packed)) > 1:
                    unplaced += [f"{path.name}: {each}" for each in found if isinstance(each, str)]
                    yield from _of_platform(path.name, packed, unplaced)
                    return
            inside = _unwrapped(members(file, allowance), allowance)
    except BadArchive as error:
        unplaced.append(f"{path.name}: {error.args[0]}")
    else:
        yield Bundle(path.name, path.name, inside, whose, _changed(path))


def _of_platform(download: str, inside: Iterable[Packed | Loose], unplaced: list[str]) -> Iterator[Bundle]:
    """Yield what each student uploaded, of the files of a bulk download.

    One after the other is unpacked, and what is wrong with one does not affect the others.
    """
    everybody = Allowance(MAX_CLASS)
    each_student: dict[object, Allowance] = defaultdict(lambda: Allowance(MAX_STUDENT, everybody))
    loose: dict[tuple[str, ...], list[tuple[Packed | Loose, Origin]]] = defaultdict(list)
    for number, file in enumerate(inside):
        where, whose = f"{download}, {shortened(str(file.path))}", origin(file.path)
        if number >= MAX_CLASS_FILES:
            unplaced.append(f"{download}: only the first {MAX_CLASS_FILES:,} files were looked at")
            break
        if _is_archive(file.path):
            own = each_student[whose.names if whose else number]
            try:
                unpacked = members_of(file.unpack(own).content, own)
                yield Bundle(where, download, _unwrapped(unpacked, own), whose, file.changed)
            except BadArchive as error:
                unplaced.append(f"{where}: {error.args[0]}")
        elif whose:
            loose[whose.names].append((file, whose))
        else:
            unplaced.append(f"{where}: no platform names a file so")
    for names, uploaded in loose.items():
        found = []
        for file, whose in uploaded:
            try:
                found.append((file.unpack(each_student[names]), whose))
            except BadArchive as error:
                unplaced.append(f"{download}, {shortened(str(file.path))}: {error.args[0]}")
        if found:
            yield _uploaded(download, found)


def _unwrapped(inside: list[ArchivedFile], allowance: Allowance, depth: int = WRAPPED) -> list[ArchivedFile]:
    """The files of what may be an archive around one other archive, such as a hand-in that was zipped again."""
    inner = _archives_in(inside)
    if len(inner) == 1 and all(member.path.suffix.lower() not in (".py", ".ipynb") for member in inside):
        if not depth:
            raise BadArchive(f"more than {WRAPPED} archives in each other")
        return _unwrapped(members_of(inner[0].content, allowance), allowance, depth - 1)
    return flat(inside)


def _archives_in(inside: list[File]) -> list[File]:
    return [member for member in inside if _is_archive(member.path)]


def _uploaded(download: str, uploaded: list[tuple[ArchivedFile, Origin]]) -> Bundle:
    """The files that one student uploaded one by one; of a file that is there twice the later one."""
    newest: dict[str, ArchivedFile] = {}
    for member, whose in sorted(uploaded, key=lambda each: each[1].upload):
        newest[whose.file] = replace(member, path=PurePosixPath(whose.file))
    last = max((whose for _, whose in uploaded), key=lambda whose: whose.upload)
    late = any(whose.late for _, whose in uploaded)
    found = list(newest.values())
    at = max(member.changed for member in found)
    source = f"{download}, files of {shortened(last.names[-1])}"
    return Bundle(source, download, found, replace(last, file="", late=late), at)


def _changed(path: Path) -> datetime:
    return datetime.fromtimestamp(path.stat().st_mtime, UTC)
