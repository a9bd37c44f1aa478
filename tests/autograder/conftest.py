"""Grading in the tests: several at a time, each kind of answer once."""

import contextlib
import os
from concurrent.futures import ThreadPoolExecutor

import psutil
import pytest

from autograder.errors import SandboxUnavailable
from autograder.grading import single
from autograder.grading.process import WORKER
from autograder.records import Submission
from autograder.sandbox import box as sandbox
from autograder.submissions import exercises
from course.waiting import wait_until


@pytest.fixture(scope="session")
def box() -> str:
    """How this machine confines programs."""
    try:
        return sandbox.choose()
    except SandboxUnavailable as error:
        pytest.skip(str(error))


@pytest.fixture(scope="session")
def grade(box):
    """A function that begins to grade files, and returns the future report."""
    with ThreadPoolExecutor(os.cpu_count() + 1) as pool:

        def begin(files, exercise="calculator", **options):
            return pool.submit(single.grade, Submission("student", exercise, files), box, **options)

        yield begin


def no_program_is_left() -> bool:
    """Whether no program of a graded submission runs on this machine, now or after up to 10 s."""
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
    """Whether it is running; a zombie is not."""
    try:
        return process.is_running() and process.status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def processes() -> list[psutil.Process]:
    """All visible processes, with their command lines in `info`."""
    return [process for process in psutil.process_iter(["cmdline"]) if process.info["cmdline"]]
