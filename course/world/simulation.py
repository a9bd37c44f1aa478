"""A robot with a laser in a room, moved step by step: the physics of the world, without ROS and without a clock."""

import math
from dataclasses import dataclass

import numpy as np

from course.world.geometry import RayCaster, clearance
from course.world.laser import Laser
from course.world.rooms import Room, find

MAX_STEP = 0.01  # s, the longest move between two looks for a collision: 5 mm at the robot's full speed
AWAY = 0.02  # m, how far the robot must come off an obstacle before touching it again is another collision


@dataclass(frozen=True)
class Robot:
    """A round differential-drive robot; it takes any command, and moves no faster than it can."""

    radius: float = 0.18  # m
    max_linear: float = 0.5  # m/s, forwards and backwards
    max_angular: float = 2.0  # rad/s

    def limit(self, linear, angular):
        """The speeds (m/s, rad/s) that the wheels make of a command; a command that is no number stands still."""
        if not (math.isfinite(linear) and math.isfinite(angular)):
            return 0.0, 0.0
        return (
            max(-self.max_linear, min(self.max_linear, linear)),
            max(-self.max_angular, min(self.max_angular, angular)),
        )


def advance(pose, linear, angular, duration):
    """The pose (x m, y m, heading rad) after driving an arc at constant speeds (m/s, rad/s) for `duration` s."""
    x, y, heading = pose
    turn = angular * duration
    # The chord of the arc: sinc keeps it right when the robot goes straight.
    chord = linear * duration * float(np.sinc(turn / (2.0 * math.pi)))
    middle = heading + turn / 2.0
    return x + chord * math.cos(middle), y + chord * math.sin(middle), math.remainder(heading + turn, 2.0 * math.pi)


@dataclass(frozen=True)
class Collision:
    """One touch of a wall, from the moment the robot meets it until it moves away."""

    time: float  # s of simulated time
    x: float  # m
    y: float  # m

    def __str__(self):
        return f"the robot hit an obstacle at x={self.x:.2f} m, y={self.y:.2f} m, {self.time:.1f} s"


class Simulation:
    """One robot in one room.

    `pose` (x m, y m, heading rad), `velocity` (m/s, rad/s) and `time` (s) are of now; `collisions` and `path` (rows of
    time, x, y, heading) tell what has been.  The same room, laser, seed and commands give the same numbers every time.
    """

    def __init__(self, room="hall", laser=None, robot=None, seed=0):
        """Put the robot at the start of `room` (a name, a .json path or a Room).

        Raises ValueError when there is no such room or the robot touches an obstacle where it starts.
        """
        self.room: Room = find(room)
        self.laser = laser or Laser()
        self.robot = robot or Robot()
        self.seed = seed
        self._caster = RayCaster(self.room.segments)
        if self._clearance(self.room.start) <= self.robot.radius:
            raise ValueError(f"room '{self.room.name}': the robot touches an obstacle at its start")
        self.reset()

    def reset(self):
        """Back to the start: time 0, nothing driven, no collision, the noise from its beginning."""
        self.time = 0.0
        self.pose = self.room.start
        self.velocity = (0.0, 0.0)
        self.distance = 0.0  # m driven
        self.touching = False
        self.collisions: list[Collision] = []
        self._random = np.random.default_rng(self.seed)
        self._path = [(0.0, *self.pose)]

    def _clearance(self, pose):
        return clearance(pose[:2], self.room.segments)

    def scan(self):
        """What the laser measures from here (m, float32, shape (beams,)); each call draws fresh noise."""
        return self.laser.measure(self._caster, self.pose, self._random)

    def step(self, linear, angular, duration):
        """Drive at the commanded speeds (m/s, rad/s) for `duration` s.

        The robot stops where it would touch an obstacle, and can turn or drive away from there.  Returns the collision
        that began in this step, or None.
        """
        linear, angular = self.robot.limit(linear, angular)
        pieces = max(1, math.ceil(duration / MAX_STEP - 1e-9))
        begun, moved = None, 0.0
        for _ in range(pieces):
            ahead = advance(self.pose, linear, angular, duration / pieces)
            self.time += duration / pieces
            gap = self._clearance(ahead) - self.robot.radius if linear else math.inf
            if gap > 0.0:
                moved += math.dist(ahead[:2], self.pose[:2])
                self.pose = ahead
                self.touching = self.touching and (not linear or gap < AWAY)
                continue
            # Held by the obstacle: the wheels still turn the robot on the spot.
            self.pose = advance(self.pose, 0.0, angular, duration / pieces)
            if not self.touching:
                self.touching = True
                begun = Collision(self.time, *self.pose[:2])
                self.collisions.append(begun)
        self.distance += moved
        self.velocity = (math.copysign(moved / duration, linear) if moved else 0.0, angular)
        self._path.append((self.time, *self.pose))
        return begun

    @property
    def path(self):
        """Where the robot has been: an array of shape (n, 4), rows of time (s), x (m), y (m), heading (rad)."""
        return np.array(self._path)

    def ground_covered(self, cell=0.5):
        """The area (m2) of the squares of side `cell` (m) that the robot's middle has been in."""
        squares = np.unique(np.floor(self.path[:, 1:3] / cell), axis=0)
        return len(squares) * cell * cell
