"""Rooms that nobody has seen, drawn for each grading, and what is asked of a drive through one."""

import math
import random
from typing import NamedTuple

import numpy as np

from autograder.hidden.ai_integration.programs.right_agent_node import decide
from course.robot.sectors import wrap
from course.world import Laser, Room, Simulation
from course.world.geometry import RayCaster

SECONDS = 30.0  # of simulated time
ALONG = 6.0  # m of new ground that must be driven beside a wall; the grader's own follower never drives less than 7
MARK = 0.2  # m: ground is new for each mark that is so far from all marks before
SHARE = (
    0.8  # of the time, since there was a wall beside the robot first; the grader's own follower never has less than 0.9
)
BESIDE = (0.3, 1.0)  # m: so far away is a wall that the robot has on its right
VIEW = np.radians(np.arange(-120.0, -59.0, 2.0))  # rad: where that is
PERIOD = 0.1  # s between two decisions
SLANT = 0.3  # rad that the robot may be turned against the wall at first
KINDS = ("hall", "block", "bend")
LASERS = {
    "hall": Laser.turn(beams=240, angle_min=-math.pi),
    "block": Laser(beams=181, angle_min=-math.radians(135), angle_increment=math.radians(1.5)),
    "bend": Laser(beams=240, angle_min=math.pi, angle_increment=-math.radians(1.5)),
}

Point = tuple[float, float]  # m
Polygon = list[Point]


class Driven(NamedTuple):
    """The properties of a drive that the task asks for."""

    collisions: int
    first: float  # s until there was a wall on the right; infinite when there was none
    along: float  # m of new ground driven with a wall on the right
    share: float  # of the time since `first` in which there was one
    seconds: float  # of simulated time: less than SECONDS when the node sent no command any more

    @property
    def passed(self) -> bool:
        """Return True if it was as the task asks."""
        return not self.collisions and self.along >= ALONG and self.share >= SHARE


def draw(kind: str, rng: random.Random) -> Room:
    """A room of that kind, turned by any angle; the robot starts with a wall on its right."""
    width, depth = rng.uniform(6.0, 8.0), rng.uniform(5.5, 7.0)
    x, y, heading = rng.uniform(1.2, 2.2), rng.uniform(0.6, 0.9), rng.uniform(-SLANT, SLANT)
    if kind == "hall":  # with a wall that stands into it
        wall, length = rng.uniform(2.8, width - 2.5), rng.uniform(1.0, depth - 3.2)
        end = depth - length
        polygons = [
            [
                *[(0, 0), (width, 0), (width, depth), (wall + 0.1, depth)],
                *[(wall + 0.1, end), (wall - 0.1, end), (wall - 0.1, depth), (0, depth)],
            ]
        ]
    elif kind == "block":  # the robot drives around it
        wide, deep = rng.uniform(1.2, 2.0), rng.uniform(1.2, 2.0)
        polygons = [box(0, 0, width, depth), box(2.0, 2.0, 2.0 + wide, 2.0 + deep)]
        x, y, heading = 2.0 + rng.uniform(0.3, wide - 0.3), 2.0 - y, heading + math.pi
    else:
        first, second = rng.uniform(2.2, 2.8), rng.uniform(2.2, 2.8)
        polygons = [[(0, 0), (width, 0), (width, second), (first, second), (first, depth), (0, depth)]]
    angle = rng.uniform(-math.pi, math.pi)
    return Room.from_data(
        {
            "name": kind,
            "start": (*turned((x, y), angle), heading + angle),
            "polygons": [[turned(point, angle) for point in polygon] for polygon in polygons],
        }
    )


def box(x_min: float, y_min: float, x_max: float, y_max: float) -> Polygon:
    """The corners of a rectangle (m)."""
    return [(x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max)]


def turned(point: Point, angle: float) -> Point:
    """A point, turned around the origin by `angle` rad."""
    x, y = point
    return x * math.cos(angle) - y * math.sin(angle), x * math.sin(angle) + y * math.cos(angle)


def look_back(simulation: Simulation) -> Driven:
    """Return the properties of a drive that the task asks for."""
    path, caster = simulation.path, RayCaster(simulation.room.segments)
    nearest = [float(caster.distances((x, y), VIEW + heading).min()) for _, x, y, heading in path.tolist()]
    beside = [BESIDE[0] <= distance <= BESIDE[1] for distance in nearest]
    if True not in beside:
        return Driven(len(simulation.collisions), math.inf, 0.0, 0.0, simulation.time)
    first = beside.index(True)
    along = sum(new for wall, new in zip(beside, new_ground(path), strict=True) if wall)
    share = sum(beside[first:]) / (len(beside) - first)
    return Driven(len(simulation.collisions), float(path[first, 0]), along, share, simulation.time)


def new_ground(path: np.ndarray) -> list[float]:
    """Return the distance (m) of each pose of a path from all ground before; 0 for less than MARK.

    So driving back and forth does not count as following a wall.
    """
    marks, found = path[:1, 1:3], [0.0]
    for place in path[1:, 1:3]:
        nearest = float(np.linalg.norm(marks - place, axis=1).min())
        found.append(nearest if nearest >= MARK else 0.0)
        if nearest >= MARK:
            marks = np.vstack([marks, place])
    return found


def can_be_driven(room: Room, laser: Laser, seed: int) -> bool:
    """Return True if the grader's own follower passes there, carrying out decisions at once and also a moment later."""
    return all(look_back(drive(room, laser, seed, late)).passed for late in (0, 1))


def drive(room: Room, laser: Laser, seed: int, late: int = 0) -> Simulation:
    """A drive of the grader's own follower there, each decision carried out `late` periods later."""
    simulation, angles = Simulation(room, laser, seed=seed), np.degrees(wrap(laser.angles))
    actions = [(0.0, 0.0)] * late
    for _ in range(round(SECONDS / PERIOD)):
        ranges = np.where(np.isneginf(scan := simulation.scan()), 0.0, scan)
        actions.append(decide(ranges[np.abs(angles) <= 25].min(), ranges[(angles >= -80) & (angles <= -40)].min()))
        simulation.step(*actions.pop(0), PERIOD)
    return simulation
