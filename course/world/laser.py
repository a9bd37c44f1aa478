"""A laser scanner as described by sensor_msgs/LaserScan, in plain NumPy, with noise that a seed reproduces."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from course.errors import WorldError
from course.foundation.calls import is_number, is_whole
from course.world.geometry import MOST_ANGLE, Floats, Pose, RayCaster

MOST_BEAMS = 3600


@dataclass(frozen=True)
class Laser:
    """A scanner at the centre of the robot, with beams counter-clockwise from `angle_min`; 0 is straight ahead.

    The default has 360 beams, one for each degree, and starts straight ahead.  Raises WorldError for impossible
    values.
    """

    beams: int = 360
    angle_min: float = 0.0  # rad
    angle_increment: float = 2.0 * np.pi / 360  # rad, negative turns clockwise
    range_min: float = 0.1  # m
    range_max: float = 8.0  # m
    noise: float = 0.01  # m, standard deviation of a measured distance

    def __post_init__(self) -> None:
        if not is_whole(self.beams, 1, MOST_BEAMS):
            raise WorldError(f"beams must be from 1 to {MOST_BEAMS}, a whole number, not {self.beams!r:.40}")
        for name in ("angle_min", "angle_increment"):
            if not is_number(getattr(self, name), -MOST_ANGLE, MOST_ANGLE):
                raise WorldError(
                    f"{name} must be an angle in rad (math.radians(180) is half a turn), not "
                    f"{getattr(self, name)!r:.40}"
                )
        for name in ("range_min", "range_max", "noise"):
            if not is_number(getattr(self, name), 0.0):
                raise WorldError(f"{name} must be a distance (m), 0 or more, not {getattr(self, name)!r:.40}")

    @classmethod
    def turn(cls, beams: int = 360, angle_min: float = 0.0, **others: float) -> "Laser":
        """Return a scanner whose `beams` are spread evenly over one full turn; `others` are further fields."""
        return cls(beams=beams, angle_min=angle_min, angle_increment=2.0 * np.pi / (beams or 1), **others)

    @property
    def angles(self) -> Floats:
        """Return the angle of each beam (rad, shape (beams,)), relative to the robot's heading."""
        return self.angle_min + self.angle_increment * np.arange(self.beams, dtype=np.float64)

    def measure(self, caster: RayCaster, pose: Pose, random: np.random.Generator) -> NDArray[np.float32]:
        """Scan from `pose` (x m, y m, heading rad): ranges (m, shape (beams,)).

        `caster` holds the walls, `random` draws the noise.  By REP 117, a beam without an obstacle up to `range_max`
        reads +inf, and one with an obstacle nearer than `range_min` reads -inf.
        """
        ranges = caster.distances(pose[:2], self.angles + pose[2])
        if self.noise > 0.0:
            ranges = ranges + random.normal(0.0, self.noise, self.beams)
        near, far = ranges < self.range_min, ranges > self.range_max
        ranges[near], ranges[far] = -np.inf, np.inf
        return ranges.astype(np.float32)
