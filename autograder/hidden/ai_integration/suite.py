"""Tests of the wall follower: its decisions, how the node reads a scan, its timing and its drives.

The agent is asked by itself, without a node; the node is judged by what it gives to an agent of the grader's, so that
a mistake in one costs nothing in the other.  What the node makes of a scan is judged by a scanner that it reads right
(the fixture `eye`), but for what a test is about.  Everything with a clock is played in simulated time, in which a busy
machine changes nothing.  A node that keeps its own time by the wall clock does not show 10 Hz there, and is judged in
real time instead; and in real time as well a node for which simulated time must wait.  Points add up to 20.
"""

import contextlib
import math
import random
import time
from collections.abc import Callable, Mapping, Sequence

import pytest
from sensor_msgs.msg import LaserScan

from autograder.errors import Fault
from autograder.hidden.ai_integration.conversation import (
    AGENT,
    BOTH,
    LONG_ENOUGH,
    NEXT,
    NODE,
    OPPOSITE,
    PERIOD,
    STILL,
    STOOD_IN,
    STOP,
    STRANGE,
    Agent,
    Command,
    Eye,
    Follower,
    expect_numbers_each_time,
    is_of_the_agent,
    said,
)
from autograder.hidden.ai_integration.rooms import ALONG, LASERS, SECONDS, SHARE, can_be_driven, decide, draw, look_back
from autograder.hidden.ai_integration.scanner import INF, MAX, MIN, NAN, OUTSIDE, PLAIN, Scanner
from autograder.suitekit import Alive, Wrong, on_wrong, points, twice
from course.world import Laser

BESIDE = Scanner(360, 90.0, 1.0)
EDGES = ((-25.0, -40.0), (25.0, -80.0))  # degrees: an edge of the front and one of the right
BEHIND = (100.0, 170.0)  # degrees: behind it on the left, far from both sectors
MORE_THAN_MAX = MAX + 5.0  # m
A_MILLIMETRE = 0.01  # m/s and rad/s: more than the difference that it makes to a decision
MANY = 3600  # beams, ten in a degree
SOME = 0.5  # the share of a sector's beams that have a special value

LONG = 150  # decisions in a row: a robot makes so many in 15 s
A_WHILE = 0.35  # s, in which a robot makes three decisions or four

FIRST_TICKS = 6  # before the first scan
MORE_TICKS = 76  # before the first scan: with the FIRST_TICKS, more than 8 s of simulated time
LOOKS = Command(0.2, 0.4)  # the speeds of the curve by which a robot looks for a wall, but for their signs
RUNS_ON = 5.0  # s after its start for which a node is seen to run without a scan: since the first test began
GOES_ON = 3.0  # s in which as many commands come after these, too: usually the next ticks bring them
FIRST_COMMANDS = 3  # that must come in them at least: a node's timer may begin with any of the ticks

RATE = (9.0, 11.0)  # Hz that pass as 10 Hz
RATE_SECONDS = 3.0  # of simulated time, in which the rate is measured
RATE_STEPS = {5: 0.05, 40: 0.025, 0: PERIOD}  # s of simulated time between two ticks while scans come at so many Hz
SILENCE = 8.0  # s of simulated time without scans, after which commands must still come
DRIVEN = 0.8  # the share of commands that must be the agent's: the first ones may be older

PAUSES = (1.5, 7.0)  # s of simulated time without scans
PAUSE_COMMANDS = 5  # that must come in each second of it at least, of 10
FRESH_COMMANDS = (3, 5)  # that must still be the agent's, and may: a scan's age is 0.3 or 0.4 s, and 0.5 or 0.6 s
TOO_OLD = 0.65  # s of simulated time: 0.5 s, a period of the timer, and how much later a scan may seem to have come
EARLIEST_STOP = 0.3  # s of real time: 0.5 s, but for a period of the timer, and a little for a busy machine
LATEST_STOP = 0.75  # s of real time: 0.5 s, two periods of a timer of 10 Hz, and a little for a busy machine
LONGEST_GAP = 0.35  # s of real time between two commands: more than a period of the timer, also on a busy machine
SILENT_FROM = 2.0  # s after the last scan, of 3 in which commands must come
RULES = 3  # of the agent
TRIED_ROOMS = 2  # rooms in which the grader's own follower drives well, and the node fails, until it has failed


@points(1, cell="wall-agent")
def test_agent_needs_no_ros(agent: Agent) -> None:
    """WallAgent of wall_agent.py returns its decision as a dict with two floats, where ROS 2 is not installed."""
    if agent.imports_course:
        raise Wrong(f"{AGENT} must not import course: a robot has ROS 2 and NumPy, and no course.{in_its_place(agent)}")
    answers = agent.ask((3.0, 0.3), (3.0, 0.9), (0.2, 0.6), ros=False)
    if not all(math.isfinite(speed) for answer in answers for speed in answer) or len({*answers}) == 1:
        raise Wrong(
            "Without ROS 2, decide_action must return two speeds that depend on the distances; for three very "
            f"different ones it said {'; '.join(map(said, answers))}.",
            answers,
        )
    if agent.of_ros:
        raise Wrong(
            f"wall_agent.py must import nothing of ROS, and it tried to import {agent.of_ros}. Without ROS 2 it "
            "decides all the same; leave the import out.",
            answers,
        )
    if agent.no_floats:
        raise Wrong(
            "The two speeds must be floats (`0.0`, not `0`), because a Twist takes nothing else: decide_action "
            f"returned {agent.no_floats}.",
            answers,
        )


