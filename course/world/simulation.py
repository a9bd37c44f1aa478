"""The physics of the world: a robot with a laser in a room, moved step by step, without ROS or a clock."""

import math
from dataclasses import dataclass, replace
from numbers import Real
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from course.errors import WorldError
from course.foundation.calls import fitting, is_number, is_whole
from course.world.geometry import (
    MOST_ANGLE,
    Floats,
    Pose,
    RayCaster,
    circle,
    clearance,
    is_inside,
    nearest_point,
    outlines,
)
from course.world.laser import Laser
from course.world.rooms import Room, find

MAX_STEP = 0.01  # s, the longest move between two collision checks: 5 mm at the robot's full speed
OBSTACLE = 0.15  # m, radius of a dropped obstacle: smaller than the robot, so that the robot cannot be inside
OVERLAP = 0.01  # m by which an obstacle may stand in a wall: the robot view knows walls to the nearest 0.01 m
ROUNDING = 1e-9  # m, more than the sums of a step are wrong by
AWAY = 0.02  # m that the robot must back off before touching the obstacle again counts as a new collision


@dataclass(frozen=True)
class Robot:
    """A round differential-drive robot; commands beyond its limits are clipped."""

    radius: float = 0.18  # m
    max_linear: float = 0.5  # m/s, forwards and backwards
    max_angular: float = 2.0  # rad/s

    def limit(self, linear: float, angular: float) -> tuple[float, float]:
        """Return the reachable speeds (m/s, rad/s) for a command; 0 for NaN and infinity."""
        if not (math.isfinite(linear) and math.isfinite(angular)):
            return 0.0, 0.0
        return (
            max(-self.max_linear, min(self.max_linear, linear)),
            max(-self.max_angular, min(self.max_angular, angular)),
        )


def advance(pose: Pose, linear: float, angular: float, duration: float) -> Pose:
    """Return the pose after driving from `pose` for `duration` s at constant speeds (m/s, rad/s), on a circular arc."""
    return _moved(pose, *_arc(linear, angular, duration))


def _arc(linear: float, angular: float, duration: float) -> tuple[float, float]:
    """Return the chord (m) and the turn (rad) of the arc that is driven in `duration` s."""
    turn = angular * duration
    # Written with sinc, the chord also holds when the robot drives straight.
    return linear * duration * float(np.sinc(turn / (2.0 * math.pi))), turn


def _moved(pose: Pose, chord: float, turn: float) -> Pose:
    """Return the pose at the end of an arc from `pose`, of this chord (m) and turn (rad)."""
    x, y, heading = pose
    middle = heading + turn / 2.0
    return x + chord * math.cos(middle), y + chord * math.sin(middle), math.remainder(heading + turn, 2.0 * math.pi)


def in_the_way(
    point: tuple[float, float], radius: float, segments: Floats, robot: tuple[float, float] | None = None
) -> str:
    """Return why a round robot of `radius` (m) cannot stand at `point` (m) between `segments`, or "".

    `robot` (m) is a place where it can stand: what has closed walls around the point alone is a solid block.
    """
    if len(segments):
        points = segments.reshape(-1, 2)
        if np.any(point < points.min(axis=0)) or np.any(point > points.max(axis=0)):
            return "it is outside the room"
    if clearance(point, segments) <= radius:
        return "it would touch an obstacle"
    return "" if robot is None else _barrier(point, robot, segments)


def no_room(point: tuple[float, float], radius: float, segments: Floats, robot: tuple[float, float]) -> str:
    """Return why no obstacle of `radius` (m) fits at `point` (m) between `segments`, or "".

    `robot` (m) is a place where the robot can stand: it must be able to meet the obstacle.
    """
    if why := _barrier(point, robot, segments):
        return why
    return "it would touch a wall or an obstacle" if clearance(point, segments) < radius - OVERLAP else ""


def _barrier(point: tuple[float, float], robot: tuple[float, float], segments: Floats) -> str:
    """Return what keeps a robot at `robot` (m) from `point` (m) for certain: a closed outline around one of them."""
    for outline in outlines(segments):
        if is_inside(point, outline) != is_inside(robot, outline):
            return "it is outside the room" if is_inside(robot, outline) else "it is inside an obstacle"
    return ""


