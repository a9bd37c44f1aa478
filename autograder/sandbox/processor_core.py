"""A core of the processor for all programs of one grading, for machines that give no control groups.

Otherwise a program with many busy processes would take the processor from the programs of another grading.  The filter
of system calls keeps a program from moving to another core.
"""

import contextlib
import itertools
import os
from collections.abc import Iterator

from filelock import FileLock, Timeout

from course.foundation.folders import runtime_folder


@contextlib.contextmanager
def taken() -> Iterator[int]:
    """The core that the fewest gradings of this user have; it counts as taken as long as the block."""
    cores = sorted(os.sched_getaffinity(0))
    with contextlib.ExitStack() as held:
        for place in itertools.count():
            with contextlib.suppress(Timeout):
                held.enter_context(FileLock(runtime_folder() / f"core-{place}.lock", blocking=False))
                break
        yield cores[place % len(cores)]


def command(core: int, command: list[str]) -> list[str]:
    """A command line that runs `command` on this core."""
    return ["taskset", "--cpu-list", str(core), *command]
