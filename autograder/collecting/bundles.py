"""What there is to collect: each bundle holds the files that one student handed in together."""

import contextlib
import json
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path, PurePath, PurePosixPath
from typing import Any

from autograder.collecting.archives import MAX_FILE, BadArchive, Member, flat, members
from autograder.collecting.origins import Origin, origin
from autograder.errors import UsageError
from autograder.submissions import exercises, notebook, reading
from course.hand_in import RECEIPT

MAX_SOURCE = 4_000_000_000  # bytes of one archive
WRAPPED = 3  # archives around each other


@dataclass(frozen=True)
class Bundle:
    """Files that belong together: one archive, or what one student uploaded."""

    source: str  # where it was found, for messages
    download: str  # the archive or folder that was given, in which a platform's numbers tell students apart
    members: list[Member]
    origin: Origin | None
    at: datetime


def bundles(source: Path, unplaced: list[str]) -> Iterator[Bundle]:
    """What belongs together in a source; what cannot be read gets a line in `unplaced`.

    Raises UsageError for a source that is not there.
    """
    if source.is_dir():
        for student, assignment in _laid_out_already(source):
            yield _folder(source / student / assignment, student, source)
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

    Raises BadArchive, also for what says that it is of another exercise.
    """
    try:
        inside = _unwrapped(members(path.read_bytes()))
    except BadArchive as error:
        raise BadArchive(f"{path}: {error.args[0]}") from None
    wanted = exercises.load(assignment).taken
    with tempfile.TemporaryDirectory(prefix="handed-in-") as folder:
        for member in inside:
            if str(member.path) == RECEIPT and (claimed := receipt(member.content).get("assignment")) != assignment:
                other = claimed if claimed in exercises.names() else "no exercise of this course"
                raise BadArchive(f"{path} is a hand-in of {other}, not of {assignment}")
            if str(member.path) in wanted:
                (Path(folder) / member.path.name).write_bytes(member.content)
        yield Path(folder)


def receipt(content: bytes | None) -> dict[str, Any]:
    """What the receipt of a hand-in says; empty when there is none, without files when it cannot be read."""
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
    found = [Member(PurePosixPath(path.name), content, _changed(path)) for path, content in files_of(folder)]
    at = max((member.changed for member in found), default=_changed(folder))
    return Bundle(str(folder), str(source), found, Origin((student,), ""), at)


def files_of(folder: Path) -> Iterator[tuple[Path, bytes]]:
    """The ordinary files of a folder.  What else is there is not taken along: the grader names what is missing."""
    for path in sorted(folder.iterdir()) if folder.is_dir() else ():
        with contextlib.suppress(OSError, ValueError):
            yield path, reading.read_file(path, notebook.MAX_BYTES)


def _downloaded(source: Path, unplaced: list[str]) -> Iterator[Bundle]:
    """A bulk download that a browser has unpacked: files, or folders of students, with a platform's names."""
    found = []
    for path in sorted(source.iterdir()):
        if path.is_symlink() or not _named_by_platform(path) or (path.is_file() and _is_archive(path)):
            continue
        for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
            if file.is_symlink() or not file.is_file():
                continue
            try:
                content = reading.read_file(file, MAX_FILE)
            except (OSError, ValueError) as error:
                unplaced.append(f"{file.relative_to(source)}: cannot be read ({error})")
            else:
                found.append(Member(PurePosixPath(file.relative_to(source)), content, _changed(file)))
    yield from _of_platform(source.name, found, unplaced)


def _named_by_platform(path: Path) -> bool:
    return bool(origin(PurePosixPath(path.name, "file") if path.is_dir() else PurePosixPath(path.name)))


def _is_archive(path: PurePath) -> bool:
    return path.suffix.lower() == ".zip"


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
    if any(origin(member.path) for member in inside) or len(_archives_in(inside)) > 1:
        yield from _of_platform(path.name, inside, unplaced)
        return
    try:
        yield Bundle(path.name, path.name, _unwrapped(inside), origin(PurePosixPath(path.name)), _changed(path))
    except BadArchive as error:
        unplaced.append(f"{path.name}: {error.args[0]}")


def _of_platform(download: str, inside: list[Member], unplaced: list[str]) -> Iterator[Bundle]:
    """What each student uploaded, of the files of a bulk download."""
    loose: dict[tuple[str, ...], list[tuple[Member, Origin]]] = defaultdict(list)
    for member in inside:
        where, whose = f"{download}, {member.path}", origin(member.path)
        if _is_archive(member.path):
            try:
                yield Bundle(where, download, _unwrapped(members(member.content)), whose, member.changed)
            except BadArchive as error:
                unplaced.append(f"{where}: {error.args[0]}")
        elif whose:
            loose[whose.names].append((member, whose))
        else:
            unplaced.append(f"{where}: no platform names a file so")
    for uploaded in loose.values():
        yield _uploaded(download, uploaded)


def _unwrapped(inside: list[Member], depth: int = WRAPPED) -> list[Member]:
    """The files of what may be an archive around one other archive, such as a hand-in that was zipped again."""
    inner = _archives_in(inside)
    if len(inner) == 1 and all(member.path.suffix.lower() not in (".py", ".ipynb") for member in inside):
        if not depth:
            raise BadArchive(f"more than {WRAPPED} archives in each other")
        return _unwrapped(members(inner[0].content), depth - 1)
    return flat(inside)


def _archives_in(inside: list[Member]) -> list[Member]:
    return [member for member in inside if _is_archive(member.path)]


def _uploaded(download: str, uploaded: list[tuple[Member, Origin]]) -> Bundle:
    """The files that one student uploaded one by one; of a file that is there twice the later one."""
    newest: dict[str, Member] = {}
    for member, whose in sorted(uploaded, key=lambda each: each[1].upload):
        newest[whose.file] = replace(member, path=PurePosixPath(whose.file))
    last = max((whose for _, whose in uploaded), key=lambda whose: whose.upload)
    late = any(whose.late for _, whose in uploaded)
    found = list(newest.values())
    at = max(member.changed for member in found)
    source = f"{download}, files of {last.names[-1]}"
    return Bundle(source, download, found, replace(last, file="", late=late), at)


def _changed(path: Path) -> datetime:
    return datetime.fromtimestamp(path.stat().st_mtime, UTC)