def in_its_place(agent: Agent) -> str:
    """Return a sentence on the other tests of an agent that imports course."""
    try:
        agent.ask((3.0, 0.6))
    except Fault as fault:
        needed = "No module named 'course'" in fault.message
        return " (It cannot decide without what it imports from there, so other tests fail, too.)" if needed else ""
    return STOOD_IN


@points(1, cell="wall-agent")
def test_wall_ahead(agent: Agent, rng: random.Random) -> None:
    """It turns left on the spot at a wall ahead, wherever else a wall is."""
    about = "With a wall ahead nearer than 0.5 m, and {}"
    agent.expect(
        *case(rng.uniform(0.2, 0.45), rng.uniform(0.3, 0.5), about.format("one near on the right")),
        *case(rng.uniform(0.2, 0.45), 8.0, about.format("none near on the right")),
        *case(rng.uniform(0.2, 0.45), rng.uniform(1.5, 3.0), about.format("one far away on the right")),
        *case(rng.uniform(0.46, 0.499), rng.uniform(0.5, 0.7), about.format("one on the right")),
        *case(0.0, rng.uniform(0.7, 0.9), about.format("the robot touching it")),
        *case(rng.uniform(0.2, 0.45), INF, about.format("nothing on the right")),
        *case(0.499, rng.uniform(0.5, 0.7), about.format("one on the right")),
    )


@points(1, cell="wall-agent")
def test_looks_for_a_wall(agent: Agent, rng: random.Random) -> None:
    """Without a wall on the right it drives a curve to the right."""
    about = "With nothing ahead, and {}"
    agent.expect(
        *case(INF, INF, about.format("nothing on the right")),
        *case(rng.uniform(2.0, 4.0), rng.uniform(1.3, 2.0), about.format("a wall on the right, farther than 1.2 m")),
        *case(rng.uniform(2.0, 4.0), rng.uniform(1.21, 1.3), about.format("a wall on the right, farther than 1.2 m")),
        *case(rng.uniform(0.6, 0.9), rng.uniform(4.0, 8.0), "With a wall ahead farther than 0.5 m, and none right"),
        *case(rng.uniform(2.0, 4.0), INF, about.format("nothing on the right, again")),
        *case(rng.uniform(2.0, 4.0), 1.201, about.format("a wall on the right, farther than 1.2 m")),
    )


@points(2, cell="wall-agent")
def test_keeps_its_distance(agent: Agent, rng: random.Random) -> None:
    """It steers towards 0.6 m from the wall, the more the farther it is from that, and at most by 0.5 rad/s."""
    distances = [rng.uniform(*span) for span in ((0.3, 0.45), (0.45, 0.59), (0.61, 0.75), (0.75, 0.92))]
    beside = [0.6 - rng.uniform(0.002, 0.008), 0.6 + rng.uniform(0.002, 0.008)]  # the least error is steered against
    hardly = [rng.uniform(0.27, 0.297), rng.uniform(0.903, 0.93)]  # near the limit of what it may steer
    sharp = [rng.uniform(0.05, 0.25), rng.uniform(0.96, 1.15), rng.uniform(1.16, 1.195), 0.0]
    rng.shuffle(distances)
    agent.expect(
        *(
            one
            for right in [*distances, *beside, *hardly]
            for one in case(8.0, right, "With nothing near ahead, and a wall near 0.6 m right")
        ),
        *(one for right in sharp for one in case(2.0, right, "With a wall on the right, very near or nearly lost")),
        *case(rng.uniform(0.505, 0.54), 0.5, "With a wall ahead farther than 0.5 m, and one on the right"),
        *case(rng.uniform(0.55, 0.9), rng.choice(sharp), "With a wall ahead farther than 0.5 m, and one on the right"),
        *case(INF, rng.uniform(0.65, 0.75), "With nothing ahead, and a wall near 0.6 m right"),
    )


