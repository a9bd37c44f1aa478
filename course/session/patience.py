"""Waits for a program that end early, once the program can no longer do in time what is waited for."""

import time
from collections.abc import Callable, Collection

from course.session.failure_report import Frame
from course.session.node_process import NodeProcess

LOOK = 0.05  # s between two looks
FIRST = 40  # the look at which the program is asked where it is: after about 2 s, later on a busy machine
AGAIN = 10  # looks until it is asked again


class Patience:
    """The looks at a program during one wait for its `callbacks`, which must return within `limit` s of their call."""

    def __init__(self, process: NodeProcess, callbacks: Callable[[], Collection[str]], limit: float):
        self._process, self._callbacks, self._limit = process, callbacks, limit
        self._looked = time.monotonic()
        self._left = FIRST
        self._seen: tuple[Frame, ...] = ()  # what it was last found in

    def exhausted(self) -> tuple[Frame, ...]:
        """Return the program's frames in a callback that does not return in time, () before two looks have found it.

        To be called again and again: few of the calls look, and the first ask comes so late that it rarely comes.
        """
        if (now := time.monotonic()) - self._looked < LOOK:
            return ()
        self._looked = now
        self._left -= 1
        if self._left > 0:
            return ()
        self._left = AGAIN
        before, self._seen = self._seen, self._process.hang(self._callbacks(), self._limit)
        found = before and self._seen and before[0].function == self._seen[0].function
        return self._seen if found else ()
