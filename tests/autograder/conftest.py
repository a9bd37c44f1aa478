"""Grading in the tests: several at a time, each kind of answer once."""

import contextlib
import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from autograder import exercises, grading, sandbox
from autograder.records import Submission
from autograder.ros import wait_until


@pytest.fixture(scope="session")
def box() -> str:
    """How this machine confines programs."""
    try:
        return sandbox.choose()
    except sandbox.SandboxUnavailable as error:
        pytest.skip(str(error))


@pytest.fixture(scope="session")
def grade(box):
    """Begin to grade files: returns a future of the report."""
    with ThreadPoolExecutor(os.cpu_count() + 1) as pool:
        def begin(files, exercise="calculator", **options):
            return pool.submit(grading.grade, Submission("student", exercise, files), box, **options)
        yield begin


def no_program_is_left() -> bool:
    """Whether no program of a graded submission runs on this machine, at once or after the time to reap it."""
    return wait_until(lambda: not _confined(), 10)


def _confined() -> list[int]:
    """The processes that are called as a handed-in program is, in a process namespace that is not ours.

    Those below a worker of somebody else's are left out: another batch may run on this machine.
    """
    programs = {file.encode() for name in exercises.names() for file in exercises.load(name).files}
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            called = (entry / "cmdline").read_bytes().split(b"\0")[1:2]
            outside = os.readlink(entry / "ns" / "pid") == os.readlink("/proc/self/ns/pid")
            if outside or not programs.intersection(called):
                continue
            parents = above(int(entry.name))
            graded = any(b"autograder.worker" in Path(f"/proc/{pid}/cmdline").read_bytes() for pid in parents)
            if not graded or os.getpid() in parents:
                found.append(int(entry.name))
    return found


def above(pid: int) -> list[int]:
    """The processes that `pid` descends from."""
    above = [pid]
    while above[-1]:
        above.append(int(Path(f"/proc/{above[-1]}/stat").read_text().rpartition(")")[2].split()[1]))
    return above[1:-1]
