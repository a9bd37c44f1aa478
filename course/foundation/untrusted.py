"""Reading untrusted files, zip archives and texts within fixed limits of time and memory.

Nothing is written under a name from an archive: callers ask for files by names of their own.
"""

import io
import os
import re
import stat
import sys
import zipfile
from pathlib import Path
from typing import Any, BinaryIO

from course.errors import BadArchive

MOST_DIRECTORY = 8_000_000  # bytes of an archive's directory; an entry has some 100, and takes some 700 in memory
METHODS = {zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED}  # bzip2 and LZMA unpack without a limit in Python's zipfile
CHUNK = 65_536  # bytes
ENCRYPTED = 0x1  # in a zip entry's flags
LONGEST_NAME = 80  # characters of a name in a message
LONGEST_TEXT = 100_000  # characters of a text in a page
# Control characters, marks that change the direction of text or end a line, what is not seen at all, lone surrogates,
# and invisible tags; not what joins letters in the names of some languages.
UNSEEN = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200b\u2028-\u202e\u2060-\u206f\ud800-\udfff\ufeff\U000e0000-\U000e007f]"
)


class Allowance:
    """The number of bytes that may still be unpacked; nested archives share one.

    Bytes taken from it are also taken from the allowance `within` which it lies: a student's from the class's.
    """

    def __init__(self, most: int, within: "Allowance | None" = None):
        self._most, self._left, self._within = most, most, within

    def require(self, count: int) -> None:
        """Raise BadArchive unless `count` bytes are left."""
        if count > self._left:
            raise BadArchive(f"more than {self._most / 1e6:,.0f} MB when it is unpacked")
        if self._within:
            self._within.require(count)

    def spend(self, count: int) -> None:
        """Take `count` bytes; raises BadArchive when fewer are left."""
        self.require(count)
        self._left -= count
        if self._within:
            self._within.spend(count)


class Archive:
    """The files of an open zip archive, without its folders; raises BadArchive for any other file."""

    def __init__(self, file: BinaryIO):
        try:
            self._zip = zipfile.ZipFile(_Guarded(file))
        except BadArchive:
            raise
        except Exception as error:  # BadZipFile, struct.error and whatever a crafted directory leads to
            raise BadArchive(_unreadable(error)) from None
        entries = self._zip.infolist()
        if not all(info.filename for info in entries):
            raise BadArchive("a file in it has no name")
        self.files = [info for info in entries if not info.is_dir()]

    def read(self, info: zipfile.ZipInfo, allowance: Allowance) -> bytes:
        """Return a file's content; raises BadArchive for a link, a password, damage, and more than is allowed."""
        name = shortened(info.filename)
        if stat.S_IFMT(info.external_attr >> 16) not in (0, stat.S_IFREG):
            kind = "a link" if stat.S_ISLNK(info.external_attr >> 16) else "not an ordinary file"
            raise BadArchive(f"{name} is {kind}")
        if info.flag_bits & ENCRYPTED:
            raise BadArchive(f"{name} needs a password")
        if info.compress_type not in METHODS:
            raise BadArchive(f"{name} uses an unsupported compression: create an ordinary zip archive")
        allowance.require(info.file_size)
        chunks = []
        try:
            with self._zip.open(info) as file:  # returns no more bytes than the directory says
                while chunk := file.read(CHUNK):
                    allowance.spend(len(chunk))
                    chunks.append(chunk)
        except BadArchive:
            raise
        except Exception as error:  # zlib.error, EOFError, BadZipFile and whatever a crafted header leads to
            raise BadArchive(_unreadable(error)) from None
        return b"".join(chunks)


class _Guarded:
    """A file that refuses a single read larger than any valid archive's directory."""

    def __init__(self, file: BinaryIO):
        self._file = file
        self.seek, self.tell, self.seekable = file.seek, file.tell, file.seekable

    def read(self, size: int = -1) -> bytes:
        content = self._file.read(MOST_DIRECTORY + 1 if size < 0 else min(size, MOST_DIRECTORY + 1))
        if len(content) > MOST_DIRECTORY:
            raise BadArchive("too many files in it")
        return content


def read_regular(path: Path, most: int) -> bytes:
    """Return the content of a regular file, or of one that a link leads to.

    Raises OSError, or ValueError for anything else (a pipe would block) and for more than `most` bytes.
    """
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    with open(descriptor, "rb") as file:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise ValueError("it is not an ordinary file")
        content = file.read(most + 1)
    if len(content) > most:
        raise ValueError(f"it is larger than {most / 1e6:.0f} MB")
    return content


def read_regular_text(path: Path, most: int) -> str:
    """Return the UTF-8 text of a regular file, with `\\n` at the end of each line.

    Raises the errors of `read_regular`, and UnicodeDecodeError, which is a ValueError.
    """
    return read_regular(path, most).decode().replace("\r\n", "\n").replace("\r", "\n")


def printable(text: str) -> str:
    """Return the text with control characters escaped, which a terminal would obey; newlines are kept."""
    return "".join(c if c == "\n" or c.isprintable() else f"\\x{ord(c):02x}" for c in text)


def visible(text: str, longest: int = LONGEST_TEXT) -> str:
    """Return the text for a page: of limited length, with characters escaped that would reverse or hide the rest."""
    if len(text) > longest:
        text = f"{text[:longest]} ... ({len(text) - longest:,} more characters)"
    return text if text.isprintable() else UNSEEN.sub(lambda found: f"\\x{ord(found[0]):02x}", text)


def all_visible(data: Any, longest: int = LONGEST_TEXT) -> Any:
    """Return JSON data with all its texts made `visible`."""
    if isinstance(data, str):
        return visible(data, longest)
    if isinstance(data, dict):
        return {all_visible(name, longest): all_visible(value, longest) for name, value in data.items()}
    if isinstance(data, list | tuple):
        return [all_visible(value, longest) for value in data]
    return data


class _Escaping(io.TextIOWrapper):
    """A stream to a terminal that escapes control characters."""

    def write(self, text: str) -> int:
        super().write("\t".join(map(printable, text.split("\t"))))
        return len(text)


def guard_terminal() -> None:
    """Escape control characters in everything printed to a terminal from now on.

    Output to a file or another program is not changed.
    """
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if isinstance(stream, io.TextIOWrapper) and stream.isatty():
            stream.flush()
            guarded = _Escaping(stream.detach(), stream.encoding, "backslashreplace", line_buffering=True)
            setattr(sys, name, guarded)


def one_line(text: str) -> str:
    """Return the text with control characters and newlines escaped."""
    return printable(text).replace("\n", "\\x0a")


def shortened(name: str) -> str:
    """Return a name for a message: in one line, and shortened."""
    return one_line(name if len(name) <= LONGEST_NAME else f"{name[: LONGEST_NAME - 4]} ...")


def _unreadable(error: Exception) -> str:
    why = str(error) if isinstance(error, (zipfile.BadZipFile, NotImplementedError)) else type(error).__name__
    return f"not a zip archive that can be read ({shortened(why)})"
