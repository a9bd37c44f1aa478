"""Tests of the PID node, as a conversation over its parameters and its two topics.

The node measures time steps itself, in real time.  What depends on them is judged by bounds: the node got an error
after the grader had sent it and before its answer came, however busy the machine was.
What a node refuses and accepts counts only when it is a controller: those tests use the fixture `controls`.
Points add up to 20.
"""

import contextlib
import math
import random
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from autograder.errors import Fault
from autograder.hidden.parameters.conversation import (
    DECIMALS,
    DEFAULTS,
    HUGE,
    RANGES,
    ROUNDING,
    STILL,
    TIMING,
    WIDE,
    Answer,
    Early,
    PidNode,
    apart,
    begin_with_gains,
    between,
    between_limits,
    changes,
    expect_reason,
    meet_early,
    near,
    refusal,
)
from autograder.suitekit import Crashed, TimedOut, Wrong, on_wrong, points, twice
from course.foundation.waiting import wait_until

FIRST_ERROR = "The first error must be answered with the proportional part alone"
EXTRA = 0.2  # s in which a second answer to one error would come
INSTANT = 1e-6  # s, the shortest time between two errors that a node can have measured
ALMOST_NOTHING = 1e-9  # of an error: it adds nothing to the integral, but it is a message to measure time from
LENIENT = 3.0  # times that a growth may differ where another test judges it
JUST = 1e-9  # above another limit
ONE = {"output_min": -1.0, "output_max": 1.0}
NARROW = 0.01  # limits that clamp nearly everything
SHORT = 0.02  # s, a step that no node takes for none
LONGER = 0.2  # s, after which the same change gives a much smaller slope
LATER, BETWEEN = 2.3, 0.1  # s after a refused set for which nothing of it may be seen, and from error to error
MUCH_LATER = 3.3  # s after another refused set, which are over when the test has come so far, or nearly
LONG = 2.5  # s, a step that is longer than a second or two
SLOW, FAST = 0.5, 16.0  # a ki, and another that nobody takes for it
SLIGHT = 1e-3  # a change of the error that makes no large slope, however short the step
LEAP, STEEP = 0.125, 9.0  # a change of the error, and a kd with which it makes a large slope
BEFORE = 0.5  # a kp with which each error has another effort
SLOWLY, SLOW_CHANGE = 1.2, 0.25  # s between two errors, and by how much they differ
SHARP = 0.5  # of an effort: a slope of LEAP with the gain STEEP makes more in a step of less than 2 s
FAR = 1e12  # a limit that is as good as any
TINY = 2.0**-14  # a ki that adds hardly anything, or hardly differs from another
LARGE, LEAST = 9e8, 2.0**-24  # an error that makes a large integral, and a ki with which the effort stays below 10
MORE = 8  # times that an error is as large as another
QUICK = 60  # errors one right after the other, each a short step
CLAMPED = 6  # efforts in a row that are clamped
SETTLES, SETTLED = 3, 0.4  # tries until nothing of what was before is seen, for so many s

Overridden = tuple[PidNode, Mapping[str, Any]]  # a node with the values that it was started with


@points(0.25, cell="pid-node")
def test_defaults(pid: PidNode, by_start: Mapping[str, Any]) -> None:
    """The parameters are declared with their types and default values, and keep their types."""
    for name, value in DEFAULTS.items():
        if name not in by_start:
            declared = ", ".join(by_start) or "none of the six"
            raise Wrong(f"The node must declare the parameter {name}. It has declared: {declared}.", by_start)
        if by_start[name] != value or type(by_start[name]) is not type(value):
            got = repr(by_start[name])
            if type(by_start[name]) is not type(value):
                got += f" ({named(by_start[name])})"
            raise Wrong(f"The default of the parameter {name} must be {value!r}; it is {got}.", by_start)
    for other in (3, "three"):
        for name in (name for name, value in DEFAULTS.items() if isinstance(value, float)):
            result, now = pid.parameters.set({name: other})[0], pid.get()
            if not isinstance(now.get(name), float):
                pid.end()
                raise Wrong(
                    f"The parameter {name} must stay a double: a value of another type must be refused (an integer may "
                    f"be stored as a double). After a set to {named(other)}, it is {named(now.get(name))}.",
                    f"{other!r}: {result}, {now}",
                )


def named(value: Any) -> str:
    """Return the type of a parameter's value, in words for the student."""
    kinds = {int: "an integer", str: "a string", bool: "a bool", type(None): "without a value"}
    return kinds.get(type(value), "of another type")


@points(0.25, cell="pid-node")
def test_descriptors(pid: PidNode, by_command_line: Overridden) -> None:
    """The ranges of the gains, and that joint_name is read-only, can be read from their descriptors."""
    if did := why_not_described(pid):
        raise Wrong(did)
    try:
        did = why_not_described(by_command_line[0])
    except (Crashed, TimedOut):
        return  # a node that cannot be started with other values is judged by another test
    if did:
        raise Wrong(f"{did} This was in a node that was started with other values (-p NAME:=VALUE).")


def why_not_described(node: PidNode) -> str:
    """Return what is wrong with the descriptors of a node, for the student, or ''."""
    for name, (low, high) in RANGES.items():
        ranges = node.parameters.describe(name).floating_point_range
        if [(limits.from_value, limits.to_value) for limits in ranges] != [(low, high)]:
            had = " and ".join(f"from {limits.from_value} to {limits.to_value}" for limits in ranges) or "none"
            return f"The descriptor of {name} must have the range from {low} to {high}; it has {had}."
        if ranges[0].step:
            return (
                f"The descriptor of {name} must allow every value from {low} to {high}: its range must have the step "
                f"0, and has {ranges[0].step}."
            )
    read_only = node.parameters.describe("joint_name").read_only
    return "" if read_only else "The descriptor of joint_name must set read_only to True; it has False."


@points(0.25, cell="pid-node")
@twice
def test_first_message(
    pid: PidNode, by_command_line: Overridden, controls: None, early: Early | None, rng: random.Random
) -> None:
    """The first effort has no integral and no derivative part, because no step comes before it; the second has both."""
    pid.start_fresh()
    old = pid.get().get("kp", 1.0)
    kp = old + 0.5
    error = rng.choice([-1, 1]) * rng.randrange(5, 14) / 8
    pid.arrange(kp=kp, ki=float(rng.randrange(8, 40)), kd=rng.randrange(4, 20) / 2)
    about = f"{FIRST_ERROR}: there is no earlier message to measure a time step from"
    answer = pid.ask(error)
    effort = answer.effort
    pid.first_by_old_kp = near(effort, old * error) and not pid.gains_by_launch  # judged by another test
    if not pid.first_by_old_kp and not near(effort, kp * error, DECIMALS):
        right, got = apart(kp * error, effort)
        raise Wrong(f"{about}: {right} was right, and it was {got}.", f"error {error}: {pid.get()}")
    if not pid.first_by_old_kp:
        expect_step_from_first(pid, error, answer)
    if efforts := begin_with_gains(by_command_line[0]):
        first, proportional = efforts
        if not near(first, proportional, DECIMALS):
            raise Wrong(
                f"{FIRST_ERROR}, also when the node is started with ki and kd (--ros-args -p ki:=...): "
                f"{proportional:.3g} was right, and it was {first:.3g}."
            )


def expect_step_from_first(pid: PidNode, error: float, first: Answer) -> None:
    """The second message's step and slope begin at the first, in a node whose later ones begin at the one before."""
    rate = pid.get().get("ki", 0.0) * error
    try:
        second, third = pid.send(error), pid.send(error)
        time.sleep(SHORT)  # by another step, a slope that each message has would be another
        fourth = pid.send(error)
    except (Crashed, TimedOut):
        return  # judged by other tests
    if grows(third, fourth, rate) and not grows(first, second, rate):
        raise Wrong(
            "The second error after the start has the first one as the message before: when the same error comes "
            "again, the slope is 0, and the effort must change by ki × error × the seconds between these two: "
            f"{told([rate * step for step in steps(first, second)])} was right, and it changed by "
            f"{second.effort - first.effort:.3g}.",
            f"{first} then {second}, {third} and {fourth}: {pid.get()}",
        )


