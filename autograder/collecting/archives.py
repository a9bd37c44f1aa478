"""Reading submissions from .zip and .tar.gz archives: only regular files of sane names, number and size, as bytes."""

import io
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path, PurePath, PurePosixPath
from typing import Any, BinaryIO

from course.errors import BadArchive
from course.foundation.tarball import Entry, Tarball
from course.foundation.untrusted import Allowance, Archive, shortened

ARCHIVE, TARBALLS = ".zip", (".tar.gz", ".tgz")
MAX_STUDENT = 50_000_000  # unpacked bytes of all that one student handed in; an exercise has up to 1,000,000
MAX_CLASS = 2_000_000_000  # unpacked bytes of a bulk download
MAX_UNNAMED = 500_000_000  # the same, when no platform has named anybody: it may be one student's
MAX_FILES = 1_000  # of one student's archive
MAX_CLASS_FILES = 20_000
DEEPEST = 8  # nested folders
JUNK = {"__MACOSX", ".DS_Store", "Thumbs.db", "desktop.ini"}


@dataclass(frozen=True)
class ArchivedFile:
    """A file in an archive."""

    path: PurePosixPath
    content: bytes
    changed: datetime  # from the archive, taken as UTC


@dataclass(frozen=True)
class Packed:
    """A file that has not been unpacked yet."""

    path: PurePosixPath
    changed: datetime
    _unpack: Callable[[Allowance], bytes]

    def unpack(self, allowance: Allowance) -> ArchivedFile:
        """Unpack the file; raises BadArchive."""
        return ArchivedFile(self.path, self._unpack(allowance), self.changed)


def contents(file: BinaryIO, most: int = MAX_CLASS_FILES, tarball: Allowance | None = None) -> Iterator[Packed | str]:
    """Return the files of an open archive, without file managers' leftovers; for a bad name, what is wrong with it.

    A .tar.gz must be unpacked to be listed, within the allowance `tarball`; without one the archive is a .zip.  Raises
    BadArchive for a file that is not an archive, or has more than `most` files.
    """
    archive = Tarball(file, tarball, most) if tarball else Archive(file)
    infos: list[Any] = [info for info in archive.files if not is_junk(info.filename)]
    if len(infos) > most:
        raise BadArchive(f"more than {most:,} files")
    seen = set()
    for info in infos:
        path = PurePosixPath(info.filename.replace("\\", "/"))
        if path.is_absolute() or ".." in path.parts or not path.parts or "\0" in info.orig_filename:
            yield f"the path {shortened(info.orig_filename)} leads outside the archive"
        elif len(path.parts) > DEEPEST:
            yield f"the path {shortened(info.filename)} is nested too deeply"
        elif path in seen:
            yield f"{shortened(str(path))} is in the archive twice"
        else:
            seen.add(path)
            yield Packed(path, _changed(info), partial(archive.read, info))


def members(file: BinaryIO, name: str, allowance: Allowance) -> list[ArchivedFile]:
    """Unpack one student's archive, called `name`; raises BadArchive when anything in it is not as it should be."""
    found = list(contents(file, MAX_FILES, allowance if is_tarball(name) else None))
    if wrong := [each for each in found if isinstance(each, str)]:
        raise BadArchive(wrong[0])
    return [each.unpack(allowance) for each in found if isinstance(each, Packed)]


def members_of(content: bytes, name: str, allowance: Allowance) -> list[ArchivedFile]:
    """Unpack an archive that was inside another one; both share the allowance.  Raises BadArchive."""
    return members(io.BytesIO(content), name, allowance)


def is_archive(name: str) -> bool:
    """Return True for the name of a .zip or .tar.gz archive, which this module can open."""
    return name.lower().endswith((ARCHIVE, *TARBALLS))


def is_tarball(name: str) -> bool:
    """Return True for the name of a .tar.gz."""
    return name.lower().endswith(TARBALLS)


def stem(path: PurePath) -> str:
    """Return an archive's name without its suffixes."""
    return next((path.name[: -len(end)] for end in TARBALLS if path.name.lower().endswith(end)), path.stem)


@contextmanager
def opened(path: Path) -> Iterator[BinaryIO]:
    """Open an archive's file; raises BadArchive when it cannot be read."""
    try:
        with path.open("rb") as file:
            yield file
    except OSError as error:
        raise BadArchive(f"cannot be read ({error.strerror})") from None


def flat(inside: list[ArchivedFile]) -> list[ArchivedFile]:
    """Return the files without the folders that contain all of them."""
    while inside and len({member.path.parts[0] for member in inside}) == 1 and len(inside[0].path.parts) > 1:
        inside = [replace(member, path=PurePosixPath(*member.path.parts[1:])) for member in inside]
    return inside


def _changed(info: zipfile.ZipInfo | Entry) -> datetime:
    try:
        return datetime(*info.date_time, tzinfo=UTC)
    except ValueError:
        return datetime(1980, 1, 1, tzinfo=UTC)


def is_junk(name: str) -> bool:
    """Return True for a file that file managers leave in a folder."""
    parts = PurePosixPath(name.replace("\\", "/")).parts
    return any(part in JUNK or part.startswith("._") for part in parts)
