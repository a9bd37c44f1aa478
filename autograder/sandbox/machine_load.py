"""A measure of this machine's load: a verdict reached while every core had a run queue says little."""

import os
import time
from collections.abc import Callable

from autograder.sandbox.usage import read
from course.foundation.waiting import wait_until

STARVED = 5.0  # runnable threads per core; more gradings than cores make it two or three
CALM = 3.0  # runnable threads per core, below which a machine is calm
WINDOW = 2.0  # s over which the machine must be calm
GLANCE = 0.1  # s between two looks


class Load:
    """The average number of runnable threads per core, over the calls of `look`."""

    def __init__(self) -> None:
        self._sum, self._looks = 0.0, 0

    def look(self, own: Callable[[], int] = lambda: 0) -> None:
        """Take a sample; `own`, asked on a machine that is not calm, tells how many of the threads do not count.

        Threads that run in bursts may have stopped before `own` counts them, so the load after it is asked, too.
        """
        found = runnable()
        if found >= CALM:
            without = own() / _cores()
            found = max(0.0, min(found, runnable()) - without)
        self._sum += found
        self._looks += 1

    @property
    def average(self) -> float:
        """The average so far; 0 before the first look."""
        return self._sum / self._looks if self._looks else 0.0


def is_starved() -> bool:
    """Return True if each core of the machine had more than STARVED threads to run in the last minute, on average."""
    return os.getloadavg()[0] / (os.cpu_count() or 1) > STARVED


def runnable() -> float:
    """Return the number of runnable threads, without this one, per core of this process (proc(5), /proc/loadavg)."""
    return waiting() / _cores()


def waiting() -> int:
    """Return the number of threads of the whole machine that run or could, without this one (/proc/loadavg)."""
    return int(read("/proc/loadavg").split()[3].partition(b"/")[0]) - 1


def _cores() -> int:
    return len(os.sched_getaffinity(0))


def wait_for_calm(timeout: float) -> bool:
    """Wait until the machine has been calm for WINDOW s; return False after `timeout` s."""

    def calm() -> bool:
        load, end = Load(), time.monotonic() + WINDOW
        while time.monotonic() < end:
            load.look()
            time.sleep(GLANCE)
        return load.average < CALM

    return bool(wait_until(calm, timeout, alert=False))
