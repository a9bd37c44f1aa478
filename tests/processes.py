"""The processes of this machine, for tests that ask what is left running."""

import contextlib
import os

import psutil

from autograder.grading.process import WORKER
from autograder.submissions import exercises
from course.waiting import wait_until


def no_program_is_left() -> bool:
    """Return True if no program of a graded submission runs on this machine, now or after up to 10 s."""
    return wait_until(lambda: not _confined(), 10)


def _confined() -> list[int]:
    """The processes with the name of a handed-in program, in a process namespace other than ours.

    Those that another coordinator's worker has started are left out: another batch may run on this machine.
    """
    programs = {file for name in exercises.names() for file in exercises.load(name).files}
    found = []
    for process in processes():
        with contextlib.suppress(OSError, psutil.Error):
            outside = os.readlink(f"/proc/{process.pid}/ns/pid") == os.readlink("/proc/self/ns/pid")
            if outside or not programs.intersection(process.info["cmdline"][1:2]):
                continue
            parents = process.parents()
            graded = any(WORKER in parent.cmdline() for parent in parents)
            if not graded or os.getpid() in [parent.pid for parent in parents]:
                found.append(process.pid)
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
