"""A backup of a class in one file: everybody's work, hand-ins, grades, settings and passwords.

The class must be down.  A process that is left over may still change a home, so nothing in it is opened by its path.
"""

import errno
import gzip
import json
import os
import shutil
import stat
import subprocess
import tarfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from autograder.classroom import accounts, homes, hub, servers
from autograder.classroom.plan import SETTINGS, Classroom
from autograder.errors import ClassroomError, UsageError
from course.foundation import storage

TAR = ["tar", "--gzip", "--file=-", "--numeric-owner"]
LONGEST = os.pathconf("/", "PC_PATH_MAX") // 2  # bytes of a path in the class: a restored path may be longer
LEVEL = 6  # of the compression: that of gzip
MOST_READ = 1 << 20  # bytes at a time
GONE = (errno.ENOENT, errno.ELOOP, errno.ENXIO, errno.EINVAL)  # it is removed, or of another kind by now
# A sparse file in GNU tar's format, by the places in its header: the first parts that hold data, more of them in
# blocks that follow, and its size with the holes.
PARTS, FIRST, MORE, SIZE, SUM = 386, 4, 482, 483, slice(148, 156)
IN_BLOCK = 21


def write(classroom: Classroom, file: Path) -> tuple[int, list[str]]:
    """Write the class to the new file `file`; return its size (bytes), and the folders left out as too deep.

    Raises UsageError while the class is up, and ClassroomError when it cannot be written; then there is no file.
    """
    without_user = accounts.missing(classroom)
    if hub.running(classroom) or servers.started(classroom) or len(without_user) < len(classroom.members):
        raise UsageError("the class is up: run `down` first; everybody keeps their password")
    if file.exists():
        raise UsageError(f"{file} exists; name another file")
    draft = file.with_name(f".{file.name}.part")
    try:
        descriptor = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_NOFOLLOW, storage.PRIVATE)
        with open(descriptor, "wb") as written:
            with gzip.GzipFile("", "wb", LEVEL, written) as packed:
                too_deep = _pack(classroom.folder, packed)
            written.flush()
            os.fsync(descriptor)
        draft.replace(file)
    except OSError as error:
        raise ClassroomError(f"cannot write {file}: {error.strerror}") from None
    finally:
        draft.unlink(missing_ok=True)
    return file.stat().st_size, too_deep


def _pack(folder: Path, packed: gzip.GzipFile) -> list[str]:
    """Write the class's folder to an open archive; return the folders that are left out.

    A path that is too long could be written, but not restored.
    """
    opened, too_deep = os.open(folder, homes.FOLDER), []
    first: dict[tuple[int, int], str] = {}  # the path of each file that has several hard links
    try:
        device = os.fstat(opened).st_dev
        for path, below, files, at in homes.walk(opened):
            if os.fstat(at).st_dev != device:
                below.clear()
            elif len(os.fsencode(path)) > LONGEST or path.count("/") >= homes.DEEPEST:
                too_deep.append(os.path.normpath(path))
                below.clear()
            else:
                packed.write(_header(path, os.fstat(at)))
                # Records of running processes are useless, because other processes may have their ids after a restore.
                for name in (*files, *below):
                    if path != "./state" or not name.endswith(".pid"):
                        _pack_file(packed, os.path.join(path, name), name, at, first)
        packed.write(bytes(2 * tarfile.BLOCKSIZE))
    finally:
        os.close(opened)
    return too_deep


def _pack_file(packed: gzip.GzipFile, path: str, name: str, at: int, first: dict[tuple[int, int], str]) -> None:
    """Write a file, a link or a pipe in the open folder `at`: as it is when it is opened, which follows no link.

    Sockets need no backup.  Raises ClassroomError when it cannot be read.
    """
    file, target = -1, ""
    try:
        known = os.stat(name, dir_fd=at, follow_symlinks=False)
        if stat.S_ISLNK(known.st_mode):
            target = os.readlink(name, dir_fd=at)
        elif stat.S_ISREG(known.st_mode):
            file = os.open(name, homes.FILE, dir_fd=at)
            known = os.fstat(file)
    except OSError as error:
        if error.errno in GONE:
            return
        raise ClassroomError(f"cannot read {path}: {error.strerror}") from None
    if file < 0:
        if target or stat.S_ISFIFO(known.st_mode):
            packed.write(_header(path, known, target))
        return
    with open(file, "rb"):
        if stat.S_ISREG(known.st_mode):
            _pack_content(packed, path, file, known, first)


def _pack_content(
    packed: gzip.GzipFile, path: str, file: int, known: os.stat_result, first: dict[tuple[int, int], str]
) -> None:
    """Write an open regular file without its holes, or its other name if it was written under that."""
    if known.st_nlink > 1:
        before = first.setdefault((known.st_dev, known.st_ino), path)
        if before != path:
            packed.write(_header(path, known, before))
            return
    parts = list(_data(file, known.st_size))
    length = sum(size for _, size in parts)
    if length == known.st_size:
        packed.write(_header(path, known))
    else:
        parts.append((known.st_size, 0))  # as GNU tar ends its list: a hole at the end is told so
        packed.write(_sparse(_header(path, known, length=length), parts, known.st_size))
    for start, size in parts:
        for offset in range(start, start + size, MOST_READ):
            most = min(MOST_READ, start + size - offset)
            try:
                content = os.pread(file, most, offset)
            except OSError as error:
                raise ClassroomError(f"cannot read {path}: {error.strerror}") from None
            packed.write(content.ljust(most, b"\0"))  # it may have become shorter
    packed.write(bytes(-length % tarfile.BLOCKSIZE))


