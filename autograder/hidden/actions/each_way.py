"""The student's lift, to which something happens on the way up and down, on each leg, with a near and a far stop ahead.

Beside the first tests, so that it takes no time of its own.
"""

import random
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from autograder.hidden.actions.conversation import TOP, EarlyKinds
from autograder.hidden.actions.rides import counted, floors_heard, published_later
from autograder.suitekit import Alive, Bench, Goal, Wrong

EACH_STEP = 0.25  # s
ROOM = 5  # steps that a goal has ahead at most
LONG_BEGUN = 5  # steps of a goal that are over when something happens late: an odd number, as it goes to and fro
FIRST, _, LAST = LEGS = ("first", "second", "last")
NEAR, FAR = 1, 3  # steps to the next stop
TRIES = 3  # of the very same: what is wrong each time is not for a machine that was busy
MISSES = 4  # times that a try shows nothing, until other tests alone judge the lift
ENDS = 5.0  # s until a goal has ended that goes on to its last stop
BEGUN = 1.0  # s until a goal has told of its first step
LATEST = 0.1  # s until the last feedback has come, after the result
ENOUGH = 8.0  # s for one kind of event, so that a lift with long steps does not take for ever
# What may happen, with the steps that may be reported after its answer: that under way, and one of a lift that is told
# of a new goal after that was answered.
CANCEL, PREEMPT, BLOCKED = "cancel", "preempt", "block"
ALLOWED = {CANCEL: 1, PREEMPT: 2, BLOCKED: 1}
RULES = {
    CANCEL: "When the request to cancel is accepted, the step under way may be finished, and no other begins",
    PREEMPT: "When a new goal is accepted, the one that runs must end within a step",
    BLOCKED: "When /lift/block has answered, the step under way may be finished, and no other begins",
}


# Of a goal and the floor where the step under way ends; returns when it was answered, or 0.
Event = Callable[[Goal, int], float]


@dataclass(frozen=True)
class Way:
    """The place of a cabin when something happens: after the first step of its goal, or after some to and fro."""

    up: bool
    leg: str  # of LEGS: on the way to which of its stops
    ahead: int  # steps to that stop, when the step that is under way is over
    done: int = 1  # steps of its goal that are over, an odd number: more are made between the first two floors

    @property
    def start(self) -> int:
        """A floor from which there is room."""
        return TOP // 2 - 1 if self.up else TOP // 2 + 1

    def suits(self, here: int) -> bool:
        """Return True if there is room from that floor."""
        return here <= TOP - ROOM if self.up else here >= ROOM

    def floors(self, here: int) -> list[int]:
        """The goal of a cabin that stands there."""
        stop = 2 + self.ahead
        away = [*([] if self.leg == FIRST else [1]), stop]
        if self.leg != LAST:
            away += [*range(stop + 1, ROOM + 1)] or [0]
        return [self.from_(here, steps) for steps in [*[1, 0] * (self.done // 2), *away]]

    def path(self, here: int) -> list[int]:
        """The floors to which it has come when something happens."""
        return [self.from_(here, 1 - number % 2) for number in range(self.done)]

    def from_(self, here: int, count: int) -> int:
        """The floor so many steps from there."""
        return here + count if self.up else here - count

    def __str__(self) -> str:
        steps = counted(self.ahead, "floor")
        late = f"after {self.done} steps of a goal, " if self.done > 1 else ""
        return f"{late}on the way {'up' if self.up else 'down'} to the {self.leg} stop of a goal, {steps} away"


def ways(rng: random.Random) -> list[Way]:
    """Each leg with each distance, each direction with each leg and with each distance; up and down in turn.

    The last one happens late.
    """
    first = rng.random() < 0.5
    cases = [(leg, ahead) for leg in LEGS for ahead in (FAR, NEAR, 2)]
    found = [Way(bool(number % 2) == first, leg, ahead) for number, (leg, ahead) in enumerate(cases)]
    return [*found[:-1], replace(found[-1], done=LONG_BEGUN)]


class EachWay(EarlyKinds):
    """The student's lift with a short step period, and many goals of which each is ended after a step."""

    def __init__(self, bench: Bench, rng: random.Random):
        super().__init__(bench, EACH_STEP, ALLOWED)
        self._ways = ways(rng)
        self._misses = 0  # of one kind of event

    def _play(self, limit: float, alive: Alive) -> bool | None:
        def cancel(goal: Goal, there: int) -> float:
            goal.cancel()
            goal.wait(lambda g: g.cancel_accepted is not None, self.allow(limit))
            return goal.cancel_answered if goal.cancel_accepted else 0.0

        def preempt(goal: Goal, there: int) -> float:
            newest = self.give([there], alive, limit)
            return newest.answered if newest and self._ends(newest) else 0.0

        def block(goal: Goal, there: int) -> float:
            answered = self.set(True, limit, alive) is not None and time.monotonic()
            self._ends(goal)
            return answered if self.set(False, limit, alive) is not None else 0.0

        happens: dict[str, Event] = {CANCEL: cancel, PREEMPT: preempt, BLOCKED: block}
        for kind, event in happens.items():
            end, self._misses, right = time.monotonic() + self.allow(ENOUGH), 0, 0
            for way in self._ways:
                after: list[int] = []
                while len(after) < TRIES and self._misses < MISSES and (after or time.monotonic() < end):
                    count = self._steps_after(way, event, limit, alive)
                    if count is None:
                        self._misses += 1
                        continue
                    after.append(count)
                    if count <= ALLOWED[kind]:
                        right += 1
                        break
                else:
                    if len(after) == TRIES:
                        before = f" Before that, {counted(right, 'goal')} in other places ended in time."
                        self._wrong[kind] = Wrong(
                            f"{RULES[kind]}, wherever the cabin is. {str(way).capitalize()}, "
                            f"{counted(after[-1], 'step')} came after that, in each of {TRIES} tries."
                            f"{before if right else ''}",
                            f"{after}",
                        )
                    if after or self._misses >= MISSES:
                        break
            self._over[kind].set()
        return True

    def _steps_after(self, way: Way, event: Event, limit: float, alive: Alive) -> int | None:
        """Return the number of a goal's steps after the event was answered; None if nothing shows it."""
        if not way.suits(self.place) and not self._ends(self.give([way.start], alive, limit)):
            return None
        here = self.place
        goal = self.give(way.floors(here), alive, limit)
        if not goal or not goal.accepted:
            return None
        begun = BEGUN + 2 * EACH_STEP * (way.done - 1)
        goal.wait(lambda g: len(g.feedback) >= way.done or g.status, self.allow(begun))
        running = way.suits(here) and not goal.status and floors_heard(goal)[: way.done] == way.path(here)
        answered = event(goal, way.from_(here, 2)) if running else 0.0
        if not self._ends(goal) or not answered:
            return None
        goal.wait(lambda g: not g.feedback or g.feedback[-1].message.floor == g.result.floor, LATEST)
        return published_later(goal, answered)

    def _ends(self, goal: Goal | None) -> bool:
        """Wait for the end of a goal; False when there is none."""
        if not goal or not goal.accepted:
            return False
        if not goal.wait(lambda g: g.status, self.allow(ENDS)):
            self._misses = MISSES  # it would take for ever
            goal.cancel()
            return False
        return True