@points(1, cell="wall-agent")
def test_thresholds(agent: Agent, patient: Agent, rng: random.Random) -> None:
    """Exactly 0.5 m ahead is not near, exactly 1.2 m on the right is not lost; no decision depends on earlier ones."""
    near, beside, lost, far = (rng.uniform(*span) for span in ((0.2, 0.28), (0.5, 0.8), (2.0, 4.0), (2.0, 4.0)))
    asked = [(near, beside), (0.5, beside), (0.501, beside), (0.5, lost), (0.501, lost)]
    asked += [(far, lost), (far, 1.2), (far, 1.199), (0.5, 1.2), (0.501, 1.199)]
    asked += [(0.499, beside), (far, 1.201)]
    # A little on either side of each threshold after every rule: a little nearer than lost (7) and a little beyond near
    # (2) after another rule; a little near (10) and a little lost (11) also after their own, which may hold on to them.
    others = [0, 7, 11, 5, 2, 0, 10, 5, 11, 5, 10]
    rest = [number for number in range(len(asked)) if number not in others]
    again = [*others, *rng.sample(rest, len(rest))]
    again += (kept := [0, 5, 7])  # one decision of each rule, for a long time
    answers = agent.ask(*asked, *(asked[number] for number in again), last=len(kept), times=LONG, pause=A_WHILE)
    turns, at_half, beyond_half, at_half_lost, beyond_half_lost = answers[:5]
    searches, at_lost, before_lost, at_both, beyond_both = answers[5:10]
    # A threshold that makes no difference is judged by another test.
    sees_ahead, sees_right = not is_close(turns, beyond_half), not is_close(searches, before_lost)
    if not sees_ahead and not sees_right:
        raise Wrong(
            "The decision must change at 0.5 m ahead and at 1.2 m on the right: on both sides of either it said "
            f"{said(turns)}.",
            answers,
        )
    if sees_ahead and not (is_close(at_half, beyond_half) and is_close(at_half_lost, beyond_half_lost)):
        at = at_half if not is_close(at_half, beyond_half) else at_half_lost
        beyond = beyond_half if at is at_half else beyond_half_lost
        raise Wrong(
            "Exactly 0.5 m ahead is not nearer than 0.5 m: the agent must decide as it does a little farther away, and "
            f"not turn on the spot. It said {said(at)}, and a little farther away {said(beyond)}.",
            answers,
        )
    if sees_right and not is_close(at_lost, before_lost):
        raise Wrong(
            "Exactly 1.2 m on the right is not farther than 1.2 m: the agent must decide as it does a little nearer, "
            f"and not look for a wall. It said {said(at_lost)}, and a little nearer {said(before_lost)}.",
            answers,
        )
    if sees_ahead and sees_right and not is_close(at_both, beyond_both):
        raise Wrong(
            "With exactly 0.5 m ahead and exactly 1.2 m on the right, the agent must follow the wall; it said "
            f"{said(at_both)}.",
            answers,
        )
    for count, (number, answer) in enumerate(zip(again, answers[len(asked) :], strict=True)):
        if not is_close(answer, answers[number]):
            when = (
                "other decisions"
                if count < len(again) - len(kept)
                else f"many decisions, the last one {A_WHILE} s before,"
            )
            raise Wrong(
                "The same two distances must lead to the same decision, whatever was decided before: first it said "
                f"{said(answers[number])}, and after {when} {said(answer)}.",
                answers,
            )
    for decided in patient.finish_long():
        first, answer = decided[0], next((one for one in decided if not is_close(one, decided[0])), decided[0])
        if answer != first:
            raise Wrong(
                "The same two distances must lead to the same decision, however often: asked for them again and again "
                f"for {LONG_ENOUGH:g} s, the agent said {said(first)} at first, and later {said(answer)}.",
                decided,
            )


def is_close(one: Command, other: Command) -> bool:
    """Return True if two decisions are the same, except for the effect of a millimetre."""
    return math.dist(one, other) < A_MILLIMETRE


def case(front: float, right: float, about: str) -> list[tuple[float, float, Command, str]]:
    """These distances (m), rounded, with the right decision."""
    front, right = round(front, 3), round(right, 3)
    return [(front, right, Command(*decide(front, right)), about)]


@points(0.5, cell="wall-follower")
@twice
def test_stands_before_the_first_scan(follower: Follower, rng: random.Random) -> None:
    """Before the first scan it commands the robot to stand still, and then what the agent decides."""
    follower.start_fresh()

    def wait(limit: float, alive: Alive) -> list[Command] | None:
        commands = [command for _ in range(FIRST_TICKS) for command in follower.tick()]
        return commands if alive() else None

    def go_on(limit: float, alive: Alive) -> list[Command] | None:
        commands: list[Command] = []
        end = time.monotonic() + follower.allow(GOES_ON)  # a node that keeps its own time may need some of it
        while alive() and len(commands) < FIRST_COMMANDS and time.monotonic() < end:
            commands += follower.tick()
        return commands if alive() else None

    with on_wrong(follower.renew):  # once more, from a start of its own: the time before the first scan is over
        commands = follower.ask(wait, "what came before the first scan")
        must = "Before the first scan, a zero Twist must be published ten times a second"
        if len(commands) < FIRST_COMMANDS:
            raise Wrong(f"{must}: in {FIRST_TICKS * PERIOD:g} s, {len(commands) or 'nothing'} came.", commands)
        commands += follower.simulate(MORE_TICKS * PERIOD, PERIOD, lambda tick: None)
        later = follower.ask(go_on, "what came later, before the first scan")
        commands += later
        moving = [command for command in commands if command != STOP]
        if any(is_of_the_agent(command) and command != LOOKS for command in moving):
            raise Wrong(f"{must}: the node asked the agent, and published what that decided.", commands)
        if moving:
            raise Wrong(f"{must}: the robot was told to move, without a scan.", commands)
        if len(later) < FIRST_COMMANDS:  # how many there are each second, another test judges
            raise Wrong(
                f"{must}, until a scan comes: more than {MORE_TICKS * PERIOD:.0f} s after the start, "
                f"{len(later) or 'nothing'} came.",
                commands,
            )
    follower.expect_driving(seen(rng), "After the first scan")


