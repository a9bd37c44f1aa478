"""Root's work in members' folders: done in a child process that has become their owner and has no capabilities.

A member can redirect any path below their own folder at any moment, by a link.  So root opens only that folder, which
lies in one of root's, and touches nothing below it; the child starts from there, and follows no links.
"""

import contextlib
import ctypes
import errno
import json
import os
import secrets
import select
import shutil
import signal
import stat
import subprocess
import time
from base64 import b64decode, b64encode
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path, PurePosixPath

from autograder.errors import ClassroomError
from autograder.sandbox.networks import check

LONGEST = 60.0  # s that a child process may take
MOST_FILES, MOST_BYTES = 2000, 200 << 20  # read from one folder
MOST_SMALL = 1 << 20  # bytes of a settings file
DEEPEST = 100  # nested folders whose owner is changed
COUNTED = 100.0  # s that counting the files of all homes may take
FOLDER = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC
FILE = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
NO_NEW_PRIVILEGES = 38  # PR_SET_NO_NEW_PRIVS of prctl(2)
AT_EMPTY_PATH = 0x1000  # of fchownat(2)

_libc = ctypes.CDLL(None, use_errno=True)


def act(
    folder: Path, uid: int, gid: int, work: Callable[[int], bytes], groups: Sequence[int] = (), seconds: float = LONGEST
) -> bytes:
    """Run `work` on the open `folder` as another user, in a child process; return what it returned.

    Raises ClassroomError when `work` fails, or takes longer than `seconds`.
    """
    opened = os.open(folder, FOLDER)
    reading, writing = os.pipe()
    child = os.fork()
    if not child:
        try:
            _become(uid, gid, groups)
            answer = b"+" + work(opened)
        except OSError as error:
            answer = f"-{error.strerror}".encode()
        except ClassroomError as error:
            answer = f"-{error}".encode()
        except BaseException as error:
            answer = f"-{type(error).__name__}: {error}".encode(errors="replace")
        with contextlib.suppress(BaseException), open(writing, "wb") as out:
            out.write(answer)
        os._exit(0)
    os.close(opened)
    os.close(writing)
    try:
        answer = _read(reading, time.monotonic() + seconds)
    finally:
        os.close(reading)
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
    if not answer:
        raise ClassroomError(f"it did not end within {seconds:g} s")
    if answer[:1] != b"+":
        raise ClassroomError(answer[1:].decode(errors="replace"))
    return answer[1:]


def lay(home: Path, uid: int, gid: int, things: Mapping[str, Mapping[str, bytes]]) -> list[str]:
    """Write files into a home folder, as its owner; return the things that had no place.  Raises ClassroomError.

    A thing is a folder of files by path, or a single file, with the path ''.  It is left out if its name is taken; it
    has no place if what is there, or a folder on the way to it, is of another kind.
    """
    return act(home, uid, gid, lambda opened: _lay(opened, things)).decode().splitlines()


def make_folder(home: Path, uid: int, gid: int, name: str) -> None:
    """Make a folder in a home folder, as its owner, unless it exists; raises ClassroomError."""
    act(home, uid, gid, lambda opened: _make(opened, name))


def read(folder: Path, name: str, uid: int, gid: int, groups: Sequence[int]) -> dict[str, bytes]:
    """Return the regular files in `folder`/`name` by their paths in it, read as that user; raises ClassroomError.

    Links are left out.
    """
    try:
        answer = act(folder, uid, gid, lambda opened: _tree(opened, name), groups)
    except ClassroomError as error:
        raise ClassroomError(f"{folder / name}: {error}") from None
    return {path: b64decode(content) for path, content in json.loads(answer).items()}


def small_file(folder: int, name: str) -> bytes:
    """Return the content of a small regular file in an open folder, b"" if there is none; raises OSError for others.

    For `act`.
    """
    try:
        opened = os.open(name, FILE, dir_fd=folder)
    except FileNotFoundError:
        return b""
    with open(opened, "rb") as file:
        content = file.read(MOST_SMALL + 1) if stat.S_ISREG(os.fstat(opened).st_mode) else None
    if content is None or len(content) > MOST_SMALL:
        raise OSError(errno.EFBIG, f"{name} is not a file, or too large")
    return content


