"""A host user for each program that root starts, so that the kernel counts its processes apart from all others'.

bubblewrap's `--uid` alone would leave such a program root on the host.
"""

import contextlib
import fcntl
import logging
import os
import secrets
import signal
import subprocess
from collections.abc import Iterator, Mapping
from pathlib import Path

from autograder.errors import SandboxError, SandboxUnavailable
from autograder.sandbox.usage import of_user
from course.foundation.waiting import wait_until

INSIDE = 65534  # what a program is inside a user namespace, where it is started by anybody but root
SPARE = range(60600, 61100)  # left alone by Debian's and systemd's own allocations
LOCKS = Path("/run/lock/ros2-autograder")
GONE = 5.0  # s until the processes of a user that were killed are gone

log = logging.getLogger("autograder")


def available() -> bool:
    """Return True if root may become one of the SPARE users: in a container only some users exist."""
    for line in Path("/proc/self/uid_map").read_text().splitlines():
        first, _, count = map(int, line.split())
        if first <= SPARE[0] and SPARE[-1] < first + count:
            return True
    return False


@contextlib.contextmanager
def borrowed(confinement: str) -> Iterator[int | None]:
    """A user id that no other program has meanwhile, in the confinement "root"; None in the others."""
    if confinement != "root":
        yield None
        return
    uid, lock = take()
    try:
        yield uid
    finally:
        give_back({uid: lock})


def take() -> tuple[int, int]:
    """A user id that no other program on this machine has, and the open lock that keeps it: `give_back` frees the id.

    No process of that user is left: the kernel would count it among the next program's.  Other containers' graders are
    counted by the same kernel and have locks of their own, so each looks from another id on.  Raises SandboxError when
    all are taken, and SandboxUnavailable when the locks are not root's.
    """
    _make_folder()
    first = secrets.randbelow(len(SPARE) or 1)
    for uid in (*SPARE[first:], *SPARE[:first]):
        with contextlib.ExitStack() as undo:
            lock = os.open(LOCKS / str(uid), os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
            undo.callback(os.close, lock)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            if _is_unused(uid):  # or another container's, or whoever had it was killed, or could not end all of it
                undo.pop_all()
                return uid, lock
    raise SandboxError(f"all {len(SPARE)} user ids for students' programs are taken: end another grading first")


def give_back(taken: Mapping[int, int]) -> None:
    """Free these users, given with their locks, once nothing of them is left.

    A worker, which is the first process of its namespace, ends what there is of them.  One of whom something is left
    all the same, dead or alive, has no next program until the kernel counts none.
    """
    wait_until(lambda: not _end_all(taken), GONE, alert=False)
    for uid, lock in taken.items():
        if left := of_user(uid):
            log.warning("processes %s of user %d have not ended: it gets no program until they have", [*left], uid)
        os.close(lock)


def _end_all(taken: Mapping[int, int]) -> bool:
    """Return True if there is a process of these users; zombies count, as they do for the kernel.

    It gets SIGKILL where it is certainly of this worker's: elsewhere, a container's users may have the same numbers.
    """
    left = [process for uid in taken for process in of_user(uid)]
    for process in left if os.getpid() == 1 else []:
        with contextlib.suppress(ProcessLookupError):
            os.kill(process, signal.SIGKILL)
    return bool(left)


def _make_folder() -> None:
    LOCKS.mkdir(mode=0o755, parents=True, exist_ok=True)
    made = os.lstat(LOCKS)
    if made.st_uid != os.geteuid() or not LOCKS.is_dir() or made.st_mode & 0o022:
        raise SandboxUnavailable(f"{LOCKS} must belong to root alone, as it does when the grader makes it: remove it")


def _is_unused(uid: int) -> bool:
    """Return True if the kernel counts no process of that user, in any process namespace: it may run a program."""
    become = ["setpriv", f"--reuid={uid}", f"--regid={uid}", "--clear-groups", "true"]
    return not subprocess.run(["prlimit", "--nproc=0", "--", *become], capture_output=True).returncode