def grows(last: Answer, answer: Answer, rate: float) -> bool:
    """Return True if the effort changed at this rate (per second), except for rounding, with the same error again."""
    low, high = sorted(rate * step for step in steps(last, answer))
    room = 2 * DECIMALS + TIMING * max(abs(low), abs(high))
    return low - room <= answer.effort - last.effort <= high + room


@points(0.25, cell="pid-node")
@twice
def test_proportional(pid: PidNode, controls: None, rng: random.Random) -> None:
    """With kp alone the effort is kp × error, one on the topic effort for each error."""
    kp = rng.randrange(3, 9) / 2
    pid.leaves_out_the_same = False  # until it has been seen to
    pid.arrange(kp=kp)
    pid.renamed.expect_none("pid_node.py")
    pid.send(rng.uniform(1.0, 2.0))  # whether a new gain counts at once is judged by another test
    before, errors = len(pid.efforts.heard), [sign * rng.randrange(5, 20) / 8 for sign in (1, -1, -1, 1)]
    errors += [errors[-1], 2.0**-8, 0.0, 0.0]  # an effort that does not change is published too
    for error in errors:
        pid.expect_effort(error, kp * error, "With kp alone, the effort must be kp × error")
    small = pid.ask(LEAST)
    errors.append(LEAST)
    if abs(small.effort - kp * LEAST) > SLIGHT * kp * LEAST / 100:
        raise Wrong(
            f"With kp alone, the effort must be kp × error, not rounded: with an error of {LEAST:.5g}, "
            f"{kp * LEAST:.5g} was right, and it was {small.effort:.5g}.",
            f"kp {kp}: {small}",
        )
    pid.parameters.set_together({"output_min": -0.5, "output_max": 0.5})
    pid.parameters.set({"kp": kp + 0.5})  # an effort comes for an error, not for a set
    errors += [1.0, 1.0]
    for error in errors[-2:]:  # also when the effort stays at its limit
        pid.ask(error)
    wait_until(lambda: len(pid.efforts.heard) > before + len(errors), EXTRA)
    if len(pid.efforts.heard) != before + len(errors):
        raise Wrong(
            "Each error must be answered with exactly one effort, and nothing may be published without an error: "
            f"{len(errors)} errors, and {len(pid.efforts.heard) - before} efforts.",
            f"{len(errors)} errors, {len(pid.efforts.heard) - before} efforts",
        )
    if not pid.gains_by_launch:
        pid.arrange()
        pid.send(error)
        pid.expect_effort(error, 0.0, "With kp, ki and kd all set to 0, the effort must be 0")


@points(3, cell="pid-node")
@twice
def test_new_gain(pid: PidNode, rng: random.Random) -> None:
    """A new gain is used from the very next message on."""
    error = rng.choice([*range(5, 8), *range(9, 15)]) / 8  # not 1, with which kp itself would be right
    pid.arrange(kp=0.5)
    pid.send(error)
    for kp in rng.sample(range(3, 12), 3):
        pid.expect_set("A kp in its range, set while the node runs,", kp=kp / 2)
        about = "After kp was set, the very next effort must use the new kp"
        pid.expect_effort(error, kp / 2 * error, about, DECIMALS)
    if pid.first_by_old_kp:
        raise Wrong(
            "A kp that is set before the first error must be used for it, the very next message: the first effort was "
            "that with the kp of before."
        )
    pid.expect_set("A kp in its range, set together with kd,", kd=0.0, kp=1.2)
    about = "After kd and kp were set together, the very next effort must use the new kp"
    pid.expect_effort(error, 1.2 * error, about, DECIMALS)
    if pid.gains_by_launch:
        return
    last = begin_integral(pid, error, ki=SLOW)
    pid.parameters.set({"ki": FAST})
    answer = pid.send(error)
    shortest, longest = (error * step for step in steps(last, answer))
    # Only what the old ki explains, and the new one does not: how the integral grows is judged by another test.
    if 0 < answer.effort <= SLOW * longest * (1 + TIMING) and answer.effort < FAST * shortest * (1 - TIMING):
        raise Wrong(
            "After ki was set, the very next effort must use the new ki, and the integral start again: with ki alone "
            f"{FAST * shortest:.3g} or more was right, and it was {answer.effort:.3g}.",
            f"{last} then {answer}, ki {SLOW} then {FAST}",
        )
    pid.arrange()
    pid.send(-STILL)
    time.sleep(SHORT)
    pid.parameters.set({"kd": 0.5})
    efforts = [pid.send(error).effort for error in (STILL, -STILL)]
    pid.parameters.set({"kd": 1.0})
    efforts.append(pid.send(STILL).effort)  # 0 once more when a new kd starts the slope again: another test judges it
    if efforts[0] == 0 and efforts[1] != 0 and efforts[2] != 0:
        raise Wrong(
            "After kd was set, the very next effort must use the new kd: with kd alone, an error that had changed was "
            f"answered with 0, and only the next one with another effort, {efforts[1]:.3g}.",
            efforts,
        )


@points(0.75, cell="pid-node")
@twice
def test_clamped(pid: PidNode, early: Early | None, rng: random.Random) -> None:
    """The effort stays within output_min and output_max, as they are at that moment."""
    kp = float(rng.randrange(10, 40))
    for _ in range(1 if pid.gains_by_launch else 2):  # each time costs it a start
        low, high = -rng.randrange(20, 60) / 4, rng.randrange(20, 60) / 4
        pid.arrange(kp=kp, output_min=low, output_max=high)
        pid.send(STILL)  # whether a new gain counts at once is judged by another test
        above, below = rng.uniform(5, 9), rng.uniform(-9, -5)
        pid.expect_effort(above, high, "An effort above output_max must become the current output_max")
        pid.expect_effort(below, low, "An effort below output_min must become the current output_min")
        error = rng.choice([-1, 1]) / 64
        pid.expect_effort(error, kp * error, "An effort between output_min and output_max must stay as it is", DECIMALS)
        about = "After {} alone was set, the very next effort must stay within it"
        for name, value, out in (("output_max", high - 2.5, above), ("output_min", low + 2.5, below)):
            pid.parameters.set({name: value})
            if pid.get().get(name) == value:  # or else another test judges it
                pid.expect_effort(out, value, about.format(name))
    for name, error in (("output_max", 5.0), ("output_min", -5.0)):
        pid.arrange(kp=kp, **{name: 0.0})
        pid.send(STILL)
        if pid.get().get(name) == 0.0:  # or else another test judges it
            pid.expect_effort(error, 0.0, f"With an {name} of 0, an effort beyond it must become 0")
    pid.arrange(kd=0.5)
    pid.send(-STILL)
    time.sleep(SHORT)
    if pid.send(STILL).effort > ROUNDING:  # or else another test judges it, also when it has the wrong sign
        keeps_error = abs(pid.send(STILL).effort) <= ROUNDING  # so does this
        pid.arrange(kd=9.5, output_min=-1.0, output_max=1.0)
        pid.send(-8.0)
        for error, limit in ((8.0, 1.0), (-8.0, -1.0)):
            time.sleep(SHORT)
            pid.expect_effort(error, limit, "The whole effort must be clamped, with its derivative part")
        if keeps_error and not pid.gains_by_launch:  # who is started anew for each set shows less, in the same time
            expect_clamped_sum(pid, rng.choice([-1, 1]))
    if not pid.gains_by_launch:
        expect_clamped_integral(pid, rng.choice([-1, 1]))
        expect_clamped_on_one_side(pid, rng, kp)
    if early and early.first.effort > early.given["output_max"] + ROUNDING:
        raise Wrong(
            "The first effort, too, must be clamped: an effort above output_max must become output_max, "
            f"{early.given['output_max']:.3g}, and it was {early.first.effort:.3g}.",
            early,
        )


def expect_clamped_on_one_side(pid: PidNode, rng: random.Random, kp: float) -> None:
    """With both limits above 0, or both below, an effort between 0 and the nearer one becomes that."""
    pid.arrange(kp=kp)
    pid.send(STILL)  # whether a new gain counts at once is judged by another test
    limit = rng.randrange(8, 24) / 4
    for low, high in ((-2 * limit, -limit), (limit, 2 * limit)):
        pid.store({"output_min": low, "output_max": high})
        got = pid.get()
        if (got.get("output_min"), got.get("output_max")) != (low, high):
            return  # judged by another test
        name, nearer = ("output_min", low) if low > 0.0 else ("output_max", high)
        about = f"With an output_min of {low:g} and an output_max of {high:g}, an effort between 0 and {name} must"
        pid.expect_effort(math.copysign(1 / 64, nearer), nearer, f"{about} become the current {name}")


