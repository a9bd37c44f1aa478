"""A good driver to learn from: a rule that uses the whole scan, where the chapter's agent has three numbers."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from course.errors import WorldError
from course.robot.sectors import wrap

AHEAD = math.radians(100.0)  # rad to both sides: directions in which it may steer
FRONT = math.radians(25.0)  # rad to both sides: obstacles there are in the way
NEAR = 0.6  # m within which an obstacle pushes the robot aside
SLOW, STAND = 0.75, 0.35  # m ahead, below which it slows down, and stops
SPEED, TURN, PIVOT = 0.3, 1.0, 0.8  # m/s; rad/s at most while driving; rad/s on the spot


class GoodDriver:
    """Steers towards open space and away from near obstacles, and drives more slowly with less room ahead."""

    def decide_action(self, laser_data: Mapping[str, Sequence[float]]) -> dict[str, float]:
        """Return the next action, {'linear': m/s, 'angular': rad/s}.

        Args:
            laser_data: a dict with 'ranges', the distances (m, finite) at angles that are spread evenly over a turn,
                the first one straight ahead, counter-clockwise.

        Raises WorldError for distances that are not finite.
        """
        ranges = np.asarray(laser_data["ranges"], dtype=float)
        if not ranges.size or not np.isfinite(ranges).all():
            raise WorldError(
                "the good driver needs distances that are finite: `np.clip(scan.ranges, 0.0, 3.0)` cuts those of free "
                "beams, which are infinite"
            )
        angles = wrap(2.0 * np.pi * np.arange(len(ranges)) / len(ranges))
        ahead = np.abs(angles) <= AHEAD
        weights = ranges**2 * np.cos(angles / 2.0)
        way = math.atan2((weights * np.sin(angles))[ahead].sum(), (weights * np.cos(angles))[ahead].sum())
        near = np.clip(NEAR - ranges, 0.0, None)
        push = -(near * np.sign(np.sin(angles)))[ahead].sum() * 2.0 * np.pi / len(ranges)
        front = ranges[np.abs(angles) <= FRONT].min()
        linear = SPEED * min(1.0, max(0.0, (front - STAND) / (SLOW - STAND)))
        if linear < SPEED / 6.0:
            return {"linear": 0.0, "angular": math.copysign(PIVOT, way)}
        return {"linear": linear, "angular": max(-TURN, min(TURN, 1.5 * way + 2.0 * push))}