@points(1, cell="wall-follower")
@twice
def test_asks_its_agent(follower: Follower, rng: random.Random) -> None:
    """The node asks one WallAgent of wall_agent.py, and publishes its decisions unchanged."""
    front, right = some_distance(rng), some_distance(rng)
    follower.expect_asks_its_agent(PLAIN.flat(rng, front=front, right=right), front, right)
    reads = follower.reads(PLAIN, Eye(PLAIN, BOTH), "strange")  # or else other tests judge it
    follower.expect_leaves_it_as_it_is(PLAIN.flat(rng, front=STRANGE, right=some_distance(rng)), reads)
    follower.expect_leaves_the_opposite(PLAIN.flat(rng, front=OPPOSITE, right=some_distance(rng)), reads)


@points(1, cell="wall-follower")
@twice
def test_sectors(follower: Follower, eye: Eye, rng: random.Random) -> None:
    """Front is from -25 to 25 degrees and right from -80 to -40, and the nearest obstacle in each counts."""
    finer = Scanner(2 * eye.scanner.beams, eye.scanner.first, eye.scanner.step / 2)
    scanner = finer if follower.reads(finer, eye, "finer") else eye.scanner
    about = "With {}, and nearer obstacles outside the sectors"
    for front_at, right_at in EDGES:
        front, right = some_distance(rng), some_distance(rng)
        scan = scanner.look_at(rng, {"front": front_at, "right": right_at}, front=front, right=right)
        follower.expect(scan, front, right, about.format("an obstacle at the edge of each sector"))
    front, right = some_distance(rng), some_distance(rng)
    scan = scanner.look_at(rng, {}, front=front, right=right)
    follower.expect(scan, front, right, about.format("an obstacle in the middle of each sector"))
    expect_the_newest(follower, eye, rng)


def expect_the_newest(follower: Follower, eye: Eye, rng: random.Random) -> None:
    """Each scan counts at once and alone, without those before it; after a lost one, others are shown."""
    about = "When a scan shows other distances than the scans before it"
    for last in (False, False, True):
        far, *spans = (2.0, 3.0), (0.25, 1.5), (2.0, 3.0), (0.25, 1.5)
        front, right = (round(rng.uniform(*far), 2) for _ in BOTH)
        follower.expect_driving(eye.scanner.flat(rng, front=front, right=right), "With a fresh scan")
        with contextlib.nullcontext() if last else contextlib.suppress(Wrong):
            for span in spans:
                front, right = (round(rng.uniform(*span), 2) for _ in BOTH)
                scan = eye.scanner.flat(rng, front=front, right=right)
                follower.expect_at_once(scan, front, right, about, eye.sectors)
            return


@points(0.5, cell="wall-follower")
@twice
def test_any_number_of_beams(follower: Follower, eye: Eye, rng: random.Random) -> None:
    """Scanners with fewer and with more than 360 beams a turn, and with two beams."""
    for beams in (72, rng.choice([180, 240, 300]), 1440, MANY):
        scanner = Scanner(beams, eye.scanner.first, math.copysign(360.0 / beams, eye.scanner.step))
        expect_sight(follower, eye, scanner, rng, "a turn of fewer or more than 360 beams")
    front, right = some_distance(rng), some_distance(rng)
    sees = follower.read(eye.scanner.look(rng, front=front, right=right), front, right)
    for _ in range(2 * (sees >= eye.sectors)):  # or else another test judges it
        front, right = some_distance(rng), some_distance(rng)
        scan = scanner.look(rng, front=front, right=right)
        about = f"With a scanner that has {MANY} beams a turn, one of which sees the nearest obstacle"
        follower.expect(scan, front, right, about, eye.sectors)
    if follower.reads(BESIDE, eye, "beside"):  # or else another test judges it
        expect_sight(follower, eye, two_beams(eye), rng, "two beams, one ahead and one on the right")
        sign = math.copysign(1.0, eye.scanner.step)
        eight = Scanner(8, sign * -180.0, sign * 45.0, beyond=1)
        expect_sight(follower, eye, eight, rng, "eight beams, and an angle_max one step beyond the last of them")