def expect_clamped_integral(pid: PidNode, sign: int) -> None:
    """The integral part is clamped with the rest, and not by itself; what is asked is measured in the same node."""
    kp, ki = 96.0, 48.0
    begin_integral(pid, sign * 1.0, ki=ki, kp=kp)
    time.sleep(SHORT)
    pid.send(sign * 1.0)
    full = pid.send(sign * ALMOST_NOTHING).effort  # the integral part alone
    limit = sign * full / 2
    if not NARROW < limit < WIDE["output_max"] / 2:
        return  # other tests judge the integral
    if not pid.parameters.set_together({"output_min": -limit, "output_max": limit}).successful:
        return
    alone = pid.send(sign * ALMOST_NOTHING)
    if abs(alone.effort) > limit + ROUNDING:
        right, got = apart(sign * limit, alone.effort)
        raise Wrong(
            f"The whole effort must be clamped, with its integral part: {right} was right, and it was {got}.",
            f"{full} before the limits {limit}: {alone}",
        )
    error = -full / kp  # with the integral part, this makes an effort near 0
    answer = pid.send(error)
    most = ki * abs(error) * (answer.came - alone.sent)  # the size of the right effort
    pid.parameters.set_together(WIDE)
    again = pid.send(sign * ALMOST_NOTHING).effort  # near `full`, or else the integral was not kept
    if (
        near(abs(alone.effort), limit)
        and abs(answer.effort) > limit / 2
        and near(again, full, limit / 2)
        and most < limit / 4
    ):
        raise Wrong(
            "The sum of all parts must be clamped, and not one part by itself: the integral part was "
            f"{full:.3g}, the proportional part {-full:.3g}, and the limits {-limit:.3g} and {limit:.3g}. An effort "
            f"near 0 was right, and it was {answer.effort:.3g}.",
            f"{alone} then {answer}, and {again} in the end",
        )


def expect_clamped_sum(pid: PidNode, sign: int) -> None:
    """The derivative part is not clamped by itself: it is larger than the others, however long the step."""
    kp, kd, before, error = 4.0, 9.6, 1000.0, 1.0
    # The effort of the message before is not clamped: a node that does not keep such a message is judged elsewhere.
    pid.arrange(kp=kp, kd=kd, output_min=-FAR, output_max=FAR)
    last = pid.send(sign * before)
    if not abs(last.effort) > WIDE["output_max"] or not pid.parameters.set_together(ONE).successful:
        return  # judged by other tests
    time.sleep(SHORT)
    answer = pid.send(sign * error)
    if kd * (before - error) / (answer.came - last.sent) > 3 * kp * error and near(answer.effort, sign * 1.0):
        part = by_slope(kd, sign * (error - before), last, answer)
        raise Wrong(
            "The sum of all parts must be clamped, and not one part by itself: the proportional part was "
            f"{sign * kp * error:.3g}, the derivative part {told(part)}, and the limits -1 and 1. An effort of "
            f"{-sign * 1.0:.3g} was right, and it was {answer.effort:.3g}.",
            f"{last} then {answer}",
        )


@points(0.5, cell="pid-node")
@twice
def test_integral(pid: PidNode, early: Early | None, rng: random.Random) -> None:
    """The integral grows by error × the seconds since the message before, also while the effort is clamped."""
    ki, error = rng.randrange(4, 16) / 2, rng.choice([-1, 1]) * rng.randrange(5, 10) / 8
    last = begin_integral(pid, error, ki=ki)
    for pause, other in (
        (0.15, error / 2),
        (0.05, -error),
        (0.05, SLIGHT),
        (rng.uniform(0.1, 0.15), error),
        (0.3, -2 * error),
    ):
        last, fault = send_after(pid, pause, other, ki, last)
        if fault:
            raise Wrong(
                "With ki alone, the effort must change from one message to the next by ki × error × the seconds "
                f"between the two: {fault}.{pid.beside}",
                fault,
            )
    first = last
    for _ in range(QUICK):
        last = pid.send(error)
    if not between(last.effort - first.effort, expected := tuple(ki * error * step for step in steps(first, last))):
        raise Wrong(
            f"When {QUICK} errors come one right after the other, the integral must grow by error × step, too, however "
            f"many and short the steps are: with ki alone, the effort must have changed by {told(expected)}, and it "
            f"changed by {last.effort - first.effort:.3g}.",
            f"{first} then {last}",
        )
    if pid.takes(ki=LEAST):
        last = begin_integral(pid, LARGE, ki=LEAST)
        last, fault = send_after(pid, 0.1, LARGE, LEAST, last)
        movable = WIDE.items() <= pid.get().items()  # or else another test judges it
        pid.end()  # a node that keeps so large an integral would show nothing else
        if fault and movable:
            raise Wrong(
                "A large integral must grow, too, by error × step: neither it nor the error has limits. With an error "
                f"of {LARGE:g} and a small ki alone, the change of the effort was wrong: {fault}.",
                fault,
            )
    narrow = {"output_min": -NARROW, "output_max": NARROW}
    for held in (error, -error):  # at either limit
        last = begin_integral(pid, held, ki=ki)
        last, fault = send_after(pid, 0.05, held, ki, last)
        if fault or not pid.parameters.set_together(narrow).successful:
            return  # judged by other tests
        for _ in range(CLAMPED):
            pid.send(held)
        time.sleep(0.15)
        pid.send(held)
        pid.parameters.set_together(WIDE)
        if pid.get().get("output_max") != WIDE["output_max"]:
            return
        pid.send(held)  # a node may use a new limit one message late
        answer = pid.send(held)
        grown = answer.effort - last.effort
        if not between(grown, expected := tuple(ki * held * step for step in steps(last, answer))):
            pid.integral_waits = True
            expect_growth_over_limits(pid, held, ki)
            raise Wrong(
                "While the effort is clamped, at either limit, the integral must go on growing by error × step: the "
                f"effort must have changed by {told(expected)} once it is not clamped. It changed by {grown:.3g}.",
                f"expected {expected}, got {grown}",
            )
    if early and early.lives:
        expect_long_step(early)


def expect_growth_over_limits(pid: PidNode, error: float, ki: float) -> None:
    """The integral goes on growing when limits are set that clamp nothing."""
    last = begin_integral(pid, error, ki=ki)
    last, fault = send_after(pid, 0.05, error, ki, last)
    time.sleep(0.15)
    if fault or not pid.parameters.set_together({name: 2 * limit for name, limit in WIDE.items()}).successful:
        return
    answer = pid.send(error)
    grown, expected = answer.effort - last.effort, tuple(ki * error * step for step in steps(last, answer))
    if not between(grown, expected):
        raise Wrong(
            "When the limits are set while no effort is clamped, the integral must go on from where it was, by error × "
            f"the seconds since the message before: with ki alone, the effort must have changed by {told(expected)}, "
            f"and it changed by {grown:.3g}.",
            f"{last} then {answer}",
        )


def expect_long_step(early: Early) -> None:
    """A step of more than a second counts as long as it was, in a node that got its last error early."""
    given, last, grew = early.given, early.last, early.last.effort > early.answer.effort
    time.sleep(max(0.0, last.came + LONG - time.monotonic()))
    answer = early.node.send(STILL)
    grown, expected = answer.effort - last.effort, [given["ki"] * STILL * step for step in steps(last, answer)]
    if between(grown + given["kp"] * STILL, expected):
        return  # the last effort still had the kp of the launch: other tests judge when a new gain counts
    if (
        (grown or grew) and early.lives and not between(grown, expected)
    ):  # it never grows when the ki of the launch is not used: judged by another test
        raise Wrong(
            f"After {answer.came - last.came:.1f} s without an error, the step must be these seconds: with ki alone, "
            f"the effort must have changed by {told(expected)}, and it changed by {grown:.3g}.",
            f"{last} then {answer}, {given}",
        )


