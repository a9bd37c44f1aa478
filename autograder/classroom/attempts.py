"""A limit on attempts with wrong passwords: the first few at once, then ever longer waits.

Wrong passwords are counted by user name and address, so that guessing from one address does not lock the owner out at
another.  Guesses at one name from all addresses are also counted together.  A browser in which the owner has logged in
before has a count of its own: nobody else can make it wait.
"""

import json
import time
from collections.abc import Callable
from dataclasses import dataclass

from autograder.classroom.plan import Classroom
from course.foundation import storage

FREE, FREE_TOGETHER = 5, 50  # wrong passwords before a wait: from one place, and from all places together
FIRST, LONGEST = 10.0, 300.0  # s to wait: the first time, and at most; doubles each time
EXPIRY = 3600.0  # s after its last wrong password, a count is dropped first, when there are MOST
MOST = 20_000  # counts that are kept; then the forgotten are dropped, and the oldest
UNLOCKED = "unlocked.json"  # in `Classroom.state`: by user name, when an instructor unlocked it
EVERYWHERE = ""  # stands for all places together


@dataclass
class Count:
    """Wrong passwords in a row."""

    wrong: int = 0
    last: float = 0.0  # s

    def wait(self, free: int, now: float) -> float:
        """Return how many seconds must pass until the next password may be tried."""
        if self.wrong < free:
            return 0.0
        return max(0.0, self.last + min(LONGEST, FIRST * 2.0 ** min(self.wrong - free, 10)) - now)


class Attempts:
    """The wrong passwords since the hub was started."""

    def __init__(self, clock: Callable[[], float] = time.time):
        self._clock = clock
        self._counts: dict[tuple[str, str], Count] = {}

    def begin(self, name: str, place: str, known: bool) -> float:
        """Return how many seconds somebody must wait before trying a password; 0 if it may be tried now.

        If so, it counts as wrong until `succeeded` is called, so that parallel attempts gain nothing.  `known` says
        that the owner has logged in at this place before.
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
        """Clear the count of this place, and count one wrong password less for all places together."""
        self._counts.pop((name, place), None)
        if together := self._counts.get((name, EVERYWHERE)):
            together.wrong = max(0, together.wrong - 1)

    def forget_before(self, name: str, moment: float) -> None:
        """Clear the counts of a user name whose last attempt was before `moment` (s, of the clock)."""
        for key in [key for key, count in self._counts.items() if key[0] == name and count.last <= moment]:
            del self._counts[key]

    def _forget(self, now: float) -> None:
        if len(self._counts) >= MOST:
            self._counts = {key: count for key, count in self._counts.items() if count.last + EXPIRY > now}
        while len(self._counts) >= MOST:
            del self._counts[next(iter(self._counts))]  # the oldest


def unlock(classroom: Classroom, name: str) -> None:
    """Let a member try passwords at once again; writes a file that the hub reads."""
    path = classroom.state / UNLOCKED
    known = json.loads(path.read_text()) if path.exists() else {}
    storage.replace(path, json.dumps(known | {name: time.time()}).encode(), storage.PRIVATE)


def unlocked(classroom: Classroom, name: str) -> float:
    """Return when a member was last unlocked (s since the epoch); 0 if never."""
    try:
        return float(json.loads((classroom.state / UNLOCKED).read_text())[name])
    except (OSError, ValueError, KeyError):
        return 0.0