@dataclass(frozen=True)
class Collision:
    """A collision with an obstacle, counted once from the first contact until the robot moves away."""

    time: float  # s of simulated time
    x: float  # m, of the robot's middle
    y: float  # m
    contact: tuple[float, float]  # m, where it touched the obstacle

    def __str__(self) -> str:
        return f"the robot hit an obstacle at x={self.x:.2f} m, y={self.y:.2f} m, {self.time:.1f} s"


class Simulation:
    """One robot in one room.

    `pose` (x m, y m, heading rad), `velocity` (m/s, rad/s) and `time` (s) are current; `collisions` and `path` have the
    history.  The same room, laser, seed and commands always give the same numbers.
    """

    @fitting
    def __init__(
        self, room: str | Path | Room = "hall", laser: Laser | None = None, robot: Robot | None = None, seed: int = 0
    ) -> None:
        """Put the robot at the start of `room` (a name, the path of a .json file or a Room).

        Raises WorldError if there is no such room, if the robot touches an obstacle at its start, and for anything else
        in the place of the others.
        """
        self.room = find(room)
        self.laser = Laser() if laser is None else laser
        self.robot = Robot() if robot is None else robot
        self.seed = seed
        for each, kind, usual in ((self.laser, Laser, "Laser(beams=180)"), (self.robot, Robot, "Robot(radius=0.2)")):
            if not isinstance(each, kind):
                raise WorldError(f"a simulation takes a {kind.__name__.lower()}, such as `{usual}`, not {each!r:.40}")
        if not is_whole(seed, 0):
            raise WorldError(f"`seed` is a whole number, 0 or more, not {seed!r:.40}")
        self._caster = RayCaster(self.room.segments)
        if self._clearance(self.room.start) <= self.robot.radius:
            raise WorldError(f"room '{self.room.name}': the robot touches an obstacle at its start")
        self.reset()

    def reset(self) -> None:
        """Put the robot back at the start: time 0, no history, and the noise restarts."""
        self.time = 0.0
        self.pose: Pose = self.room.start
        self.velocity: tuple[float, float] = (0.0, 0.0)
        self.distance = 0.0  # m driven
        self.touching = False
        self.collisions: list[Collision] = []
        self._random = np.random.default_rng(self.seed)
        self._path: list[tuple[float, float, float, float]] = [(0.0, *self.pose)]

    def _clearance(self, pose: Pose) -> float:
        return clearance(pose[:2], self.room.segments)

    def _is_free(self, way: float) -> bool:
        """Return True if the robot is farther from all obstacles than it drives now (m): most steps touch nothing."""
        return self._clearance(self.pose) - self.robot.radius > way + ROUNDING

    @fitting
    def place(self, pose: Pose) -> None:
        """Put the robot at `pose` (x m, y m, heading rad), at rest; its history is kept.

        Raises WorldError if it would touch an obstacle, be inside one or outside the room, and for a number that is not
        finite.
        """
        if np.shape(pose) != (3,) or not all(map(is_number, pose)) or abs(pose[2]) > MOST_ANGLE:
            raise WorldError(f"a pose is three finite numbers, x (m), y (m) and heading (rad), not {pose!r:.60}")
        x, y, heading = pose
        if obstacle := in_the_way((x, y), self.robot.radius, self.room.segments, self.room.start[:2]):
            raise WorldError(f"the robot cannot stand at x={x:.2f} m, y={y:.2f} m: {obstacle}")
        self.pose, self.velocity, self.touching = (x, y, math.remainder(heading, 2.0 * math.pi)), (0.0, 0.0), False
        self._path.append((self.time, *self.pose))

    @fitting
    def drop(self, x: float, y: float, radius: float = OBSTACLE) -> None:
        """Put a round obstacle of `radius` (m) at x, y (m); a new Simulation does not have it.

        Raises WorldError if the robot stands there, if it would touch a wall or an obstacle, if the place is inside an
        obstacle or outside the room, and for a number that is not finite.
        """
        if not (is_number(x) and is_number(y) and is_number(radius, 0.0)):
            raise WorldError("an obstacle has finite numbers: x (m), y (m) and its radius (m)")
        if math.dist((x, y), self.pose[:2]) <= radius + self.robot.radius:
            raise WorldError(f"no obstacle fits at x={x:.2f} m, y={y:.2f} m: the robot stands there")
        if why := no_room((x, y), radius, self.room.segments, self.room.start[:2]):
            raise WorldError(f"no obstacle fits at x={x:.2f} m, y={y:.2f} m: {why}")
        self.room = replace(self.room, segments=np.concatenate([self.room.segments, circle(x, y, radius)]))
        self._caster = RayCaster(self.room.segments)

    def scan(self) -> NDArray[np.float32]:
        """Return the laser's measurement at the current pose (m, shape (beams,)); each call draws fresh noise."""
        return self.laser.measure(self._caster, self.pose, self._random)

    @fitting
    def nearest(self, begin: float, end: float) -> float:
        """Return the distance (m) from the robot's middle to the nearest obstacle between two angles (degrees).

        It is the true distance, not a measurement; `inf` if there is no obstacle.  Raises WorldError unless the first
        angle is the smaller one.
        """
        if not (is_number(begin) and is_number(end) and begin <= end):
            raise WorldError(
                f"`nearest` takes two angles in degrees, counter-clockwise, the smaller one first, such as "
                f"`nearest(-30, 30)`, not {begin!r:.20} and {end!r:.20}"
            )
        x, y, heading = self.pose
        angles = heading + np.radians(np.arange(begin, end + 0.5, 1.0))
        return float(self._caster.distances((x, y), angles).min())

    @fitting
    def step(self, linear: float, angular: float, duration: float) -> Collision | None:
        """Drive at the commanded speeds (m/s, rad/s) for `duration` s.

        The robot stops before it would touch an obstacle, and can turn or drive away from there.  Returns the collision
        that began in this step, or None.  Raises WorldError for anything but numbers, and for a negative duration.
        """
        if not is_number(duration, 0.0):
            raise WorldError(f"`duration` is a number of seconds, 0 or more, not {duration!r:.40}")
        command: tuple[object, ...] = linear, angular
        if not all(isinstance(speed, Real) for speed in command):
            raise WorldError(f"the robot is driven by two numbers (m/s, rad/s), not {linear!r:.40} and {angular!r:.40}")
        linear, angular = self.robot.limit(linear, angular)
        pieces = max(1, math.ceil(duration / MAX_STEP - 1e-9))
        begun, moved = None, 0.0
        chord, turn = _arc(linear, angular, duration / pieces)
        free = not linear or (not self.touching and self._is_free(pieces * abs(chord)))
        for _ in range(pieces):
            ahead = _moved(self.pose, chord, turn)
            self.time += duration / pieces
            gap = math.inf if free else self._clearance(ahead) - self.robot.radius
            if gap > 0.0:
                moved += math.dist(ahead[:2], self.pose[:2])
                self.pose = ahead
                self.touching = self.touching and (not linear or gap < AWAY)
                continue
            # The obstacle blocks the way, but the robot can still turn on the spot.
            self.pose = advance(self.pose, 0.0, angular, duration / pieces)
            if not self.touching:
                self.touching = True
                begun = Collision(self.time, *self.pose[:2], nearest_point(ahead[:2], self.room.segments))
                self.collisions.append(begun)
        self.distance += moved
        self.velocity = (math.copysign(moved / duration, linear) if moved else 0.0, angular)
        self._path.append((self.time, *self.pose))
        return begun

    @property
    def path(self) -> Floats:
        """Return the robot's path: shape (n, 4), rows of time (s), x (m), y (m), heading (rad)."""
        return np.array(self._path)

    def path_since(self, count: int) -> tuple[int, list[tuple[float, float, float, float]]]:
        """Return the number of rows of `path`, and the rows after the first `count`."""
        path = self._path
        return len(path), path[count:]

    def ground_covered(self, cell: float = 0.5) -> float:
        """Return the area (m²) of the grid squares of side `cell` (m) that the robot's centre has visited."""
        squares = np.unique(np.floor(self.path[:, 1:3] / cell), axis=0)
        return len(squares) * cell * cell