@points(0.25, cell="pid-node")
@twice
def test_monotonic_clock(pid: PidNode, controls: None, rng: random.Random) -> None:
    """The seconds go on while use_sim_time is set, for the integral and for the slope."""
    ki, kd, error = rng.randrange(4, 16) / 2, rng.randrange(1, 4) / 2, rng.randrange(5, 10) / 8
    about = (
        "While use_sim_time is set, {} must be as always: the seconds are those of time.monotonic(), not those of the "
        "node's clock."
    )
    try:
        begin_integral(pid, error, ki=ki)
        usual = rate_of_growth(pid, error)
        pid.parameters.set({"use_sim_time": True})
        if any(usual):  # how fast it grows is judged by another test
            got = rate_of_growth(pid, error)
            clamped = pid.send(error).effort >= WIDE["output_max"]
            if not clamped and not (got[0] <= LENIENT * usual[1] and usual[0] <= LENIENT * got[1]):
                seen = f" The effort grew by about {got[1]:.3g} a second, and by about {usual[1]:.3g} without it."
                raise Wrong(about.format("the integral") + seen, f"{usual} then {got}")
        pid.parameters.set({"use_sim_time": False})
        usual_slope = has_slope(pid, STILL, kd=kd)  # of a small error: no effort is clamped
        pid.parameters.set({"use_sim_time": True})
        pid.send(STILL)
        effort = effort_of_change(pid, STILL)
        if usual_slope and not abs(effort) > ROUNDING:
            seen = f" With kd alone, an error that changed gave an effort of {effort:.3g}."
            raise Wrong(about.format("the slope") + seen)
        timed = any(usual) or (usual_slope and abs(effort_of_change(pid, STILL, LONGER)) < abs(effort) / 2)
    finally:
        pid.parameters.set({"use_sim_time": False})
    if not timed:
        raise Wrong(
            "With ki or kd alone the effort must depend on the seconds between two messages: without that, the clock "
            "cannot be tested."
        )


def rate_of_growth(pid: PidNode, error: float) -> tuple[float, float]:
    """The least and most by which the effort can have grown in a second, in size, with the same error again.

    The step before is as long: a node that adds it one message late is not told apart here.
    """
    time.sleep(0.1)
    last = pid.send(error)
    time.sleep(0.1)
    answer = pid.send(error)
    grown = abs(answer.effort - last.effort)
    shortest, longest = steps(last, answer)
    return (grown / longest, grown / shortest) if math.isfinite(grown) else (0.0, 0.0)


def has_slope(pid: PidNode, error: float, **gains: float) -> bool:
    """Return True if a change of the error changes the effort, after setting gains, if any are given."""
    if gains:
        pid.arrange(**gains)
    return abs(effort_of_change(pid, error)) > ROUNDING


def effort_of_change(pid: PidNode, error: float, seconds: float = 0.02) -> float:
    """The effort for this error so many seconds after the opposite one."""
    pid.send(-error)
    time.sleep(seconds)
    return pid.send(error).effort


def send_after(pid: PidNode, pause: float, error: float, ki: float, last: Answer) -> tuple[Answer, str]:
    """The answer to an error after a pause (s), and what is wrong with how the effort has changed, or ''."""
    time.sleep(pause)
    answer = pid.send(error)
    grown = answer.effort - last.effort
    right = between(grown, expected := tuple(ki * error * step for step in steps(last, answer)))
    return answer, "" if right else f"{told(expected)} was right, and it changed by {grown:.3g}"


@points(0.5, cell="pid-node")
@twice
def test_derivative(pid: PidNode, early: Early | None, rng: random.Random) -> None:
    """The derivative part is kd × the change of the error per second."""
    begun = begin_slope(early) if early and early.lives else None
    # Efforts of less than 10: limits that do not move cost nothing here.
    kd, before = rng.randrange(1, 4) / 2, rng.uniform(-0.25, -0.1)
    if not pid.gains_by_launch:  # else it is started anew
        pid.arrange(kp=BEFORE)  # the error and the time before are kept, too, while kd is 0
        pid.send(0.5)
        time.sleep(0.06)
        last = pid.send(before)
    pid.arrange(kd=kd)
    if pid.gains_by_launch:
        last = pid.send(before)
    errors = [
        (rng.uniform(0.1, 0.25), 0.06),
        (0.0, 0.06),
        (rng.uniform(-0.25, -0.1), 0.06),
        (rng.uniform(-0.1, 0), 0.06),
    ]
    errors += [(errors[-1][0], 0.1), (errors[-1][0] + SLIGHT, 0.0)]
    for number, (error, pause) in enumerate(errors):
        time.sleep(pause)
        try:
            answer = pid.send(error)
        except TimedOut:
            if error == 0.0:
                return  # judged by another test
            raise
        # Whether new gains count at once is judged by another test: these are the efforts of those before.
        expected = by_slope(kd, error - before, last, answer)
        rest = answer.effort - BEFORE * error
        late = number == 0 and (answer.effort == 0 or near(rest, 0.0) or between(rest, expected))
        if not late and not between(answer.effort, expected):
            raise Wrong(
                "With kd alone, the effort must be kd × (error − error before) / the seconds between the two: "
                f"{told(expected)} was right, and it was {answer.effort:.3g}.{pid.beside}",
                f"{before} to {error}: expected {expected}, got {answer.effort}",
            )
        last, before = answer, error
    expect_large_slope(pid, kd)
    if not pid.gains_by_launch:
        for gain, value in (("ki", TINY), ("kp", TINY), ("kd", 2 * kd)):
            expect_slope_after(pid, gain, value, kd)
        if early and begun:
            expect_slow_slope(early, begun)


def begin_slope(early: Early) -> Answer | None:
    """Its answer to STILL, with a kd from now on; None if it has none."""
    with contextlib.suppress(Fault):
        early.node.parameters.set({"kd": STEEP})
        answer = early.node.send(STILL)  # a node may use a new gain one message late
        if early.node.get().get("kd") == STEEP:
            return answer
    return None


def expect_slow_slope(early: Early, last: Answer) -> None:
    """A slope over more than a second is as large as it is; after it, the node has a kd of 0 again."""
    time.sleep(max(0.0, last.came + SLOWLY - time.monotonic()))
    error = STILL + SLOW_CHANGE
    try:
        answer, again = early.node.send(error), early.node.send(error)
        early.node.parameters.set({"kd": 0.0})
        early.node.send(STILL)
    except Fault:
        return  # judged by other tests
    low, high = sorted(by_slope(STEEP, SLOW_CHANGE, last, answer))
    # The second of the two has no slope, and a little more of the integral; they are equal when they are clamped.
    got, integral = answer.effort - again.effort, early.given["ki"] * error * (again.came - answer.sent)
    if early.lives and got and max(integral, abs(got)) < low / LENIENT:
        raise Wrong(
            f"After {answer.came - last.came:.1f} s without an error, the slope must be the change of the error / "
            f"these seconds: the derivative part must have been {told((low, high))}, and it was {max(0.0, got):.3g}.",
            f"{last} then {answer} and {again}, {early.given}",
        )


def by_slope(kd: float, change: float, last: Answer, answer: Answer) -> tuple[float, ...]:
    """The efforts between which kd × slope lies, when the error has changed by so much from one answer to the next."""
    return tuple(kd * change / step for step in steps(last, answer))


def expect_large_slope(pid: PidNode, kd: float) -> None:
    """A slope has no limits, where the effort has none that matter."""
    pid.arrange(kp=1.0)
    pid.send(STILL)
    if not near(pid.send(500.0).effort, 500.0):
        return  # judged by another test: limits do not move
    pid.arrange(kd=kd, output_min=-FAR, output_max=FAR)
    for clamped, error in ((False, 10.0), (True, 4.0)):
        if clamped and not pid.parameters.set_together(ONE).successful:
            return
        last = pid.send(-10.0)
        if clamped and not (abs(last.effort) == 1.0 and pid.parameters.set_together(WIDE).successful):
            return  # judged by other tests
        time.sleep(0.06)
        answer = pid.send(error)
        expected = by_slope(kd, error + 10.0, last, answer)
        # 0 and 1: whether a new gain and new limits count at once is judged by other tests.
        if answer.effort and abs(answer.effort) != 1.0 and not between(answer.effort, expected):
            about = (
                "The slope is the change of the error since the message before, / the seconds between the two, also "
                "when the effort before was clamped."
                if clamped
                else "A large slope counts as it is: it has no limits."
            )
            raise Wrong(
                f"{about} With kd alone, and an error that changed by {error + 10:g}, {told(expected)} was right, and "
                f"it was {answer.effort:.3g}.",
                f"{last} then {answer}",
            )


