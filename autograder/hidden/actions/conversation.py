"""The grader's side of the conversation with the student's lift, while one goal runs at a time."""

import random
import threading
import time
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from course_interfaces.action import Lift
from std_srvs.srv import SetBool

from autograder.errors import Fault
from autograder.hidden.actions.rides import Ride, floors_heard, steps
from autograder.sandbox.cleaning import excerpt
from autograder.suitekit import (
    ANSWER,
    START,
    ActionCaller,
    Alive,
    Bench,
    Crashed,
    Goal,
    Heard,
    LiveProgram,
    Offers,
    TimedOut,
    Wrong,
    offer,
    offered_actions,
    on_wrong,
)
from course.foundation.waiting import wait_until

ACTION, BLOCK = "/lift", "/lift/block"
KIND = "course_interfaces/action/Lift"
OFFERED = f"the action {ACTION} ({KIND})"
TOP = 9  # the default
NOT_ACCEPTED = "A goal with at least one floor, and only floors from 0 to top, must be accepted; it was rejected."
STEP = 1.0  # s, the default
SLOW_STEP = 1.6  # s: longer than the default, and than who waits for the cabin only for a while
BEGUN = 0.3  # s after which a goal has begun its first step
SLOWEST = 1.3 * STEP  # s that a step may take, also when the parameter has no effect: that is judged by one test
LATE = 1.0  # s until the last feedback has come, after the result
HOPEFUL = 3.0  # s without news until a goal is given up, of a program whose goals have been given up before
# s: short enough for many steps; an ActionServer keeps 10 messages for a grader that is late, so not shorter.
QUICK_STEPS = (0.04, 0.045, 0.05)
PART = 0.6  # of a step that is over when a goal is cancelled
DYING = 0.2  # s in which a program that gives no result may turn out to be dying
PLAYS = 3  # times that something is tried, when what came of it was wrong
TELLS_ITS_PLACE = "each goal begins with a message for the floor where the cabin stands"
RAISED = "Error raised in execute callback: "  # so rclpy logs it, and aborts the goal


