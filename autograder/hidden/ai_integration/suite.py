"""What the task asks of the obstacle avoider: its command for a scan, its timing, and whether it drives safely.

Everything is played in simulated time, in which a busy machine changes nothing.  A node that keeps its own time by the
wall clock does not show 10 Hz there, and is judged in real time instead.
Points add up to 20.
"""

import math
import random
from collections.abc import Callable, Mapping

from sensor_msgs.msg import LaserScan

from autograder.hidden.ai_integration.conversation import FORWARD, LEFT, PERIOD, RIGHT, STOP, Avoider, Command
from autograder.hidden.ai_integration.rooms import GROUND, LASERS, SECONDS, can_be_driven, draw, passed
from autograder.hidden.ai_integration.scanner import INF, MAX, MIN, NAN, PLAIN, Scanner
from autograder.suitekit import Alive, Wrong, points, twice

CLEAR = {"front": 3.0, "left": 2.0, "right": 2.5}  # m
EDGES = {"front": [-28.0, 28.0], "left": [32.0, 88.0], "right": [-88.0, -32.0]}  # degrees, just inside
MORE_THAN_MAX = MAX + 5.0  # m
SOME = 0.5  # the share of a sector's beams that have a special value

FIRST_TICKS = 6  # before the first scan
FIRST_COMMANDS = 3  # that must come in them at least: a node's timer may begin with any of the ticks

RATE = (9.0, 11.0)  # Hz that pass as 10 Hz
RATE_SECONDS = 3.0  # of simulated time, in which the rate is measured
RATE_STEP = 0.025  # s of simulated time between two ticks then: scans come at up to 40 Hz
SCAN_RATES = (5, 40)  # Hz
DRIVEN = 0.8  # the share of commands that must drive forward when nothing is near: the first ones may be older

PAUSE = 1.5  # s of simulated time without scans
PAUSE_COMMANDS = 8  # that must come in it at least, of 15
FRESH_COMMANDS = 5  # of 0.5 s, in which the last scan is still fresh; all later ones must stop
LATEST_STOP = 0.75  # s of real time: 0.5 s, two periods of a timer of 10 Hz, and a little for a busy machine
TRIED_ROOMS = 2  # rooms in which the course's own agent drives well, and the node fails, until it has failed


@points(1, cell="obstacle-avoider")
@twice
def test_stands_before_the_first_scan(avoider: Avoider) -> None:
    """Before the first scan it commands the robot to stand still."""
    avoider.start_fresh()

    def wait(limit: float, alive: Alive) -> list[Command] | None:
        commands = [command for _ in range(FIRST_TICKS) for command in avoider.tick()]
        return commands if alive() else None

    commands = avoider.ask(wait, "the time before the first scan")
    if len(commands) < FIRST_COMMANDS or set(commands) != {STOP}:
        raise Wrong("Before the first scan, a zero Twist must be published ten times a second.", commands)


@points(2, cell="obstacle-avoider")
@twice
def test_decisions(avoider: Avoider, rng: random.Random) -> None:
    """It drives forward while the way is clear, and turns to the more open side when it is not."""
    for seen, right, about in [
        ({"front": rng.uniform(1, 4)}, FORWARD, "With nothing near"),
        (
            {"front": rng.uniform(0.2, 0.45), "left": rng.uniform(1.5, 3), "right": rng.uniform(0.4, 1)},
            LEFT,
            "With an obstacle nearer than 0.5 m ahead and more room on the left",
        ),
        (
            {"front": rng.uniform(0.55, 0.7), "left": 0.4, "right": 0.3},
            FORWARD,
            "With an obstacle ahead that is farther than 0.5 m, and nearer ones beside it",
        ),
        (
            {"front": rng.uniform(0.2, 0.45), "left": rng.uniform(0.4, 1), "right": rng.uniform(1.5, 3)},
            RIGHT,
            "With an obstacle nearer than 0.5 m ahead and more room on the right",
        ),
        (
            {"front": rng.uniform(0.2, 0.45), "left": 0.4, "right": 0.3},
            LEFT,
            "With obstacles all around, a little farther on the left",
        ),
        (
            {"front": rng.uniform(0.2, 0.45), "left": 1.5, "right": 1.5},
            RIGHT,
            "With an obstacle ahead and both sides equally open",
        ),
    ]:
        avoider.expect(PLAIN.look(rng, **seen), right, about)