def expect_slope_after(pid: PidNode, gain: str, value: float, kd: float) -> None:
    """A new gain starts no slope again: the error and the time of the message before stay as they are."""
    before, error = 0.25, 0.125
    pid.arrange(kd=kd)
    last = pid.send(before)
    pid.parameters.set({gain: value})
    time.sleep(0.06)
    answer = pid.send(error)
    kd = value if gain == "kd" else kd
    right, from_zero = (by_slope(kd, change, last, answer) for change in (error - before, error))
    begun = between(answer.effort, from_zero) or abs(answer.effort) < min(map(abs, right)) / LENIENT
    if begun and not between(answer.effort, right):
        raise Wrong(
            f"After {gain} was set, the slope must still be the change of the error since the message before, / the "
            f"seconds between the two: with kd{' alone' if gain == 'kd' else f', and hardly any {gain}'}, "
            f"{told(right)} was right, and it was {answer.effort:.3g}.",
            f"{last} then {answer}",
        )


@points(2, cell="pid-node")
@twice
def test_ki_starts_the_integral_again(pid: PidNode, rng: random.Random) -> None:
    """When ki is set to another value, the integral starts again from zero, and grows from the next message on."""
    ki, error = rng.randrange(4, 16) / 2, rng.randrange(5, 10) / 8
    if pid.gains_by_launch:
        expect_new_rate(pid, error, ki)
    # By little and by more, alone, and as the last of several.
    little = [{"ki": ki + TINY}] if pid.takes(ki=ki + TINY) else []
    for new in (*little, {"ki": ki + 1.5}, {"kd": 0.0, "kp": 0.0, "ki": ki - 0.5}):
        fill_integral(pid, error, ki=ki)
        slowest, fastest = rate_of_growth(pid, error)  # judged by another test
        if not fastest:  # as when it grows so fast that it is clamped
            return
        last = pid.send(error)
        time.sleep(0.1)
        result = pid.parameters.set_together(new) if len(new) > 1 else pid.parameters.set(new)[0]
        answer = pid.send(error)
        if not result.successful:
            raise Wrong(f"A new ki in its range must be accepted: it was {refusal(result)}.", f"{new}: {result}")
        shortest, longest = steps(last, answer)
        share = new["ki"] / ki
        expect_new_start(pid, "", last, answer, (share * slowest * shortest / LENIENT, share * fastest * longest))
    rates = share * slowest / LENIENT, share * fastest
    for sign in (1, -1):  # an integral below 0 starts again, too
        full = send_often(pid, sign * error)
        if full.effort * sign <= 0:
            return  # judged by another test
        pid.parameters.set({"ki": 0.0})
        send_often(pid, sign * MORE * error)  # what is gathered of these must be gone, too
        last = pid.send(sign * error)  # a node may go by the error before, too: another test judges it
        pid.parameters.set({"ki": new["ki"]})
        time.sleep(0.1)  # as long as the step that was measured
        answer = pid.send(sign * error)
        longest = answer.came - full.sent  # a node may take no time while ki is 0: another test judges it
        expected = sign * rates[0] * steps(last, answer)[0], sign * rates[1] * longest
        expect_new_start(pid, " to 0 and back,", full, answer, expected)


def expect_new_rate(pid: PidNode, error: float, ki: float) -> None:
    """In a node whose gains count at its start, a ki that is set while it runs counts, too."""
    fill_integral(pid, error, ki=ki)
    slowest, _ = rate_of_growth(pid, error)
    pid.parameters.set({"ki": 2 * LENIENT * ki})
    _, fastest = rate_of_growth(pid, error)
    if fastest < LENIENT * slowest:
        raise Wrong(
            "A ki that is set while the node runs must be used from the next message on, with an integral that starts "
            "again from zero: your node uses only the ki of its start."
        )


def has_effort_without_gains(pid: PidNode) -> bool:
    """Return True if an error gives the same effort again when all gains are 0, which other tests judge."""
    pid.parameters.set({"ki": 0.0})
    pid.send(STILL)
    first = pid.send(STILL).effort
    time.sleep(0.05)
    return abs(first) > ROUNDING and near(pid.send(STILL).effort, first)


def expect_new_start(pid: PidNode, about: str, last: Answer, answer: Answer, expected: Sequence[float]) -> None:
    """The effort after a new ki must lie between these; `about` tells the student how ki was set."""
    if (answer.effort == 0 or not between(answer.effort, expected)) and not has_effort_without_gains(pid):
        raise Wrong(
            f"After ki was set to another value,{about} the integral must start again from zero: with ki alone, the "
            f"next effort must be ki × error × step. The last effort before was {last.effort:.3g}, and the next one "
            f"{answer.effort:.3g}.{pid.beside}",
            f"{last} then {answer}, expected {expected}",
        )


def told(ends: Sequence[float]) -> str:
    """Two bounds, for the student."""
    low, high = sorted(ends)
    return f"{low:.3g} to {high:.3g}"


def begin_integral(pid: PidNode, error: float, ki: float, **gains: float) -> Answer:
    """The first answer to an error, whose time step starts at a message just before it, and the integral at zero."""
    if not pid.gains_by_launch:  # else it is started anew
        for value in (0.0, ki):  # by way of 0: a ki that is as before would leave the integral as it is
            pid.parameters.set({"ki": value})
    pid.arrange(ki=ki, **gains)
    pid.send(error * ALMOST_NOTHING)
    return pid.send(error)


def fill_integral(pid: PidNode, error: float, ki: float, **gains: float) -> Answer:
    """The last of several answers to a positive error, while the integral grows; raises Wrong when it does not."""
    begin_integral(pid, error, ki, **gains)
    first, last = pid.send(error), send_often(pid, error)
    if not last.effort > first.effort:
        least, most = WIDE.values()
        raise Wrong(
            "With ki above 0 and the same positive error again and again, the effort must grow: it was "
            f"{first.effort:.4g} and then {last.effort:.4g}, within limits of {least:g} and {most:g}. Only of an "
            "integral that grows can be tested when it starts again.",
            f"ki {ki}: {first} then {last}",
        )
    return last


def send_often(pid: PidNode, error: float) -> Answer:
    """The last of several answers to the same error."""
    for _ in range(3):
        time.sleep(0.05)
        pid.send(error)
    return pid.send(error)


def expect_no_less(pid: PidNode, error: float, last: Answer, about: str, grows: bool = False) -> None:
    """The same positive error again must be answered with no less effort than last: the integral is still there.

    With more, if the integral `grows`.
    """
    answer = pid.send(error)
    if grows and answer.effort == last.effort:
        raise Wrong(
            f"{about}, which must go on growing: the same error again was answered with {answer.effort:.4g}, as before "
            "it.",
            f"{last} then {answer}",
        )
    if not answer.effort >= last.effort - ROUNDING:
        raise Wrong(
            f"{about}: the same error again was answered with {answer.effort:.3g}, and before it with "
            f"{last.effort:.3g}.",
            f"{last} then {answer}",
        )


def expect_nothing_remembered(pid: PidNode, rng: random.Random) -> None:
    """A limit that was refused must not be compared with those that are set later."""
    low, high = -rng.randrange(80, 100) / 4, rng.randrange(80, 100) / 4
    for bad, good, order in (
        ({"output_min": high + 30.0}, {"output_max": high - 1.0}, ("output_max", "above", "output_min")),
        ({"output_max": low - 30.0}, {"output_min": low + 1.0}, ("output_min", "below", "output_max")),
    ):
        for before in ({}, bad):
            pid.store({"output_min": low, "output_max": high})
            if before and not is_refused(pid, before):
                break  # judged by other tests
            if not before and is_refused(pid, good):
                break
            if before:
                pid.expect_set("{}, set alone to a value {} the stored {}, after a refused set,".format(*order), **good)


