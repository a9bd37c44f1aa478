"""A limit on attempts with wrong passwords: some at once, then ever more slowly.

Wrong ones are counted for a name and where they come from, so that whoever guesses keeps the owner out nowhere else.
Where many addresses guess for one name, they are counted together.  A browser in which the owner has logged in before
counts for itself alone: nobody else can make it wait.
"""

import json
import time
from collections.abc import Callable
from dataclasses import dataclass

from autograder.classroom.plan import Classroom
from course.foundation import storage

FREE, FREE_TOGETHER = 5, 50  # wrong passwords until one has to wait: from one place, and from all places together
FIRST, LONGEST = 10.0, 300.0  # s to wait: then, and at most; it doubles with each
FORGOTTEN = 3600.0  # s after the last one, it begins anew
MOST = 20_000  # counts that are kept
UNLOCKED = "unlocked.json"  # in `Classroom.state`: when whom an instructor let try again
EVERYWHERE = ""  # the place of what is counted together


@dataclass
class Count:
    """Wrong passwords in a row."""

    wrong: int = 0
    last: float = 0.0  # s

    def wait(self, free: int, now: float) -> float:
        """Seconds until the next one may be tried."""
        if self.wrong < free:
            return 0.0
        return max(0.0, self.last + min(LONGEST, FIRST * 2.0 ** min(self.wrong - free, 10)) - now)


class Attempts:
    """The attempts since the hub was started."""

    def __init__(self, clock: Callable[[], float] = time.time):
        self._clock = clock
        self._counts: dict[tuple[str, str], Count] = {}

    def begin(self, name: str, place: str, known: bool) -> float:
        """Seconds to wait before somebody may try a password; 0 when it may be tried now.

        Then it counts as a wrong one until it has `succeeded`, so that many at the same time are not more than one
        after the other.  `known` says that the owner has been at this place before.
        """
        now = self._clock()
        self._forget(now)
        asked = {place: FREE} if known else {place: FREE, EVERYWHERE: FREE_TOGETHER}
        counts = {each: self._counts.get((name, each), Count()) for each in asked}
        if wait := max(count.wait(asked[each], now) for each, count in counts.items()):
            return wait
        for each, count in counts.items():
            self._counts[name, each] = Count(count.wrong + 1, now)
        return 0.0

    def succeeded(self, name: str, place: str) -> None:
        """Forget what was counted for this place; all places together have one wrong password less."""
        self._counts.pop((name, place), None)
        if together := self._counts.get((name, EVERYWHERE)):
            together.wrong = max(0, together.wrong - 1)

    def forget_before(self, name: str, moment: float) -> None:
        """Forget what was tried for a name before a moment (s, of the clock)."""
        for key in [key for key, count in self._counts.items() if key[0] == name and count.last <= moment]:
            del self._counts[key]

    def _forget(self, now: float) -> None:
        if len(self._counts) >= MOST:
            self._counts = {key: count for key, count in self._counts.items() if count.last + FORGOTTEN > now}
        while len(self._counts) >= MOST:
            del self._counts[next(iter(self._counts))]  # the oldest


def unlock(classroom: Classroom, name: str) -> None:
    """Let somebody try at once again; the hub looks there."""
    path = classroom.state / UNLOCKED
    known = json.loads(path.read_text()) if path.exists() else {}
    storage.replace(path, json.dumps(known | {name: time.time()}).encode(), storage.PRIVATE)


def unlocked(classroom: Classroom, name: str) -> float:
    """Return when somebody was let try again, in seconds; 0 when never."""
    try:
        return float(json.loads((classroom.state / UNLOCKED).read_text())[name])
    except (OSError, ValueError, KeyError):
        return 0.0
