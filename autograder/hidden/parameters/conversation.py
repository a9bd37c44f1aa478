"""The grader's side of the conversation: it sets the PID node's parameters, sends errors and hears efforts."""

import contextlib
import math
import time
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, NamedTuple

from rcl_interfaces.msg import SetParametersResult
from std_msgs.msg import Float64

from autograder.errors import Fault
from autograder.suitekit import (
    PUBLISH,
    SUBSCRIBE,
    Alive,
    Bench,
    Listener,
    Offers,
    Parameters,
    Renamed,
    Topic,
    TopicProgram,
    Wrong,
    speaker,
)
from autograder.suitekit.lifecycle import State
from autograder.suitekit.parameters import OFFER

ERROR = "a subscription to the topic error (std_msgs/Float64)"
EFFORT = "a publisher of the topic effort (std_msgs/Float64)"
DEFAULTS: dict[str, Any] = {
    "kp": 1.0,
    "ki": 0.0,
    "kd": 0.0,
    "output_min": -10.0,
    "output_max": 10.0,
    "joint_name": "elbow",
}
RANGES = {"kp": (0.0, 100.0), "ki": (0.0, 50.0), "kd": (0.0, 10.0)}
WIDE = {"output_min": -1e3, "output_max": 1e3}  # limits that clamp nothing
HUGE = 1e7  # an error whose effort is outside all limits
JOINTS = ["wrist", "shoulder", "hip", "knee", "ankle", "neck"]
FILLING = 0.2  # s in which an integral grows
NO_RESULT = "Callback returned an invalid type"  # rclpy's reason, where a callback returned no SetParametersResult
STILL = 0.015625  # an error that is sent again, so that its slope is 0
OTHER = -3 * STILL  # an error that is answered with another effort, also by the kp from before and without a sign
ROUNDING = 1e-9  # of a number's size: several ways to compute the same are right
DECIMALS = 0.0101  # what an effort of two decimals may differ by; that it has no more is judged by other tests
ALIKE = 0.01  # of a number's size: what other tests judge, such as rounding
LEFT_OUT = 1.0  # s after which an effort is left out, by a node that leaves out others
TIMING = 0.02  # of a number's size: what a node may gain or lose by when it reads the clock


class Answer(NamedTuple):
    """An effort; the node got the error between `sent` and `came` (s of time.monotonic)."""

    effort: float
    sent: float
    came: float


