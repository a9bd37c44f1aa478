"""The student's lift, to which nothing happens for some seconds: while it is free, and then while it is blocked.

Beside the first tests, so that it takes no time of its own.
"""

import time
from collections.abc import Callable

from autograder.hidden.actions.conversation import BLOCK, LATE, QUICK_STEPS, EarlyKinds
from autograder.hidden.actions.rides import Ride, floors_heard, way
from autograder.suitekit import Alive, Bench, Goal, Wrong
from course.foundation.waiting import wait_until

IDLE = 5.0  # s
TRIES = 2  # of the same, when something is wrong
PLACE, SHAFT = "place", "shaft"
LOW, HIGH = 3, 5  # floors between which it goes
ENDS = 5.0  # s until a goal of some short steps has ended


class Idle(EarlyKinds):
    """The student's lift with short steps, which is left alone after a goal, and after its shaft was blocked."""

    def __init__(self, bench: Bench):
        super().__init__(bench, QUICK_STEPS[-1], (PLACE, SHAFT))

    def _play(self, limit: float, alive: Alive) -> bool:
        kinds: dict[str, Callable[[float, Alive], str]] = {PLACE: self._moved, SHAFT: self._freed}
        for kind, question in kinds.items():
            told = ""
            for _ in range(TRIES):
                if not (told := question(limit, alive)):
                    break
            if told:
                self._wrong[kind] = Wrong(told)
            self._over[kind].set()
        return True

    def _moved(self, limit: float, alive: Alive) -> str:
        """Return what is wrong if the cabin has left its floor by itself; '' if nothing shows that."""
        first = self._goal([LOW], limit, alive)
        waited = self._left_alone(alive) if self._arrived(first, LOW) else 0.0
        if not waited:
            return ""
        second = self._goal([HIGH], limit, alive)
        heard = way(second.goal) if second else []
        if heard[-1:] != [HIGH] or heard[0] in (LOW, LOW + 1):
            return ""
        return (
            f"The cabin keeps its place until the next goal, however late that comes. It stood at floor {LOW}, and "
            f"{waited:.0f} s later the first message of a goal for floor {HIGH} told floor {heard[0]}."
        )

    def _freed(self, limit: float, alive: Alive) -> str:
        """Return what is wrong if the shaft became free by itself; '' if nothing shows that."""
        before = self._goal([LOW], limit, alive)
        if not self._arrived(before, LOW) or self.set(True, limit, alive) is None:
            return ""
        blocked = self._goal([HIGH], limit, alive)  # which must be aborted
        if blocked and self._arrived(blocked, HIGH):
            self.set(False, limit, alive)
            return (
                f"`data: true` blocks the shaft also while no goal runs: a goal that comes then and needs a step is "
                f"aborted. After {BLOCK} had answered it, a goal moved the cabin from floor {LOW} to floor {HIGH}, and "
                f"ended as {blocked.end}."
            )
        aborted = blocked and blocked.end == "ABORTED" and not blocked.goal.feedback
        if not aborted or self.set(True, limit, alive) is None:
            return ""
        again = self._goal([HIGH], limit, alive)
        if again and self._arrived(again, HIGH):
            self.set(False, limit, alive)
            return (
                "To block what is blocked changes nothing, also while no goal runs. A goal that came after `data: "
                f"true` was aborted; after a second `data: true` another one moved the cabin from floor {LOW} to floor "
                f"{HIGH}, and ended as {again.end}."
            )
        waited = self._left_alone(alive)
        if not waited:
            return ""
        after = self._goal([HIGH], limit, alive)
        if self.set(False, limit, alive) is None or not after or not self._arrived(after, HIGH):
            return ""
        return (
            f"The shaft stays blocked until {BLOCK} gets `data: false`. A goal that came at once after `data: true` "
            f"was aborted; another one, {waited:.0f} s later, moved the cabin, and ended as {after.end}."
        )

    def _left_alone(self, alive: Alive) -> float:
        """Let time pass, and return how much (s); 0 when the program has ended meanwhile."""
        begun = time.monotonic()
        wait_until(lambda: not alive(), self.allow(IDLE))
        return time.monotonic() - begun if alive() else 0.0

    def _goal(self, floors: list[int], limit: float, alive: Alive) -> Ride | None:
        """A goal, once it is over; None when it has no end."""
        goal: Goal | None = self.give(floors, alive, limit)
        if not goal or not goal.accepted:
            return None
        if not goal.wait(lambda g: g.status, self.allow(ENDS)):
            goal.cancel()
            return None
        goal.wait(lambda g: not g.feedback or g.feedback[-1].message.floor == g.result.floor, LATE)
        return Ride(floors, goal)

    @staticmethod
    def _arrived(ride: Ride | None, floor: int) -> bool:
        """Return True if a goal has brought the cabin there, according to its feedback."""
        return bool(ride and floors_heard(ride.goal)[-1:] == [floor])
