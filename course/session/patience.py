"""Waits for a program that end early, once the program can no longer do in time what is waited for."""

import time
from collections.abc import Callable

from course.explaining.failure_report import Frame

LOOK = 0.05  # s between two looks
FIRST = 40  # the look at which the program is asked where it is: after about 2 s, later on a busy machine
AGAIN = 10  # looks until it is asked again


class Patience:
    """The looks at a program during one wait: `find` returns its frames where it hangs, () if it does not."""

    def __init__(self, find: Callable[[], tuple[Frame, ...]], first: int = FIRST):
        """`first` is the look at which the program is asked first."""
        self._find = find
        self._looked = time.monotonic()
        self._left = first
        self._seen: tuple[Frame, ...] = ()  # what it was last found in

    def exhausted(self) -> tuple[Frame, ...]:
        """Return the program's frames in a function that does not return in time, () before two looks have found it.

        To be called again and again: few of the calls look, and the first ask comes so late that it rarely comes.
        """
        if (now := time.monotonic()) - self._looked < LOOK:
            return ()
        self._looked = now
        self._left -= 1
        if self._left > 0:
            return ()
        self._left = AGAIN
        before, self._seen = self._seen, self._find()
        found = before and self._seen and before[0].function == self._seen[0].function
        return self._seen if found else ()
