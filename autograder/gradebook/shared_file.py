"""Small files of nbgrader's course folder, which the instructors of a class share."""

import contextlib
import fcntl
import json
import os
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from course.foundation import storage
from course.foundation.untrusted import read_regular

MOST = 10_000_000  # bytes


def read(path: Path) -> bytes:
    """Return the content of a file; raises OSError, and ValueError for what is not a small file: a pipe would block."""
    return read_regular(path, MOST)


def from_json(content: bytes) -> Any:
    """Return what JSON text stands for; raises ValueError, also for what is nested too deeply."""
    try:
        return json.loads(content)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None


def write(path: Path, text: str) -> None:
    """Replace a file, for all instructors where its folder is theirs together; raises OSError."""
    shared = path.parent.stat().st_mode & stat.S_IWGRP
    storage.replace(path, (text + "\n").encode(), 0o660 if shared else storage.PRIVATE)


@contextlib.contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Let one instructor at a time change a file of `folder` by what it says; raises OSError."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)