@points(1, cell="wall-follower")
@twice
def test_first_beam_anywhere(follower: Follower, eye: Eye, rng: random.Random) -> None:
    """Scanners that start ahead, behind or beside the robot, or see less than a full turn."""
    for beams, first, about in (
        (360, 0.0, "the first beam ahead of the robot"),
        (360, -180.0, "the first beam behind the robot"),
        (181, -90.0, "a view of 180 degrees"),
        (360, rng.choice([40.0, 90.0, 140.0]), "the first beam on the left and a full turn"),
        (360, 330.0, "an angle_min above pi"),  # its beams on the right are more than a turn away
        (360, -340.0, "an angle_min below -pi"),
    ):
        sign = math.copysign(1.0, eye.scanner.step)
        expect_sight(follower, eye, Scanner(beams, sign * first, sign), rng, about)


@points(0.5, cell="wall-follower")
@twice
def test_clockwise(follower: Follower, eye: Eye, rng: random.Random) -> None:
    """Scanners that turn clockwise: angle_increment is negative."""
    scanners = [Scanner(360, eye.scanner.first, -1.0)]
    if follower.reads(BESIDE, eye, "beside"):  # or else another test judges it
        scanners += [Scanner(360, 180.0, -1.0), Scanner(360, -90.0, -1.0)]
    for scanner in scanners:
        expect_sight(follower, eye, scanner, rng, "a negative angle_increment")


def two_beams(eye: Eye) -> Scanner:
    """A scanner with a beam in each sector, which turns as the eye does."""
    return Scanner(2, -60.0, 60.0) if eye.scanner.step > 0 else Scanner(2, 0.0, -60.0)


def expect_sight(follower: Follower, eye: Eye, scanner: Scanner, rng: random.Random, about: str) -> None:
    """By this scanner it must see how far away the wall in each sector is, as far as it can by any scanner."""
    front, right = some_distance(rng), some_distance(rng)
    if len(eye.sectors) == 1:  # not the nearest of all, which is what a node sees that looks at all beams
        front, right = sorted((front, right), reverse="front" in eye.sectors)
    scan = scanner.flat(rng, front=front, right=right)
    follower.expect(scan, front, right, f"With a scanner that has {about}", eye.sectors)


def some_distance(rng: random.Random) -> float:
    """A distance (m) of an obstacle in a sector."""
    return round(rng.uniform(0.25, 3.0), 2)


@points(0.5, cell="wall-follower")
@twice
def test_no_return_and_touching(follower: Follower, eye: Eye, rng: random.Random) -> None:
    """inf means that nothing is there, and -inf that the robot touches something."""
    plain = eye.scanner
    true = {"front": some_distance(rng), "right": some_distance(rng)}
    for share, wanted, where in ((1.0, {"front": INF, "right": INF}, "the whole"), (SOME, true, "some beams of the")):
        scan = plain.look(rng, **true)
        for sector in BOTH:
            scan = plain.change(scan, rng, sector, INF, share)
        about = f"With inf (no return) in {where} front and right"
        follower.expect(scan, wanted["front"], wanted["right"], about, eye.sectors)
    about = "With inf (no return) in every beam of the scan"
    follower.expect(plain.scan([INF] * plain.beams), INF, INF, about, eye.sectors)
    for sector in sorted(eye.sectors):
        near, seen_there = true | {sector: -INF}, true | {sector: 0.0}
        about = f"With -inf (touching, a distance of 0) in one beam of the {sector}"
        follower.expect(plain.look(rng, **near), seen_there["front"], seen_there["right"], about, eye.sectors)


@points(0.5, cell="wall-follower")
@twice
def test_no_measurements(follower: Follower, eye: Eye, rng: random.Random) -> None:
    """NaN and values outside range_min and range_max are left out; a sector without any usable value counts as free."""
    plain = eye.scanner

    def expect(scan: LaserScan, distances: Mapping[str, float], about: str) -> None:
        follower.expect(scan, distances["front"], distances["right"], about, eye.sectors)

    for value, what in (
        (NAN, "NaN"),
        (0.0, "0.0"),
        (MIN / 2, "less than range_min"),
        (MORE_THAN_MAX, "more than range_max"),
    ):
        true = {"front": some_distance(rng), "right": some_distance(rng)}
        scan = plain.flat(rng, **true)
        for sector in BOTH:
            scan = plain.change(scan, rng, sector, value, SOME)
        expect(scan, true, f"With {what} in some beams, which is not a measurement")
        if math.isnan(value):  # now that something near was seen
            about = "With NaN in every beam of the scan, so that all is free (inf)"
            expect(plain.scan([NAN] * plain.beams), {"front": INF, "right": INF}, about)
        for sector in BOTH:
            scan = plain.change(scan, rng, sector, value)
        about = f"With {what} in all beams of the front and of the right, which then count as free (inf)"
        expect(scan, {"front": INF, "right": INF}, about)
    expect_range_limits(follower, eye, rng)
    if "right" in eye.sectors:
        front = some_distance(rng)
        part = [*plain.flat(rng, front=front).ranges]
        for beam in range(plain.beams):
            if plain.angle(beam) < -26.0:
                part[beam] = NAN
        about = "With a scanner that does not cover the right, which then counts as free (inf)"
        expect(plain.scan(part), {"front": front, "right": INF}, about)
        if follower.reads(two_beams(eye), eye, "two"):  # or else another test judges it
            about = "With a scanner of one beam, on the right; in front nothing is seen, which counts as free (inf)"
            expect(Scanner(1, rng.uniform(-75.0, -45.0)).scan([front]), {"front": INF, "right": front}, about)
    free = {"front": INF, "right": INF}
    about = "With a scan that has no beams at all, so that all is free (inf)"
    expect(plain.scan([]), free, about)
    expect(Scanner(0, 0.0, 0.0).scan([]), free, f"{about}, and an angle_increment of 0")
    true = {"front": some_distance(rng), "right": some_distance(rng)}
    expect(plain.flat(rng, **true), true, "After a scan without beams")