@points(1, cell="obstacle-avoider")
@twice
def test_edges_of_the_sectors(avoider: Avoider, rng: random.Random) -> None:
    """Front is within 30 degrees of 0, left is 30 to 90, right is -90 to -30."""
    expect_sectors(avoider, PLAIN, rng, "the first beam ahead and one beam per degree")


@points(1, cell="obstacle-avoider")
@twice
def test_resolutions(avoider: Avoider, rng: random.Random) -> None:
    """Any number of beams over a full turn."""
    for beams in (72, rng.choice([180, 240, 300]), rng.choice([720, 900, 1440])):
        expect_sectors(
            avoider, Scanner(beams, 0.0, 360.0 / beams), rng, "the first beam ahead and more or fewer than 360 beams"
        )


@points(2, cell="obstacle-avoider")
@twice
def test_first_beam_anywhere(avoider: Avoider, rng: random.Random) -> None:
    """Scanners that start behind or beside the robot, or see less than a full turn."""
    for scanner, about in [
        (Scanner(360, -180.0, 1.0), "the first beam behind the robot"),
        (Scanner(1081, -135.0, 0.25), "270 degrees of view, in steps of a quarter of a degree"),
        (Scanner(481, -120.0, 0.5), "240 degrees of view, in steps of half a degree"),
        (Scanner(720, rng.choice([40.0, 90.0, 140.0]), 0.5), "the first beam on the left and a full turn"),
    ]:
        expect_sectors(avoider, scanner, rng, about)


@points(1, cell="obstacle-avoider")
@twice
def test_clockwise(avoider: Avoider, rng: random.Random) -> None:
    """Scanners that turn clockwise: angle_increment is negative."""
    for scanner in (Scanner(360, 180.0, -1.0), Scanner(541, 135.0, -0.5), Scanner(360, 0.0, -1.0)):
        expect_sectors(avoider, scanner, rng, "a negative angle_increment")


def expect_sectors(avoider: Avoider, scanner: Scanner, rng: random.Random, about: str) -> None:
    """It must see the nearest obstacle of each sector, even at its edges, and none behind or in the next sector."""
    front, left, right = (rng.sample(EDGES[sector], 2) for sector in ("front", "left", "right"))
    about = f"With a scanner that has {about}, and {{}}"
    avoider.expect(
        scanner.look_at(rng, {"left": left[0], "right": right[0]}, left=0.3, right=0.35),
        FORWARD,
        about.format("obstacles left, right and behind, none within 30 degrees of 0"),
    )
    avoider.expect(
        scanner.look_at(rng, {"front": front[0], "left": left[0]}, front=0.4, left=0.8, right=1.6),
        RIGHT,
        about.format("an obstacle ahead, and one between 30 and 90 degrees"),
    )
    avoider.expect(
        scanner.look_at(rng, {"left": left[1], "right": right[1]}, left=0.35, right=0.3),
        FORWARD,
        about.format("obstacles left, right and behind, none within 30 degrees of 0"),
    )
    avoider.expect(
        scanner.look_at(rng, {"front": front[1], "right": right[0]}, front=0.4, left=1.6, right=0.8),
        LEFT,
        about.format("an obstacle ahead, and one between -90 and -30 degrees"),
    )
    avoider.expect(
        scanner.look_at(rng, {"front": front[1], "left": left[1]}, front=0.4, left=0.8, right=1.6),
        RIGHT,
        about.format("an obstacle ahead, and one between 30 and 90 degrees"),
    )
    avoider.expect(
        scanner.look_at(rng, {"front": front[0], "right": right[1]}, front=0.4, left=1.6, right=0.8),
        LEFT,
        about.format("an obstacle ahead, and one between -90 and -30 degrees"),
    )


