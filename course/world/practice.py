"""Training drives: records a driver's inputs and decisions, without ROS and much faster than real time."""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Protocol

import numpy as np

from course.errors import WorldError
from course.foundation.calls import fitting, is_number, is_whole, takes
from course.robot.sectors import Scan
from course.world.laser import Laser
from course.world.rooms import Room
from course.world.simulation import Simulation

PERIOD = 0.1  # s between two decisions
SHOVE = 0.8  # rad/s, standard deviation of the angular speed that a shove adds
SHOVED = 10  # decisions that a shove lasts


class Agent(Protocol):
    """An agent that decides on the next action."""

    def decide_action(self, laser_data: Mapping[str, Any]) -> Mapping[str, float]:
        """Return the next action, {'linear': m/s, 'angular': rad/s}."""


@fitting
def practise(
    driver: Agent,
    look: Callable[[Scan], Mapping[str, Any]],
    rooms: Iterable[str | Path | Room],
    seconds: float = 60.0,
    drives: int = 6,
    seed: int = 0,
) -> tuple[list[Mapping[str, Any]], list[Mapping[str, float]]]:
    """Return the inputs of `driver` (by `look`, from each scan) and its decisions, ten times a second.

    In each room it drives `drives` times for `seconds` s of simulated time.  Half of the time the robot is shoved
    aside, so that there are examples of getting out of a bad place.  The same `seed` gives the same examples.  Raises
    WorldError if there is no such room, and for anything else in the place of an argument or of a decision.
    """
    if not hasattr(driver, "decide_action") or not takes(look, None):
        raise WorldError(
            "`practise` takes a driver with `decide_action`, and then a function of a scan, as in "
            f"`practise(GoodDriver(), look, rooms=['hall'])`, not {driver!r:.40} and {look!r:.40}"
        )
    if isinstance(rooms, str | Room):
        written = repr(rooms) if isinstance(rooms, str) else "the_room"
        raise WorldError(f"`rooms` is a list of rooms: write rooms=[{written}]")
    if not isinstance(rooms, Iterable):
        raise WorldError(f"`rooms` is a list of rooms, such as rooms=['hall', 'pillars'], not {rooms!r:.40}")
    if not is_whole(drives, 0) or not is_number(seconds, 0.0):
        raise WorldError(
            f"`drives` is a whole number and `seconds` a number, as in `seconds=25.0, drives=6`, not "
            f"{drives!r:.40} and {seconds!r:.40}"
        )
    random = np.random.default_rng(seed)
    seen: list[Mapping[str, Any]] = []
    done: list[Mapping[str, float]] = []
    for room in rooms:
        for _ in range(drives):
            simulation, shove = Simulation(room, Laser(), seed=int(random.integers(1 << 30))), 0.0
            for tick in range(round(seconds / PERIOD)):
                laser_data = look(scan_of(simulation))
                action = driver.decide_action(laser_data)
                if not isinstance(action, Mapping) or not {"linear", "angular"} <= {*action}:
                    raise WorldError(
                        "`decide_action` must return a dict with 'linear' (m/s) and 'angular' (rad/s), and has "
                        f"returned {action!r:.60}"
                    )
                seen.append(laser_data)
                done.append(action)
                if tick % SHOVED == 0:
                    shove = float(random.normal(0.0, SHOVE)) if random.random() < 0.5 else 0.0
                simulation.step(action["linear"], action["angular"] + shove, PERIOD)
    return seen, done


def scan_of(simulation: Simulation) -> Scan:
    """Return the current scan, with the fields of a sensor_msgs/LaserScan that `course.robot.sectors` needs.

    Raises WorldError for anything but a simulation.
    """
    if not isinstance(simulation, Simulation):
        raise WorldError(f"`scan_of` takes a simulation, such as `world.node.simulation`, not {simulation!r:.40}")
    laser = simulation.laser
    return SimpleNamespace(
        ranges=simulation.scan(),
        angle_min=laser.angle_min,
        angle_increment=laser.angle_increment,
        range_min=laser.range_min,
        range_max=laser.range_max,
    )
