"""The grader's side of the conversation with the student's lift, when something happens while a goal runs."""

import random
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Any

from autograder.errors import Fault
from autograder.hidden.actions.conversation import BLOCK, HOPEFUL, OFFERED, PLAYS, Server, accepted
from autograder.hidden.actions.rides import STILL, Ride
from autograder.suitekit import Alive, Bench, Goal, Wrong, offer, on_wrong

LOW_TOP = 8  # the highest floor, set on the command line: less than the default
HIGH = 7  # a floor that every lift has: whether it has its highest one is judged by one test
BUSY_STEP = 0.3  # s: long enough that a request takes effect before the next step
MOST_STARTS = 8  # of the program, so that one that is all wrong does not take for ever
AT_MOST = 5.0  # s until a goal has ended that must end within a step
ASKED = 6  # times that the service is asked while a goal runs
SOON = 0.5 * BUSY_STEP  # s in which it must answer one of these times
HALF = 0.5 * BUSY_STEP  # s after a step's report, in the middle of the next one
TRIES = 3  # until a goal has come within the last step of another one, on a busy machine


@dataclass
class Blocking:
    """The results of a goal whose shaft was blocked, and of the goals after it."""

    ride: Ride
    running: bool  # the goal still ran when the shaft was to be blocked
    sent: float  # when that was, a time of time.monotonic (s)
    answered: float  # when the service had answered
    here: int  # where the cabin stood then
    stuck: Ride  # asked for this floor and another one, while the shaft was blocked
    away: Ride  # asked for another one alone, while the shaft was blocked
    there: list[Ride]  # asked for this floor alone, while the shaft was blocked; and where the result says that it is
    freed: Ride  # asked for another floor, when the shaft was free again


@dataclass
class Preemption:
    """Goals of which each was sent while the one before ran, or waited."""

    rides: list[Ride]
    running: bool  # the first one still ran when the second was sent
    refused: bool = False  # a goal that another one had taken over from could not be cancelled
    last: bool = False  # the second one was answered within the last step of the first


@dataclass
class Asked:
    """The answers of the service that blocks the shaft while a goal ran."""

    goal: Goal
    running: bool = True  # the goal still ran when the service was first asked
    freed: str = ""  # how the goal had ended when the shaft, which was free, had been freed; empty while it ran
    twice: Ride | None = None  # sent when the shaft had been blocked twice
    after: Ride | None = None  # sent when the shaft had been blocked twice, and freed once
    unblocked: Ride | None = None  # sent when the shaft had been blocked and freed, with no goal in between
    freed_by_rejected: bool = False  # a rejected goal has freed the blocked shaft
    success: list[bool] = field(default_factory=list)  # for `false`, and at last for `true`
    took: list[float] = field(default_factory=list)  # s until an answer came while the goal ran