def _header(path: str, known: os.stat_result, target: str = "", length: int | None = None) -> bytes:
    """Return what stands before a file's content: `target` is where a link leads, `length` that without its holes."""
    kinds = {stat.S_IFDIR: tarfile.DIRTYPE, stat.S_IFLNK: tarfile.SYMTYPE, stat.S_IFIFO: tarfile.FIFOTYPE}
    kind = kinds.get(stat.S_IFMT(known.st_mode), tarfile.LNKTYPE if target else tarfile.REGTYPE)
    about = tarfile.TarInfo(path)
    about.type, about.linkname = kind if length is None else tarfile.GNUTYPE_SPARSE, target
    about.mode, about.uid, about.gid = stat.S_IMODE(known.st_mode), known.st_uid, known.st_gid
    content = known.st_size if kind == tarfile.REGTYPE else 0
    about.size = content if length is None else length
    about.mtime = int(known.st_mtime)
    return about.tobuf(tarfile.GNU_FORMAT)


def _data(file: int, size: int) -> Iterator[tuple[int, int]]:
    """Yield where each part of an open file that is not a hole begins, and its length."""
    end = 0
    while end < size:
        try:
            start = os.lseek(file, end, os.SEEK_DATA)
            stop = min(os.lseek(file, start, os.SEEK_HOLE), size)
        except OSError as error:
            if error.errno != errno.ENXIO:  # otherwise there is no data behind this place
                yield end, size - end
            return
        if start < stop:
            yield start, stop - start
        end = stop


def _sparse(header: bytes, parts: list[tuple[int, int]], size: int) -> bytes:
    """Return the header of a sparse file with the list of its parts."""

    def number(value: int) -> bytes:
        return b"\x80" + value.to_bytes(11)

    def listed(some: list[tuple[int, int]]) -> bytes:
        return b"".join(number(start) + number(length) for start, length in some)

    *before, last = [header[at : at + tarfile.BLOCKSIZE] for at in range(0, len(header), tarfile.BLOCKSIZE)]
    block = bytearray(last)
    block[PARTS : PARTS + FIRST * 24] = listed(parts[:FIRST]).ljust(FIRST * 24, b"\0")
    block[MORE] = len(parts) > FIRST
    block[SIZE : SIZE + 12] = number(size)
    block[SUM] = b" " * 8
    block[SUM] = b"%06o\0 " % sum(block)
    blocks = [*before, bytes(block)]
    for at in range(FIRST, len(parts), IN_BLOCK):
        more = listed(parts[at : at + IN_BLOCK]).ljust(IN_BLOCK * 24, b"\0")
        blocks.append((more + bytes([at + IN_BLOCK < len(parts)])).ljust(tarfile.BLOCKSIZE, b"\0"))
    return b"".join(blocks)


def read(file: Path, folder: Path) -> Classroom:
    """Restore a class into the new folder `folder`; it is down, and closed to all but root.

    Raises UsageError when `file` holds no class, ClassroomError when it cannot be restored; no folder is made then.
    """
    if folder.exists():
        raise UsageError(f"{folder} exists; name another folder with --folder, or move it away")
    draft = folder.with_name(f".{folder.name}.part")
    shutil.rmtree(draft, ignore_errors=True)
    try:
        draft.mkdir(storage.PRIVATE_FOLDER, parents=True)
        with open(file, "rb") as kept:
            try:
                _run([*TAR, "--extract", "--same-owner", "--preserve-permissions"], draft, stdin=kept)
            except ClassroomError as error:
                raise ClassroomError(f"{file} cannot be unpacked: {error}") from None
        draft.chmod(storage.PRIVATE_FOLDER)
        if not (draft / "state" / SETTINGS).exists():
            raise UsageError(f"{file} is not a backup of a class")
        classroom = replace(Classroom.load(draft), folder=folder)
        _take_from_who_left(draft, {member.name for member in classroom.members})
        settings = json.loads((draft / "state" / SETTINGS).read_text()) | {"folder": str(folder)}
        storage.replace(draft / "state" / SETTINGS, json.dumps(settings, indent=1).encode(), storage.PRIVATE)
        draft.rename(folder)
    except OSError as error:
        raise ClassroomError(f"cannot restore {file} to {folder}: {error.strerror}") from None
    finally:
        shutil.rmtree(draft, ignore_errors=True)
    return classroom


def _take_from_who_left(folder: Path, members: set[str]) -> None:
    """Give root the homes of former members: somebody else may have their user id on this machine."""
    for home in (folder / "homes").iterdir():
        if home.name not in members:
            homes.give(home, 0, 0)


def _run(command: list[str], folder: Path, **streams: Any) -> None:
    """Run tar in a folder; raises ClassroomError with tar's first line of errors."""
    environment = os.environ | {"LC_ALL": "C"}
    done = subprocess.run(command, cwd=folder, env=environment, stderr=subprocess.PIPE, text=True, **streams)
    if done.returncode:
        said = [line for line in done.stderr.splitlines() if line.strip()]
        raise ClassroomError(said[0] if said else f"tar ended with exit status {done.returncode}")