class Server(LiveProgram):
    """The student's lift, with a given step period (s) or its default."""

    advice = "each goal must be answered at once, and end with a result"

    def __init__(self, bench: Bench, period: float = STEP, *args: str):
        self.period = period
        self.accepts = False  # it has accepted a goal
        self.endless = False  # a goal was accepted, and given up because no result came
        super().__init__(bench, "lift_server.py", *args)
        service = offer(BLOCK)
        self.kinds = {OFFERED: (f"the action {ACTION}", KIND), service: (service, "std_srvs/srv/SetBool")}

    def connect(self) -> Offers:
        """The clients of the action and of the service."""
        self.goals: list[Goal] = []  # that were sent to this start of the program
        self.caller = ActionCaller(self.ros, ACTION, Lift)
        self.service = self.ros.node.create_client(SetBool, BLOCK)
        return {OFFERED: self.caller.ready, offer(BLOCK): self.service.service_is_ready}

    def other_services(self) -> list[str]:
        """The actions and services that the program offers instead."""
        return offered_actions(self.ros) + [name for name in super().other_services() if "/_action/" not in name]

    @property
    def place(self) -> int:
        """Return the floor of the cabin according to the feedback, and to the results of goals without any."""
        told = next((where for goal in reversed(self.goals) if (where := last_place(goal)) is not None), 0)
        return max(0, min(TOP, told))  # whatever it tells, the next goals are possible ones

    @property
    def exception(self) -> str:
        """Return the last exception of an execute callback, which ended its goal; '' without one."""
        _, found, raised = self.log.rpartition(RAISED)
        source = self.bench.files[self.file].decode(errors="replace")
        return excerpt(raised.partition("\n")[0], source, self.program.hidden) if found else ""

    def how(self, status: str) -> str:
        """Return how a goal ended, in words for the student, with the exception that ended it."""
        reason = self.exception if status == "ABORTED" else ""
        return f"ended as {status}" + (
            f", because its execute callback raised an exception: {reason}" if reason else ""
        )

    def give(self, floors: Sequence[int], alive: Alive, limit: float) -> Goal | None:
        """A new goal that is accepted or rejected; None when it is not answered."""
        self.fresh = False
        goal, earlier = self.caller.send(Lift.Goal(floors=list(floors)), alive), [*self.goals]
        goal.surplus = lambda heard: TELLS_ITS_PLACE in self.bench.known and tells_its_place(heard, earlier)
        self.goals.append(goal)
        if not goal.wait(lambda g: g.accepted is not None, limit):
            return None
        self.accepts = self.accepts or goal.accepted is True
        return goal

    def send(self, floors: Sequence[int]) -> Goal:
        """A new goal, once it is accepted or rejected."""
        return self.converse(lambda limit, alive: self.give(floors, alive, limit), "a goal", OFFERED)

    def run(self, floors: Sequence[int]) -> Goal:
        """A new goal, once it is over, or given up twice because no result came; raises Wrong when it is rejected."""

        def question(limit: float, alive: Alive) -> Goal | None:
            goal = self.give(floors, alive, limit)
            if goal and goal.accepted and not self.over(goal, floors, limit):
                if not alive() and not goal.feedback:
                    return None
                goal.fault = self.unfinished(goal)
            return goal

        for known in (self.endless, True):
            goal = accepted(self.converse(question, "a goal", OFFERED))
            if goal.status:
                break
            self.end()  # what it still does must not disturb other goals
            if known:
                break
        return goal

    def set(self, blocked: bool, limit: float, alive: Alive) -> bool | None:
        """Return the answer of the service that blocks the shaft; None without an answer."""
        response = self.ros.call(self.service, SetBool.Request(data=blocked), limit, alive)
        return None if response is None else bool(response.success)

    def over(self, goal: Goal, floors: Sequence[int], limit: float) -> bool:
        """Wait until an accepted goal has ended and its last feedback has come; False when it does not end.

        It is given up when there was no news for `limit` s, and for the time of its steps when it tells of none.
        """
        allow = self.bench.clock.allow
        most = 2 * TOP + sum(abs(a - b) for a, b in pairwise(floors))  # steps, wherever it starts
        limit = min(limit, HOPEFUL) if self.endless else limit
        end = time.monotonic() + allow(limit + most * SLOWEST)
        while not goal.status:
            patience = allow(limit if goal.feedback or self.endless else limit + most * self.period)
            if not goal.wait_for_news(patience) or time.monotonic() > end:
                self.endless = True
                return False
        if goal.feedback:
            goal.wait(lambda g: g.feedback[-1].message.floor == g.result.floor, LATE)
        return True

    def unfinished(self, goal: Goal) -> Fault:
        """Return the Fault of a goal that was given up, which says how far it got."""
        if self.program.wait(DYING):
            return Crashed(f"{self.file} died while it worked on a goal: {self.program.last_words()}.")
        heard = [*goal.heard]
        waited = time.monotonic() - (heard[-1].time if heard else goal.answered)
        within = "" if goal.status else f" within {waited:.0f} s{' of its last message' if heard else ''}"
        return TimedOut(
            f"A goal {goal.phase}{within}. An execute callback must be begun, and come to its end: first "
            "goal_handle.succeed(), canceled() or abort(), then `return Lift.Result(...)`."
        )


def last_place(goal: Goal) -> int | None:
    """Return the floor of the goal's last feedback; None if it has none."""
    if goal.feedback:
        return floors_heard(goal)[-1]
    return goal.result.floor if goal.status else None


def begins_with_its_place(ride: Ride) -> bool:
    """Return True if a lift's first goal began with feedback for floor 0, and then that of its steps."""
    told = [heard.message.floor for heard in ride.goal.heard]
    return told[:1] == [0] and ride.floors[0] > 1 and told[1:] == [floor for floor, _ in steps(0, ride.floors)]


def tells_its_place(heard: Sequence[Heard], earlier: Sequence[Goal]) -> bool:
    """Return True if a goal's first feedback is for the floor of the cabin, according to `earlier` goals."""
    if not heard:
        return False
    before = [told for goal in earlier for told in list(goal.heard) if told.published < heard[0].published]
    place = max(before, key=lambda told: told.published).message.floor if before else 0
    return bool(heard[0].message.floor == place)


def accepted(goal: Goal) -> Goal:
    """The goal; raises Wrong when it is rejected."""
    if not goal.accepted:
        raise Wrong(NOT_ACCEPTED)
    return goal


