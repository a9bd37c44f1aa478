"""The moves of a cabin, and what a goal has told of them: no ROS in here."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise

from autograder.suitekit import Goal, Heard

STILL = "still running"  # in the place of how a goal ended that had to end


@dataclass
class Ride:
    """A goal, and the floors that it asked for."""

    floors: list[int]
    goal: Goal
    still: bool = False  # it was still running long after it had to end

    @property
    def end(self) -> str:
        """Return how it ended; raises the Fault of a goal that was given up because no result came."""
        if self.goal.fault:
            raise self.goal.fault
        return STILL if self.still else self.goal.status

    @property
    def made(self) -> bool:
        """Return True if the cabin has been at its last floor, by its feedback or by its result."""
        result = list(self.goal.result.stops) if self.goal.status else []
        return way(self.goal)[-1:] == self.floors[-1:] or result == self.floors


def steps(start: int, floors: Sequence[int]) -> list[tuple[int, int]]:
    """Return the feedback of a goal from the floor `start`: floor and remaining stops after each step."""
    here, left = start, list(floors)
    told: list[tuple[int, int]] = []
    while True:
        while left and left[0] == here:
            left.pop(0)
        if here != start or told:
            told.append((here, len(left)))
        if not left:
            return told
        here += 1 if left[0] > here else -1


def stops_made(path: Sequence[int], floors: Sequence[int]) -> list[int]:
    """The floors stopped at by a cabin that has been at each floor of `path`, the place where it started included."""
    left = list(floors)
    for floor in path:
        while left and left[0] == floor:
            left.pop(0)
    return list(floors[: len(floors) - len(left)])


def way(goal: Goal) -> list[int]:
    """The floors in the feedback, when they show how the cabin moved, floor by floor; else nothing."""
    floors = floors_heard(goal)
    return floors if len(floors) > 1 and all(abs(a - b) == 1 for a, b in pairwise(floors)) else []


def follows(goal: Goal, floors: Sequence[int], top: int) -> bool:
    """Return True if the feedback so far is that of a cabin on its way to these floors, from any start."""
    heard = floors_heard(goal)
    return any([floor for floor, _ in steps(start, floors)][: len(heard)] == heard for start in range(top + 1))


def floors_heard(goal: Goal) -> list[int]:
    """The floors in the feedback."""
    return [heard.message.floor for heard in list(goal.feedback)]


def moves(goal: Goal) -> list[Heard]:
    """The first message for each floor that the cabin has come to."""
    return [next(told) for _, told in groupby(goal.feedback, lambda heard: heard.message.floor)]


def later(goal: Goal, moment: float) -> int:
    """Return the number of feedback messages after that moment, without those that repeat a floor."""
    return sum(heard.time > moment for heard in moves(goal))


def counted(number: int, what: str = "feedback message") -> str:
    """Return a number of things, in words for the student."""
    return f"{number} {what}{'' if number == 1 else 's'}"


def published_later(goal: Goal, moment: float) -> int:
    """Return the number of such messages that the server published after that moment, however late they came."""
    moment += time.time() - time.monotonic()  # a time of the publisher's clock
    return sum(heard.published > moment for heard in moves(goal))


def lengths(told: Sequence[Heard]) -> list[float]:
    """Return the times (s) of steps between messages of successive goals, by their publisher's clock.

    A message for a floor that was told before is not a step.
    """
    moved = [*told[:1], *(b for a, b in pairwise(told) if a.message.floor != b.message.floor)]
    return [b.published - a.published for a, b in pairwise(moved)]
