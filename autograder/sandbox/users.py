"""A host user for each program that root starts, so that the kernel counts its processes apart from all others'.

bubblewrap's `--uid` alone would leave such a program root on the host.
"""

import contextlib
import fcntl
import os
from collections.abc import Iterator
from pathlib import Path

INSIDE = 65534  # what a program is inside a user namespace, where it is started by anybody but root
SPARE = range(60600, 61100)  # left alone by Debian's and systemd's own allocations
LOCKS = Path("/run/lock/ros2-autograder")


def available() -> bool:
    """Whether root may become one of the SPARE users: in a container only some users exist."""
    for line in Path("/proc/self/uid_map").read_text().splitlines():
        first, _, count = map(int, line.split())
        if first <= SPARE[0] and SPARE[-1] < first + count:
            return True
    return False


@contextlib.contextmanager
def borrowed(box: str) -> Iterator[int | None]:
    """A user id that no other program has meanwhile, in the box "root"; None in the others, which have none to give."""
    if box != "root":
        yield None
        return
    uid, lock = take()
    try:
        yield uid
    finally:
        os.close(lock)


def take() -> tuple[int, int]:
    """A user id that no other program on this machine has, and the open lock that keeps it: close it to free the id.

    Raises RuntimeError when all are taken.
    """
    LOCKS.mkdir(parents=True, exist_ok=True)
    for uid in SPARE:
        lock = os.open(LOCKS / str(uid), os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(lock)
            continue
        return uid, lock
    raise RuntimeError(f"all {len(SPARE)} user ids for students' programs are taken")
