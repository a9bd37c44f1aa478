"""The grader's side of the conversation: a client of the student's server, and a server for the student's client."""

import threading
import time
from contextlib import contextmanager

from course_interfaces.action import Fibonacci

from autograder.errors import Wrong
from autograder.suitekit.actions import Caller, Goal, serve
from autograder.suitekit.bench import Run
from autograder.suitekit.live import START, Live, finish
from course.waiting import wait_until

ACTION = "/fibonacci"
LAST = 46
STEP = 1.0  # s, the default
SLOWEST = 1.3 * STEP  # s that a step may take, also when the parameter has no effect: that is judged by one test
LATE = 1.0  # s until the last feedback has come, after the result
CLIENT = "fibonacci_client.py"
FEW = 0.05  # s between two feedback messages
EARLY = 0.3  # s that a client is given to cancel too early
PATIENT = 4.0  # s that it is given to cancel at all


def elements(order: int) -> list[int]:
    """The elements 0 to `order`."""
    sequence = [0, 1]
    while len(sequence) <= order:
        sequence.append(sequence[-1] + sequence[-2])
    return sequence[: order + 1]


class Server(Live):
    """The student's server, with a step period or its default."""

    advice = "each goal must be answered at once, and end with a result"

    def __init__(self, bench, period: float | None = None):
        self.period = period
        self.accepts = False  # it has accepted a goal
        super().__init__(
            bench, "fibonacci_server.py", *([] if period is None else ["--ros-args", "-p", f"step_period:={period}"])
        )

    def connect(self):
        """The client."""
        self.caller = Caller(self.ros, ACTION, Fibonacci)
        return {f"the action {ACTION} (course_interfaces/action/Fibonacci)": self.caller.ready}

    def send(self, order: int) -> Goal:
        """A goal, once it is answered."""

        def question(limit, alive):
            goal = self.caller.send(Fibonacci.Goal(order=order), alive)
            return goal if goal.wait(lambda g: g.accepted is not None, limit) else None

        goal = self.converse(question, "a goal")
        self.accepts = self.accepts or goal.accepted
        return goal

    def run(self, order: int, goal: Goal | None = None) -> Goal:
        """A goal (by default a new one), once it is over; raises Wrong when it is not accepted."""

        def question(limit, alive):
            nonlocal goal
            goal = goal if goal and alive() else self.caller.send(Fibonacci.Goal(order=order), alive)
            answered = goal.wait(lambda g: g.accepted is not None, limit)
            done = answered and (not goal.accepted or self.over(goal, order, limit))
            goal = goal if done else None
            return goal

        goal = self.converse(question, "a goal")
        if not goal.accepted:
            raise Wrong(f"Every goal with an order from 0 to {LAST} must be accepted.", f"order {order}")
        self.accepts = True
        return goal

    def over(self, goal: Goal, order: int, limit: float) -> bool:
        """Wait for the end of an accepted goal, and for the feedback that is still on its way."""
        ended = goal.wait(lambda g: g.status, self.bench.clock.allow(limit + order * SLOWEST))
        if ended:
            goal.wait(
                lambda g: any(len(heard.message.partial_sequence) > order for heard in g.feedback),
                LATE if goal.feedback and goal.status == "SUCCEEDED" else 0,
            )
        return ended


class Quick(Server):
    """The student's server with a short step period."""

    def __init__(self, bench, rng):
        super().__init__(bench, rng.choice([0.02, 0.025, 0.03]))
        self._order, self._sample = rng.randrange(9, 14), None

    @contextmanager
    def sample(self):
        """An ordinary order with its goal; another one is sent when something is found wrong with it."""
        try:
            self._sample = self._sample or self.run(self._order)
            yield self._order, self._sample
        except Wrong:
            self._sample = None
            raise


