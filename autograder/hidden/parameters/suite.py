"""What the task asks of the PID node, as a conversation over its parameters and its two topics.

The node measures time steps itself, in real time.  What depends on them is judged by bounds: the node got an error
after the grader had sent it and before its answer came, however busy the machine was.
Points add up to 20.
"""

import math
import random
import time
from collections.abc import Mapping
from typing import Any

from autograder.hidden.parameters.conversation import DEFAULTS, RANGES, ROUNDING, Answer, PidNode, between
from autograder.suitekit import Wrong, points, twice
from course.waiting import wait_until

EXTRA = 0.2  # s in which a second answer to one error would come
INSTANT = 1e-6  # s, the shortest time between two errors that a node can have measured
ALMOST_NOTHING = 1e-9  # of an error: it adds nothing to the integral, but it is a message to measure time from

Overridden = tuple[PidNode, Mapping[str, Any]]  # a node with the values that it was started with


@points(1, cell="pid-node")
def test_defaults(by_start: Mapping[str, Any]) -> None:
    """The parameters are declared, with their default values."""
    for name, value in DEFAULTS.items():
        if name not in by_start:
            raise Wrong(f"The node must declare the parameter {name}.", by_start)
        if by_start[name] != value or type(by_start[name]) is not type(value):
            raise Wrong(f"The default of the parameter {name} must be {value!r}.", by_start)


@points(1, cell="pid-node")
def test_descriptors(pid: PidNode) -> None:
    """The ranges of the gains, and that joint_name is read-only, can be read from their descriptors."""
    for name, (low, high) in RANGES.items():
        ranges = pid.parameters.describe(name).floating_point_range
        if [(limits.from_value, limits.to_value) for limits in ranges] != [(low, high)]:
            raise Wrong(f"The descriptor of {name} must have the range from {low} to {high}.", ranges)
    if not pid.parameters.describe("joint_name").read_only:
        raise Wrong("The descriptor of joint_name must set read_only to True.")


@points(1, cell="pid-node")
@twice
def test_first_message(pid: PidNode, rng: random.Random) -> None:
    """The first effort has no integral and no derivative part, because no time step comes before it."""
    pid.start_fresh()
    kp, error = rng.randrange(5, 20) / 4, rng.choice([-1, 1]) * rng.randrange(5, 14) / 8
    pid.arrange(kp=kp, ki=float(rng.randrange(8, 40)), kd=rng.randrange(8, 40) / 4)
    pid.expect_effort(
        error,
        kp * error,
        "The first error must be answered with the proportional part alone: there is no earlier message to measure "
        "a time step from",
    )


@points(1, cell="pid-node")
@twice
def test_proportional(pid: PidNode, rng: random.Random) -> None:
    """With kp alone the effort is kp × error, one for each error."""
    kp = rng.randrange(9, 30) / 8
    pid.arrange(kp=kp)
    before, errors = len(pid.efforts.heard), [sign * rng.randrange(5, 20) / 8 for sign in (1, -1, -1, 1)]
    errors += [errors[-1], 0.0, 0.0]  # an effort that does not change is published too
    for error in errors:
        pid.expect_effort(error, kp * error, "With kp alone, the effort must be kp × error")
    wait_until(lambda: len(pid.efforts.heard) > before + len(errors), EXTRA)
    if len(pid.efforts.heard) != before + len(errors):
        raise Wrong(
            "Each error must be answered with exactly one effort, and nothing may be published without an error.",
            f"{len(errors)} errors, {len(pid.efforts.heard) - before} efforts",
        )


@points(1, cell="pid-node")
@twice
def test_new_gain(pid: PidNode, rng: random.Random) -> None:
    """A new gain is used from the very next message on."""
    error = rng.randrange(5, 15) / 8
    for kp in rng.sample(range(10, 40), 3):
        pid.arrange(kp=kp / 8)
        pid.expect_effort(error, kp / 8 * error, "After kp was set, the very next effort must use the new kp")


@points(1, cell="pid-node")
@twice
def test_clamped(pid: PidNode, rng: random.Random) -> None:
    """The effort stays within output_min and output_max, as they are at that moment."""
    kp = float(rng.randrange(10, 40))
    for _ in range(2):
        low, high = -rng.randrange(10, 60) / 4, rng.randrange(10, 60) / 4
        pid.arrange(kp=kp, output_min=low, output_max=high)
        pid.expect_effort(rng.uniform(5, 9), high, "An effort above output_max must become the current output_max")
        pid.expect_effort(rng.uniform(-9, -5), low, "An effort below output_min must become the current output_min")
        error = rng.choice([-1, 1]) / 64
        pid.expect_effort(error, kp * error, "An effort between output_min and output_max must stay as it is")


