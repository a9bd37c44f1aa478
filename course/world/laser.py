"""A laser scanner: what sensor_msgs/LaserScan says it measures, in plain NumPy, with noise that a seed repeats."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Laser:
    """A scanner at the middle of the robot, its beams counter-clockwise from `angle_min`, 0 straight ahead.

    The default is one turn of 360 beams, one a degree, that starts straight ahead.
    """

    beams: int = 360
    angle_min: float = 0.0  # rad
    angle_increment: float = 2.0 * np.pi / 360  # rad, negative turns clockwise
    range_min: float = 0.1  # m
    range_max: float = 8.0  # m
    noise: float = 0.01  # m, standard deviation of a measured distance

    @classmethod
    def turn(cls, beams=360, angle_min=0.0, **others):
        """A scanner whose `beams` share one full turn evenly."""
        return cls(beams=beams, angle_min=angle_min, angle_increment=2.0 * np.pi / beams, **others)

    @property
    def angles(self):
        """The angle of each beam (rad, shape (beams,)), relative to the robot's heading."""
        return self.angle_min + self.angle_increment * np.arange(self.beams)

    def measure(self, caster, pose, random):
        """Scan from `pose` (x m, y m, heading rad): ranges (m, float32, shape (beams,)).

        `caster` is the room's `RayCaster`, `random` a numpy.random.Generator.  By REP 117 a beam that meets nothing up
        to `range_max` reads +inf, and one that meets something nearer than `range_min` -inf.
        """
        ranges = caster.distances(pose[:2], self.angles + pose[2])
        if self.noise > 0.0:
            ranges = ranges + random.normal(0.0, self.noise, self.beams)
        near, far = ranges < self.range_min, ranges > self.range_max
        ranges[near], ranges[far] = -np.inf, np.inf
        return ranges.astype(np.float32)
