"""A lift of the grader's for the student's client, whose numbers cannot be guessed."""

import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

from course_interfaces.action import Lift

from autograder.errors import Fault
from autograder.hidden.actions.conversation import ACTION, PLAYS, TOP
from autograder.sandbox.program import Program
from autograder.suitekit import Bench, Ros, Run, Wrong, numbers, on_wrong, serve, sought_actions
from autograder.suitekit.runs import LIMIT
from course.foundation.waiting import wait_until

CLIENT = "lift_client.py"
FEEDBACK_PAUSE = 0.05  # s between two feedback messages to the client
WIDE = (1_000, 10_000)  # floors that only the server can refuse
LONG = 11.0  # s that a goal takes for a client that must wait for its end
EARLY = 0.3  # s that a client is given to cancel too early
HELD = (1.0, 3.0)  # s that the last message before a cancel that comes too late is held back: time tells nothing
AFTER = 2  # feedback messages to a client that has cancelled its goal
PATIENT = 4.0  # s that it is given to cancel at all, or to print what it has heard
MOST_FEEDBACK = 29  # messages to a client that never cancels
NUMBERS = (10**4, 10**9)  # that a client gets: nothing else that it prints looks like them
THREADS = 4  # of the server for the client: its goal, a cancel, and two to spare
LOOK, LOOKED = 0.2, 10.0  # s between two looks which action a client asks for, and until the last look
SAID = 100  # characters of what a client printed, in a message
FEW = 4  # feedback messages of a goal that nobody cancels, without the last two


class Called(NamedTuple):
    """The client's runs with a server whose goals succeed at once."""

    misused: dict[str, Run]  # with a wrong command line, by what is wrong
    for_ros: Run  # with arguments that are meant for ROS