def expect_kp_counts(pid: PidNode, error: float) -> None:
    """A kp that is accepted after refused sets must be used; a node may use it one message late here."""
    if pid.gains_by_launch:
        return
    efforts = []
    for kp in (0.5, 1.0):
        pid.arrange(kp=kp)
        pid.send(error)
        efforts.append(pid.send(error).effort)
    if efforts[0] and near(*efforts):
        raise Wrong(
            "A refused set changes nothing, so a kp that is accepted later must be used as before. With a kp of 0.5 "
            f"and then of 1, set after several refused sets, the same error was answered with {efforts[0]:.3g} both "
            "times.",
            efforts,
        )


def refuse_a_kp(early: Early) -> float | None:
    """Return when a node with a kp of 0 refused one, set with limits; None if it has another kp, or accepts it."""
    with contextlib.suppress(Fault):
        leap, _ = turn(early)
        if abs(leap) < STILL and is_refused(early.node, {"kp": RANGES["kp"][1], "output_min": 2.0, "output_max": 1.0}):
            return time.monotonic()
    return None


def expect_old_kp(early: Early, refused_at: float) -> None:
    """A kp that was refused is not used some seconds later, either."""
    time.sleep(max(0.0, refused_at + MUCH_LATER - time.monotonic()))
    try:
        leap, integral = turn(early)
    except (Crashed, TimedOut):
        return  # judged by other tests
    kp = RANGES["kp"][1]
    if abs(leap) > kp * STILL + integral and early.lives:
        raise Wrong(
            f"{time.monotonic() - refused_at:.0f} s after a refused set of kp and of both limits nothing of it may "
            f"take effect: with a kp of 0, an error that changed by {2 * STILL:g} changed the effort by {leap:.3g}.",
            f"refused: a kp of {kp}",
        )


def turn(early: Early) -> tuple[float, float]:
    """By how much the effort changes when the error does, from STILL to -STILL, and the integral's most part in it."""
    before, after = early.node.send(STILL), early.node.send(-STILL)
    return after.effort - before.effort, early.given["ki"] * STILL * (after.came - before.sent) * LENIENT


def expect_no_slope(pid: PidNode, error: float, gains: Mapping[str, float], bad: dict[str, float]) -> None:
    """A kd of a refused set must not be used, while kd is 0."""
    pid.parameters.set({"kd": 0.0})
    pid.send(error)

    def leap() -> tuple[float, float]:
        last, answer = pid.send(error), pid.send(error + LEAP)
        pid.send(error)
        most = last.effort + gains["kp"] * LEAP + gains["ki"] * (error + LEAP) * (answer.came - last.sent)
        return answer.effort, most + ROUNDING * max(1.0, abs(most))

    effort, most = leap()
    if effort > most:
        return  # judged by other tests
    for values in ({"kd": STEEP} | bad, bad | {"kd": STEEP}, {"kd": STEEP, "output_min": math.nan}):
        if not is_refused(pid, values):
            continue
        effort, most = leap()
        if effort > most + SHARP:
            raise Wrong(
                f"After a refused set of {', '.join(values)} the node must use the kd that it had, 0: when the error "
                f"changed, {most:.3g} at most was right, and it was {effort:.3g}.",
                f"{values}, {gains}",
            )


def expect_no_late_change(pid: PidNode, fill: Callable[[], Answer], error: float, values: Mapping[str, float]) -> None:
    """A refused set must not take effect some time later, either."""
    for _ in range(SETTLES):
        fill()
        last, less = watch_effort(pid, error, SETTLED)
        if less is None:
            break
    else:
        return  # the effort falls by itself: another test judges it
    if not is_refused(pid, values):
        return  # judged by the other tests
    last, less = watch_effort(pid, error, LATER)
    if less is not None:
        raise Wrong(
            f"For {LATER:.0f} s after a refused set of {', '.join(values)} nothing of it may take effect: the same "
            f"error again was answered with {less.effort:.3g}, and before it with {last.effort:.3g}.",
            f"{last} then {less}",
        )


def watch_effort(pid: PidNode, error: float, seconds: float) -> tuple[Answer, Answer | None]:
    """Send the same positive error again and again: the last answer, and one with less effort than before, if any."""
    last = pid.send(error)
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        time.sleep(BETWEEN)
        answer = pid.send(error)
        if not answer.effort >= last.effort - ROUNDING:
            return last, answer
        last = answer
    return last, None


def steps(last: Answer, answer: Answer) -> tuple[float, float]:
    """The shortest and the longest time (s) that the node can have measured between two errors."""
    return max(INSTANT, answer.sent - last.came), answer.came - last.sent


@points(0.25, cell="pid-node")
@twice
def test_out_of_range(pid: PidNode, controls: None, rng: random.Random) -> None:
    """A gain outside its range is refused with a reason, and changes nothing; the range's ends are accepted."""
    for name, (low, high) in RANGES.items():
        for value in (low, high):
            pid.expect_set(f"A {name} at the end of its range, {value:g},", **{name: value})
        between_steps = low + rng.randrange(1, 16, 2) / 16
        pid.bench.hide(between_steps)
        pid.expect_set(f"A {name} within its range, a value that is not round,", **{name: between_steps})
    pid.arrange(**{name: (low + high) / 4 for name, (low, high) in RANGES.items()})
    for name, (low, high) in RANGES.items():
        for value in (high + rng.randrange(1, 80) / 8, low - rng.randrange(1, 80) / 8):
            pid.bench.hide(value)
            pid.expect_refusal(f"A {name} {'above' if value > high else 'below'} its range", **{name: value})


@points(3, cell="pid-node")
@twice
def test_limits_in_order(pid: PidNode, controls: None, rng: random.Random) -> None:
    """An output_min above output_max is refused, set alone or together with others."""
    low, high = ordered_limits(pid, rng)
    pid.expect_refusal("An output_min above output_max", False, output_min=high + 1.5)
    pid.expect_refusal("An output_max below output_min", False, output_max=low - 1.5)
    together = "Setting both limits together, in the wrong order,"
    pid.expect_refusal(together, False, output_min=high, output_max=low)
    pid.expect_refusal(together, False, output_max=high + 2.5, output_min=high + 4.0)
    pid.expect_refusal(together, False, output_min=low - 2.5, output_max=low - 4.0)
    for gain in RANGES:
        about = f"An output_min above output_max, set together with {gain},"
        pid.expect_refusal(about, False, **{"output_min": high + 1.5, gain: 2.0})
    for bad, limits in (
        ("output_max", {"output_min": high, "output_max": high + 2}),
        ("output_min", {"output_min": low - 2, "output_max": low}),
    ):
        pid.store(limits)
        if limits.items() <= pid.get().items():  # or else another test judges it
            pid.expect_refusal(f"An {bad} of 0 that is not in order with the other limit", False, **{bad: 0.0})


@points(0.5, cell="pid-node")
@twice
def test_equal_limits(pid: PidNode, controls: None, rng: random.Random) -> None:
    """An output_min that is equal to output_max is refused."""
    low, high = ordered_limits(pid, rng)
    pid.expect_refusal("An output_min equal to output_max", False, output_min=high)
    pid.expect_refusal("An output_max equal to output_min", False, output_max=low)
    together = "Setting both limits together, to the same value,"
    pid.expect_refusal(together, False, output_min=low + 1, output_max=low + 1)
    about = "Setting both limits together, to the same value, and kp as well"
    pid.expect_refusal(about, False, output_min=low + 1, output_max=low + 1, kp=2.0)


@points(0.5, cell="pid-node")
@twice
def test_reasons(pid: PidNode, controls: None, rng: random.Random) -> None:
    """Limits that are not in order are refused with a reason."""
    low, high = -rng.randrange(5, 30) / 4, rng.randrange(5, 30) / 4
    pid.bench.hide(low, high)
    refused = 0
    expect_accepting(pid, output_min=low, output_max=high)
    for about, values in (
        ("An output_min above output_max", {"output_min": high + 1.5}),
        ("An output_max below output_min", {"output_max": low - 1.5}),
        ("Setting both limits together, in the wrong order,", {"output_min": high, "output_max": low}),
        ("An output_min equal to output_max", {"output_min": high}),
        ("NaN as output_min", {"output_min": math.nan}),
        ("NaN as output_max", {"output_max": math.nan}),
    ):
        pid.store({"output_min": low, "output_max": high})
        result = pid.parameters.set_together(values)
        if result.successful:
            continue  # judged by other tests
        refused += 1
        expect_reason(about, result)
    if not refused:
        raise Wrong("Limits that are not in order must be refused with a reason: all were accepted.")


