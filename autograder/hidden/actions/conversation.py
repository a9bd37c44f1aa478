"""The grader's side of the conversation: a client of the student's server, and a server for the student's client."""

import random
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from course_interfaces.action import Fibonacci

from autograder.sandbox.program import Program
from autograder.suitekit import START, ActionCaller, Alive, Bench, Goal, LiveProgram, Offers, Wrong, on_wrong, serve
from course.waiting import wait_until

ACTION = "/fibonacci"
LAST = 46  # the largest order whose elements fit int32
NOT_ACCEPTED = f"Every goal with an order from 0 to {LAST} must be accepted."
STEP = 1.0  # s, the default
SLOWEST = 1.3 * STEP  # s that a step may take, also when the parameter has no effect: that is judged by one test
LATE = 1.0  # s until the last feedback has come, after the result
QUICK_STEPS = (0.02, 0.025, 0.03)  # s: long enough to be measured, short enough for many goals
CLIENT = "fibonacci_client.py"
FEEDBACK_PAUSE = 0.05  # s between two feedback messages to the client
EARLY = 0.3  # s that a client is given to cancel too early
PATIENT = 4.0  # s that it is given to cancel at all
MOST_FEEDBACK = 29  # messages to a client that never cancels
NUMBERS = (10**4, 10**9)  # of the sequences that a client gets: nothing else that it prints looks like them
THREADS = 4  # of the server for the client: its goal, a cancel, and two to spare


def elements(order: int) -> list[int]:
    """The elements 0 to `order`."""
    sequence = [0, 1]
    while len(sequence) <= order:
        sequence.append(sequence[-1] + sequence[-2])
    return sequence[: order + 1]


class Server(LiveProgram):
    """The student's server, with a given step period (s) or its default."""

    advice = "each goal must be answered at once, and end with a result"

    def __init__(self, bench: Bench, period: float = STEP, *args: str):
        self.period = period
        self.accepts = False  # it has accepted a goal
        super().__init__(bench, "fibonacci_server.py", *args)

    def connect(self) -> Offers:
        """The client of the action."""
        self.caller = ActionCaller(self.ros, ACTION, Fibonacci)
        return {f"the action {ACTION} (course_interfaces/action/Fibonacci)": self.caller.ready}

    def send(self, order: int) -> Goal:
        """A new goal, once it is accepted or rejected."""

        def question(limit: float, alive: Alive) -> Goal | None:
            goal = self.caller.send(Fibonacci.Goal(order=order), alive)
            return goal if goal.wait(lambda g: g.accepted is not None, limit) else None

        goal = self.converse(question, "a goal")
        self.accepts = self.accepts or goal.accepted is True
        return goal

    def run(self, order: int, sent: Goal | None = None) -> Goal:
        """A goal (by default a new one), once it is over; raises Wrong when it is not accepted."""
        known = [] if sent is None else [sent]  # waited for first; if that fails, a new goal is sent

        def question(limit: float, alive: Alive) -> Goal | None:
            first = known.pop() if known else None
            goal = first if first and alive() else self.caller.send(Fibonacci.Goal(order=order), alive)
            answered = goal.wait(lambda g: g.accepted is not None, limit)
            return goal if answered and (not goal.accepted or self.over(goal, order, limit)) else None

        goal = self.converse(question, "a goal")
        if not goal.accepted:
            raise Wrong(NOT_ACCEPTED, f"order {order}")
        self.accepts = True
        return goal

    def over(self, goal: Goal, order: int, limit: float) -> bool:
        """Wait until an accepted goal has ended and its last feedback has come; False when it does not end."""
        ended = goal.wait(lambda g: g.status, self.bench.clock.allow(limit + order * SLOWEST))
        if ended:
            goal.wait(
                lambda g: any(len(heard.message.partial_sequence) > order for heard in g.feedback),
                LATE if goal.feedback and goal.status == "SUCCEEDED" else 0,
            )
        return ended


class Quick(Server):
    """The student's server with a short step period."""

    def __init__(self, bench: Bench, rng: random.Random):
        period = rng.choice(QUICK_STEPS)
        super().__init__(bench, period, "--ros-args", "-p", f"step_period:={period}")
        self._order = rng.randrange(9, 14)
        self._sample: Goal | None = None

    @contextmanager
    def sample(self) -> Iterator[tuple[int, Goal]]:
        """An ordinary order with its goal; another goal is sent when something is found wrong with it."""
        with on_wrong(self._forget):
            self._sample = self._sample or self.run(self._order)
            yield self._order, self._sample

    def _forget(self) -> None:
        self._sample = None


