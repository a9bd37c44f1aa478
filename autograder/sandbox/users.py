"""A host user for each program that root starts, so that the kernel counts its processes separately.

With bubblewrap's `--uid` alone such a program would still be root on the host.
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
from autograder.sandbox.usage import of_users
from course.foundation.waiting import wait_until

INSIDE = 65534  # a program's user id inside its user namespace, if anybody but root grades
SPARE = range(60600, 61100)  # not used by Debian's and systemd's allocations
LOCKS = Path("/run/lock/ros2-autograder")
GONE = 5.0  # s to wait until a user's killed processes are gone

log = logging.getLogger("autograder")


def available() -> bool:
    """Return True if root may become one of the SPARE users: a container may map only some user ids."""
    for line in Path("/proc/self/uid_map").read_text().splitlines():
        first, _, count = map(int, line.split())
        if first <= SPARE[0] and SPARE[-1] < first + count:
            return True
    return False


@contextlib.contextmanager
def borrowed(confinement: str) -> Iterator[int | None]:
    """Yield a user id that no other program has during the block, in the confinement "root"; None in the others."""
    if confinement != "root":
        yield None
        return
    uid, lock = take()
    try:
        yield uid
    finally:
        give_back({uid: lock})


def take() -> tuple[int, int]:
    """Return a user id that no other program on this machine has, and its open lock, for `give_back`.

    The user has no processes left, because the kernel would count them for the next program.  Graders in other
    containers share the kernel but have separate locks, so each search starts at a random id.  Raises SandboxError when
    all ids are taken, and SandboxUnavailable when the locks do not belong to root.
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
            if _is_unused(uid):  # otherwise another container's, or left by a grader that was killed or failed
                undo.pop_all()
                return uid, lock
    raise SandboxError(f"all {len(SPARE)} user ids for students' programs are taken: end another grading first")


def give_back(taken: Mapping[int, int]) -> None:
    """Free these user ids, given with their locks, once their processes are gone.

    A worker, as the first process of its namespace, kills these processes.  A user with a process left, even a zombie,
    gets no new program until the kernel counts none.
    """
    wait_until(lambda: not _end_all(taken), GONE, alert=False)
    seen = of_users()
    for uid, lock in taken.items():
        if left := seen.get(uid):
            log.warning("processes %s of user %d have not ended: it gets no program until they have", [*left], uid)
        os.close(lock)


def _end_all(taken: Mapping[int, int]) -> bool:
    """Return True if these users have a process; zombies count, as they do for the kernel.

    Kills the processes if they certainly are this worker's: outside its own namespace, a container's users may have the
    same ids.
    """
    seen = of_users()
    left = [process for uid in taken for process in seen.get(uid, ())]
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
    """Return True if the kernel counts no process of that user in any process namespace, so it may be used."""
    become = ["setpriv", f"--reuid={uid}", f"--regid={uid}", "--clear-groups", "true"]
    nowhere = subprocess.DEVNULL
    return not subprocess.call(["prlimit", "--nproc=0", "--", *become], stdout=nowhere, stderr=nowhere)