def ordered_limits(pid: PidNode, rng: random.Random) -> tuple[float, float]:
    """Two limits in order, which are set; raises Wrong when they cannot be."""
    low, high = -rng.randrange(5, 30) / 4, rng.randrange(5, 30) / 4
    pid.bench.hide(low, high)
    pid.store({"output_min": low, "output_max": high})
    got = pid.get()
    for name, value in (("output_min", low), ("output_max", high)):
        if got.get(name) != value:
            raise Wrong(
                f"It must be possible to set output_min and output_max when output_min is the smaller one: {name} "
                f"was not set.",
                f"{low}, {high}: {got}",
            )
    return low, high


@points(0.25, cell="pid-node")
@twice
def test_one_limit(pid: PidNode, controls: None, early: Early | None, rng: random.Random) -> None:
    """One limit, set alone, is accepted when it is in order with the stored value of the other."""
    low, high = -rng.randrange(80, 100) / 4, rng.randrange(80, 100) / 4
    pid.arrange(kp=1.0, output_min=low, output_max=high)
    about = "{}, set alone to a value {} the stored {},"
    pid.expect_set(about.format("output_min", "below", "output_max"), output_min=high - 2.5)
    pid.expect_set(about.format("output_max", "above", "output_min"), output_max=high - 1.5)
    pid.expect_set(about.format("output_min", "below", "output_max"), output_min=low)
    pid.expect_set(about.format("output_max", "above", "output_min"), output_max=low + 1.5)
    pid.expect_set("The value that output_max already has, set again,", output_max=low + 1.5)
    pid.expect_set("An output_max a little above the stored output_min,", output_max=low + JUST)
    if accepts_one(pid, {"kp": 1.5}):  # or else other tests judge it
        pid.expect_set("An output_max above the stored output_min, set together with kp,", output_max=high, kp=2.0)
        pid.expect_set("An output_min below the stored output_max, set together with kp,", kp=1.0, output_min=low + 1.5)
    if early and not early.one_limit.successful:
        given, value = early.given, between_limits(early.given)
        raise Wrong(
            f"In a node that was started with an output_min of {given['output_min']:g} and an output_max of "
            f"{given['output_max']:g}, an output_min of {value:g}, set alone, must be accepted: it is below the stored "
            f"output_max. It was {refusal(early.one_limit)}.",
            early,
        )


def expect_accepting(pid: PidNode, **values: float) -> None:
    """The node must accept one of these, set together or alone: who refuses all has not shown what must be refused."""
    if not accepts_one(pid, values):
        raise Wrong(
            "This is judged only in a node that accepts what it must accept: good values were refused, for "
            f"{' and '.join(values)}."
        )


def accepts_one(pid: PidNode, values: Mapping[str, float]) -> bool:
    """Return True if the node accepts these values, set together, or at least one of them alone."""
    answers = pid.store(values).values()  # empty when it accepts them together
    return not answers or any(answer.successful for answer in answers)


def is_refused(pid: PidNode, bad: Mapping[str, float]) -> bool:
    """Return True if the node refuses to set these together; False if it dies, which another test judges."""
    try:
        return not pid.parameters.set_together(bad).successful
    except Crashed:
        return False


@points(1, cell="pid-node")
@twice
def test_nan_limits(pid: PidNode, controls: None, rng: random.Random) -> None:
    """NaN as a limit is refused, set alone or together with others."""
    low, high = -rng.randrange(5, 30) / 4, rng.randrange(5, 30) / 4
    pid.arrange(kp=1.0, output_min=low, output_max=high)
    expect_accepting(pid, output_min=low, output_max=high)
    for name, other, value in (("output_min", "output_max", high + 1), ("output_max", "output_min", low - 1)):
        pid.expect_refusal(f"NaN as {name}", False, **{name: math.nan})
        pid.expect_refusal(f"NaN as {name}, set together with {other},", False, **{name: math.nan, other: value})
        for gain in RANGES:
            pid.expect_refusal(f"NaN as {name}, set together with {gain},", False, **{name: math.nan, gain: 2.0})
    pid.expect_refusal("NaN as both limits", False, output_min=math.nan, output_max=math.nan)


@points(0.25, cell="pid-node")
@twice
def test_limits_together(pid: PidNode, controls: None, rng: random.Random) -> None:
    """Both limits, set together, can be moved beyond the old ones."""
    pid.arrange(kp=1.0, output_min=-5.0, output_max=5.0)
    above, below = rng.randrange(60, 90) / 4, -rng.randrange(100, 140) / 4
    about = "Setting both limits together, in order and both {} the old ones,"
    pid.expect_set(about.format("above"), output_min=above, output_max=above + 2.5)
    pid.expect_set(about.format("below"), output_max=below + 2.5, output_min=below)
    pid.expect_set(f"{about.format('above')} with kp as well,", output_max=above + 2.5, kp=2.0, output_min=above)
    pid.expect_set(f"{about.format('below')} with kp as well,", kp=1.0, output_min=below, output_max=below + 2.5)
    gains = {"kp": 2.0, "ki": 1.0, "kd": 0.5}
    pid.expect_set(f"{about.format('above')} with all gains,", output_min=above, output_max=above + 2.5, **gains)
    pid.expect_set(f"{about.format('below')} with all gains,", **gains, output_min=below, output_max=below + 2.5)
    pid.expect_set("Setting both limits together, in order and far apart,", output_min=-FAR, output_max=FAR)


@points(5, cell="pid-node")
@twice
def test_all_or_nothing(pid: PidNode, early: Early | None, controls: None, rng: random.Random) -> None:
    """A refused set, of one parameter or of several, changes nothing at all."""
    if early and not early.lives:  # again in the second run: the mistake shows once
        early = meet_early(early.node)
    refused_at = refuse_a_kp(early) if early else None
    gains = {"kp": rng.randrange(10, 20) / 2, "ki": rng.randrange(4, 8) / 2}
    error = rng.randrange(5, 10) / 8

    def fill() -> Answer:  # with an integral, if the node has one
        begin_integral(pid, error, **gains)
        return send_often(pid, error)

    pid.arrange(**gains)
    for name, gain in gains.items():
        expect_accepting(pid, **{name: gain})
    movable = accepts_one(pid, {name: limit / 2 for name, limit in WIDE.items()})
    pid.arrange(**gains)
    last, refused = fill(), 0
    grows = pid.send(error).effort > last.effort
    last = pid.send(error)
    pid.parameters.set({"kd": 0.5})
    answer = pid.send(error)
    growth = gains["ki"] * error * (answer.came - last.sent)  # of the integral: the derivative of no change is 0
    steady = -ROUNDING <= answer.effort - last.effort <= growth + ROUNDING  # or else another test judges it
    if not steady:
        last = fill()
    less = {name: gain / 2 for name, gain in gains.items()}
    above = RANGES["kd"][1] + 1.5
    several = ({"output_min": 2.0, "output_max": 1.0}, {"kd": above}, {"output_max": -2e6})
    for values in (
        *(values for bad in several for values in (less | bad, bad | less)),
        *({name: high + 1.5} for name, (_, high) in RANGES.items()),
        *({name: low - 1.5} for name, (low, _) in RANGES.items()),
        *({"kp": gains["kp"] / 2, name: math.nan} for name in WIDE),
    ):
        before, last = pid.get(), pid.send(error)
        if not is_refused(pid, values):
            last = fill()  # judged by the other tests
            continue
        if not movable and WIDE.keys() & values.keys():
            continue  # it refuses every limit, and so shows nothing
        refused += 1
        about = (
            f"After a refused set of {', '.join(values)} the node must continue as if nothing had been asked, with "
            "the old gains and limits and with its integral"
        )
        expect_no_less(pid, error, last, about, grows and last.effort < WIDE["output_max"] / 2)
        if (after := pid.get()) != before:
            raise Wrong(
                f"A set of {', '.join(values)} was refused, and yet {changes(before, after)} changed: none of its "
                "parameters may.",
                f"{values}: {before} became {after}",
            )
        if steady:
            pid.parameters.set({"kd": 0.5})
            expect_no_less(
                pid,
                error,
                last,
                f"After a refused set of {', '.join(values)}, and then an accepted one of kd, nothing of the "
                "refused one may take effect",
            )
    if steady:
        expect_no_slope(pid, error, gains, several[0])
    expect_nothing_remembered(pid, rng)
    if refused:
        # Less than the sets before: what takes effect late may be one of theirs by now.
        expect_no_late_change(pid, fill, error, {name: gain / 8 for name, gain in gains.items()} | several[0])
        with on_wrong(pid.end):  # once more, from a start of its own: the mistake shows once
            expect_kp_counts(pid, error)
    if early and refused_at is not None:
        with on_wrong(early.node.end):
            expect_old_kp(early, refused_at)
    if not refused:
        raise Wrong(
            "A set of several parameters must be refused when one of its values is bad: "
            f"{'all were accepted' if movable else 'those of the limits are refused when they are good, too'}."
        )


