"""Reading an untrusted .tar.gz archive within fixed limits of time and memory.

Python's own `tarfile` trusts sizes, offsets and extended headers: a crafted archive makes some versions of it loop
forever (CVE-2024-6232, CVE-2025-8194).  This module reads the small part of the format that hand-ins need (POSIX ustar,
with the long names of pax and GNU tar).
"""

import zlib
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import BinaryIO

from course.errors import BadArchive
from course.foundation.untrusted import CHUNK, Allowance, shortened

BLOCK = 512  # bytes
FILES, FOLDER, LINKS = {b"0", b"\0", b"7"}, b"5", {b"1", b"2"}  # types of entries
LONG_NAME, LONG_LINK, EXTENDED, GLOBAL = b"L", b"K", b"x", b"g"  # types of entries that describe the next one
LONGEST_DESCRIPTION = 65_536  # bytes
GZIP = 31  # the format with a header, for zlib
MOST_PARTS = 2_000  # of a gzip file; bgzip makes one of 65,280 bytes
MOST_IDLE = 300_000  # bytes; ordinary files have none but a long name and what fills up the last block
EARLIEST = datetime(1980, 1, 1, tzinfo=UTC)  # as in zip archives


@dataclass(frozen=True)
class Entry:
    """A file in an archive; fields that a zip archive's entry also has, have the same names."""

    filename: str
    date_time: tuple[int, int, int, int, int, int]  # modification time, in UTC
    kind: bytes
    begin: int  # offset of its content
    size: int

    @property
    def orig_filename(self) -> str:
        """Return the name in the archive."""
        return self.filename


class Tarball:
    """The files of an open .tar.gz archive, without its folders; raises BadArchive for any other file.

    It is unpacked into memory, which spends of `allowance`; an archive of more than `most` entries is refused.
    """

    def __init__(self, file: BinaryIO, allowance: Allowance, most: int):
        self._content = _unzipped(file, allowance)
        self.files = self._entries(most)

    def read(self, entry: Entry, allowance: Allowance) -> bytes:
        """Return a file's content, for which `allowance` has paid already; raises BadArchive for a link."""
        if entry.kind not in FILES:
            kind = "a link" if entry.kind in LINKS else "not an ordinary file"
            raise BadArchive(f"{shortened(entry.filename)} is {kind}")
        return bytes(self._content[entry.begin : entry.begin + entry.size])

    def _entries(self, most: int) -> list[Entry]:
        found, at, described, name, sparse = [], 0, 0, "", False
        while any(header := self._content[at : at + BLOCK]):
            _check(header)
            begin, size, kind = at + BLOCK, _number(header[124:136]), bytes(header[156:157])
            at = begin + -(-size // BLOCK) * BLOCK
            if begin + size > len(self._content):
                raise _unreadable("it ends too early")
            if kind in (LONG_NAME, LONG_LINK, EXTENDED, GLOBAL):
                if size > LONGEST_DESCRIPTION or (described := described + 1) > 4 * most:
                    raise _unreadable("its headers are too long")
                text = bytes(self._content[begin : begin + size])
                if kind == LONG_NAME:
                    name = _decoded(text.rstrip(b"\0"))
                elif kind == EXTENDED:
                    said = _records(text)
                    sparse = any(key.startswith(b"GNU.sparse") or key == b"size" for key in said)
                    name = _decoded(said[b"path"]) if b"path" in said else name
                continue
            own, name = name or _name(header), ""
            if kind != FOLDER and not own.endswith("/"):
                found.append(Entry(own, _time(header), b"S" if sparse else kind, begin, size))
            sparse = False
            if len(found) > most:
                raise BadArchive(f"more than {most:,} files")
        return found


def _unzipped(file: BinaryIO, allowance: Allowance) -> bytearray:
    """Return the content; raises BadArchive for damage, and for what takes long to unpack to little."""
    content = bytearray()
    parts, idle = 0, 0  # `idle`: bytes that unpacked to little
    part = None
    try:
        while packed := file.read(CHUNK):
            read, before = len(packed), len(content)
            while packed:
                if part is None:
                    if parts and not (packed := packed.lstrip(b"\0")):  # some programs fill up the last block
                        break
                    part, parts = zlib.decompressobj(GZIP), parts + 1
                unpacked = part.decompress(packed, CHUNK)
                allowance.spend(len(unpacked))
                content += unpacked
                packed, part = (part.unused_data, None) if part.eof else (part.unconsumed_tail, part)
            idle += read if len(content) - before < read // 2 else 0
            if idle > MOST_IDLE or parts > MOST_PARTS:
                raise _unreadable("too much of it unpacks to nothing")
    except (OSError, zlib.error) as error:
        raise _unreadable(type(error).__name__) from None
    if part is not None:
        raise _unreadable("it ends too early")
    if not content:
        raise _unreadable("it is empty")
    return content


def _check(header: bytearray) -> None:
    """Raise BadArchive unless the header's checksum is right; its own field counts as blanks."""
    if len(header) < BLOCK or sum(header) - sum(header[148:156]) + 8 * ord(" ") != _number(header[148:156]):
        raise _unreadable("it is damaged, or no tar archive")


def _number(field: bytearray) -> int:
    """Return a number, never below zero, in octal digits or, marked by its first byte, in base 256, as in GNU tar."""
    if field[0] == 0x80:
        return int.from_bytes(field[1:], "big")
    digits = field.strip(b"\0 ") or b"0"
    if digits.strip(b"01234567"):  # int() also accepts signs and underscores
        raise _unreadable("it is damaged, or no tar archive")
    return int(digits, 8)


def _name(header: bytearray) -> str:
    name = bytes(header[:100]).partition(b"\0")[0]
    before = bytes(header[345:500]).partition(b"\0")[0] if header[257:263] == b"ustar\0" else b""
    return _decoded(b"/".join(part for part in (before, name) if part))


def _decoded(name: bytes) -> str:
    return name.decode("utf-8", "replace")


def _time(header: bytearray) -> tuple[int, int, int, int, int, int]:
    try:
        time = max(EARLIEST, datetime.fromtimestamp(_number(header[136:148]), UTC))
    except (BadArchive, OverflowError, ValueError, OSError):
        time = EARLIEST
    return time.year, time.month, time.day, time.hour, time.minute, time.second


def _records(text: bytes) -> dict[bytes, bytes]:
    """Return the records of an extended header: each is `LENGTH KEY=VALUE` and a newline, LENGTH bytes in all."""
    found, at = {}, 0
    while at < len(text):
        digits, blank, _ = text[at : at + 8].partition(b" ")
        length = int(digits) if blank and digits.isdigit() else 0
        key, equals, value = text[at + len(digits) + 1 : at + length].partition(b"=")
        if not equals or at + length > len(text) or not value.endswith(b"\n"):
            raise _unreadable("a header in it is damaged")
        found[key] = value[:-1]
        at += length
    return found


def _unreadable(why: str) -> BadArchive:
    return BadArchive(f"not a .tar.gz archive that can be read ({why})")