class Busy(Server):
    """The student's lift, to which something happens while a goal runs."""

    STEPS = 2  # of a goal, before something happens

    def __init__(self, bench: Bench, rng: random.Random):
        super().__init__(bench, BUSY_STEP, "--ros-args", "-p", f"step_period:={BUSY_STEP}", "-p", f"top:={LOW_TOP}")
        self._rng, self._seed = rng, rng.random()
        self._plays: Counter[str] = Counter()  # of each of the scenes below
        self._began: dict[str, int] = {}  # the floor from which each was played first
        self._seen: dict[str, Any] = {}  # what came of each of the scenes below

    def begin(self) -> None:
        """Start the program."""
        self._played = False  # a scene, with this start of it
        super().begin()

    def preemption(self) -> Any:
        """A goal that another one preempts."""
        return self._scene("preemption", self._preempt, "a goal while another one ran", OFFERED)

    @property
    def takes_over(self) -> bool:
        """Return True if a goal that another one takes over from ends soon, as ABORTED."""
        with suppress(Fault), self.preemption() as seen:
            return bool(seen.running and seen.rides[0].end == "ABORTED")
        return False

    def three(self) -> Any:
        """A goal that runs, another one, and a third one before that has begun."""
        return self._scene("three", self._send_three, "a goal while another one ran", OFFERED)

    def leaving(self) -> Any:
        """A goal that another one preempts, for the floor that the cabin is just leaving."""
        return self._scene("leaving", self._leave, "a goal while another one ran", OFFERED)

    def last_step(self) -> Any:
        """A goal in whose last step another one comes."""
        return self._scene("last step", self._come_last, "a goal while another one ran", OFFERED)

    def cancelled(self) -> Any:
        """A goal that is cancelled while it waits for the one that runs."""
        return self._scene("cancelled", self._cancel_waiting, "a goal while another one ran", OFFERED)

    def blocking(self) -> Any:
        """A goal whose shaft is blocked."""
        return self._scene("blocking", self._block, f"a goal or a request to {BLOCK}", OFFERED, offer(BLOCK))

    def asked(self) -> Any:
        """The service, asked while a goal runs."""
        return self._scene("asked", self._ask, f"a request to {BLOCK} while a goal ran", OFFERED, offer(BLOCK))

    @contextmanager
    def _scene(self, name: str, question: Callable[[float, Alive], Any], what: str, *wanted: str) -> Iterator[Any]:
        """Yield the result of a scene, played once; again, from the same floor, when something is found wrong."""

        def play(limit: float, alive: Alive) -> Any:
            self._rng = random.Random(f"{self._seed} {name}")
            began = self._began.setdefault(name, self.place)
            if self.place != began:
                goal = self.give([began], alive, limit)
                if goal and goal.accepted:
                    self.over(goal, [began], limit)
            return question(limit, alive)

        def again() -> None:  # with a fresh program, also for the tests that come after this one
            if self._plays[name] < PLAYS:
                self._seen.pop(name, None)
                if self.accepts and self.starts < MOST_STARTS:
                    self.end()

        with on_wrong(again):
            if name not in self._seen:
                self._plays[name] += 1
                seen = self.converse(play, what, *wanted)
                if not getattr(seen, "running", True) and self._played and self.starts < MOST_STARTS:
                    # Something that was said to this start before may be the reason.
                    self.end()
                    seen = self.converse(play, what, *wanted)
                if isinstance(seen, Fault):
                    self.end()  # what it still does must not disturb other goals
                    raise seen
                self._seen[name] = seen
                self._played = True
            yield self._seen[name]

    def away(self, least: int = 2, most: int = 4, but: int | None = None) -> int:
        """A floor that is so many steps from the cabin, not near floor 0, and another one than `but`."""
        here = min(HIGH, self.place)
        floors = [floor for floor in range(2, HIGH + 1) if least <= abs(floor - here) <= most and floor != but]
        return self._rng.choice(floors)

    def begin_long(self, alive: Alive, limit: float) -> Ride | None:
        """A goal of at least 11 steps, some of which are done, the first of them a stop; None when it has no answer."""
        here = min(HIGH, self.place)
        floors = [here + 1, HIGH, 0] if here < HIGH / 2 else [here - 1, 0, HIGH]
        goal = self.give(floors, alive, limit)
        if goal is None:
            return None

        def begun(goal: Goal) -> object:
            return len(goal.feedback) >= self.STEPS or goal.status

        if not accepted(goal).wait(begun, 2 * self.STEPS * BUSY_STEP) and any(each.heard for each in self.goals):
            goal.wait(begun, self.bench.clock.allow(AT_MOST))  # a busy machine: it must be known where the cabin is
        return Ride(floors, goal)

    def soon_over(self, ride: Ride, limit: float) -> None:
        """Wait for a goal that must end within a step; if it does not, note that, and cancel it."""
        if ride.goal.wait(lambda g: g.status, self.bench.clock.allow(AT_MOST)):
            self.over(ride.goal, ride.floors, limit)
        else:
            ride.still = True
            self.stop(ride.goal, HOPEFUL)

    def stop(self, goal: Goal, limit: float = AT_MOST) -> None:
        """Cancel a goal that need not go on, so that the next one has the lift for itself."""
        goal.cancel()
        goal.wait(lambda g: g.status, self.bench.clock.allow(limit))

    def hangs(self, goal: Goal) -> Fault | None:
        """Return the Fault of a goal without feedback, of a lift whose goals get no result; None if it is not one."""
        return self.unfinished(goal) if self.endless and not goal.feedback and not goal.status else None

    def _preempt(self, limit: float, alive: Alive) -> Preemption | Fault | None:
        return self._take_over(self.away, limit, alive)

    def _leave(self, limit: float, alive: Alive) -> Preemption | Fault | None:
        return self._take_over(lambda: self.place, limit, alive)

    def _take_over(self, where: Callable[[], int], limit: float, alive: Alive) -> Preemption | Fault | None:
        """A goal that another one preempts, for the floor that `where` gives when the first one runs."""
        first = self.begin_long(alive, limit)
        if first is None:
            return None
        if fault := self.hangs(first.goal):
            return fault
        running = not first.goal.status
        floors = [where()]
        goal = self.give(floors, alive, limit)
        if goal is None:
            return None
        if goal.accepted:
            self.soon_over(first, limit)
            if not self.over(goal, floors, limit):
                return self.unfinished(goal) if alive() else None
        else:
            self.stop(first.goal)
        return Preemption([first, Ride(floors, goal)], running)

    def _send_three(self, limit: float, alive: Alive) -> Preemption | Fault | None:
        first = self.begin_long(alive, limit)
        if first is None:
            return None
        if fault := self.hangs(first.goal):
            return fault
        running = not first.goal.status
        # Of both others, which are two goals all the same: the way back, so that who begins too early is seen.
        floors = [1 if first.floors[1] == HIGH else HIGH - 1]
        rides = [first]
        for _ in range(2):
            goal = self.give(floors, alive, limit)
            if goal is None:
                return None
            rides.append(Ride(floors, goal))
            if not goal.accepted:
                break
        else:
            for ride in rides[:2]:
                self.soon_over(ride, limit)
            last = rides[-1].goal
            if not self.over(last, floors, limit):
                return self.unfinished(last) if alive() else None
        for ride in rides:
            if ride.goal.accepted and not ride.goal.status:
                self.stop(ride.goal)
        return Preemption(rides, running)

    def _come_last(self, limit: float, alive: Alive) -> Preemption | Fault | None:
        """A goal of two steps, each to a stop, and in the second of them another goal, for the floor where it ends."""
        for _ in range(TRIES):
            here = min(HIGH, self.place)
            floors = [here + 1, here + 2] if here < HIGH / 2 else [here - 1, here - 2]
            goal = self.give(floors, alive, limit)
            if goal is None:
                return None
            if fault := self.hangs(accepted(goal)):
                return fault
            goal.wait(lambda g: g.feedback or g.status, self.bench.clock.allow(AT_MOST))
            goal.wait(lambda g: len(g.feedback) > 1 or g.status, HALF)
            running = not goal.status
            newest = self.give(floors[-1:], alive, limit)
            if newest is None:
                return None
            last = running and len(goal.feedback) == 1
            seen = Preemption([Ride(floors, goal), Ride(floors[-1:], newest)], True, last=last)
            self.soon_over(seen.rides[0], limit)
            if newest.accepted and not self.over(newest, floors[-1:], limit):
                return self.unfinished(newest) if alive() else None
            if last:
                break
        return seen

    def _cancel_waiting(self, limit: float, alive: Alive) -> Preemption | Fault | None:
        first = self.begin_long(alive, limit)
        if first is None:
            return None
        if fault := self.hangs(first.goal):
            return fault
        running = not first.goal.status
        floors = [1, HIGH] if self.place > HIGH / 2 else [HIGH - 1, 0]
        goal = self.give(floors, alive, limit)
        if goal is None:
            return None
        second = Ride(floors, goal)
        if not goal.accepted:
            self.stop(first.goal)
            return Preemption([first, second], running)
        goal.cancel()
        self.soon_over(first, limit)
        if not self.over(goal, floors, limit):
            return self.unfinished(goal) if alive() else None
        goal.wait(lambda g: g.cancel_accepted is not None, self.bench.clock.allow(limit))
        floors = [self.away(1, 2)]
        goal = self.give(floors, alive, limit)
        if goal is None:
            return None
        if goal.accepted and not self.over(goal, floors, limit):
            return self.unfinished(goal) if alive() else None
        return Preemption([first, second, Ride(floors, goal)], running, self._refuses_replaced(limit, alive))

    def _refuses_replaced(self, limit: float, alive: Alive) -> bool:
        """Return True if a goal in its first step that another one takes over from can no longer be cancelled.

        It is asked for twice: when it ends just as its server decides about a cancel, the answer is the same, once.
        """
        rides = []
        for floors in ([self.away()], [self.place]):
            goal = self.give(floors, alive, limit)
            if goal is None or not goal.accepted:
                break
            rides.append(Ride(floors, goal))
        else:
            for _ in range(2):
                rides[0].goal.cancel()
                rides[0].goal.wait(lambda g: g.cancel_accepted is not None, self.bench.clock.allow(limit))
        for ride in rides:
            self.soon_over(ride, limit)
        return bool(rides) and rides[0].goal.refusals > 1

    def _block(self, limit: float, alive: Alive) -> Blocking | Fault | None:
        begun = self.place
        ride = self.begin_long(alive, limit)
        if ride is None:
            return None
        if fault := self.hangs(ride.goal):
            return fault
        running, sent = not ride.goal.status, time.monotonic()
        if self.set(True, limit, alive) is None:
            return None
        answered = time.monotonic()
        self.soon_over(ride, limit)
        here = self.place
        told = ride.goal.result.floor if ride.goal.status else here
        floor = self.away(but=begun)  # there, a cabin that a block puts back would need no step
        rides = []
        for floors in ([here, floor], [floor], *([place] for place in dict.fromkeys((here, told)))):
            goal = self.give(floors, alive, limit)
            if goal is None:
                return None
            rides.append(Ride(floors, goal))
            if goal.accepted:
                self.soon_over(rides[-1], limit)
        floors = [self.away()]
        goal = self.give(floors, alive, limit) if self.set(False, limit, alive) is not None else None
        if goal is None:
            return None
        if goal.accepted and not self.over(goal, floors, limit):
            return self.unfinished(goal) if alive() else None
        return Blocking(ride, running, sent, answered, here, rides[0], rides[1], rides[2:], Ride(floors, goal))

    def _ask(self, limit: float, alive: Alive) -> Asked | None:
        ride = self.begin_long(alive, limit)
        if ride is None:
            return None
        seen = Asked(ride.goal, running=not ride.goal.status)
        for number in range(ASKED):
            ride.goal.wait_for_news(self.bench.clock.allow(3 * BUSY_STEP))  # of a goal that goes on, or has ended
            if ride.goal.status:
                break
            sent = time.monotonic()
            success = self.set(False, limit, alive)  # it is free already, so that the goal goes on
            if success is None:
                return None
            seen.success.append(success)
            seen.took.append(time.monotonic() - sent)
            if number and min(seen.took) < SOON:
                break
        ride.goal.wait_for_news(self.bench.clock.allow(3 * BUSY_STEP))  # one that is over may not have said so yet
        seen.freed = ride.goal.status
        for blocked in (True, True, False):
            if not blocked and seen.running:  # a shaft that is freed within the step has not stopped the goal
                ride.goal.wait(lambda g: g.status, self.bench.clock.allow(AT_MOST))
            if not blocked:
                seen.twice = self._one_step(limit, alive)
            success = self.set(blocked, limit, alive) if alive() else None
            if success is None and seen.success and not alive():  # as the goal ends now: that is another test's
                self.end()
                return seen
            if success is None:
                return None
            seen.success.append(success)
        if not ride.goal.status:
            self.stop(ride.goal)
        seen.after = self._one_step(limit, alive)
        if all(self.set(blocked, limit, alive) is not None for blocked in (True, False)):
            seen.unblocked = self._one_step(limit, alive)
        seen.freed_by_rejected = alive() and self._freed_by_rejected(limit, alive)
        return seen

    def _freed_by_rejected(self, limit: float, alive: Alive) -> bool:
        """Return True if a goal that a blocked shaft aborts succeeds when another one has been rejected in between."""
        here = min(HIGH, self.place)
        floors = [here + 1 if here < HIGH else here - 1]
        if self.set(True, limit, alive) is None:
            return False
        freeing = ((floors, "ABORTED"), ([-1], "REJECTED"), (floors, "SUCCEEDED"))
        freed = all(self._end(asked, limit, alive) == end for asked, end in freeing)
        if alive():
            self.set(False, limit, alive)
        return freed

    def _end(self, floors: list[int], limit: float, alive: Alive) -> str:
        """Return how a goal ends that must end within a step, or REJECTED; empty when it is not answered."""
        goal = self.give(floors, alive, limit)
        if goal is None or not goal.accepted:
            return "" if goal is None else "REJECTED"
        ride = Ride(floors, goal)
        self.soon_over(ride, limit)
        return ride.end

    def _one_step(self, limit: float, alive: Alive) -> Ride | None:
        """A goal of one step, once it is over; None when it is not."""
        here = min(HIGH, self.place)
        floors = [here + 1 if here < HIGH else here - 1]
        goal = self.give(floors, alive, limit)
        over = goal and goal.accepted and self.over(goal, floors, limit)
        return Ride(floors, goal) if goal and over else None


def ended(ride: Ride, status: str, rule: str, server: Server) -> None:
    """The goal must have ended so; raises Wrong with the rule, and with what happened instead."""
    if ride.end == status:
        return
    raise Wrong(f"{rule} It {f'was {STILL}' if ride.still else server.how(ride.end)}.")
