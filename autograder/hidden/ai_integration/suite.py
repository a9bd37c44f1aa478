"""What the task asks of the obstacle avoider: what it does about a scan, in time, and whether it drives.

Everything is played in simulated time, in which a busy machine changes nothing.  A node that keeps its own time by the
wall clock, and so does not show 10 Hz there, is judged in real time instead.
Points add up to 20.
"""

import math

from autograder.errors import Wrong
from autograder.hidden.ai_integration.conversation import FORWARD, LEFT, RIGHT, STOP, speeds
from autograder.hidden.ai_integration.rooms import GROUND, LASERS, SECONDS, can_be_driven, draw, passed
from autograder.hidden.ai_integration.scanner import INF, MAX, MIN, NAN, PLAIN, Scanner
from autograder.suitekit.judge import points
from autograder.suitekit.live import twice

CLEAR = {"front": 3.0, "left": 2.0, "right": 2.5}
EDGES = {"front": [-28.0, 28.0], "left": [32.0, 88.0], "right": [-88.0, -32.0]}  # degrees, just inside


@points(1, cell="obstacle-avoider")
@twice
def test_stands_before_the_first_scan(avoider):
    """Before the first scan it commands to stand still."""
    avoider.ensure_fresh()

    def wait(limit, alive):
        commands = [speeds(command) for _ in range(6) for command in avoider.tick()]
        return commands if alive() else None

    commands = avoider.converse(wait, "the time before the first scan")
    if len(commands) < 3 or set(commands) != {STOP}:
        raise Wrong("Before the first scan, a zero Twist must be published ten times a second.", commands)