@points(1, cell="obstacle-avoider")
@twice
def test_no_return(avoider: Avoider, rng: random.Random) -> None:
    """inf means that nothing is there."""
    blocked = {"front": 0.4, "left": 2.0, "right": 2.5}
    about = "With inf (no return) {}"
    avoider.expect(PLAIN.look(rng, **blocked), RIGHT, "With an obstacle ahead and more room on the right")
    avoider.expect(
        PLAIN.change(PLAIN.look(rng, left=0.3), rng, "front", INF), FORWARD, about.format("in all beams of the front")
    )
    avoider.expect(
        PLAIN.change(PLAIN.look(rng, **blocked), rng, "left", INF),
        LEFT,
        about.format("in all beams of the left, and obstacles ahead and on the right"),
    )
    avoider.expect(
        PLAIN.change(PLAIN.look(rng, **blocked), rng, "left", INF, SOME),
        RIGHT,
        about.format("in some beams on the left, while others there see an obstacle nearer than on the right"),
    )


@points(1, cell="obstacle-avoider")
@twice
def test_touching(avoider: Avoider, rng: random.Random) -> None:
    """-inf means an obstacle that is too near to be measured."""
    about = "With -inf (touching) in one beam {}"
    avoider.expect(PLAIN.look(rng, **CLEAR), FORWARD, "With nothing near")
    avoider.expect(
        PLAIN.look(rng, **CLEAR | {"front": -INF}), RIGHT, about.format("of the front, and nothing else near")
    )
    avoider.expect(
        PLAIN.look(rng, front=0.4, left=0.6, right=-INF), LEFT, about.format("of the right, and an obstacle ahead")
    )
    avoider.expect(
        PLAIN.look(rng, front=0.4, left=-INF, right=0.6), RIGHT, about.format("of the left, and an obstacle ahead")
    )


@points(1, cell="obstacle-avoider")
@twice
def test_no_measurements_among_others(avoider: Avoider, rng: random.Random) -> None:
    """NaN, and values outside range_min and range_max, are no measurements."""
    for value, what in (
        (NAN, "NaN"),
        (0.0, "0.0"),
        (MIN / 2, "less than range_min"),
        (NAN, "NaN"),
        (MORE_THAN_MAX, "more than range_max"),
    ):
        about = f"With {what} in some beams, which is no measurement, and {{}}"
        for sector in ("front", "left"):
            avoider.expect(
                PLAIN.change(PLAIN.look(rng, **CLEAR), rng, sector, value, SOME),
                FORWARD,
                about.format("nothing near in the other beams"),
            )
        blocked = PLAIN.look(rng, front=0.4, left=1.6, right=0.8)
        for sector in ("front", "left", "right"):
            blocked = PLAIN.change(blocked, rng, sector, value, SOME)
        avoider.expect(blocked, LEFT, about.format("an obstacle ahead, and more room on the left"))


@points(1, cell="obstacle-avoider")
@twice
def test_nothing_usable(avoider: Avoider, rng: random.Random) -> None:
    """A sector without any usable value counts as free, and so does an empty scan."""
    for value, what in ((NAN, "NaN"), (0.0, "less than range_min"), (MORE_THAN_MAX, "more than range_max")):
        about = f"With {what} in all beams of {{}}, which then counts as free"
        blocked = {"front": 0.4, "left": 2.0, "right": 3.0}
        avoider.expect(PLAIN.change(PLAIN.look(rng, **blocked), rng, "left", value), LEFT, about.format("the left"))
        avoider.expect(
            PLAIN.change(PLAIN.look(rng, front=0.3), rng, "front", value), FORWARD, about.format("the front")
        )
    about = "With an obstacle ahead, and a scanner that does not cover the {} side, which then counts as free"
    avoider.expect(Scanner(121, -95.0, 1.0).look(rng, front=0.4), LEFT, about.format("left"))
    avoider.expect(Scanner(121, -25.0, 1.0).look(rng, front=0.4), RIGHT, about.format("right"))
    avoider.expect(PLAIN.scan([]), FORWARD, "With a scan that has no beams at all")
    avoider.expect(
        PLAIN.look(rng, front=0.4, left=3.0, right=1.0),
        LEFT,
        "After a scan without beams, with an obstacle ahead and more room on the left",
    )
    avoider.expect(PLAIN.scan([NAN] * 360), FORWARD, "With NaN in all beams")


