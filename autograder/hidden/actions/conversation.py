"""The grader's side of the conversation: a client of the student's lift, and a lift for the student's client."""

import random
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from course_interfaces.action import Lift
from std_srvs.srv import SetBool

from autograder.sandbox.program import Program
from autograder.suitekit import (
    START,
    ActionCaller,
    Alive,
    Bench,
    Goal,
    LiveProgram,
    Offers,
    Wrong,
    numbers,
    offer,
    on_wrong,
    serve,
)
from course.waiting import wait_until

ACTION, BLOCK = "/lift", "/lift/block"
OFFERED = f"the action {ACTION} (course_interfaces/action/Lift)"
TOP = 9  # the default
HIGH = 8  # a floor that every lift has: whether it has `TOP` is judged by one test
NOT_ACCEPTED = "A goal with at least one floor, and only floors from 0 to top, must be accepted."
STEP = 1.0  # s, the default
SLOWEST = 1.3 * STEP  # s that a step may take, also when the parameter has no effect: that is judged by one test
LATE = 1.0  # s until the last feedback has come, after the result
QUICK_STEPS = (0.02, 0.025, 0.03)  # s: long enough to be measured, short enough for many steps
AT_MOST = 5.0  # s until a goal has ended that must end within a step
STILL = "still running"  # in the place of how such a goal ended
BUSY_STEP = 0.3  # s: long enough that a request takes effect before the next step
CLIENT = "lift_client.py"
FEEDBACK_PAUSE = 0.05  # s between two feedback messages to the client
EARLY = 0.3  # s that a client is given to cancel too early
PATIENT = 4.0  # s that it is given to cancel at all, or to print what it has heard
MOST_FEEDBACK = 29  # messages to a client that never cancels
NUMBERS = (10**4, 10**9)  # that a client gets: nothing else that it prints looks like them
THREADS = 4  # of the server for the client: its goal, a cancel, and two to spare


def steps(start: int, floors: Sequence[int]) -> list[tuple[int, int]]:
    """What is told of a goal from the floor `start`: the floor, and the stops that are left, after each step."""
    here, left, told = start, list(floors), []
    while left:
        if left[0] == here:
            left.pop(0)
        else:
            here += 1 if left[0] > here else -1
            told.append((here, len(left) - (left[0] == here)))
    return told


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


def floors_heard(goal: Goal) -> list[int]:
    """The floors in the feedback."""
    return [heard.message.floor for heard in list(goal.feedback)]


def later(goal: Goal, moment: float) -> int:
    """How many feedback messages came after that moment."""
    return sum(heard.time > moment for heard in goal.feedback)


class Server(LiveProgram):
    """The student's lift, with a given step period (s) or its default."""

    advice = "each goal must be answered at once, and end with a result"

    def __init__(self, bench: Bench, period: float = STEP, *args: str):
        self.period = period
        self.accepts = False  # it has accepted a goal
        super().__init__(bench, "lift_server.py", *args)

    def connect(self) -> Offers:
        """The clients of the action and of the service."""
        self.goals: list[Goal] = []  # that were sent to this start of the program
        self.caller = ActionCaller(self.ros, ACTION, Lift)
        self.service = self.ros.node.create_client(SetBool, BLOCK)
        return {OFFERED: self.caller.ready, offer(BLOCK): self.service.service_is_ready}

    @property
    def place(self) -> int:
        """Where the cabin is, as far as the feedback tells."""
        return next((floors_heard(goal)[-1] for goal in reversed(self.goals) if goal.feedback), 0)

    def give(self, floors: Sequence[int], alive: Alive, limit: float) -> Goal | None:
        """A new goal that is accepted or rejected; None when it is not answered."""
        self.fresh = False
        goal = self.caller.send(Lift.Goal(floors=list(floors)), alive)
        self.goals.append(goal)
        if not goal.wait(lambda g: g.accepted is not None, limit):
            return None
        self.accepts = self.accepts or goal.accepted is True
        return goal

    def send(self, floors: Sequence[int]) -> Goal:
        """A new goal, once it is accepted or rejected."""
        return self.converse(lambda limit, alive: self.give(floors, alive, limit), "a goal", OFFERED)

    def run(self, floors: Sequence[int]) -> Goal:
        """A new goal, once it is over; raises Wrong when it is not accepted."""

        def question(limit: float, alive: Alive) -> Goal | None:
            goal = self.give(floors, alive, limit)
            return goal if goal and (not goal.accepted or self.over(goal, floors, limit)) else None

        return accepted(self.converse(question, "a goal", OFFERED))

    def over(self, goal: Goal, floors: Sequence[int], limit: float) -> bool:
        """Wait until an accepted goal has ended and its last feedback has come; False when it does not end."""
        most = 2 * TOP + sum(abs(a - b) for a, b in pairwise(floors))
        ended = goal.wait(lambda g: g.status, self.bench.clock.allow(limit + most * SLOWEST))
        if ended and goal.feedback:
            goal.wait(lambda g: g.feedback[-1].message.floor == g.result.floor, LATE)
        return ended