def sizes(homes: Mapping[str, tuple[Path, int, int]]) -> dict[str, int | None]:
    """Return the disk space (bytes) of home folders, given by name with path and owner; None where counting takes long.

    Folders that their own owner cannot read are not counted.
    """
    end = time.monotonic() + COUNTED
    command = ["du", "--summarize", "--one-file-system", "--block-size=1", "."]

    def count(home: tuple[Path, int, int]) -> int | None:
        folder, uid, gid = home
        try:
            done = subprocess.run(
                command,
                cwd=folder,
                user=uid,
                group=gid,
                extra_groups=[],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                text=True,
                timeout=max(0.0, end - time.monotonic()),
            )
        except subprocess.TimeoutExpired:
            return None
        return int(done.stdout.split()[0]) if done.stdout else None

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return dict(zip(homes, pool.map(count, homes.values()), strict=True))


def give(home: Path, uid: int, gid: int) -> None:
    """Give a kept home folder, and its former owner's files in it, to a user who has no processes yet.

    Each file is changed through a descriptor that was checked, never by its path.  A file with hard links outside the
    home keeps its owner, but loses its set-user-id and set-group-id bits.
    """
    opened = os.open(home, FOLDER)
    try:
        former = os.fstat(opened).st_uid
        _change_below(opened, lambda user, group: (uid, gid) if user == former else (user, group))
    finally:
        os.close(opened)


def walk(folder: int) -> Iterator[tuple[str, list[str], list[str], int]]:
    """Yield an open folder and all below it, as `os.fwalk` does, down to DEEPEST: each level takes a descriptor.

    A link to a folder counts as a folder, and is not followed.
    """
    for path, below, names, at in os.fwalk(".", dir_fd=folder, follow_symlinks=False):
        if path.count("/") >= DEEPEST:
            below.clear()
        yield path, below, names, at


def hand_on(folder: Path, user: Callable[[int], int], group: Callable[[int], int] = int) -> None:
    """Change the owners and groups in a folder that several users share, to `user(uid)` and `group(gid)`.

    As in `give`: through descriptors that were checked, and no file with hard links elsewhere.
    """
    opened = os.open(folder, FOLDER)
    try:
        _change_below(opened, lambda uid, gid: (user(uid), group(gid)))
    finally:
        os.close(opened)


def _change_below(folder: int, owner: Callable[[int, int], tuple[int, int]]) -> None:
    """Change the owners of an open folder and all below it: `owner` maps the old user and group to the new ones."""
    named = Counter[tuple[int, int]]()  # hard links that each file has below the folder
    for _, below, names, at in walk(folder):
        for name in (*below, *names):
            with contextlib.suppress(OSError):
                known = os.stat(name, dir_fd=at, follow_symlinks=False)
                named[known.st_dev, known.st_ino] += known.st_nlink > 1
    _change(folder, owner, named)
    for _, below, names, at in walk(folder):
        for name in (*below, *names):
            with contextlib.suppress(OSError):
                file = os.open(name, os.O_PATH | os.O_NOFOLLOW | os.O_CLOEXEC, dir_fd=at)
                try:
                    _change(file, owner, named)
                finally:
                    os.close(file)


def _change(file: int, owner: Callable[[int, int], tuple[int, int]], named: Counter[tuple[int, int]]) -> None:
    """Change the owner of a descriptor's file, or of a link itself, unless it has hard links not counted in `named`."""
    known = os.fstat(file)
    uid, gid = owner(known.st_uid, known.st_gid)
    if (uid, gid) == (known.st_uid, known.st_gid):
        return
    if stat.S_ISDIR(known.st_mode) or known.st_nlink in (1, named[known.st_dev, known.st_ino]):
        check(_libc.fchownat(file, b"", uid, gid, AT_EMPTY_PATH))
    elif stat.S_ISREG(known.st_mode) and known.st_mode & (stat.S_ISUID | stat.S_ISGID):
        os.chmod(f"/proc/self/fd/{file}", known.st_mode & 0o777)