@points(1, cell="obstacle-avoider")
@twice
def test_rate(avoider: Avoider, by_the_wall: Avoider, rng: random.Random) -> None:
    """Ten commands per second, whether scans come at 5 or at 40 Hz."""
    scan = PLAIN.look(rng, **CLEAR)
    for hertz in SCAN_RATES:
        commands = avoider.simulate(RATE_SECONDS, RATE_STEP, scans_at(hertz, scan))
        rate = len(commands) / RATE_SECONDS
        if not is_right(rate):
            rate, commands = by_the_wall.rate(scan, hertz)
        about = f"while scans come at {hertz} Hz"
        if not is_right(rate):
            raise Wrong(f"Commands must be published at 10 Hz {about}; it was {rate:.1f} Hz.")
        if commands.count(FORWARD) < DRIVEN * len(commands):
            raise Wrong(
                f"With nothing near, the robot must keep driving {about}: a scan that is 0.2 s old is fresh.", commands
            )


def scans_at(hertz: int, scan: LaserScan) -> Callable[[int], LaserScan | None]:
    """The scan, or none, for each tick of RATE_STEP, so that it comes `hertz` times a second."""
    every = round(1 / (hertz * RATE_STEP))
    return lambda tick: scan if tick % every == 0 else None


def is_right(rate: float) -> bool:
    """Whether a rate (Hz) passes as 10 Hz."""
    return RATE[0] <= rate <= RATE[1]


@points(1, cell="obstacle-avoider")
@twice
def test_stops(avoider: Avoider, by_the_wall: Avoider, rng: random.Random) -> None:
    """When scans stop coming, it commands the robot to stand still within 0.5 s, and to drive when they come again."""
    scan = PLAIN.look(rng, **CLEAR)
    avoider.expect(scan, FORWARD, "With nothing near")
    after = avoider.simulate(PAUSE, PERIOD, lambda tick: None)
    if len(after) < PAUSE_COMMANDS or set(after[FRESH_COMMANDS:]) != {STOP}:
        late = by_the_wall.time_to_stop(scan)
        if late > LATEST_STOP:
            raise Wrong(
                "When no scan has come for 0.5 s, every command until the next scan must be a zero Twist.",
                f"commands {after}; in real time after {late} s",
            )
    avoider.expect(scan, FORWARD, "When scans come again after a pause, with nothing near")


@points(2, cell="rooms")
def test_hall(drivers: Mapping[str, Avoider], rng: random.Random) -> None:
    """Drives about a hall, with a scanner of 720 beams that starts behind."""
    expect_drive(drivers["hall"], "hall", rng)


@points(2, cell="rooms")
def test_pillars(drivers: Mapping[str, Avoider], rng: random.Random) -> None:
    """Drives among pillars, with a scanner that sees 270 degrees."""
    expect_drive(drivers["pillars"], "pillars", rng)


@points(2, cell="rooms")
def test_corridor(drivers: Mapping[str, Avoider], rng: random.Random) -> None:
    """Drives along a corridor, with a scanner that turns clockwise."""
    expect_drive(drivers["corridor"], "corridor", rng)


def expect_drive(driver: Avoider, kind: str, rng: random.Random) -> None:
    """It must drive safely and cover ground, in one of two rooms where the course's own agent does."""
    tried = 0
    while tried < TRIED_ROOMS:
        room, seed = draw(kind, rng), rng.randrange(1000)
        driven = driver.drive(room, LASERS[kind], seed, SECONDS)
        if passed(driven):
            return
        tried += can_be_driven(room, LASERS[kind], seed)
    if driven.collisions:
        seconds = math.ceil(driven.collisions[0].time)
        raise Wrong(f"The robot must not touch anything: it hit an obstacle after {seconds} s.")
    raise Wrong(
        f"In {SECONDS:.0f} s the robot must cover {GROUND:g} m² (in squares of 0.5 m): it covered "
        f"{driven.ground_covered():g} m²."
    )
