"""Replacing a file or a folder: a reader finds either the old content or the new, a file's even after a power cut."""

import contextlib
import ctypes
import errno
import os
import re
import secrets
import shutil
import stat
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

DRAFT, FORMER = ".part-", ".former-"  # how the name of a folder begins that is being filled, or replaced
PRIVATE, PRIVATE_FOLDER = 0o600, 0o700  # modes for this user only
MOST_LINKS = 40  # that lead to one another, as in Linux
OF_ONE_FILE = re.compile(r"\[Errno \d+\] (.+?)(: '.*' -> '.*')?", re.DOTALL)  # the text of an OSError

AT_FDCWD, RENAME_EXCHANGE = -100, 2  # renameat2(2)
CANNOT_EXCHANGE = (errno.EINVAL, errno.ENOSYS, errno.ENOTSUP)  # what a file system says that has no RENAME_EXCHANGE
_libc = ctypes.CDLL(None, use_errno=True)


def draft_of(path: Path) -> Path:
    """Return where `replace` first writes a file."""
    return path.with_name(f".{path.name}.part")


def replace(path: Path, content: bytes | Iterable[bytes], mode: int = 0o666) -> None:
    """Write or replace a file; `mode` as for open(2).  If it raises OSError, nothing has changed."""
    draft = draft_of(path)
    draft.unlink(missing_ok=True)  # left by a killed writer, perhaps with another mode
    try:
        with open(os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, mode), "wb") as file:
            file.writelines([content] if isinstance(content, bytes) else content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(draft, path)
    except BaseException:
        draft.unlink(missing_ok=True)  # frees the space on a full disk
        raise


@contextlib.contextmanager
def folder(target: Path, mode: int = 0o777, former: Path | None = None) -> Iterator[Path]:
    """Yield an empty folder beside `target` to be filled; at the end of the block it takes the place of `target`.

    What was there, a folder, is removed; with `former`, a new path on the same file system, it is kept there, whatever
    it is.  If the block raises an error, or the folder cannot take that place (OSError), nothing has changed.  Whenever
    it is stopped, `target` is the old folder or the new one, and with `former` the old one is there or at `target`.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    draft = target.with_name(f"{DRAFT}{secrets.token_hex(8)}")
    try:
        draft.mkdir(mode)
        filled = draft.stat()
        yield draft
        if former and os.path.lexists(target):
            try:
                draft.rename(former)  # under its last name before the exchange, after which nothing may be left to do
                _exchange(former, target)
            except BaseException:
                if os.path.lexists(former) and os.path.samestat(former.lstat(), filled):
                    former.rename(draft)  # not exchanged
                raise
        elif target.is_dir() and not target.is_symlink():
            _exchange(draft, target)
        else:
            draft.rename(target)
    finally:
        shutil.rmtree(draft, ignore_errors=True)  # the old folder, or the new one: frees the space on a full disk


def _exchange(one: Path, other: Path) -> None:
    """Let two paths of one file system change places: at once, where the file system can.  Raises OSError."""
    if not _libc.renameat2(AT_FDCWD, os.fsencode(one), AT_FDCWD, os.fsencode(other), RENAME_EXCHANGE):
        return
    number = ctypes.get_errno()
    if number not in CANNOT_EXCHANGE:
        raise OSError(number, os.strerror(number), str(other))
    aside = other.with_name(f"{FORMER}{secrets.token_hex(8)}")
    try:
        other.rename(aside)
        one.rename(other)
        aside.rename(one)
    except BaseException:
        if os.path.lexists(aside):
            aside.rename(one if os.path.lexists(other) else other)
        raise


def why(error: OSError) -> str:
    """Return what the system says is wrong, in a few words; also for the error of a copied folder of `shutil`."""
    if isinstance(error, shutil.Error) and isinstance(error.args[0], list):
        said = str(error.args[0][0][-1])  # of the first file
        return known[1] if (known := OF_ONE_FILE.fullmatch(said)) else said
    return error.strerror or str(error)


def refused(named: Path) -> str:
    """Return why `write` refuses to write to the file that a person has named, as a line; '' if it does not."""
    try:
        place = _behind_links(named)
        kind = stat.S_IFMT(os.stat(place).st_mode)
    except FileNotFoundError:
        return ""
    except OSError as error:
        return error.strerror or str(error)
    if kind == stat.S_IFDIR:
        return "it is a folder: name a file"
    return "" if kind in (stat.S_IFREG, stat.S_IFCHR, stat.S_IFIFO) else "it is not an ordinary file: name another one"


def write(named: Path, content: bytes, mode: int = 0o666) -> None:
    """Write the file that a person has named: replace it, or the file that a link leads to, as `replace` does.

    A terminal, a pipe and `/dev/stdout` are written to, and stay what they are.  Raises OSError, also for what is
    `refused`, and then nothing has changed.
    """
    if why := refused(named):
        raise OSError(errno.EINVAL, why, str(named))
    place = _behind_links(named)
    if isinstance(place, int):
        sys.stdout.flush()  # what was printed before comes first
        descriptor = os.dup(place)
    elif not place.exists() or place.is_file():
        replace(place, content, mode)
        return
    else:
        descriptor = os.open(place, os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC)  # no wait for a reader
        os.set_blocking(descriptor, True)
    with open(descriptor, "wb") as file:
        file.write(content)


def _behind_links(named: Path) -> Path | int:
    """Return the path that links lead to, or the descriptor of this process that it stands for, as `/dev/stdout` does.

    Raises OSError, also for a link that somebody else has put into a folder where everybody may.
    """
    here = named
    for _ in range(MOST_LINKS):
        folder = Path(os.path.realpath(here.parent))
        if folder == Path(f"/proc/{os.getpid()}/fd") and here.name.isdecimal():
            return int(here.name)
        here = folder / here.name
        if not here.is_symlink():
            return here
        around = folder.stat()
        if around.st_mode & stat.S_IWOTH and here.lstat().st_uid not in (os.geteuid(), around.st_uid):
            raise OSError(errno.EPERM, "it is a link that another user has made: name another file", str(named))
        here = folder / os.readlink(here)
    raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(named))