class Quick(Server):
    """The student's lift with a short step period and more floors."""

    def __init__(self, bench: Bench, rng: random.Random):
        period, self.top = rng.choice(QUICK_STEPS), rng.randrange(24, 40)
        super().__init__(bench, period, "--ros-args", "-p", f"step_period:={period}", "-p", f"top:={self.top}")
        # On the way to its first floor it passes the second one, where it must not stop yet.
        self._floors = [rng.randrange(6, 9), rng.randrange(1, 4), TOP, rng.randrange(4, 6)]
        self._sample: Ride | None = None
        self._usual = "SUCCEEDED"
        self._plays = 0

    @contextmanager
    def sample(self) -> Iterator[Ride]:
        """The program's first goal; the program is started again when something is found wrong with it."""
        with on_wrong(self._forget):
            if self._sample is None:
                self.ensure_fresh(OFFERED)
                self._plays += 1
                self._sample = Ride(self._floors, self.run(self._floors))
                self._usual = self._sample.goal.status if self._sample.made else "SUCCEEDED"
                if begins_with_its_place(self._sample):  # which one test judges, and the others leave out
                    self.bench.known.add(TELLS_ITS_PLACE)
            yield self._sample

    def _forget(self) -> None:
        if self._plays < PLAYS:
            self._sample = None

    def ends_well(self, ride: Ride) -> bool:
        """Return True if a goal made its stops and ended as every goal does; another test judges SUCCEEDED."""
        return ride.end == "SUCCEEDED" or (ride.made and ride.end == (self._usual or "SUCCEEDED"))


class Early(Server):
    """The student's lift, to which something happens as soon as it is there, beside the first tests."""

    def __init__(self, bench: Bench, period: float = STEP, *args: str):
        super().__init__(bench, period, *args)
        self._sample: Any = None  # what came of it
        self._spare = True  # only one, because it takes many seconds
        self._thread = threading.Thread(target=self._early, daemon=True)

    def begin(self) -> None:
        """Start the program; the first time, the goal is sent as soon as that is possible."""
        super().begin()
        if self.starts == 1:
            self._thread.start()

    def join(self) -> None:
        """Wait until the first goal is over, or given up."""
        self._thread.join()

    def _play(self, limit: float, alive: Alive) -> Any:
        """Return the result of the event; None if the program died or did not answer."""
        raise NotImplementedError

    def _use_spare(self) -> None:
        if self._spare:
            self._spare, self._sample = False, None

    def _early(self) -> None:
        program = self.program
        if wait_until(lambda: self.caller.ready() or not program.alive, START) and program.alive:
            self._sample = self._play(ANSWER, lambda: program.alive)


class EarlyKinds(Early):
    """The same, with several kinds of what happens, in turn: each test waits for its own alone."""

    def __init__(self, bench: Bench, period: float, kinds: Collection[str]):
        super().__init__(bench, period, "--ros-args", "-p", f"step_period:={period}")
        self._wrong: dict[str, Wrong] = {}
        self._over = {kind: threading.Event() for kind in kinds}

    def expect(self, kind: str) -> None:
        """Wait until this kind is over; raises Wrong when something was wrong each time that it was tried."""
        self._over[kind].wait()
        if kind in self._wrong:
            raise self._wrong[kind]

    def _early(self) -> None:
        try:
            super()._early()
        finally:
            for over in self._over.values():
                over.set()


@dataclass
class Slowly:
    """The results of goals with long steps."""

    rides: list[Ride]  # the second one was sent in the first step of the first
    twice: Ride | None = None  # asked for the floor where the cabin stood, twice
    back: Goal | None = None  # one more goal, whose first step went down
    block_took: float = 0.0  # s until the shaft was blocked in that step; 0 when it was not


