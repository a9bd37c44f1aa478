"""Rooms that nobody has seen: drawn anew for each grading, and driven by the course's own agent when in doubt."""

import math
import random
from typing import NamedTuple

from course.robot.agent import ObstacleAvoidanceAI
from course.robot.sectors import sectors
from course.world import Laser, Room, Simulation

SECONDS = 30.0  # of simulated time
GROUND = 3.0  # m² that must be covered, in squares of 0.5 m; the course's own agent never covers less than 4
PERIOD = 0.1  # s between two decisions
ROBOT = 0.3  # m around the start of a drive that stay free
PILLARS, DRAWN = 4, 100  # pillars at most, and places that are tried for them
CORNERS = 16  # of the polygon that stands for a round pillar
WALL = 1.2  # m from a wall to the middle of a pillar, at least
GAP = 0.9  # m between two pillars, at least: the robot is 0.36 m wide
SLANT = 0.3  # rad that the robot may be turned against the corridor's direction at first
KINDS = ("hall", "pillars", "corridor")
LASERS = {
    "hall": Laser.turn(beams=720, angle_min=-math.pi),
    "pillars": Laser(beams=541, angle_min=-math.radians(135), angle_increment=math.radians(0.5)),
    "corridor": Laser(beams=360, angle_min=math.pi, angle_increment=-math.radians(1.0)),
}


Point = tuple[float, float]  # m
Polygon = list[Point]


class Pose(NamedTuple):
    """Where the robot starts."""

    x: float  # m
    y: float  # m
    heading: float  # rad


def draw(kind: str, rng: random.Random) -> Room:
    """A room of that kind, turned by any angle."""
    width, depth = rng.uniform(6.0, 9.0), rng.uniform(5.0, 7.0)
    polygons = [outline(width, depth, rng.uniform(0.8, 1.2))]
    start = Pose(rng.uniform(1.5, 2.5), rng.uniform(1.5, 2.5), rng.uniform(-math.pi, math.pi))
    if kind == "pillars":
        polygons += pillars(rng, width, depth, start)
    if kind == "corridor":
        wide = rng.uniform(1.5, 1.8)
        polygons.append([(wide, wide), (width - wide, wide), (width - wide, depth - wide), (wide, depth - wide)])
        along = rng.uniform(2.0, width / 2)
        start = Pose(along, wide / 2, rng.choice([0.0, math.pi]) + rng.uniform(-SLANT, SLANT))
    angle = rng.uniform(-math.pi, math.pi)
    return Room.from_data(
        {
            "name": kind,
            "start": (*turned((start.x, start.y), angle), start.heading + angle),
            "polygons": [[turned(point, angle) for point in polygon] for polygon in polygons],
        }
    )


def outline(width: float, depth: float, corner: float) -> Polygon:
    """The walls of a room (m), whose corners are cut off by `corner` m."""
    return [
        (corner, 0),
        (width - corner, 0),
        (width, corner),
        (width, depth - corner),
        (width - corner, depth),
        (corner, depth),
        (0, depth - corner),
        (0, corner),
    ]


def pillars(rng: random.Random, width: float, depth: float, start: Pose) -> list[Polygon]:
    """Up to four round pillars, with room for the robot between them and around its start."""
    taken = [(start.x, start.y, ROBOT)]
    for _ in range(DRAWN):
        x, y = rng.uniform(WALL, width - WALL), rng.uniform(WALL, depth - WALL)
        radius = rng.uniform(0.25, 0.45)
        if len(taken) <= PILLARS and all(math.hypot(x - a, y - b) > radius + other + GAP for a, b, other in taken):
            taken.append((x, y, radius))
    corners = [turn * 2 * math.pi / CORNERS for turn in range(CORNERS)]
    return [
        [(x + radius * math.cos(corner), y + radius * math.sin(corner)) for corner in corners]
        for x, y, radius in taken[1:]
    ]


def turned(point: Point, angle: float) -> Point:
    """A point, turned around the origin by `angle` rad."""
    x, y = point
    return x * math.cos(angle) - y * math.sin(angle), x * math.sin(angle) + y * math.cos(angle)


def passed(driven: Simulation) -> bool:
    """Whether a drive was as the task asks."""
    return not driven.collisions and driven.ground_covered() >= GROUND


def can_be_driven(room: Room, laser: Laser, seed: int) -> bool:
    """Whether the course's own agent passes there, with each decision carried out at once and a moment later."""
    return all(passed(drive(room, laser, seed, late)) for late in (0, 1))


def drive(room: Room, laser: Laser, seed: int, late: int = 0) -> Simulation:
    """A drive of the course's own agent there, each decision carried out `late` periods later."""
    simulation, agent = Simulation(room, laser, seed=seed), ObstacleAvoidanceAI()
    actions = [agent.stop()] * late
    for _ in range(round(SECONDS / PERIOD)):
        seen = sectors(simulation.scan(), laser.angle_min, laser.angle_increment, laser.range_min, laser.range_max)
        actions.append(agent.decide_action(seen))
        action = actions.pop(0)
        simulation.step(action["linear"], action["angular"], PERIOD)
    return simulation