class Encounter:
    """A run of the student's client with an action server of the grader's.

    What the server does is told by `script`:

    - "succeed", "abort": publishes feedback, and ends the goal so;
    - "reject": rejects the goal;
    - "cancel": publishes feedback until it is cancelled;
    - "late", "stopped": the same, and yet the goal succeeds, or is aborted;
    - "at once": succeeds at once, without feedback.
    """

    def __init__(
        self,
        bench: Bench,
        script: str,
        floors: tuple[int, int] = (0, 10),
        cancel_after: int | None = None,
        lasts: float = 0.0,
        ahead: bool = False,
    ):
        """`floors` are the lowest floor that the client is given, and the first that it is not.

        A goal that succeeds `lasts` at least so many seconds.  Its first feedback comes `ahead` of the answer to it, if
        asked.
        """
        self._plays, self.ahead = 0, ahead
        self.script, self.cancel_after, self._lasts = script, cancel_after, lasts
        self._bench, self._range = bench, floors
        self._rng = bench.random(f"client {script} {cancel_after}")
        self.begin()

    def begin(self) -> None:
        """Draw new numbers, and run the client."""
        self._plays += 1
        rng = self._rng
        self.floors = [rng.randrange(*self._range) for _ in range(3)]
        if self._range[0]:  # where none is the lowest: that one, and one twice
            self.floors[1:2] = 0, self.floors[0]
        self.feedback = [(rng.randrange(*NUMBERS), rng.randrange(*NUMBERS)) for _ in range(FEW)]
        self.feedback.append(self.feedback[-1])  # two that are alike are two messages
        self.feedback.append((rng.randrange(*NUMBERS), 0))  # as at the end of each goal that succeeds
        self.result = Lift.Result(floor=rng.randrange(*NUMBERS))
        if self.cancel_after != 0:  # a goal that is cancelled at once has made no stops
            low, middle, high = sorted(rng.sample(range(*NUMBERS), 3))
            # A floor that comes twice; and stops that read otherwise backwards.
            self.result.stops = [middle, high, low] if self.script == "abort" else [high, low, high]
        self.goals: list[list[int]] = []
        self.early: Counter[float] = Counter()  # the numbers that were printed before the goal ended
        self.before_cancel: int | None = None  # feedback messages sent when the cancel came
        self.after_cancel: list[tuple[int, int]] = []  # those that were sent after it, and before the result
        self.stayed = False  # the client was there until its goal had lasted as long as it should
        self._came = threading.Event()  # a goal
        self._sought: list[str] = []  # the actions that the client asked for
        self._fault: Fault | None = None  # how the run ended, when it did not end well
        self._bench.hide(*self.floors)
        ros = self._bench.enter(self._bench.new_domain(), threads=THREADS)
        self._server = serve(ros, ACTION, Lift, self._execute, self._accept, self._tell_ahead if self.ahead else None)
        command = [*map(str, self.floors)]
        command += [] if self.cancel_after is None else ["--cancel-after", str(self.cancel_after)]
        self._starts = 1  # of the client, which sends a goal each time
        self._run = self._bench.run(CLIENT, *command, domain=ros.domain)
        threading.Thread(target=self._look, args=(ros, self.goals, self._came), daemon=True).start()

    def _look(self, ros: Ros, goals: list[list[int]], came: threading.Event) -> None:
        """Note which actions the client asks for, until its goal has come."""

        end = time.monotonic() + LOOKED
        while not came.wait(LOOK) and time.monotonic() < end:
            if goals is self.goals and (sought := sought_actions(ros)):
                self._sought = sought

    @property
    def doing(self) -> str:
        """Return the run, in words for the student."""
        floors = (
            f"floors of {self._range[0]} and more, one of them twice, one of 0 and " if self._range[0] > TOP else ""
        )
        lasts = f" whose goal takes {self._lasts:g} s" if self._lasts else ""
        if self.script == "succeed" and self.cancel_after:
            lasts += " and ends before N messages have come"
        return f"with {'' if self.cancel_after is None else '--cancel-after and '}{floors}a server{lasts}"

    @contextmanager
    def judged(self) -> Iterator[Program]:
        """The ended program; it is run again when something is found wrong with it."""
        with on_wrong(self.again):
            program = self._finish()
            if not self.goals:
                others = [action for action in self._sought if not action.startswith(f"the action {ACTION} (")]
                instead = f" It asked for {', '.join(others)[:200]}." if others else ""
                last = self.excerpt(program.output).rpartition("\n")[2][:SAID]
                said = f" It printed {last!r}." if last else " It printed nothing."
                raise Wrong(
                    f"Run {self.doing}, the client did not send a goal to {ACTION}.{instead or said}", program.output
                )
            yield program

    @property
    def end(self) -> str:
        """Return how its goal ended, according to the server."""
        ends = {"reject": "REJECTED", "abort": "ABORTED"}
        if self.script in ("cancel", "stopped"):
            stopped = "CANCELED" if self.script == "cancel" else "ABORTED"
            return "SUCCEEDED" if self.before_cancel is None else stopped
        return ends.get(self.script, "SUCCEEDED")

    @property
    def shown(self) -> Counter[float]:
        """The numbers of the feedback, with how often a client that prints all of it prints them.

        Without a 0, for which it may have a word.
        """
        return drawn_numbers(self.feedback)

    def excerpt(self, output: str) -> str:
        """Return what the client has printed, as its student may read it."""
        return self._bench.shown(CLIENT, output)

    def works(self) -> bool:
        """Return True if the client did some of its tasks with a server that succeeds."""
        try:
            program = self._finish()
        except Fault:
            return False
        sent = {*self.shown, *self.result.stops, self.result.floor}
        return bool(self.goals) and (program.exit_status == 0 or bool(sent & {*numbers(program.output)}))

    @property
    def output(self) -> str:
        """Return the output of a client whose goal came and that ended by itself and in time; otherwise ''."""
        try:
            program = self._finish()
        except Fault:
            return ""
        return program.output if self.goals else ""  # it may say that it found no server, when the machine is busy

    def exits_with(self, status: int) -> bool:
        """Return True if it ends in time, by itself and with this exit status."""
        try:
            return self._finish().exit_status == status
        except Fault:
            return False

    def again(self) -> None:
        """Run the client again, unless that was done often enough."""
        if self._plays < PLAYS:
            self.begin()

    def _finish(self) -> Program:
        """The ended program; raises Crashed or TimedOut, the same each time that it is asked for."""
        if self._fault:
            raise self._fault
        try:
            return self._run.finish(self.doing, LIMIT + self._lasts)
        except Fault as fault:
            self._fault = fault
            raise
        finally:
            self._came.set()  # there is nothing to look for any more

    def _accept(self, goal: Any) -> bool:
        if self._starts != self._run.starts:  # it was started again, because of how or when it ended: this is its goal
            self._starts = self._run.starts
            self.goals.clear()
            self.before_cancel, self.stayed = None, False
            self.after_cancel.clear()
        self.goals.append(list(goal.floors))
        self._came.set()
        return self.script != "reject"

    def _execute(self, handle: Any) -> Any:
        if self.script in ("cancel", "late", "stopped"):
            return self._wait_for_cancel(handle)
        if self.script != "at once":
            begun = time.monotonic()
            for number in range(self.ahead, len(self.feedback)):
                handle.publish_feedback(self._message(number))
                time.sleep(FEEDBACK_PAUSE)
            # A client loses the feedback that comes after its result, so that comes when all feedback is printed.
            wait_until(lambda: self.shown <= self._printed(), PATIENT)
            self._last_from(begun)
        self.early = self._printed()
        (handle.abort if self.script == "abort" else handle.succeed)()
        return self.result

    def _printed(self) -> Counter[float]:
        return Counter(numbers(self._run.output))

    def _last_from(self, begun: float) -> None:
        """Wait until the goal, which began then (s), has lasted as long as it should, or the client has ended."""
        lasts = min(self._lasts, self._bench.clock.allow(self._lasts))  # less, where less patience is asked for
        self.stayed = self._run.until(lambda: time.monotonic() > begun + lasts, LIMIT + lasts)

    def _tell_ahead(self, publish: Callable[[Any], None]) -> None:
        """Publish the first feedback, and let the client print it before its goal is answered."""
        first = self._message(1 if self.script == "cancel" else 0)
        publish(first)
        wait_until(lambda: self._printed()[float(first.floor)] > 0, EARLY)

    def _message(self, number: int) -> Lift.Feedback:
        floor, left = self.feedback[number % len(self.feedback)]
        return Lift.Feedback(floor=floor, stops_left=left)

    def _tell(self, handle: Any, number: int) -> tuple[int, int]:
        handle.publish_feedback(message := self._message(number))
        return message.floor, message.stops_left

    def _wait_for_cancel(self, handle: Any) -> Any:
        """Publish feedback, and note after which message the client cancels."""
        wanted, begun = self.cancel_after or 0, time.monotonic()
        held = self._rng.uniform(*HELD) if self.script == "late" else EARLY
        waits = {wanted - 1: held, wanted: PATIENT}
        for number in range(self.ahead, MOST_FEEDBACK + 1):
            if number > self.ahead:
                self._tell(handle, number)
            if wait_until(lambda: handle.is_cancel_requested, waits.get(number, FEEDBACK_PAUSE if number else 0)):
                self.before_cancel = number
                break
        if self.script != "late" and self.before_cancel is not None:
            time.sleep(
                EARLY
            )  # the result comes later than the answer to the cancel, as from a cabin that ends its step
            (handle.canceled if self.script == "cancel" else handle.abort)()
            return self.result
        last = MOST_FEEDBACK if self.before_cancel is None else self.before_cancel
        for number in range(last + 1, last + 1 + AFTER):  # it cannot be stopped any more
            self.after_cancel.append(self._tell(handle, number))
            time.sleep(FEEDBACK_PAUSE)
        self._last_from(begun)  # so that a client that prints these messages has printed them
        handle.succeed()
        return self.result


def drawn_numbers(feedback: Iterable[tuple[int, int]]) -> Counter[float]:
    """The numbers of feedback messages, with how often each is there, without 0."""
    return Counter(float(number) for message in feedback for number in message if number)