def accepted(goal: Goal) -> Goal:
    """The goal; raises Wrong when it is rejected."""
    if not goal.accepted:
        raise Wrong(NOT_ACCEPTED)
    return goal


@dataclass
class Ride:
    """A goal that is over, and the floors that it asked for."""

    floors: list[int]
    goal: Goal
    still: bool = False  # it was still running long after it had to end

    @property
    def end(self) -> str:
        """How it ended."""
        return STILL if self.still else self.goal.status


class Quick(Server):
    """The student's lift with a short step period and more floors."""

    def __init__(self, bench: Bench, rng: random.Random):
        period, self.top = rng.choice(QUICK_STEPS), rng.randrange(11, 14)
        super().__init__(bench, period, "--ros-args", "-p", f"step_period:={period}", "-p", f"top:={self.top}")
        # On the way to its first floor it passes the second one, where it must not stop yet.
        self._floors = [rng.randrange(6, 9), rng.randrange(1, 4), TOP, rng.randrange(4, 6)]
        self._sample: Ride | None = None

    @contextmanager
    def sample(self) -> Iterator[Ride]:
        """The program's first goal; the program is started again when something is found wrong with it."""
        with on_wrong(self._forget):
            if self._sample is None:
                self.ensure_fresh(OFFERED)
                self._sample = Ride(self._floors, self.run(self._floors))
            yield self._sample

    def _forget(self) -> None:
        self._sample = None


class Cancelled(Server):
    """The student's lift with its default step period, and a goal that is cancelled after some steps."""

    STEPS = 2  # before it is cancelled

    def __init__(self, bench: Bench, rng: random.Random):
        super().__init__(bench)
        self.floors = [1, rng.randrange(7, 9), 0]
        self._sample: Goal | None = None
        self._spare = True  # only one, because it takes many seconds
        self._thread = threading.Thread(target=self._early, daemon=True)

    def begin(self) -> None:
        """Start the program; the first time, the goal is sent as soon as that is possible."""
        super().begin()
        if self.starts == 1:
            self._thread.start()

    @contextmanager
    def sample(self) -> Iterator[Goal]:
        """The goal, once it is over; when something is found wrong, another goal is sent, once for all tests."""
        self._thread.join()
        with on_wrong(self._use_spare):
            self._sample = self._sample or self.converse(self._cancel, "a goal that was cancelled", OFFERED)
            yield accepted(self._sample)

    def _use_spare(self) -> None:
        if self._spare:
            self._spare, self._sample = False, None

    def _early(self) -> None:
        program = self.program
        if wait_until(lambda: self.caller.ready() or not program.alive, START) and program.alive:
            self._sample = self._cancel(START, lambda: program.alive)

    def _cancel(self, limit: float, alive: Alive) -> Goal | None:
        """The goal, sent, cancelled after some steps and over; None when it is not answered or does not end."""
        goal = self.give(self.floors, alive, limit)
        if goal and goal.accepted:
            goal.wait(lambda g: len(g.feedback) >= self.STEPS or g.status, 2 * self.STEPS * STEP)
            if not goal.status:
                goal.cancel()
            if not self.over(goal, self.floors, limit):
                return None
            goal.wait(lambda g: g.cancel_accepted is not None, LATE)
        return goal