def _become(uid: int, gid: int, groups: Sequence[int]) -> None:
    check(_libc.prctl(NO_NEW_PRIVILEGES, 1, 0, 0, 0))
    os.setgroups(groups)
    os.setresgid(gid, gid, gid)
    os.setresuid(uid, uid, uid)  # which drops all capabilities
    os.umask(0o077)


def _make(home: int, name: str) -> bytes:
    if not _kind(home, name):
        os.mkdir(name, 0o700, dir_fd=home)
    return b""


def _lay(home: int, things: Mapping[str, Mapping[str, bytes]]) -> bytes:
    without_place = []
    for thing, files in things.items():
        *above, name = PurePosixPath(thing).parts
        try:
            folder = _below(home, above)
        except OSError:  # something on the way there is a link, or not a folder
            without_place.append(thing)
            continue
        try:
            kind = _kind(folder, name)
            if not kind:
                _lay_whole(folder, name, files)
            elif kind != (stat.S_IFREG if "" in files else stat.S_IFDIR):
                without_place.append(thing)
        finally:
            os.close(folder)
    return "\n".join(without_place).encode()


def _lay_whole(folder: int, name: str, files: Mapping[str, bytes]) -> None:
    """Write a thing into an open folder, whole or not at all: whatever bears its name is not written again."""
    draft = f".part-{secrets.token_hex(8)}"
    try:
        for path, content in files.items():
            _write(folder, PurePosixPath(draft, path), content)
        os.rename(draft, name, src_dir_fd=folder, dst_dir_fd=folder)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(draft, dir_fd=folder)
        shutil.rmtree(draft, ignore_errors=True, dir_fd=folder)
        raise


def _write(folder: int, path: PurePosixPath, content: bytes) -> None:
    at = _below(folder, path.parts[:-1])
    try:
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
        with open(os.open(path.name, flags, 0o600, dir_fd=at), "wb") as file:
            file.write(content)
    finally:
        os.close(at)


def _below(folder: int, names: Sequence[str]) -> int:
    """Open a folder below an open one, made if needed; follows no links.  Raises OSError."""
    at = os.dup(folder)
    for name in names:
        try:
            with contextlib.suppress(FileExistsError):
                os.mkdir(name, 0o700, dir_fd=at)
            below = os.open(name, FOLDER, dir_fd=at)
        finally:
            os.close(at)
        at = below
    return at


def _kind(folder: int, name: str) -> int:
    """Return the kind of what has this name in the folder (`stat.S_IFMT`); 0 for nothing."""
    with contextlib.suppress(FileNotFoundError):
        return stat.S_IFMT(os.stat(name, dir_fd=folder, follow_symlinks=False).st_mode)
    return 0


def _tree(folder: int, name: str) -> bytes:
    found, left = {}, MOST_BYTES
    for at, _, names, opened in os.fwalk(name, dir_fd=folder, follow_symlinks=False):
        for each in names:
            with contextlib.suppress(OSError), open(os.open(each, FILE, dir_fd=opened), "rb") as file:
                if stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                    content = file.read(left + 1)
                    left -= len(content)
                    found[os.path.relpath(os.path.join(at, each), name)] = b64encode(content).decode()
            if left < 0 or len(found) > MOST_FILES:
                raise ClassroomError(
                    f"more than {MOST_FILES} files or {MOST_BYTES >> 20} MiB: remove what does not belong there"
                )
    return json.dumps(found).encode()


def _read(descriptor: int, end: float) -> bytes:
    """Return all bytes until the other side is closed; b'' when that takes too long."""
    parts: list[bytes] = []
    while True:
        ready, _, _ = select.select([descriptor], [], [], max(0.0, end - time.monotonic()))
        if not ready:
            return b""
        part = os.read(descriptor, 1 << 20)
        if not part:
            return b"".join(parts)
        parts.append(part)