@points(1, cell="pid-node")
@twice
def test_integral(pid: PidNode, rng: random.Random) -> None:
    """The integral part grows by ki × error × the seconds since the message before."""
    ki, error = rng.randrange(8, 32) / 4, rng.choice([-1, 1]) * rng.randrange(5, 10) / 8
    last = begin_integral(pid, error, ki=ki)
    for pause in (0.25, 0.05, rng.uniform(0.1, 0.15)):
        last, fault = send_after(pid, pause, error, ki, last)
        if fault:
            raise Wrong(
                "With ki alone, the effort must grow from one message to the next by ki × error × the seconds between "
                "the two.",
                fault,
            )


@points(1, cell="pid-node")
@twice
def test_monotonic_clock(pid: PidNode, rng: random.Random) -> None:
    """The seconds are those of time.monotonic(), also while use_sim_time is set."""
    ki, error = rng.randrange(8, 32) / 4, rng.choice([-1, 1]) * rng.randrange(5, 10) / 8
    last = begin_integral(pid, error, ki=ki)
    _, fault = send_after(pid, 0.1, error, ki, last)
    if fault:
        return  # whatever the clock: judged by the other tests
    pid.parameters.set({"use_sim_time": True})
    _, fault = send_after(pid, 0.1, error, ki, pid.send(error))
    pid.parameters.set({"use_sim_time": False})
    if fault:
        raise Wrong(
            "While use_sim_time is set, the integral must grow as always: the seconds are those of time.monotonic(), "
            "not those of the node's clock.",
            fault,
        )


def send_after(pid: PidNode, pause: float, error: float, ki: float, last: Answer) -> tuple[Answer, str]:
    """The answer to the same error after a pause (s), and what is wrong with how the effort has grown, or ''."""
    time.sleep(pause)
    answer = pid.send(error)
    grown = answer.effort - last.effort
    right = between(grown, expected := tuple(ki * error * step for step in steps(last, answer)))
    return answer, "" if right else f"{pause} s: expected {expected}, got {grown}"


@points(1, cell="pid-node")
@twice
def test_derivative(pid: PidNode, rng: random.Random) -> None:
    """The derivative part is kd × the change of the error per second."""
    kd, errors = rng.randrange(4, 8) / 16, [rng.uniform(-0.5, -0.2), rng.uniform(0.2, 0.5), rng.uniform(-0.2, 0)]
    pid.arrange(kd=kd)
    last, before = pid.send(errors[0]), errors[0]
    for error, pause in zip([*errors[1:], errors[-1]], (0.15, 0.06, 0.1), strict=True):
        time.sleep(pause)
        answer = pid.send(error)
        if not between(answer.effort, expected := tuple(kd * (error - before) / step for step in steps(last, answer))):
            raise Wrong(
                "With kd alone, the effort must be kd × (error − error before) / the seconds between the two.",
                f"{before} to {error}: expected {expected}, got {answer.effort}",
            )
        last, before = answer, error


@points(1, cell="pid-node")
@twice
def test_ki_starts_the_integral_again(pid: PidNode, rng: random.Random) -> None:
    """When ki is set to another value, the integral starts again from zero."""
    ki, error = rng.randrange(8, 32) / 4, rng.randrange(5, 10) / 8
    last = fill_integral(pid, error, ki=ki)
    pid.arrange(ki=ki + 1.5)
    answer = pid.send(error)
    # Whether the time step since the message before still counts is left open.
    most = (ki + 1.5) * max(last.effort / ki / 2, error * (answer.came - last.sent))
    if not 0.0 <= answer.effort <= most:
        raise Wrong(
            "After ki was set to another value, the integral must start again from zero.", f"{last} then {answer}"
        )


@points(1, cell="pid-node")
@twice
def test_nothing_else_starts_it_again(pid: PidNode, rng: random.Random) -> None:
    """Setting other parameters, or ki to the value that it has, leaves the integral as it is."""
    ki, error = rng.randrange(8, 32) / 4, rng.randrange(5, 10) / 8
    pid.parameters.set({"ki": ki})  # alone, and then together with others
    last = fill_integral(pid, error, ki=ki)
    pid.parameters.set({"kp": 0.5, "kd": 0.25, "output_min": -2e6, "output_max": 2e6})
    pid.parameters.set_together({"kp": 0.0, "kd": 0.0})
    expect_no_less(pid, error, last, "After kp, kd or a limit was set, the integral must continue from where it was")
    same = "After ki was set to the value that it already had, the integral must continue from where it was"
    pid.parameters.set({"ki": ki})
    expect_no_less(pid, error, last, same)
    pid.parameters.set_together({"kd": 0.25, "ki": ki})
    expect_no_less(pid, error, last, same)


