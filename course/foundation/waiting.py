"""Waiting until a condition holds, for a limited time."""

import threading
import time
from collections.abc import Callable
from contextlib import nullcontext
from typing import TypeVar

Found = TypeVar("Found")
POLL = 0.01  # s between two looks at a state without events, such as the ROS graph or another process
WOKEN = 0.1  # s between two looks when an event announces the change
# Called at each look of a wait in the main thread; an exception ends the wait.  A live session raises here when a node
# has died.
lookouts: list[Callable[[], None]] = []


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
    end = time.monotonic() + timeout
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
    return found


def ask_lookouts() -> None:
    """Call the lookouts, which may raise to end a wait in this thread."""
    if lookouts and threading.current_thread() is threading.main_thread():
        for look in lookouts:
            look()
