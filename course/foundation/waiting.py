"""Waiting until a condition holds, for a limited time."""

import math
import threading
import time
from collections.abc import Callable
from contextlib import nullcontext
from numbers import Real
from typing import TypeVar

from course.errors import ArgumentError

Found = TypeVar("Found")
POLL = 0.01  # s between two looks at a state without events, such as the ROS graph or another process
WOKEN = 0.1  # s between two looks when an event announces the change
# Called at each look of a wait in the main thread; an exception ends the wait.  A live session raises here when a node
# has died.
lookouts: list[Callable[[], None]] = []
# Called with what the reader of a cell should know at once, during a long wait.  A live session shows it.
tellers: list[Callable[[str], None]] = []
# Called after a wait of `LONG` s or more in the main thread that was in vain.  A live session tells a possible reason.
in_vain: list[Callable[[], None]] = []
LONG = 2.0  # s


def wait_until(
    condition: Callable[[], Found],
    timeout: float,
    *,
    news: threading.Condition | None = None,
    unless: Callable[[], object] = lambda: False,
    alert: bool = True,
) -> Found:
    """Wait until `condition()` is true, at most `timeout` s, and return its last value.

    The wait also ends when `unless()` becomes true, for example because the program that should answer has died.  With
    `news` the condition is checked whenever `news` is notified, with its lock held; without, a hundred times a second.
    Without `alert` the `lookouts` are not called.
    """
    end = time.monotonic() + time_limit(timeout)
    with news or nullcontext():
        while not (found := condition()):
            left = end - time.monotonic()
            if left <= 0.0 or unless():
                break
            if alert:
                ask_lookouts()
            if news:
                news.wait(min(left, WOKEN))
            else:
                time.sleep(min(left, POLL))
    if not found and alert and timeout >= LONG and threading.current_thread() is threading.main_thread():
        for tell in in_vain:
            tell()
    return found


def time_limit(limit: object) -> float:
    """Return the time limit of a wait; raises ArgumentError unless it is a number (of s; infinity is one)."""
    if isinstance(limit, bool) or not isinstance(limit, Real) or math.isnan(limit):
        raise ArgumentError(f"a time limit is a number of seconds, such as `timeout=5.0`, not {limit!r:.60}")
    return float(limit)


class Lasting:
    """A condition that was true at every look for some time; calling it looks."""

    def __init__(
        self,
        condition: Callable[[], object],
        seconds: float,
        *,
        unless: Callable[[], object] = lambda: False,
        more: float = 0.0,
    ):
        """With `unless`, the condition must be true for `more` s more while `unless()` is true as well."""
        self._condition, self._seconds, self._unless, self._more = condition, seconds, unless, more
        self._since: float | None = None  # the first of the looks at which it was true

    def __call__(self) -> bool:
        """Look, and return True if the condition has been true for the given time."""
        if not self._condition():
            self._since = None
            return False
        if self._since is None:
            self._since = time.monotonic()
        lasted = time.monotonic() - self._since
        return lasted >= self._seconds and (lasted >= self._seconds + self._more or not self._unless())


def tell_reader(text: str) -> None:
    """Show a message to the reader of a cell at once, if there is one."""
    for tell in tellers:
        tell(text)


def ask_lookouts() -> None:
    """Call the lookouts, which may raise to end a wait in this thread."""
    if lookouts and threading.current_thread() is threading.main_thread():
        for look in lookouts:
            look()