class PidNode(TopicProgram):
    """The student's node."""

    advice = "every message on error must be answered with one on effort, and no callback may wait"
    topics: ClassVar[dict[str, Topic]] = {
        ERROR: Topic("error", "std_msgs/Float64", SUBSCRIBE),
        EFFORT: Topic("effort", "std_msgs/Float64", PUBLISH),
    }
    has_answered = False  # an error, at any time
    first_by_old_kp = False  # whether its first effort was by the kp from before the last set
    integral_waits = False  # while the effort is clamped
    beside = ""  # which limit could not be set by `arrange`, as a sentence for the student
    leaves_out_the_same = False  # whether it publishes no effort that is the same as before, which `ask` judges
    latest: tuple[float, float] | None = None  # the error and the effort before, of the program as it runs
    gains_by_launch = False  # whether its gains count only when they are given at launch; see `why_no_controller`

    def __init__(self, bench: Bench, *args: str, renamed: Renamed):
        super().__init__(bench, "pid_node.py", *args, renamed=renamed)
        self.parameters = Parameters(self, topic="error")

    def connect(self) -> Offers:
        """A publisher of errors, a subscription of efforts, and the clients of the parameter services."""
        self.latest = None
        self.efforts = Listener(self.ros, "effort", Float64)
        self.errors = speaker(self.ros, "error", Float64)
        return {
            ERROR: lambda: self.errors.get_subscription_count() > 0,
            EFFORT: lambda: self.efforts.ready,
            **self.parameters.connect(),
        }

    def send(self, error: float) -> Answer:
        """The answer to an error; raises Crashed or TimedOut when there is none.

        Of a node that leaves out an effort that is the same as before, that effort: it has lost its points for it.
        """
        self.bench.hide(error)

        def ask(limit: float, alive: Alive) -> Answer | None:
            self.fresh = False
            before, sent = len(self.efforts.heard), time.monotonic()
            wait = min(limit, LEFT_OUT) if self.leaves_out_the_same and self.latest else limit
            self.errors.publish(Float64(data=error))
            heard = self.efforts.wait(lambda heard: heard[before:], wait, alive)
            if heard:
                self.leaves_out_the_same &= self.latest != (error, heard[0].message.data)
                self.latest = error, heard[0].message.data
                return Answer(self.latest[1], sent, heard[0].time)
            return Answer(self.latest[1], sent, time.monotonic()) if wait < limit and self.latest and alive() else None

        answer = self.converse(ask, "a message on error", OFFER, ERROR, EFFORT)
        self.has_answered = True
        return answer

    def ask(self, error: float) -> Answer:
        """The answer to an error, by the node as it runs: raises Wrong when it answers only after a new start."""
        listener, repeated = self.efforts, self.latest is not None and self.latest[0] == error
        answer = self.send(error)
        if self.efforts is not listener:
            self.leaves_out_the_same |= repeated
            raise Wrong(
                "Each error must be answered with one effort, also when the effort is the same as before: one was not "
                "answered until the node had been started again.",
                error,
            )
        return answer

    def get(self) -> dict[str, Any]:
        """The values of those of its parameters that are declared."""
        return self.parameters.get(*DEFAULTS)

    def takes(self, **gains: float) -> bool:
        """Set gains that are in their ranges; return False if one is refused, which other tests judge.

        A range may have a step, in which the smallest gains are not.
        """
        self.bench.hide(*gains.values())
        return all(answer.successful for answer in self.store(gains).values())

    def arrange(self, **values: float) -> None:
        """Set gains and limits (by default gains of 0, and limits that clamp nothing), to test something else.

        A node that does not use gains set while it runs is started with them.
        """
        self.bench.hide(*values.values())
        everything = {"kp": 0.0, "ki": 0.0, "kd": 0.0} | WIDE | values
        if self.gains_by_launch:
            args = "--ros-args", *launch_arguments(everything)
            if args != self.args or not self.fresh:  # or else it has just been started so, and got no error yet
                self.args = args
                self.forget()
        answers = self.store(everything)
        got = self.get()
        self.beside = "".join(
            f" (This test has set {name} to {everything[name]:g}: it was {refusal(answers.get(name))}.)"
            for name in WIDE
            if name in answers and not answers[name].successful and got.get(name) != everything[name]
        )
        for name in RANGES:
            if (name in got or name in values) and got.get(name) != everything[name]:
                raise Wrong(
                    f"This test sets kp, ki and kd to values in their ranges, those that it does without to 0. {name} "
                    f"could not be set: it was {refusal(answers.get(name))}, and is {got.get(name)}.",
                    f"{name} {everything[name]}: {got}",
                )

    def store(self, values: Mapping[str, float]) -> dict[str, SetParametersResult]:
        """Set these together or, when that is refused, one by one; return how each was answered alone, if it was."""
        answers: dict[str, SetParametersResult] = {}
        if not self.parameters.set_together(values).successful:
            for _ in range(2):  # a limit may have to wait in the first round until the other limit has moved
                answers = dict(zip(values, self.parameters.set(values), strict=False))
        return answers

    def expect_refusal(self, about: str, reason: bool = True, /, **values: float | str) -> None:
        """It must refuse to set these together, with a `reason`, and change nothing; `about` tells what they are."""
        before = self.get()
        together = len(values) > 1
        results = [self.parameters.set_together(values)] if together else self.parameters.set(values)
        after = self.get()
        got = f"{values}: {results}, {before} became {after}"
        if any(result.successful for result in results):
            raise Wrong(f"{about} must be refused. It was accepted.", got)
        if after != before:
            raise Wrong(f"{about} was refused, and yet {changes(before, after)} changed.", got)
        for result in results if reason else ():
            expect_reason(about, result)

    def expect_set(self, about: str, **values: float) -> None:
        """It must accept these, set together or one alone; `about` tells the student what they are."""
        result = self.parameters.set_together(values) if len(values) > 1 else self.parameters.set(values)[0]
        after = self.get()
        if not result.successful:
            raise Wrong(f"{about} must be accepted. It was {refusal(result)}.", f"{values}: {result}, {after}")
        if lost := [name for name, value in values.items() if after.get(name) != value]:
            names = " and ".join(lost)
            raise Wrong(f"{about} was accepted, but {names} has another value then.", f"{values}: {result}, {after}")

    def expect_effort(self, error: float, effort: float, about: str, room: float = 0.0) -> Answer:
        """It must answer with this effort, within that `room`; `about` tells the student which effort is right."""
        answer = self.ask(error)
        if not near(answer.effort, effort, room):
            right, got = apart(effort, answer.effort)
            raise Wrong(
                f"{about}: {right} was right, and it was {got}.{self.beside}",
                f"error {error}: expected {effort}, got {answer.effort}, parameters {self.get()}",
            )
        return answer

    def start_fresh(self) -> None:
        """Have the program running, and no error sent to it yet."""
        self.ensure_fresh(OFFER, ERROR, EFFORT)
        self.get()  # a node that has answered has found the grader's publisher and subscription too