@points(2, cell="obstacle-avoider")
@twice
def test_decisions(avoider, rng):
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
            "With the obstacle ahead no nearer than 0.5 m, and others beside it",
        ),
        (
            {"front": rng.uniform(0.2, 0.45), "left": rng.uniform(0.4, 1), "right": rng.uniform(1.5, 3)},
            RIGHT,
            "With an obstacle nearer than 0.5 m ahead and more room on the right",
        ),
        (
            {"front": rng.uniform(0.2, 0.45), "left": 0.4, "right": 0.3},
            LEFT,
            "With obstacles all around, a bit farther on the left",
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
def test_edges_of_the_sectors(avoider, rng):
    """Front is within 30 degrees of 0, left 30 to 90, right -90 to -30."""
    expect_sectors(avoider, PLAIN, rng, "the first beam ahead, one a degree")


@points(1, cell="obstacle-avoider")
@twice
def test_resolutions(avoider, rng):
    """Any number of beams over a full turn."""
    for beams in (72, rng.choice([180, 240, 300]), rng.choice([720, 900, 1440])):
        expect_sectors(avoider, Scanner(beams, 0.0, 360.0 / beams), rng, "the first beam ahead, more or less than 360")


@points(2, cell="obstacle-avoider")
@twice
def test_first_beam_anywhere(avoider, rng):
    """Scanners that start behind or beside the robot, or see less than a full turn."""
    for scanner, about in [
        (Scanner(360, -180.0, 1.0), "the first beam behind the robot"),
        (Scanner(1081, -135.0, 0.25), "270 degrees of view, in quarters of a degree"),
        (Scanner(481, -120.0, 0.5), "240 degrees of view, in halves of a degree"),
        (Scanner(720, rng.choice([40.0, 90.0, 140.0]), 0.5), "the first beam on the left, a full turn"),
    ]:
        expect_sectors(avoider, scanner, rng, about)


@points(1, cell="obstacle-avoider")
@twice
def test_clockwise(avoider, rng):
    """Scanners that turn clockwise: angle_increment is negative."""
    for scanner in (Scanner(360, 180.0, -1.0), Scanner(541, 135.0, -0.5), Scanner(360, 0.0, -1.0)):
        expect_sectors(avoider, scanner, rng, "angle_increment negative")


def expect_sectors(avoider, scanner, rng, about):
    """It sees the nearest obstacle of each sector, also at its edges, and none behind or in the next sector."""
    front, left, right = (rng.sample(EDGES[sector], 2) for sector in ("front", "left", "right"))
    about = f"On a scanner with {about}, and with {{}}"
    avoider.expect(
        scanner.look(rng, at={"left": left[0], "right": right[0]}, left=0.3, right=0.35),
        FORWARD,
        about.format("obstacles left, right and behind, none within 30 degrees of 0"),
    )
    avoider.expect(
        scanner.look(rng, at={"front": front[0], "left": left[0]}, front=0.4, left=0.8, right=1.6),
        RIGHT,
        about.format("an obstacle ahead, and one between 30 and 90 degrees"),
    )
    avoider.expect(
        scanner.look(rng, at={"left": left[1], "right": right[1]}, left=0.35, right=0.3),
        FORWARD,
        about.format("obstacles left, right and behind, none within 30 degrees of 0"),
    )
    avoider.expect(
        scanner.look(rng, at={"front": front[1], "right": right[0]}, front=0.4, left=1.6, right=0.8),
        LEFT,
        about.format("an obstacle ahead, and one between -90 and -30 degrees"),
    )
    avoider.expect(
        scanner.look(rng, at={"front": front[1], "left": left[1]}, front=0.4, left=0.8, right=1.6),
        RIGHT,
        about.format("an obstacle ahead, and one between 30 and 90 degrees"),
    )
    avoider.expect(
        scanner.look(rng, at={"front": front[0], "right": right[1]}, front=0.4, left=1.6, right=0.8),
        LEFT,
        about.format("an obstacle ahead, and one between -90 and -30 degrees"),
    )


@points(1, cell="obstacle-avoider")
@twice
def test_no_return(avoider, rng):
    """inf means that nothing is there."""
    blocked = {"front": 0.4, "left": 2.0, "right": 2.5}
    about = "With inf (no return) {}"
    avoider.expect(PLAIN.look(rng, **blocked), RIGHT, "With an obstacle ahead and more room on the right")
    avoider.expect(
        PLAIN.change(PLAIN.look(rng, left=0.3), rng, "front", INF), FORWARD, about.format("all over the front")
    )
    avoider.expect(
        PLAIN.change(PLAIN.look(rng, **blocked), rng, "left", INF),
        LEFT,
        about.format("all over the left, and obstacles ahead and on the right"),
    )
    avoider.expect(
        PLAIN.change(PLAIN.look(rng, **blocked), rng, "left", INF, 0.5),
        RIGHT,
        about.format("in some beams of the left, others of which see an obstacle nearer than on the right"),
    )


@points(1, cell="obstacle-avoider")
@twice
def test_touching(avoider, rng):
    """-inf means an obstacle too near to be measured."""
    about = "With -inf (touching) in one beam {}"
    avoider.expect(PLAIN.look(rng, **CLEAR), FORWARD, "With nothing near")
    avoider.expect(
        PLAIN.look(rng, **CLEAR | {"front": -INF}), RIGHT, about.format("of the front, and nothing else near")
    )
    avoider.expect(PLAIN.look(rng, front=0.4, left=0.6, right=-INF), LEFT, about.format("of the right, and one ahead"))
    avoider.expect(PLAIN.look(rng, front=0.4, left=-INF, right=0.6), RIGHT, about.format("of the left, and one ahead"))


@points(1, cell="obstacle-avoider")
@twice
def test_no_measurements_among_others(avoider, rng):
    """NaN, and values outside range_min and range_max, are no measurements."""
    for value, what in (
        (NAN, "NaN"),
        (0.0, "0.0"),
        (MIN / 2, "less than range_min"),
        (NAN, "NaN"),
        (MAX + 5.0, "more than range_max"),
    ):
        about = f"With {what} in some beams, which is no measurement, and {{}}"
        for sector in ("front", "left"):
            avoider.expect(
                PLAIN.change(PLAIN.look(rng, **CLEAR), rng, sector, value, 0.5),
                FORWARD,
                about.format("nothing near in the others"),
            )
        blocked = PLAIN.look(rng, front=0.4, left=1.6, right=0.8)
        for sector in ("front", "left", "right"):
            blocked = PLAIN.change(blocked, rng, sector, value, 0.5)
        avoider.expect(blocked, LEFT, about.format("an obstacle ahead, and more room on the left"))


@points(1, cell="obstacle-avoider")
@twice
def test_nothing_usable(avoider, rng):
    """A sector without any usable value counts as free, and an empty scan is no accident."""
    for value, what in ((NAN, "NaN"), (0.0, "less than range_min"), (MAX + 5.0, "more than range_max")):
        about = f"With {what} in all beams of {{}}, which then counts as free"
        blocked = {"front": 0.4, "left": 2.0, "right": 3.0}
        avoider.expect(PLAIN.change(PLAIN.look(rng, **blocked), rng, "left", value), LEFT, about.format("the left"))
        avoider.expect(
            PLAIN.change(PLAIN.look(rng, front=0.3), rng, "front", value), FORWARD, about.format("the front")
        )
    about = "With an obstacle ahead, on a scanner that sees nothing of the {} side, which then counts as free"
    avoider.expect(Scanner(121, -95.0, 1.0).look(rng, front=0.4), LEFT, about.format("left"))
    avoider.expect(Scanner(121, -25.0, 1.0).look(rng, front=0.4), RIGHT, about.format("right"))
    avoider.expect(PLAIN.scan([]), FORWARD, "With a scan that has no beams at all")
    avoider.expect(
        PLAIN.look(rng, front=0.4, left=3.0, right=1.0),
        LEFT,
        "After an empty scan, with an obstacle ahead and more room on the left",
    )
    avoider.expect(PLAIN.scan([NAN] * 360), FORWARD, "With NaN in all beams")


@points(1, cell="obstacle-avoider")
@twice
def test_rate(avoider, by_the_wall, rng):
    """Ten commands a second, whether scans come at 5 or at 40 Hz."""
    for hertz in (5, 40):
        scan, step = PLAIN.look(rng, **CLEAR), 0.025
        commands = simulate(
            avoider, 3.0, step, lambda tick, scan=scan, every=40 // hertz: scan if tick % every == 0 else None
        )
        rate = len(commands) / 3.0
        if not 9.0 <= rate <= 11.0:
            rate, commands = by_the_wall.rate(scan, hertz)
        about = f"while scans come at {hertz} Hz"
        if not 9.0 <= rate <= 11.0:
            raise Wrong(f"Commands must be published at 10 Hz {about}; it was {rate:.1f} Hz.")
        if commands.count(FORWARD) < 0.8 * len(commands):
            raise Wrong(
                f"With nothing near, it must go on driving {about}: a scan that is 0.2 s old is fresh.", commands
            )


@points(1, cell="obstacle-avoider")
@twice
def test_stops(avoider, by_the_wall, rng):
    """When scans stop coming, it commands to stand still within 0.5 s, and drives on when they come again."""
    scan = PLAIN.look(rng, **CLEAR)
    avoider.expect(scan, FORWARD, "With nothing near")
    after = simulate(avoider, 1.5, 0.1, lambda tick: None)
    # A period of its own timer more is granted, and then no other command may come.
    if len(after) < 8 or set(after[5:]) != {STOP}:
        late = by_the_wall.time_to_stop(scan)
        if late > 0.75:
            raise Wrong(
                "When no scan has come for 0.5 s, and until the next one, the command must be a zero Twist.",
                f"commands {after}; in real time after {late} s",
            )
    avoider.expect(scan, FORWARD, "When scans come again after a pause, with nothing near")


def simulate(avoider, seconds, step, scans):
    """The commands of some simulated time, in which `scans(tick)` is shown at each tick of `step` s."""
    ticks, end = range(round(seconds / step)), len(avoider.commands.heard)

    def play(limit, alive):
        for tick in ticks:
            if not alive() or avoider.bench.clock.left <= 0:
                return None
            avoider.tick(scans(tick), step, wait=False)
        return [speeds(command) for command in avoider.commands.heard[end:]] if alive() else None

    return avoider.converse(play)


@points(2, cell="rooms")
def test_hall(drivers, rng):
    """Drives about a hall, with a scanner of 720 beams that starts behind."""
    expect_drive(drivers["hall"], "hall", rng)


@points(2, cell="rooms")
def test_pillars(drivers, rng):
    """Drives among pillars, with a scanner that sees 270 degrees."""
    expect_drive(drivers["pillars"], "pillars", rng)


@points(2, cell="rooms")
def test_corridor(drivers, rng):
    """Drives along a corridor, with a scanner that turns clockwise."""
    expect_drive(drivers["corridor"], "corridor", rng)


def expect_drive(driver, kind, rng):
    """It drives without touching anything, and covers ground, in one of two rooms where the course's own agent does."""
    tried = 0
    while tried < 2:
        room, seed = draw(kind, rng), rng.randrange(1000)
        driven = driver.drive(room, LASERS[kind], seed, SECONDS)
        if passed(driven):
            return
        tried += can_be_driven(room, LASERS[kind], seed)
    if driven.collisions:
        raise Wrong(f"It must not touch anything: after {math.ceil(driven.collisions[0].time)} s it hit an obstacle.")
    raise Wrong(
        f"In {SECONDS:.0f} s it must cover {GROUND:g} m² (in squares of 0.5 m): it covered "
        f"{driven.ground_covered():g} m²."
    )