class Slow(Early):
    """The student's lift with long steps, and goals to which something happens in their first step."""

    def __init__(self, bench: Bench):
        super().__init__(bench, SLOW_STEP, "--ros-args", "-p", f"step_period:={SLOW_STEP}")

    @contextmanager
    def sample(self) -> Iterator[Slowly]:
        """The goals, as far as they have come; when something is found wrong, they are sent once more."""
        self.join()
        with on_wrong(self._use_spare):
            self._sample = self._sample or self.converse(self._play, "a goal while another one ran", OFFERED)
            yield self._sample

    def _play(self, limit: float, alive: Alive) -> Slowly | None:
        """A goal, one that takes over from it and needs a step wherever the cabin is then, and two more."""
        here = self.place
        seen = Slowly([])
        for floors in ([TOP], [here, here + 1]):
            goal = self.give(floors, alive, limit)
            if goal is None:
                return None
            seen.rides.append(Ride(floors, goal))
            if not goal.accepted:
                return seen
            goal.wait(lambda g: g.feedback or g.status, self.bench.clock.allow(BEGUN))
        if not all(self._ends(ride.goal) for ride in seen.rides):
            return seen
        goal = self.give([self.place] * 2, alive, limit)
        if goal is None or not goal.accepted or not self._ends(goal):
            return seen
        seen.twice = Ride([self.place] * 2, goal)
        seen.back = goal = self.give([0], alive, limit)
        if goal and goal.accepted:
            goal.wait(lambda g: g.feedback or g.status, self.bench.clock.allow(BEGUN))
            begun = time.monotonic()
            if not goal.status and self.set(True, limit, alive) is not None:
                seen.block_took = time.monotonic() - begun
            self._ends(goal)
            self.set(False, limit, alive)  # what is wrong is looked at once more, with the same lift
        return seen

    def _ends(self, goal: Goal) -> bool:
        """Wait for the end of a goal of two steps; one that goes on, which costs other points, is cancelled."""
        if goal.wait(lambda g: g.status, self.bench.clock.allow(4 * SLOW_STEP)):
            return True
        goal.cancel()
        return False


class Cancelled(Early):
    """The student's lift with its default step period, and a goal that is cancelled after some steps."""

    STEPS = 2  # before it is cancelled

    def __init__(self, bench: Bench, rng: random.Random):
        super().__init__(bench)
        self.floors = [1, rng.randrange(7, 9), 0]
        self.usual_end = "CANCELED"  # of a goal that is cancelled: that this is right is another test's

    @contextmanager
    def sample(self) -> Iterator[Goal]:
        """The goal, once it is over; when something is found wrong, it is sent again, once for all tests.

        To a fresh program: from the same floor, so that it is cancelled in the same place and on the same way.
        """
        self.join()
        with on_wrong(self._use_spare):
            if self._sample is None and self.program.alive:
                self.ensure_fresh(OFFERED)
            self._sample = self._sample or self.converse(self._play, "a goal that was cancelled", OFFERED)
            if accepted(self._sample).status:
                self.usual_end = self._sample.status
                yield self._sample
            else:
                fault = self._sample.fault = self._sample.fault or self.unfinished(self._sample)
                self.end()  # what it still does must not disturb other goals
                raise Wrong(fault.message) if self._spare else fault

    def follow(self, goal: Goal) -> Ride | None:
        """A goal of one step after the cancelled one, over or given up; None when the lift has ended since."""
        ends, ended = self.ends, self.has_ended
        place = min(max(goal.result.floor, 0), TOP) if goal.status else 0
        floors = [place + 1 if place < TOP else place - 1]

        def question(limit: float, alive: Alive) -> Goal | None:
            after = self.give(floors, alive, limit)
            if after and after.accepted and not self.over(after, floors, limit) and not alive():
                return None
            return after

        ride = Ride(floors, accepted(self.converse(question, "a goal", OFFERED)))
        return None if ended or self.ends > ends else ride

    def _play(self, limit: float, alive: Alive) -> Goal | None:
        """The goal, sent, cancelled after some steps and over; None when the program died or did not answer."""
        goal = self.give(self.floors, alive, limit)
        if goal and goal.accepted:
            goal.wait(lambda g: len(g.feedback) >= self.STEPS or g.status, 3 * self.STEPS * STEP)
            told = len(goal.feedback)  # what breaks off a step must not round it up to a whole one
            goal.wait(lambda g: len(g.feedback) > told or g.status, PART * STEP)
            if not goal.status:
                goal.cancel()
            if not self.over(goal, self.floors, limit) and not alive():
                return None
            goal.wait(lambda g: g.cancel_accepted is not None, LATE)
        return goal