def begin_integral(pid: PidNode, error: float, **gains: float) -> Answer:
    """The first answer to an error, whose time step starts at a message just before it."""
    pid.arrange(**gains)
    pid.send(error * ALMOST_NOTHING)
    return pid.send(error)


def fill_integral(pid: PidNode, error: float, **gains: float) -> Answer:
    """The last of several answers to a positive error, while the integral grows; raises Wrong when it does not."""
    first = begin_integral(pid, error, **gains)
    for _ in range(5):
        time.sleep(0.05)
        pid.send(error)
    last = pid.send(error)
    if not last.effort > first.effort:
        raise Wrong(
            "With ki above 0 and the same positive error again and again, the effort must grow: without an integral "
            "part it cannot be tested when that starts again.",
            f"ki {gains['ki']}: {first} then {last}",
        )
    return last


def expect_no_less(pid: PidNode, error: float, last: Answer, about: str) -> None:
    """The same positive error again must be answered with no less effort than last: the integral is still there."""
    answer = pid.send(error)
    if not answer.effort >= last.effort - ROUNDING:
        raise Wrong(f"{about}.", f"{last} then {answer}")


def steps(last: Answer, answer: Answer) -> tuple[float, float]:
    """The shortest and the longest time (s) that the node can have measured between two errors."""
    return max(INSTANT, answer.sent - last.came), answer.came - last.sent


@points(1, cell="pid-node")
@twice
def test_out_of_range(pid: PidNode, rng: random.Random) -> None:
    """A gain outside its range is refused with a reason, and changes nothing."""
    pid.arrange(**{name: (low + high) / 4 for name, (low, high) in RANGES.items()})
    for name, (low, high) in RANGES.items():
        for value in (high + rng.randrange(1, 80) / 8, low - rng.randrange(1, 80) / 8):
            pid.bench.hide(value)
            pid.expect_refusal(f"A {name} {'above' if value > high else 'below'} its range", **{name: value})


@points(1, cell="pid-node")
@twice
def test_limits_in_order(pid: PidNode, rng: random.Random) -> None:
    """An output_min that is not below output_max is refused with a reason, set alone or together with others."""
    low, high = -rng.randrange(5, 30) / 4, rng.randrange(5, 30) / 4
    pid.arrange(kp=1.0, output_min=low, output_max=high)
    if (got := pid.get()).get("output_min") != low or got.get("output_max") != high:
        raise Wrong(
            "It must be possible to set output_min and output_max when output_min is the smaller one.",
            f"{low}, {high}: {got}",
        )
    pid.expect_refusal("An output_min above output_max", output_min=high + 1.5)
    pid.expect_refusal("An output_max below output_min", output_max=low - 1.5)
    pid.expect_refusal("An output_min equal to output_max", output_min=high)
    pid.expect_refusal("An output_max equal to output_min", output_max=low)
    pid.expect_refusal("Setting both limits together, in the wrong order,", output_min=high, output_max=low)
    pid.expect_refusal(
        "Setting both limits together, in the wrong order,", output_max=high + 2.5, output_min=high + 4.0
    )
    pid.expect_refusal("Setting both limits together, to the same value,", output_min=low + 1, output_max=low + 1)


@points(1, cell="pid-node")
@twice
def test_one_limit(pid: PidNode, rng: random.Random) -> None:
    """One limit, set alone, is accepted when it is in order with the stored value of the other."""
    low, high = -rng.randrange(80, 100) / 4, rng.randrange(80, 100) / 4
    pid.arrange(kp=1.0, output_min=low, output_max=high)
    about = "{}, set alone to a value {} the stored {},"
    pid.expect_set(about.format("output_min", "below", "output_max"), output_min=high - 2.5)
    pid.expect_set(about.format("output_max", "above", "output_min"), output_max=high - 1.5)
    pid.expect_set(about.format("output_min", "below", "output_max"), output_min=low)
    pid.expect_set(about.format("output_max", "above", "output_min"), output_max=low + 1.5)
    # A refused limit must not be remembered.  Whether it is refused is judged by another test.
    about += " also after another value was refused,"
    for bad, good, order in (
        ({"output_min": high + 30.0}, {"output_max": high - 1.0}, ("output_max", "above", "output_min")),
        ({"output_max": low - 30.0}, {"output_min": low + 1.0}, ("output_min", "below", "output_max")),
    ):
        pid.arrange(kp=1.0, output_min=low, output_max=high)
        if not pid.parameters.set(bad)[0].successful:
            pid.expect_set(about.format(*order), **good)