class Early(NamedTuple):
    """The answers of a node, started with `given` values, from its start on, before and after its first set.

    It gets a HUGE error `first`, and then STILL again and again: `begun` to `filled` before kp and kd are set to 0 and
    the limits to WIDE ones, and twice after that.  Before these sets comes one of output_min alone, `one_limit`.
    """

    node: PidNode
    starts: int  # of the node so far: when there are more, it is another
    given: Mapping[str, Any]
    first: Answer
    begun: Answer
    filled: Answer
    answer: Answer
    last: Answer
    one_limit: SetParametersResult

    @property
    def lives(self) -> bool:
        """Return True if the node that answered so is still running."""
        return self.node.starts == self.starts and self.node.state is State.SERVING


def between_limits(given: Mapping[str, Any]) -> float:
    """Return an output_min that is in order with the output_max that a node was started with."""
    return (given["output_min"] + given["output_max"]) / 2


def begin_with_gains(node: PidNode) -> tuple[float, float] | None:
    """Return the first effort of a start with gains, and that to the same error with kp alone; None if it has no such.

    Whether it has the gains from its start, uses them in its first effort, answers, and uses new ones, others judge.
    """
    try:
        node.start_fresh()
        first = node.send(STILL)
        node.store({"ki": 0.0, "kd": 0.0})
        got = node.get()
        node.send(STILL)  # a node may use a new gain one message late
        alone = node.send(STILL)
        time.sleep(FILLING)
        steady = near(alone.effort, node.send(STILL).effort)  # or else it still integrates
        known = steady and got.get("ki") == got.get("kd") == 0.0 and not near(first.effort, DEFAULTS["kp"] * STILL)
        return (first.effort, alone.effort) if known else None
    except Fault:
        return None
    finally:
        node.end()  # the next test finds the values of its start


def meet_early(node: PidNode) -> Early | None:
    """Send a node its first errors; None when it does not answer, or has not all parameters: other tests judge that."""
    with contextlib.suppress(Fault):
        node.start_fresh()
        starts, given = node.starts, node.get()
        if given.keys() != DEFAULTS.keys() or not all(isinstance(given[name], float) for name in WIDE):
            return None
        first, begun = node.send(HUGE), node.send(STILL)
        time.sleep(FILLING)
        filled = node.send(STILL)
        one_limit = node.parameters.set({"output_min": between_limits(given)})[0]
        node.store({"kp": 0.0, "kd": 0.0} | WIDE)
        early = Early(node, starts, given, first, begun, filled, node.send(STILL), node.send(STILL), one_limit)
        if early.lives:
            return early
    node.end()  # the next test finds the values of its start
    return None


