"""The one way to wait for something: until a condition holds, for a limited time."""

import threading
import time
from collections.abc import Callable
from contextlib import nullcontext
from typing import TypeVar

Found = TypeVar("Found")
POLL = 0.01  # s between two looks at what no event announces: the ROS graph, another process
WOKEN = 0.1  # s between two looks when an event announces the change


def wait_until(
    condition: Callable[[], Found],
    timeout: float,
    *,
    news: threading.Condition | None = None,
    unless: Callable[[], object] = lambda: False,
) -> Found:
    """Wait until `condition()` is true, and return its last value: a false one after `timeout` s.

    The wait also ends, early, when `unless()` becomes true: the program that was to answer has died.  With `news` the
    condition is looked at whenever somebody notifies `news`, and with its lock held; without, a hundred times a second.
    """
    end = time.monotonic() + timeout
    with news or nullcontext():
        while not (found := condition()):
            left = end - time.monotonic()
            if left <= 0.0 or unless():
                break
            if news:
                news.wait(min(left, WOKEN))
            else:
                time.sleep(min(left, POLL))
    return found