@points(1, cell="pid-node")
@twice
def test_nan_limits(pid: PidNode, rng: random.Random) -> None:
    """NaN as a limit is refused with a reason, set alone or together with others."""
    low, high = -rng.randrange(5, 30) / 4, rng.randrange(5, 30) / 4
    pid.arrange(kp=1.0, output_min=low, output_max=high)
    ordinary = pid.parameters.set({"output_min": high + 1.5})[0]
    reason = bool(ordinary.reason.strip())  # a node that never gives one loses the points of limits in the wrong order
    pid.arrange(kp=1.0, output_min=low, output_max=high)
    for name, other, value in (("output_min", "output_max", high + 1), ("output_max", "output_min", low - 1)):
        pid.expect_refusal(f"NaN as {name}", reason, **{name: math.nan})
        pid.expect_refusal(f"NaN as {name}, set together with {other},", reason, **{name: math.nan, other: value})
        pid.expect_refusal(f"NaN as {name}, set together with kp,", reason, **{name: math.nan, "kp": 2.0})
    pid.expect_refusal("NaN as both limits", reason, output_min=math.nan, output_max=math.nan)


@points(1, cell="pid-node")
@twice
def test_limits_together(pid: PidNode, rng: random.Random) -> None:
    """Both limits, set together, can be moved beyond the old ones."""
    pid.arrange(kp=1.0, output_min=-5.0, output_max=5.0)
    above, below = rng.randrange(60, 90) / 4, -rng.randrange(100, 140) / 4
    about = "Setting both limits together, in order and both {} the old ones,"
    pid.expect_set(about.format("above"), output_min=above, output_max=above + 2.5)
    pid.expect_set(about.format("below"), output_max=below + 2.5, output_min=below)


@points(1, cell="pid-node")
@twice
def test_all_or_nothing(pid: PidNode, rng: random.Random) -> None:
    """Setting several parameters together, one of them to a bad value, changes nothing at all."""
    gains = {"kp": rng.randrange(9, 30) / 8, "ki": rng.randrange(8, 32) / 4}
    error = rng.randrange(5, 10) / 8
    last, refused = fill_integral(pid, error, **gains), 0
    pid.parameters.set({"kd": 0.25})
    steady = pid.send(error).effort >= last.effort - ROUNDING  # or else another test judges it
    if not steady:
        last = fill_integral(pid, error, **gains)
    less = {name: gain / 2 for name, gain in gains.items()}
    for bad in ({"output_min": 2.0, "output_max": 1.0}, {"kd": RANGES["kd"][1] + 1.5}, {"output_max": -2e6}):
        for values in (less | bad, bad | less):
            before, result = pid.get(), pid.parameters.set_together(values)
            if result.successful:
                pid.arrange(**gains)  # judged by the other tests
                last = fill_integral(pid, error, **gains)
                continue
            refused += 1
            if (after := pid.get()) != before:
                raise Wrong(
                    "When several parameters are set together and refused, none of them may change.",
                    f"{values}: {before} became {after}",
                )
            expect_no_less(
                pid,
                error,
                last,
                "After a refusal to set several parameters together, the node must continue as if nothing had been "
                "asked: with the old gains and with its integral",
            )
            if steady:
                pid.parameters.set({"kd": 0.25})
                expect_no_less(
                    pid,
                    error,
                    last,
                    "After a refused set and then an accepted one of kd, nothing of the refused one may take effect",
                )
    if not refused:
        raise Wrong("Setting several parameters together must be refused when one of the values is bad.")


@points(1, cell="pid-node")
@twice
def test_joint_name_is_read_only(pid: PidNode, by_start: Mapping[str, Any], rng: random.Random) -> None:
    """joint_name cannot be set while the node runs."""
    if "joint_name" not in by_start:
        raise Wrong("The node must declare the parameter joint_name.")
    pid.expect_refusal("A new joint_name while the node runs", joint_name=rng.choice(["left_knee", "right_hip"]))


@points(1, cell="pid-node")
@twice
def test_command_line(by_command_line: Overridden, rng: random.Random) -> None:
    """Values from the command line win over the defaults."""
    expect_overridden(*by_command_line, rng, "on the command line (--ros-args -p NAME:=VALUE)")


@points(1, cell="pid-node")
@twice
def test_parameter_file(by_file: Overridden, rng: random.Random) -> None:
    """Values from a YAML file win over the defaults."""
    expect_overridden(*by_file, rng, "in a parameter file (--ros-args --params-file FILE)")


def expect_overridden(node: PidNode, values: Mapping[str, Any], rng: random.Random, where: str) -> None:
    """The parameters must have these values from the start, and the node must use them."""
    node.start_fresh()
    got = node.get()
    for name, value in values.items():
        if got.get(name) != value:
            raise Wrong(f"The parameter {name} must have the value given {where}.", f"{values}, got {got}")
    node.parameters.set({"ki": 0.0})
    node.parameters.set({"kd": 0.0})
    error = rng.choice([-1, 1]) / 64
    node.expect_effort(error, values["kp"] * error, f"The effort must be computed from the values given {where}")