def expect_range_limits(follower: Follower, eye: Eye, rng: random.Random) -> None:
    """It must take the limits of a measurement from the scan, and the limits themselves are measurements."""
    least, most = rng.choice([0.25, 0.375]), rng.choice([2.5, 3.5])  # exact as 32-bit floats
    for value, seen_there, what in (
        (least, least, "exactly range_min, which is usable"),
        (most, most, "exactly range_max, which is usable"),
        (least - 0.0625, INF, "less than range_min"),
        (most + 0.5, INF, "more than range_max"),
    ):
        scan = eye.scanner.scan([*eye.scanner.flat(rng, front=value, right=value).ranges], least, most)
        about = f"With another range_min and range_max, and in the front and on the right {what}"
        follower.expect(scan, seen_there, seen_there, about, eye.sectors)


@points(1, cell="wall-follower")
@twice
def test_rate(follower: Follower, by_the_wall: Follower, rng: random.Random) -> None:
    """Ten commands per second, whether scans come at 5 or at 40 Hz, or not at all, whatever they show."""
    near = PLAIN.flat(rng, front=0.25, right=0.6)
    scans = [seen(rng), near, PLAIN.flat(rng, front=0.15, right=3.0), near, PLAIN.flat(rng, front=3.0, right=0.7)]
    for hertz in RATE_STEPS:
        step = RATE_STEPS[hertz]
        commands = follower.simulate(RATE_SECONDS, step, scans_at(hertz, step, scans))
        rate = len(commands) / RATE_SECONDS
        about = f"while scans come at {hertz} Hz" if hertz else "while no scans come"
        if is_right(rate):
            if follower.lags:  # simulated time waits for it, and a robot does not
                expect_in_real_time(by_the_wall.best_rate(near, hertz, RATE[0]), about)
            if not hertz:
                expect_no_end(follower)
        else:
            rate, commands = by_the_wall.rate(near, hertz)
            if not hertz and rate > RATE[0]:
                continue  # too many commands are judged by the two others
        if not is_right(rate):
            raise Wrong(f"Commands must be published at 10 Hz {about}; it was {rate:.1f} Hz.")
        if hertz:
            expect_numbers_each_time(commands, about)
        others = [command for command in commands if not is_of_the_agent(command)]
        if hertz and len(commands) - len(others) < DRIVEN * len(commands):
            raise Wrong(
                f"The node must publish what decide_action of the WallAgent in wall_agent.py returns {about}: a scan "
                f"that is 0.2 s old is fresh. {len(others)} of {len(commands)} commands were something else, such as "
                f"{said(others[0])}.",
                commands,
            )
    standing = follower.commands_at(PLAIN.flat(rng, front=STILL, right=some_distance(rng)))
    if not standing:
        raise Wrong(
            "Commands must be published at 10 Hz, whatever the agent decides: another agent decided to stand still "
            "(linear 0, angular 0), and no command came."
        )
    if STOP not in standing and not any(map(is_of_the_agent, standing)):  # other distances are judged by other tests
        raise Wrong(
            "The node must publish what decide_action of the WallAgent in wall_agent.py returns: another agent decided "
            f"to stand still (linear 0, angular 0), and the robot was told {said(standing[-1])}."
        )
    expect_without_a_clock(by_the_wall, near)


def expect_without_a_clock(by_the_wall: Follower, scan: LaserScan) -> None:
    """A node that is started without simulated time must publish, though there is no /clock."""
    if by_the_wall.is_mute_in_real_time(scan):
        sets = b"use_sim_time" in by_the_wall.bench.files[NODE]
        why = " Leave use_sim_time to those who start the node, who set it when there is a /clock." if sets else ""
        raise Wrong(
            "Commands must be published at 10 Hz in real time as well: started without use_sim_time, where nobody "
            f"publishes /clock, the node published none.{why}"
        )


def expect_in_real_time(rate: float, about: str) -> None:
    """A node that publishes at the right rate in simulated time must publish as often (Hz) by the wall clock."""
    if rate < RATE[0]:
        raise Wrong(
            f"Commands must be published at 10 Hz {about}; by the wall clock it was {rate:.1f} Hz. It was right in "
            "simulated time alone, which waits for the node's callbacks: none may wait, or compute, for so long."
        )