@dataclass
class Blocking:
    """What came of a goal whose shaft was blocked, and of the goals after it."""

    ride: Ride
    sent: float  # when the shaft was blocked, a time of time.monotonic (s)
    here: int  # where the cabin stood then
    success: bool  # what the service said
    stuck: Ride  # asked for this floor and another one, while the shaft was blocked
    freed: Goal  # asked for another floor, when the shaft was free again


@dataclass
class Preemption:
    """Two goals, of which the second was sent while the first ran."""

    first: Ride
    second: Ride


class Busy(Server):
    """The student's lift, to which something happens while a goal runs."""

    STEPS = 3  # of a goal, before something happens

    def __init__(self, bench: Bench, rng: random.Random):
        super().__init__(bench, BUSY_STEP, "--ros-args", "-p", f"step_period:={BUSY_STEP}")
        self._rng = rng
        self._blocking: Blocking | None = None
        self._preemption: Preemption | None = None

    def away(self, here: int, least: int = 2, most: int = 4) -> int:
        """A floor that is so many steps from the floor `here`, and not near floor 0."""
        return self._rng.choice([floor for floor in range(2, HIGH + 1) if least <= abs(floor - here) <= most])

    @contextmanager
    def preemption(self) -> Iterator[Preemption]:
        """A goal that another one preempts; all again when something is found wrong."""
        with on_wrong(self._forget):
            if not self._preemption:
                self._preemption = self.converse(self._preempt, "a goal while another one ran", OFFERED)
            yield self._preemption

    @contextmanager
    def blocking(self) -> Iterator[Blocking]:
        """A goal whose shaft is blocked; all again when something is found wrong."""
        with on_wrong(self._forget):
            if not self._blocking:
                self._blocking = self.converse(self._block, f"a goal or a request to {BLOCK}", OFFERED, offer(BLOCK))
            yield self._blocking

    def _forget(self) -> None:
        self._blocking = self._preemption = None

    def begin_long(self, alive: Alive, limit: float) -> Ride | None:
        """A goal of at least 12 steps, some of which are done, the first of them a stop; None when it has no answer."""
        here = max(0, min(HIGH, self.place))
        floors = [here + 1, HIGH, 0] if here < HIGH / 2 else [here - 1, 0, HIGH]
        goal = self.give(floors, alive, limit)
        if goal is None:
            return None
        accepted(goal).wait(lambda g: len(g.feedback) >= self.STEPS or g.status, 2 * self.STEPS * BUSY_STEP)
        return Ride(floors, goal)

    def soon_over(self, ride: Ride, limit: float) -> bool:
        """Whether a goal that must end within a step ends soon; if not, it is cancelled."""
        if ride.goal.wait(lambda g: g.status, self.bench.clock.allow(AT_MOST)):
            return self.over(ride.goal, ride.floors, limit)
        ride.still = True
        stop(ride.goal)
        return False

    def _preempt(self, limit: float, alive: Alive) -> Preemption | None:
        first = self.begin_long(alive, limit)
        if first is None:
            return None
        floors = [self.away(self.place)]
        goal = self.give(floors, alive, limit)
        if goal is None:
            return None
        if not goal.accepted:
            stop(first.goal)  # the next test has the lift for itself
        elif not self.soon_over(first, limit):
            stop(goal)
        elif not self.over(goal, floors, limit):
            return None
        return Preemption(first, Ride(floors, goal))

    def _block(self, limit: float, alive: Alive) -> Blocking | None:
        ride = self.begin_long(alive, limit)
        if ride is None:
            return None
        sent = time.monotonic()
        success = self._set(True, limit, alive)
        if success is None:
            return None
        self.soon_over(ride, limit)
        here = self.place
        there = self.away(here)
        goal = self.give([here, there], alive, limit)
        if goal is None:
            return None
        stuck = Ride([here, there], goal)
        if goal.accepted:
            self.soon_over(stuck, limit)
        freed = self.give([there], alive, limit) if self._set(False, limit, alive) is not None else None
        if freed is None or (freed.accepted and not self.over(freed, [there], limit)):
            return None
        return Blocking(ride, sent, here, success, stuck, freed)

    def _set(self, blocked: bool, limit: float, alive: Alive) -> bool | None:
        response = self.ros.call(self.service, SetBool.Request(data=blocked), limit, alive)
        return response and response.success