class Cancelled(Server):
    """The student's server with its default step period, and a goal that is cancelled after two steps."""

    ORDER = 8

    def __init__(self, bench):
        super().__init__(bench)
        self.had = 0  # elements in the last feedback before the cancel was sent
        self._sample: Goal | None = None
        self._spare = True  # it takes its time
        self._thread = threading.Thread(target=self._early, daemon=True)

    def begin(self) -> None:
        """Start the program; the first time, the goal is sent as soon as that is possible."""
        super().begin()
        if self.starts == 1:
            self._thread.start()

    @contextmanager
    def sample(self):
        """The goal, once it is over; when something is found wrong, another one is sent, once for all tests."""
        self._thread.join()
        try:
            self._sample = self._sample or self.converse(self._cancel, "a goal that was cancelled")
            if not self._sample.accepted:
                raise Wrong(f"Every goal with an order from 0 to {LAST} must be accepted.")
            yield self._sample
        except Wrong:
            if self._spare:
                self._spare, self._sample = False, None
            raise

    def _early(self) -> None:
        program = self.program
        if wait_until(lambda: self.caller.ready() or not program.alive, START) and program.alive:
            self._sample = self._cancel(START, lambda: program.alive)

    def _cancel(self, limit, alive):
        goal = self.caller.send(Fibonacci.Goal(order=self.ORDER), alive)
        if not goal.wait(lambda g: g.accepted is not None, limit):
            return None
        if goal.accepted:
            goal.wait(lambda g: len(g.feedback) >= 2 or g.status, 4 * STEP)
            self.had = max((len(heard.message.partial_sequence) for heard in list(goal.feedback)), default=0)
            if not goal.status:
                goal.cancel()
            if not self.over(goal, self.ORDER, limit):
                return None
            goal.wait(lambda g: g.cancel_accepted is not None, LATE)
        return goal


class Encounter:
    """A run of the student's client with an action server of the grader's, which cannot be foreseen."""

    def __init__(self, bench, script: str, *args: str):
        """`script` says what the server does: "succeed", "abort", "reject" or "cancel"; `args` follow the order."""
        self._bench, self._script, self._args = bench, script, args
        self.cancel_after = int(args[-1]) if args else 0
        self._rng = bench.random(f"client {script}")
        self.begin()

    def begin(self) -> None:
        """Draw new numbers, and run the client."""
        rng = self._rng
        self.order = rng.randrange(12, LAST + 1)
        self.feedback = [[rng.randrange(10**4, 10**9) for _ in range(length)] for length in (2, 3, 4, 5)]
        self.result = [rng.randrange(10**4, 10**9) for _ in range(6)]
        self.orders: list[int] = []
        self.before_cancel: int | None = None  # feedback messages sent when the cancel came
        self._bench.hide(self.order)
        ros = self._bench.enter(self._bench.new_domain(), threads=4)
        self._server = serve(ros, ACTION, Fibonacci, self._execute, self._accept)
        self._run = Run(self._bench, CLIENT, str(self.order), *self._args, domain=ros.domain)

    @contextmanager
    def judged(self, doing: str):
        """The ended program; it is run again when something is found wrong with it."""
        try:
            program = finish(self._run, doing)
            if not self.orders:
                raise Wrong(f"The client did not send a goal to {ACTION}.", program.output)
            yield program
        except Wrong:
            self.begin()
            raise

    def _accept(self, goal) -> bool:
        self.orders.append(goal.order)
        return self._script != "reject"

    def _execute(self, handle):
        if self._script == "cancel":
            return self._wait_for_cancel(handle)
        for sequence in self.feedback:
            handle.publish_feedback(Fibonacci.Feedback(partial_sequence=sequence))
            time.sleep(FEW)
        time.sleep(2 * FEW)
        (handle.succeed if self._script == "succeed" else handle.abort)()
        return Fibonacci.Result(sequence=self.result)

    def _wait_for_cancel(self, handle):
        """Publish feedback, and see after which message the cancel comes."""
        waits = {self.cancel_after - 1: EARLY, self.cancel_after: PATIENT}
        for number in range(1, 30):
            handle.publish_feedback(Fibonacci.Feedback(partial_sequence=self.feedback[number % 4]))
            if wait_until(lambda: handle.is_cancel_requested, waits.get(number, FEW)):
                self.before_cancel = number
                handle.canceled()
                break
        else:
            handle.succeed()
        return Fibonacci.Result(sequence=self.result)