class Cancelled(Server):
    """The student's server with its default step period, and a goal that is cancelled after some steps."""

    ORDER = 8
    STEPS = 2  # before it is cancelled

    def __init__(self, bench: Bench):
        super().__init__(bench)
        self.had = 0  # elements in the last feedback before the cancel was sent
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
            self._sample = self._sample or self.converse(self._cancel, "a goal that was cancelled")
            if not self._sample.accepted:
                raise Wrong(NOT_ACCEPTED)
            yield self._sample

    def _use_spare(self) -> None:
        if self._spare:
            self._spare, self._sample = False, None

    def _early(self) -> None:
        program = self.program
        if wait_until(lambda: self.caller.ready() or not program.alive, START) and program.alive:
            self._sample = self._cancel(START, lambda: program.alive)

    def _cancel(self, limit: float, alive: Alive) -> Goal | None:
        """The goal, sent, cancelled after some steps and over; None when it is not answered or does not end."""
        goal = self.caller.send(Fibonacci.Goal(order=self.ORDER), alive)
        if not goal.wait(lambda g: g.accepted is not None, limit):
            return None
        if goal.accepted:
            goal.wait(lambda g: len(g.feedback) >= self.STEPS or g.status, 2 * self.STEPS * STEP)
            self.had = max((len(heard.message.partial_sequence) for heard in list(goal.feedback)), default=0)
            if not goal.status:
                goal.cancel()
            if not self.over(goal, self.ORDER, limit):
                return None
            goal.wait(lambda g: g.cancel_accepted is not None, LATE)
        return goal


class Encounter:
    """A run of the student's client with an action server of the grader's, whose numbers cannot be guessed."""

    def __init__(self, bench: Bench, script: str, *args: str):
        """`script` says what the server does: "succeed", "abort", "reject" or "cancel"; `args` follow the order."""
        self._bench, self._script, self._args = bench, script, args
        self.cancel_after = int(args[-1]) if args else 0
        self._rng = bench.random(f"client {script}")
        self.begin()

    def begin(self) -> None:
        """Draw new numbers, and run the client."""
        rng = self._rng
        self.order = rng.randrange(12, LAST + 1)
        self.feedback = [[rng.randrange(*NUMBERS) for _ in range(length)] for length in (2, 3, 4, 5)]
        self.result = [rng.randrange(*NUMBERS) for _ in range(6)]
        self.orders: list[int] = []
        self.before_cancel: int | None = None  # feedback messages sent when the cancel came
        self._bench.hide(self.order)
        ros = self._bench.enter(self._bench.new_domain(), threads=THREADS)
        self._server = serve(ros, ACTION, Fibonacci, self._execute, self._accept)
        self._run = self._bench.run(CLIENT, str(self.order), *self._args, domain=ros.domain)

    @contextmanager
    def judged(self, doing: str) -> Iterator[Program]:
        """The ended program; it is run again when something is found wrong with it."""
        with on_wrong(self.begin):
            program = self._run.finish(doing)
            if not self.orders:
                raise Wrong(f"The client did not send a goal to {ACTION}.", program.output)
            yield program

    def _accept(self, goal: Any) -> bool:
        self.orders.append(goal.order)
        return self._script != "reject"

    def _execute(self, handle: Any) -> Any:
        if self._script == "cancel":
            return self._wait_for_cancel(handle)
        for sequence in self.feedback:
            handle.publish_feedback(Fibonacci.Feedback(partial_sequence=sequence))
            time.sleep(FEEDBACK_PAUSE)
        time.sleep(2 * FEEDBACK_PAUSE)  # a client loses the feedback that comes after its result
        (handle.succeed if self._script == "succeed" else handle.abort)()
        return Fibonacci.Result(sequence=self.result)

    def _wait_for_cancel(self, handle: Any) -> Any:
        """Publish feedback, and note after which message the client cancels."""
        waits = {self.cancel_after - 1: EARLY, self.cancel_after: PATIENT}
        for number in range(1, MOST_FEEDBACK + 1):
            handle.publish_feedback(Fibonacci.Feedback(partial_sequence=self.feedback[number % 4]))
            if wait_until(lambda: handle.is_cancel_requested, waits.get(number, FEEDBACK_PAUSE)):
                self.before_cancel = number
                handle.canceled()
                break
        else:
            handle.succeed()
        return Fibonacci.Result(sequence=self.result)