@points(0.25, cell="pid-node")
@twice
def test_joint_name_is_read_only(pid: PidNode, controls: None, by_start: Mapping[str, Any], rng: random.Random) -> None:
    """joint_name cannot be set while the node runs."""
    if "joint_name" not in by_start:
        raise Wrong("The node must declare the parameter joint_name.")
    pid.expect_refusal("A new joint_name while the node runs", joint_name=rng.choice(["left_knee", "right_hip"]))


@points(0.5, cell="pid-node")
@twice
def test_launch_values(
    by_command_line: Overridden, by_file: Overridden, controls: None, by_start: Mapping[str, Any], early: Early | None
) -> None:
    """Values from the command line, and from a YAML file, win over the defaults."""
    for (node, values), where in (
        (by_command_line, "on the command line (--ros-args -p NAME:=VALUE)"),
        (by_file, "in a parameter file (--ros-args --params-file FILE)"),
    ):
        got = early.given if early and early.node is node else node.get()
        for name, value in values.items():
            if name in by_start and got.get(name) != value:
                raise Wrong(
                    f"The parameter {name} must have the value given {where}: it is {got.get(name)!r}.",
                    f"{values}, got {got}",
                )


@points(0.25, cell="pid-node")
@twice
def test_launch_values_are_used(pid: PidNode, by_command_line: Overridden, controls: None) -> None:
    """The effort is computed from the values given at launch."""
    node, _ = by_command_line
    works = working_parts(pid)
    node.start_fresh()
    given = node.get()
    kp, ki, kd = (given.get(name, 0.0) for name in RANGES)

    def expect(right: bool, name: str, detail: object) -> None:
        if not right:
            raise Wrong(
                f"From its start, the node must use the {name} given on the command line, which its parameter {name} "
                "has: the effort does not show it.",
                f"{given}: {detail}",
            )

    first, _ = node.send(STILL), node.send(STILL)
    if pid.gains_by_launch:
        expect(near(first.effort, kp * STILL, DECIMALS), "kp", first)
    time.sleep(0.05)
    later = node.send(STILL)
    clamped = not given.get("output_min", -math.inf) < first.effort < given.get("output_max", math.inf)
    if works["ki"] and ki and not clamped:
        expect(later.effort != first.effort, "ki", (first, later))
    time.sleep(SHORT)
    turned = node.send(-STILL)
    longest = turned.came - later.sent
    integral, slope = ki * STILL * longest, kd * 2 * STILL / longest
    if works["kd"] and slope > 4 * integral:  # not on a machine so busy that they cannot be told apart
        expect(abs(turned.effort - later.effort + 2 * kp * STILL) > 2 * integral, "kd", (later, turned))
    node.parameters.set({"ki": 0.0, "kd": 0.0})  # with kp alone, how busy the machine is makes no difference
    if not pid.gains_by_launch:
        node.send(STILL)  # a node may use a new gain one message late, which another test judges
        got, again = node.send(STILL), node.send(STILL)  # no slope, though it may still have another kd
        if got.effort == again.effort:  # or else it still has another ki, which other tests judge
            expect(near(got.effort, kp * STILL, DECIMALS), "kp", got)
    for name, error in (("output_max", HUGE), ("output_min", -HUGE)):
        if works[name] and name in given:
            expect(near(limited := node.send(error).effort, given[name]), name, limited)


def working_parts(pid: PidNode) -> dict[str, bool]:
    """Return which gains and limits have an effect while the node runs: only these are asked for at launch."""
    pid.arrange(ki=2.0)
    pid.send(STILL)
    time.sleep(0.02)
    moves = pid.send(STILL).effort != pid.send(STILL).effort
    found = {"ki": moves, "kd": has_slope(pid, STILL, kd=0.5, ki=LEAST if pid.takes(ki=LEAST) else 0.0)}
    pid.arrange(kp=10.0, output_min=-2.0, output_max=1.0)
    for name, error, limit in (("output_max", 1.0, 1.0), ("output_min", -1.0, -2.0)):
        pid.send(STILL)
        found[name] = pid.send(error).effort == limit
    return found


@points(0.25, cell="pid-node")
@twice
def test_nothing_else_starts_it_again(pid: PidNode, early: Early | None, controls: None, rng: random.Random) -> None:
    """Setting other parameters, or ki to the value that it has, leaves the integral as it is."""
    ki, error = rng.randrange(4, 16) / 2, rng.randrange(5, 10) / 8
    pid.parameters.set({"ki": ki})  # alone, and then together with others
    last = fill_integral(pid, error, ki=ki)
    pid.parameters.set({"kp": 0.5, "kd": 0.5, "output_min": -2e6, "output_max": 2e6})
    pid.parameters.set_together({"kp": 0.0, "kd": 0.0})
    expect_no_less(pid, error, last, "After kp, kd or a limit was set, the integral must continue from where it was")
    same = "After ki was set to the value that it already had, the integral must continue from where it was"
    pid.parameters.set({"ki": ki})
    expect_no_less(pid, error, last, same)
    pid.parameters.set_together({"kd": 0.5, "ki": ki})
    pid.send(error)  # how the slope goes on is judged by another test: it is 0 when the same error comes again
    expect_no_less(pid, error, last, same)
    pid.parameters.set({"kd": 0.0})
    pid.send(error)  # a node may use a new gain one message late
    try:
        for simulated in (True, False):
            last = pid.send(error)
            pid.parameters.set({"use_sim_time": simulated})
            answer = pid.send(error)
            if 0 < answer.effort < last.effort - ROUNDING:  # below 0 by another clock, which another test judges
                raise Wrong(
                    "After use_sim_time was set, the integral must continue from where it was: the same error again "
                    f"was answered with {answer.effort:.3g}, and before it with {last.effort:.3g}.",
                    f"{simulated}: {last} then {answer}",
                )
    finally:
        pid.parameters.set({"use_sim_time": False})

    if early and not early.lives:  # again in the second run: the mistake shows once
        early = meet_early(early.node)
    if early and not pid.integral_waits:  # its efforts were clamped
        with on_wrong(early.node.end):
            expect_no_new_start(early)


def expect_no_new_start(early: Early) -> None:
    """The first set, of other parameters, and a set of ki to the value that was given at launch leave the integral."""
    node, ki = early.node, early.given["ki"]
    if not early.last.effort > early.answer.effort:
        return  # the values at launch are not used, which another test judges
    least = ki * STILL * (early.filled.sent - early.begun.came)
    if early.answer.effort * LENIENT < least:
        raise Wrong(
            "After kp, kd and the limits were set for the first time, the integral must continue from where it was: "
            f"{least:.3g} or more was right, with the ki given at launch, and it was {early.answer.effort:.3g}.",
            early,
        )
    last = node.send(STILL)
    node.parameters.set({"ki": ki})
    expect_no_less(
        node,
        STILL,
        last,
        "After ki was set to the value that it was given at launch, the integral must continue from where it was",
    )
