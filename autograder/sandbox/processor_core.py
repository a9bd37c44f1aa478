"""A processor core for all programs of one grading, for machines without control groups.

Otherwise a program with many busy processes would take processor time from the programs of another grading.  The system
call filter keeps a program from moving to another core.
"""

import contextlib
import itertools
import os
from collections.abc import Iterator

from filelock import FileLock, Timeout

from course.foundation.folders import runtime_folder


@contextlib.contextmanager
def taken() -> Iterator[int]:
    """Yield the core that the fewest gradings of this user have; it counts as taken during the block."""
    cores = sorted(os.sched_getaffinity(0))
    with contextlib.ExitStack() as held:
        for place in itertools.count():
            with contextlib.suppress(Timeout):
                held.enter_context(FileLock(runtime_folder() / f"core-{place}.lock", blocking=False))
                break
        yield cores[place % len(cores)]


def command(core: int, command: list[str]) -> list[str]:
    """Return a command line that runs `command` on this core."""
    return ["taskset", "--cpu-list", str(core), *command]