def stop(goal: Goal) -> None:
    """Cancel a goal that need not go on."""
    goal.cancel()
    goal.wait(lambda g: g.status, AT_MOST)


class Encounter:
    """A run of the student's client with an action server of the grader's, whose numbers cannot be guessed."""

    def __init__(self, bench: Bench, script: str, *args: str):
        """`script` says what the server does: "succeed", "abort", "reject" or "cancel"; `args` follow the floors."""
        self._bench, self._script, self._args = bench, script, args
        self.cancel_after = int(args[-1]) if args else 0
        self._rng = bench.random(f"client {script}")
        self.begin()

    def begin(self) -> None:
        """Draw new numbers, and run the client."""
        rng = self._rng
        self.floors = [rng.randrange(10, 100) for _ in range(3)]
        self.feedback = [(rng.randrange(*NUMBERS), rng.randrange(*NUMBERS)) for _ in range(4)]
        self.result = Lift.Result(stops=[rng.randrange(*NUMBERS) for _ in range(3)], floor=rng.randrange(*NUMBERS))
        self.goals: list[list[int]] = []
        self.shown = False  # all feedback, before the goal ended
        self.before_cancel: int | None = None  # feedback messages sent when the cancel came
        self._bench.hide(*self.floors)
        ros = self._bench.enter(self._bench.new_domain(), threads=THREADS)
        self._server = serve(ros, ACTION, Lift, self._execute, self._accept)
        command = [*map(str, self.floors), *self._args]
        self._run = self._bench.run(CLIENT, *command, domain=ros.domain)

    @contextmanager
    def judged(self, doing: str) -> Iterator[Program]:
        """The ended program; it is run again when something is found wrong with it."""
        with on_wrong(self.begin):
            program = self._run.finish(doing)
            if not self.goals:
                raise Wrong(f"The client did not send a goal to {ACTION}.", program.output)
            yield program

    def missing(self, output: str) -> bool:
        """Whether something of the feedback is not in the output."""
        return not {number for message in self.feedback for number in message} <= set(numbers(output))

    def _accept(self, goal: Any) -> bool:
        self.goals.append(list(goal.floors))
        return self._script != "reject"

    def _execute(self, handle: Any) -> Any:
        if self._script == "cancel":
            return self._wait_for_cancel(handle)
        for number in range(len(self.feedback)):
            self._tell(handle, number)
            time.sleep(FEEDBACK_PAUSE)
        # A client loses the feedback that comes after its result, so that comes when all feedback is printed.
        self.shown = bool(wait_until(lambda: not self.missing(self._run.output), PATIENT))
        (handle.succeed if self._script == "succeed" else handle.abort)()
        return self.result

    def _tell(self, handle: Any, number: int) -> None:
        floor, left = self.feedback[number % len(self.feedback)]
        handle.publish_feedback(Lift.Feedback(floor=floor, stops_left=left))

    def _wait_for_cancel(self, handle: Any) -> Any:
        """Publish feedback, and note after which message the client cancels."""
        waits = {self.cancel_after - 1: EARLY, self.cancel_after: PATIENT}
        for number in range(1, MOST_FEEDBACK + 1):
            self._tell(handle, number)
            if wait_until(lambda: handle.is_cancel_requested, waits.get(number, FEEDBACK_PAUSE)):
                self.before_cancel = number
                handle.canceled()
                break
        else:
            handle.succeed()
        return self.result
