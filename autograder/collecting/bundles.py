"""Bundles of files to collect: each bundle holds the files that one student handed in together."""

import contextlib
import json
import os
import tempfile
from collections import defaultdict
from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path, PurePath, PurePosixPath
from typing import Any, TypeVar

from autograder.collecting.archives import (
    ARCHIVE,
    DEEPEST,
    MAX_CLASS,
    MAX_CLASS_FILES,
    MAX_STUDENT,
    MAX_UNNAMED,
    ArchivedFile,
    Packed,
    contents,
    flat,
    is_archive,
    is_junk,
    is_tarball,
    members,
    members_of,
    opened,
    stem,
)
from autograder.errors import RefusedFile, UnknownTime, UsageError
from autograder.platforms import Origin, is_traced, is_unpacked, origin
from autograder.results.text import counted
from autograder.submissions import exercises, notebook, reading
from course.errors import BadArchive
from course.foundation.untrusted import Allowance, shortened
from course.hand_in import RECEIPT

File = TypeVar("File", ArchivedFile, Packed)
WRAPPED = 3  # nested archives
MOST_OTHER = 20  # files of a folder that are listed one by one as not handed in
CLOSED = "no permission to read it: ask its owner to change that, or to remove it"
NO_FORM = "its name matches neither Canvas nor Moodle"
NOBODYS = "a platform named it, but the name does not identify a student: their name there may be unusual"
UNPACKED = (
    "a folder with a name that Canvas gives to a student's file: the names of the files in it are of the student's own "
    "choice. Pack it as .zip, under the same name, or rename it if it is not an upload"
)
OTHER_ARCHIVES = {".gz", ".tar", ".bz2", ".xz", ".zst", ".rar", ".7z"}
UNREADABLE: dict[str, Any] = {"files": None}  # in place of a receipt's content


@dataclass(frozen=True)
class Loose:
    """A file that a browser has unpacked, and that has not been read yet."""

    path: PurePosixPath
    changed: datetime
    _file: Path

    def unpack(self, allowance: Allowance) -> ArchivedFile:
        """Read the file; raises BadArchive."""
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

    source: str  # the place where it was found, for messages
    download: str  # the given archive or folder, within which a platform's numbers identify students
    members: list[ArchivedFile]
    origin: Origin | None
    at: datetime  # the latest time at which it can have been handed in
    stamped: bool = False  # `at` was recorded by nbgrader or an earlier collecting
    likely: tuple[str, ...] = ()  # names of files and folders around it, one of which may be a student's
    left: tuple[str, ...] = ()  # entries there that are not readable files
    unnamed: bool = False  # it was in an archive of archives in which no platform has named anybody


def check(source: Path) -> None:
    """Raise UsageError for a source that does not exist, or is neither a file nor a folder."""
    if not source.is_dir() and not source.is_file():
        raise UsageError(f"there is no file or folder {source}")


def bundles(source: Path, unplaced: list[str], without: Path | None = None) -> Iterator[Bundle]:
    """Yield the bundles of a source; everything else in it gets a line in `unplaced`.

    The folder `without` is left out.  Raises UsageError for a source that does not exist.
    """
    check(source)
    if source.is_dir():
        yield from _below(source, source, unplaced, without.resolve() if without else None)
    else:
        yield from _archive(source, source.name, unplaced)


def _below(
    folder: Path, source: Path, unplaced: list[str], without: Path | None, done: Container[Path] = ()
) -> Iterator[Bundle]:
    """Yield the bundles in a folder of a source, and in the folders below it except those in `done`."""
    if not os.access(folder, os.R_OK | os.X_OK):
        unplaced.append(f"{shortened(str(folder.relative_to(source)))}: {CLOSED}")
        return
    laid_out = set()
    for student, assignment in _laid_out_already(folder):
        place = folder / student / assignment
        laid_out.add(place)
        try:
            yield _folder(place, student, source)
        except BadArchive as error:
            unplaced.append(f"{place}: {error.args[0]}")
        except PermissionError:
            unplaced.append(f"{place}: {CLOSED}")
    yield from _downloaded(folder, unplaced)
    other = 0
    for path in sorted(folder.iterdir()):
        where = str(path.relative_to(source))
        hidden = path.name.startswith(".") and not is_archive(path.name)
        if path in done or is_junk(path.name) or hidden or path.resolve() == without:
            continue
        if path.is_symlink():
            unplaced.append(f"{shortened(where)}: a link, which is not followed")
        elif path.is_file() and is_archive(path.name):
            around = (stem(path), *([folder.name] if folder != source else []))
            yield from _archive(path, where, unplaced, around, folder.name)
        elif _named_by_platform(path):
            continue
        elif path.is_dir() and is_unpacked(path.name):
            unplaced.append(f"{shortened(where)}: {UNPACKED}")
        elif is_traced(_as_file(path)):
            unplaced.append(f"{shortened(where)}: {NOBODYS}")
        elif path.is_dir() and len(path.relative_to(source).parts) > DEEPEST:
            unplaced.append(f"{shortened(where)}: its folders are nested too deeply")
        elif path.is_dir():
            yield from _below(path, source, unplaced, without, laid_out)
        elif (other := other + 1) <= MOST_OTHER:
            unplaced.append(f"{shortened(where)}: {_why_not(path)}")
    if other > MOST_OTHER:
        unplaced.append(f"{folder}: {counted(other - MOST_OTHER, 'more file')} without a hand-in")


