"""Rooms that nobody has seen: drawn anew for each grading, and driven by the agent of the course when in doubt."""

import math
import random

from course.robot.agent import ObstacleAvoidanceAI
from course.robot.sectors import sectors
from course.world import Laser, Room, Simulation

SECONDS = 30.0  # of simulated time
GROUND = 3.0  # m2 that must be covered, in squares of 0.5 m; the agent of the course never covers less than 4
PERIOD = 0.1  # s
KINDS = ("hall", "pillars", "corridor")
LASERS = {
    "hall": Laser.turn(beams=720, angle_min=-math.pi),
    "pillars": Laser(beams=541, angle_min=-math.radians(135), angle_increment=math.radians(0.5)),
    "corridor": Laser(beams=360, angle_min=math.pi, angle_increment=-math.radians(1.0)),
}


def draw(kind: str, rng: random.Random) -> Room:
    """A room of that kind, turned by any angle."""
    width, depth = rng.uniform(6.0, 9.0), rng.uniform(5.0, 7.0)
    corner = rng.uniform(0.8, 1.2)
    outer = [
        (corner, 0),
        (width - corner, 0),
        (width, corner),
        (width, depth - corner),
        (width - corner, depth),
        (corner, depth),
        (0, depth - corner),
        (0, corner),
    ]
    polygons, start = [outer], (rng.uniform(1.5, 2.5), rng.uniform(1.5, 2.5), rng.uniform(-math.pi, math.pi))
    if kind == "pillars":
        taken = [(*start[:2], 0.3)]
        for _ in range(100):
            x, y, radius = rng.uniform(1.2, width - 1.2), rng.uniform(1.2, depth - 1.2), rng.uniform(0.25, 0.45)
            if len(taken) < 5 and all(math.hypot(x - a, y - b) > radius + other + 0.9 for a, b, other in taken):
                taken.append((x, y, radius))
        polygons += [
            [
                (x + radius * math.cos(turn * math.pi / 8), y + radius * math.sin(turn * math.pi / 8))
                for turn in range(16)
            ]
            for x, y, radius in taken[1:]
        ]
    if kind == "corridor":
        wide = rng.uniform(1.5, 1.8)
        polygons.append([(wide, wide), (width - wide, wide), (width - wide, depth - wide), (wide, depth - wide)])
        start = (rng.uniform(2.0, width / 2), wide / 2, rng.choice([0.0, math.pi]) + rng.uniform(-0.3, 0.3))
    angle = rng.uniform(-math.pi, math.pi)
    cos, sin = math.cos(angle), math.sin(angle)

    def turned(x, y):
        return x * cos - y * sin, x * sin + y * cos

    return Room.from_data(
        {
            "name": kind,
            "start": (*turned(*start[:2]), start[2] + angle),
            "polygons": [[turned(*point) for point in polygon] for polygon in polygons],
        }
    )


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
