"""Reading a zip archive without trusting it: ordinary files of sane names, number and size, into bytes.

Nothing is written to the disk under a name from an archive: whoever wants files asks for them by names of his own.
"""

import io
import stat
import zipfile
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import PurePosixPath

from autograder.errors import UsageError

MAX_FILES = 20_000  # in a bulk download of a class
MAX_FILE = 50_000_000  # bytes of a file in it; a student's archive is one
MAX_BYTES = 2_000_000_000  # of all files together
DEEPEST = 8  # folders in each other
JUNK = {"__MACOSX", ".DS_Store", "Thumbs.db", "desktop.ini"}
BROKEN = (zipfile.BadZipFile, zipfile.LargeZipFile, NotImplementedError, RuntimeError, EOFError, ValueError, OSError)


class BadArchive(UsageError):
    """It is no archive, or one that must not be opened; the message says why, in a few words."""


@dataclass(frozen=True)
class Member:
    """A file in an archive."""

    path: PurePosixPath
    content: bytes
    changed: datetime  # as the archive says, taken as UTC


def members(data: bytes) -> list[Member]:
    """The files of a zip archive, without what file managers leave; raises BadArchive."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            infos = [info for info in archive.infolist() if not info.is_dir() and not _is_junk(info.filename)]
            if len(infos) > MAX_FILES:
                raise BadArchive(f"more than {MAX_FILES:,} files")
            if sum(info.file_size for info in infos) > MAX_BYTES:
                raise BadArchive(f"more than {MAX_BYTES / 1e9:.0f} GB when it is unpacked")
            return [_member(archive, info) for info in infos]
    except BadArchive:
        raise
    except BROKEN as error:
        raise BadArchive(f"not a zip archive that can be read ({error})") from None
    except Exception as error:  # zlib.error, struct.error and whatever a crafted header leads to
        raise BadArchive(f"not a zip archive that can be read ({type(error).__name__})") from None


def flat(inside: list[Member]) -> list[Member]:
    """The files without the folders that are around all of them."""
    while inside and len({member.path.parts[0] for member in inside}) == 1 and len(inside[0].path.parts) > 1:
        inside = [replace(member, path=PurePosixPath(*member.path.parts[1:])) for member in inside]
    return inside


def _member(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> Member:
    path = _path(info.filename)
    if stat.S_ISLNK(info.external_attr >> 16):
        raise BadArchive(f"{path} is a link")
    if info.flag_bits & 1:
        raise BadArchive(f"{path} needs a password")
    with archive.open(info) as file:  # what a header says of a size is not believed
        content = file.read(MAX_FILE + 1)
    if len(content) > MAX_FILE:
        raise BadArchive(f"{path} is larger than {MAX_FILE / 1e6:.0f} MB")
    try:
        changed = datetime(*info.date_time, tzinfo=UTC)
    except ValueError:
        changed = datetime(1980, 1, 1, tzinfo=UTC)
    return Member(path, content, changed)


def _path(name: str) -> PurePosixPath:
    path = PurePosixPath(name.replace("\\", "/"))
    if path.is_absolute() or ".." in path.parts or not path.parts or "\0" in name or len(path.parts) > DEEPEST:
        raise BadArchive("a path in it leads out of it, or is too deep")
    return path


def _is_junk(name: str) -> bool:
    parts = PurePosixPath(name.replace("\\", "/")).parts
    return any(part in JUNK or part.startswith("._") for part in parts)