def _why_not(path: PurePath) -> str:
    if is_other_archive(path.name):
        return f"this kind of archive cannot be opened: unpack it, and pack it as {ARCHIVE}"
    return "neither an archive nor named by a platform, so its student is unknown"


def is_other_archive(name: str) -> bool:
    """Return True for the name of an archive of a kind that cannot be opened here."""
    return PurePath(name).suffix.lower() in OTHER_ARCHIVES and not is_tarball(name)


@contextlib.contextmanager
def unpacked(path: Path, assignment: str) -> Iterator[Path]:
    """Unpack the files of an exercise from an archive into a temporary folder.

    Raises UsageError, also when the archive's receipt names another exercise.
    """
    try:
        allowance = Allowance(MAX_STUDENT)
        with opened(path) as file:
            inside = _unwrapped(members(file, path.name, allowance), allowance)
    except BadArchive as error:
        raise UsageError(f"{path}: {error.args[0]}") from None
    wanted = exercises.load(assignment).taken
    with tempfile.TemporaryDirectory(prefix="handed-in-") as folder:
        for member in inside:
            if str(member.path) == RECEIPT and (claimed := receipt(member.content).get("assignment")) != assignment:
                other = claimed if claimed in exercises.names() else "an exercise that this course does not have"
                raise UsageError(f"{path} is a hand-in of {other}, not of {assignment}")
            if str(member.path) in wanted:
                (Path(folder) / member.path.name).write_bytes(member.content)
        yield Path(folder)


def receipt(content: bytes | None) -> dict[str, Any]:
    """Return the content of a hand-in's receipt; empty without a receipt, UNREADABLE when it cannot be read."""
    try:
        found = json.loads(content) if content is not None else {}
    except (ValueError, RecursionError):
        return UNREADABLE
    return found if isinstance(found, dict) else UNREADABLE


def _laid_out_already(source: Path) -> Iterator[tuple[str, str]]:
    for student in sorted(source.iterdir()):
        ours = not student.name.startswith(".") and not _named_by_platform(student)
        if ours and student.is_dir() and not student.is_symlink():
            for name in exercises.names():
                if os.path.isdir(student / name) and not (student / name).is_symlink():  # its owner may have closed it
                    yield student.name, name


def _folder(folder: Path, student: str, source: Path) -> Bundle:
    allowance = Allowance(MAX_STUDENT)
    found = []
    for path, content in files_of(folder):
        allowance.spend(len(content))
        found.append(ArchivedFile(PurePosixPath(path.name), content, _changed(path)))
    read = {str(member.path) for member in found}
    left = tuple(path.name for path in sorted(folder.iterdir()) if path.name not in read)
    at = max((member.changed for member in found), default=_changed(folder))
    try:
        stamp = reading.handed_in_at(folder)
    except UnknownTime:
        stamp = None
    at = stamp.replace(tzinfo=UTC) if stamp else at
    return Bundle(str(folder), str(source), found, Origin((student,), ""), at, stamped=bool(stamp), left=left)


def files_of(folder: Path) -> Iterator[tuple[Path, bytes]]:
    """Yield the regular files of a submission's folder; the grader names those that are missing."""
    return reading.regular_files(folder, notebook.MAX_BYTES)


def _downloaded(source: Path, unplaced: list[str]) -> Iterator[Bundle]:
    """Yield the bundles of a bulk download that a browser has unpacked: files or folders with a platform's names."""
    found = []
    for path in sorted(source.iterdir()):
        if path.is_symlink() or not _named_by_platform(path) or (path.is_file() and is_archive(path.name)):
            continue
        for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
            if file.is_symlink():
                unplaced.append(f"{shortened(str(file.relative_to(source)))}: a link, which is not followed")
            elif file.is_file() and not is_junk(str(file.relative_to(source))):
                found.append(Loose(PurePosixPath(file.relative_to(source)), _changed(file), file))
    yield from _of_platform(source.name, found, unplaced)