def expect_no_end(follower: Follower) -> None:
    """Commands must go on to come, however long no scan has come; the node goes by simulated time."""
    follower.simulate(SILENCE - RATE_SECONDS - 1.0, PERIOD, lambda tick: None)
    if not follower.simulate(1.0, PERIOD, lambda tick: None) and follower.says_nothing():
        follower.renew()  # so that the mistake shows in the second run, too
        raise Wrong(
            f"Commands must be published at 10 Hz also while no scans come: {SILENCE:g} s of simulated time after the "
            "last scan no command came any more."
        )


def seen(rng: random.Random) -> LaserScan:
    """A plain scan."""
    return PLAIN.look(rng, front=some_distance(rng), right=some_distance(rng))


def scans_at(hertz: int, step: float, scans: Sequence[LaserScan]) -> Callable[[int], LaserScan | None]:
    """One of the scans in turn, or none, for each tick of `step` s, so that they come `hertz` times a second."""
    if not hertz:
        return lambda tick: None
    every = round(1 / (hertz * step))
    return lambda tick: scans[tick // every % len(scans)] if tick % every == 0 else None


def is_right(rate: float) -> bool:
    """Return True if a rate (Hz) passes as 10 Hz."""
    return RATE[0] <= rate <= RATE[1]


@points(1.5, cell="wall-follower")
@twice
def test_stops(follower: Follower, by_the_wall: Follower, rng: random.Random) -> None:
    """When scans stop coming, it drives on for 0.5 s and stands still then, until the next one comes."""
    scan = seen(rng)
    with on_wrong(follower.renew):  # once more, from a start of its own: it may not drive again
        follower.expect_driving(scan, "With a fresh scan")
        for pause in PAUSES:
            if not stops(follower, by_the_wall, scan, pause):
                follower.expect_driving(scan, "When scans come again after a pause")
                break  # by its own time, one takes long enough
            expect_driving_by_one_scan(follower, scan)
            follower.expect_driving(scan, "When scans come again after a pause")
        if follower.drives_late(scan, TOO_OLD, LATEST_STOP):
            raise Wrong(
                "When no scan has come for 0.5 s, every command until the next scan must be a zero Twist: it was "
                f"driving more than {TOO_OLD} s after it, in simulated time as by the wall clock."
            )


def expect_driving_by_one_scan(follower: Follower, scan: LaserScan) -> None:
    """After a pause, the first scan is enough to drive by."""
    got = follower.show_once(scan)
    if not any(map(is_of_the_agent, got)):
        raise Wrong(
            "When scans come again after a pause, the first one must be used: the robot was told "
            f"{said(got[-1]) if got else 'nothing'} in the {NEXT * PERIOD:.1f} s after it.",
            got,
        )


def stops(follower: Follower, by_the_wall: Follower, scan: LaserScan, pause: float) -> bool:
    """Return True if it stops in simulated time after this scan, and nothing for `pause` s.

    Raises Wrong unless it drives on for half a second by one clock, that or its own.
    """
    after = follower.simulate(pause, PERIOD, lambda tick: None)
    must, may = FRESH_COMMANDS
    if (
        len(after) >= pause * PAUSE_COMMANDS
        and all(map(is_of_the_agent, after[:must]))
        and all(command == STOP or is_of_the_agent(command) for command in after[must:may])
        and set(after[may:]) == {STOP}
    ):
        return True
    early, late, last = by_the_wall.times_to_stop(scan)
    if math.isinf(late) and last < SILENT_FROM:
        came = f"the last one, which was not zero, came {last:.1f} s after the last scan" if last else "no command came"
        raise Wrong(
            "When no scan has come for 0.5 s, a zero Twist must be published ten times a second until the next scan: "
            f"in the 3 s after the last scan, {came}.",
            f"commands {after}",
        )
    if late > LATEST_STOP:
        still = "still driving 3 s after the last one" if math.isinf(late) else f"driving until {late:.1f} s after it"
        raise Wrong(
            f"When no scan has come for 0.5 s, every command until the next scan must be a zero Twist: it was {still}.",
            f"commands {after}; in real time after {late} s",
        )
    if early < EARLIEST_STOP and late > early + LONGEST_GAP:
        drove = f"the last other than zero came {early:.1f} s after the last scan"
        drove = drove if early else "none other than zero came after the last scan"
        raise Wrong(
            f"A scan may be used until it is 0.5 s old, and ten commands must come a second: {drove}, and the first "
            f"zero Twist {late:.1f} s after it.",
            f"commands {after}",
        )
    if early < EARLIEST_STOP:
        raise Wrong(
            "A scan may be used until it is 0.5 s old: the robot was told to stand still when the last one was "
            f"{early + PERIOD:.1f} s old.",
            f"commands {after}; in real time until {early} s",
        )
    # By the wall clock all is right.  In simulated time, too, it must stand still when the wall clock has moved on.
    if not follower.stands_still_in_time(LATEST_STOP):
        zero = "When no scan has come for 0.5 s, every command until the next scan must be a zero Twist."
        if STOP in after and any(command != STOP for command in after[after.index(STOP) :]):
            raise Wrong(
                f"{zero} In simulated time the robot was told to stand still, and then, without a new scan, to move.",
                after,
            )
        raise Wrong(
            f"{zero} In simulated time the robot was still driving {pause:g} s after the last scan, and later, too: "
            "take the time of a scan, and the time now, from one clock.",
            after,
        )
    return False


Helper = Callable[[Eye], Follower]  # makes a node with a right agent


@points(5, cell="rooms")
def test_hall(drivers: Mapping[str, Follower], rng: random.Random) -> None:
    """Follows the wall of a hall, with its own agent and a scanner that starts behind."""
    driver = drivers["hall"]
    driver.expect_to_run_on(RUNS_ON)
    driven = drive(driver, "hall", LASERS["hall"], rng)
    if driven:
        raise driven


@points(0.5, cell="rooms")
def test_block(drivers: Mapping[str, Follower], helped: Helper, request: pytest.FixtureRequest) -> None:
    """Drives around a block, by its outer corners."""
    expect_drive(drivers["block"], "block", helped, request)


@points(0.5, cell="rooms")
def test_bend(drivers: Mapping[str, Follower], helped: Helper, request: pytest.FixtureRequest) -> None:
    """Follows a way with a bend."""
    expect_drive(drivers["bend"], "bend", helped, request)


def expect_drive(driver: Follower, kind: str, helped: Helper, request: pytest.FixtureRequest) -> None:
    """It must drive along the wall, with its own agent and a scanner of the room's own.

    Or else with a right agent, if its own follows two of the three rules at least, and with a scanner that it reads
    right: what is wrong with a rule and with other scanners has cost points before, and so has the drive in the hall.
    """
    rng: random.Random = request.getfixturevalue("rng")
    wrong = drive(driver, kind, LASERS[kind], rng)
    if not wrong:
        expect_directions(request, rng)
        return
    try:
        if right_rules(request.getfixturevalue("agent")) < RULES - 1:
            raise wrong
        eye: Eye = request.getfixturevalue("eye")
        second = helped(eye)
        start, step = math.radians(eye.scanner.first), math.radians(eye.scanner.step)
        laser = Laser(beams=eye.scanner.beams, angle_min=start, angle_increment=step)
        if drive(second, kind, laser, rng):
            raise wrong
    except Fault:
        raise wrong from None


@twice
def expect_directions(request: pytest.FixtureRequest, rng: random.Random) -> None:
    """Expect it not to see an obstacle behind on the left as ahead or on the right: it may drive well there by chance.

    Of a node whose sight cannot be tested, other tests judge that.
    """
    try:
        eye: Eye = request.getfixturevalue("eye")
    except Fault:
        return
    front, right = some_distance(rng), some_distance(rng)
    scan = eye.scanner.flat(rng, front=front, right=right)
    for beam in range(eye.scanner.beams):
        if BEHIND[0] < eye.scanner.angle(beam) < BEHIND[1]:
            scan.ranges[beam] = rng.uniform(*OUTSIDE)
    follower: Follower = request.getfixturevalue("follower")
    about = "A drive is judged only of a node that looks ahead and to the right: with an obstacle behind it on the left"
    follower.expect(scan, front, right, about, eye.sectors)


def right_rules(agent: Agent) -> int:
    """Return the number of the three rules that the agent follows, each in at least half of its cases."""
    rules = (((0.3, 0.6), (0.3, 3.0)), ((2.0, 2.0), (3.0, 1.5)), ((2.0, 0.5), (3.0, 0.7), (2.0, 0.2), (2.0, 1.1)))
    answers = iter(agent.ask(*(distances for cases in rules for distances in cases)))
    right = [[is_close(next(answers), Command(*decide(*distances))) for distances in cases] for cases in rules]
    return sum(2 * sum(cases) >= len(cases) for cases in right)


def drive(driver: Follower, kind: str, laser: Laser, rng: random.Random) -> Wrong | None:
    """Return the Wrong of a drive along the wall, or None; tries two rooms where the grader's own follower passes."""
    tried = 0
    while tried < TRIED_ROOMS:
        room, seed = draw(kind, rng), rng.randrange(1000)
        simulation = driver.drive(room, laser, seed, SECONDS)
        if odd := driver.beyond_any_robot():
            return Wrong(
                f"Each command must be one that a robot can carry out: in the drive, the node commanded {odd}.",
                certain=True,
            )
        driven = look_back(simulation)
        if driven.passed:
            return None
        tried += can_be_driven(room, laser, seed)
    if driven.collisions:
        seconds = math.ceil(simulation.collisions[0].time)
        return Wrong(f"The robot must not touch anything: it hit an obstacle after {seconds} s.", driven)
    if driven.along < ALONG:
        return Wrong(
            f"In {SECONDS:.0f} s the robot must drive {ALONG:g} m of new ground with a wall on its right: it drove "
            f"{driven.along:.1f} m so.",
            driven,
        )
    return Wrong(
        f"Once there is a wall on its right, the robot must keep it there for {SHARE:.0%} of the time: it did for "
        f"{driven.share:.0%}.",
        driven,
    )