def why_no_controller(pid: PidNode, launched: PidNode) -> str:
    """Return '' when the effort depends on the error and on kp, set in `pid` or given to `launched`; else what it did.

    Lenient, because the ways in which an effort can be wrong are judged by the tests: the sign is not looked at.
    """
    before = []
    pid.up(ERROR, EFFORT)  # a topic of another name is replaced by a new start, which forgets what was set before
    for kp in (2.0, 4.0):
        pid.store({"ki": 0.0, "kd": 0.0, "kp": kp} | WIDE)  # the limits, too: an earlier test may have moved them
        other = pid.send(OTHER).effort
        before.append(pid.send(STILL).effort)
    told = f"it was answered with {before[0]:.3g} and then with {before[1]:.3g}"
    if 0.0 < abs(before[0]) < math.inf and math.isclose(before[1], 2 * before[0], rel_tol=ALIKE):
        return f"{told}, but so was another error" if math.isclose(other, before[1], rel_tol=ALIKE) else ""
    pid.start_fresh()
    launched.start_fresh()
    efforts = [node.send(STILL).effort for node in (pid, launched)]
    gains = [node.get().get("kp") for node in (pid, launched)]
    by_kp = [
        effort / kp if isinstance(kp, float) and kp else math.nan for effort, kp in zip(efforts, gains, strict=True)
    ]
    follows = not math.isclose(pid.send(OTHER).effort, efforts[0], rel_tol=ALIKE)
    pid.gains_by_launch = bool(efforts[0]) and near(by_kp[0], by_kp[1]) and follows
    return "" if pid.gains_by_launch else told


def expect_reason(about: str, refused: SetParametersResult) -> None:
    """A refusal must have a reason, and not only the one that rclpy gives when a callback returned no result."""
    if not refused.reason.strip():
        raise Wrong(f"{about} was refused without a reason: the reason must say why.", refused)
    if refused.reason == NO_RESULT:
        raise Wrong(
            f"{about} was refused by rclpy ('{NO_RESULT}'), because a callback returned no SetParametersResult: its "
            "reason must say why.",
            refused,
        )


def refusal(result: SetParametersResult | None) -> str:
    """Return the answer to a set, in words for the student."""
    if result is None or result.successful:
        return "accepted"
    return f"refused with the reason {result.reason!r}" if result.reason.strip() else "refused without a reason"


def changes(before: Mapping[str, Any], after: Mapping[str, Any]) -> str:
    """The names of what is not as it was before."""
    return " and ".join(name for name in DEFAULTS if before.get(name) != after.get(name))


def near(got: float, right: float, room: float = 0.0) -> bool:
    """Return True if two numbers are the same except for rounding, or for the `room`."""
    return abs(got - right) <= max(room, ROUNDING * max(1.0, abs(right)))


def between(got: float, ends: Sequence[float]) -> bool:
    """Return True if a number is between two others, in any order, give or take how the node measures time."""
    low, high = sorted(ends)
    room = TIMING * max(abs(low), abs(high)) + ROUNDING
    return low - room <= got <= high + room


def apart(right: float, got: float) -> tuple[str, str]:
    """Return two numbers for the student, with as many digits as tell one from the other."""
    for digits in range(3, 17):
        shown = f"{right:.{digits}g}", f"{got:.{digits}g}"
        if shown[0] != shown[1]:
            break
    return shown


def launch_arguments(values: dict[str, Any]) -> list[str]:
    """The words of a command line that start a node with these parameters."""
    return [word for name, value in values.items() for word in ("-p", f"{name}:={value}")]


def overrides(bench: Bench, purpose: str, above: float = 0.0) -> dict[str, Any]:
    """Values for all parameters, each different from its default; limits `above` a value, or on both sides of 0."""
    rng = bench.random(purpose)
    low, high = -rng.randrange(5, 39) / 4, rng.randrange(5, 39) / 4
    values: dict[str, Any] = {
        "kp": rng.randrange(5, 80) / 2,
        "ki": rng.randrange(1, 10) / 2,
        "kd": rng.randrange(1, 6) / 2,
        "output_min": above - low if above else low,
        "output_max": above - low + high if above else high,
        "joint_name": rng.choice(JOINTS),
    }
    bench.hide(*values.values())
    return values