def _named_by_platform(path: Path) -> bool:
    return bool(origin(_as_file(path)))


def _as_file(path: Path) -> PurePosixPath:
    """Return the path in a download of the file at this path, or of a file in the folder at this path."""
    return PurePosixPath(path.name, "file") if path.is_dir() else PurePosixPath(path.name)


def _archive(
    path: Path, where: str, unplaced: list[str], likely: tuple[str, ...] = (), around: str = ""
) -> Iterator[Bundle]:
    """Yield the bundle of one student's archive, or those of a bulk download.

    A file that a platform named after a student belongs to that student, whatever names are inside it.  It belongs to
    the same download as other files that the platform has named in the folder `around` it.
    """
    whose = origin(PurePosixPath(path.name))
    allowance = Allowance(MAX_STUDENT)
    if is_other_archive(path.name):
        unplaced.append(f"{where}: {_why_not(path)}")
        return
    if not whose and is_traced(PurePosixPath(path.name)):
        unplaced.append(f"{where}: {NOBODYS}")
        return
    try:
        with opened(path) as file:
            if not whose and not is_tarball(path.name):  # platforms pack a class only as .zip
                found = list(contents(file))
                packed = [each for each in found if isinstance(each, Packed)]
                if any(is_traced(each.path) for each in packed) or len(_archives_in(packed)) > 1:
                    unplaced += [f"{where}: {each}" for each in found if isinstance(each, str)]
                    yield from _of_platform(where, packed, unplaced)
                    return
            inside = _unwrapped(members(file, path.name, allowance), allowance)
    except BadArchive as error:
        unplaced.append(f"{where}: {error.args[0]}")
    else:
        download = around if whose and around else where
        yield Bundle(where, download, inside, whose, _changed(path), likely=likely or (stem(path),))


def _of_platform(download: str, inside: Sequence[Packed | Loose], unplaced: list[str]) -> Iterator[Bundle]:
    """Yield the bundle of each student from the files of a bulk download.

    They are unpacked one after the other, and an error in one does not affect the others.  If a platform has named some
    files, a file that it has not named after a student belongs to nobody, because a student controls the content of an
    archive, including its receipt.
    """
    named = any(is_traced(file.path) for file in inside)
    everybody = Allowance(MAX_CLASS if named else min(MAX_CLASS, MAX_UNNAMED))
    each_student: dict[object, Allowance] = defaultdict(lambda: Allowance(MAX_STUDENT, everybody))
    loose: dict[tuple[str, ...], list[tuple[Packed | Loose, Origin]]] = defaultdict(list)
    for number, file in enumerate(inside):
        where, whose = f"{download}, {shortened(str(file.path))}", origin(file.path)
        if number >= MAX_CLASS_FILES:
            unplaced.append(f"{download}: only the first {MAX_CLASS_FILES:,} files were looked at")
            break
        if named and not whose and is_archive(file.path.name):
            unplaced.append(f"{where}: {NOBODYS}")
        elif is_archive(file.path.name):
            own = each_student[whose.names if whose else number]
            try:
                unpacked = members_of(file.unpack(own).content, file.path.name, own)
                likely = (stem(file.path), *file.path.parts[:-1][::-1])
                inner = _unwrapped(unpacked, own)
                yield Bundle(where, download, inner, whose, file.changed, likely=likely, unnamed=not named)
            except BadArchive as error:
                unplaced.append(f"{where}: {error.args[0]}")
        elif whose:
            loose[whose.names].append((file, whose))
        else:
            why = _why_not(file.path) if is_other_archive(file.path.name) else NO_FORM
            unplaced.append(f"{where}: {why}")
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
    """Return the files; unpacks an archive that is alone in another one, such as a hand-in that was zipped again."""
    inner = _archives_in(inside)
    if len(inner) == 1 and all(member.path.suffix.lower() not in (".py", ".ipynb") for member in inside):
        if not depth:
            raise BadArchive(f"more than {WRAPPED} nested archives")
        return _unwrapped(members_of(inner[0].content, inner[0].path.name, allowance), allowance, depth - 1)
    return flat(inside)


def _archives_in(inside: list[File]) -> list[File]:
    return [member for member in inside if is_archive(member.path.name)]


def _uploaded(download: str, uploaded: list[tuple[ArchivedFile, Origin]]) -> Bundle:
    """Return the files that one student uploaded one by one; of files with the same name, the later one."""
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
