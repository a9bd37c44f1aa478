"""The processes of this machine, for tests that ask what is left running."""

import contextlib
import os

import psutil

from autograder.grading.worker import WORKER
from autograder.submissions import exercises
from course.foundation.waiting import wait_until

KERNEL = "ipykernel_launcher"


def programs_left() -> list[str]:
    """Return the programs of graded submissions that run on this machine now, and still after 10 s."""
    wait_until(lambda: not _confined(), 10)
    return _confined()


def _confined() -> list[str]:
    """Return the command lines of handed-in programs in process namespaces other than ours, each with its parents'.

    Those that another coordinator's worker, or a student's kernel in a classroom, has started are left out: another
    batch, and the tests of the classroom, may run on this machine.
    """
    programs = {file for name in exercises.names() for file in exercises.load(name).files}
    found = []
    for process in processes():
        with contextlib.suppress(OSError, psutil.Error):
            outside = os.readlink(f"/proc/{process.pid}/ns/pid") == os.readlink("/proc/self/ns/pid")
            if outside or not programs.intersection(process.info["cmdline"][1:2]):
                continue
            parents = process.parents()
            others = any({WORKER, KERNEL}.intersection(parent.cmdline()) for parent in parents)
            if not others or os.getpid() in [parent.pid for parent in parents]:
                found.append(" < ".join(" ".join(each.cmdline()[:6]) for each in (process, *parents)))
    return found


def runs(process: psutil.Process) -> bool:
    """Return True if it is running; a zombie is not."""
    try:
        return process.is_running() and process.status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def processes() -> list[psutil.Process]:
    """All visible processes, with their command lines in `info`."""
    return [process for process in psutil.process_iter(["cmdline"]) if process.info["cmdline"]]
