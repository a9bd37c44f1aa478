"""Scans of which the nearest distances are known: a scanner, and how near the obstacles in each sector are."""

import math
import random
from collections.abc import Mapping
from dataclasses import dataclass

from sensor_msgs.msg import LaserScan

SECTORS = {"front": (-25.0, 25.0), "right": (-80.0, -40.0)}  # degrees
MIDDLE = {"front": (-16.0, 16.0), "right": (-70.0, -50.0)}  # degrees, far from any edge
AROUND = 12.0  # degrees beside a sector that have the value that a whole sector has
EDGE = 0.4  # degrees on both sides of a sector's edge: no obstacle is there, so rounding at the edge is not judged
MIN, MAX = 0.12, 10.0  # m, of every scanner
FAR = (6.0, 8.0)  # m: what is seen outside the sectors
OUTSIDE = (0.13, 0.19)  # m: the same where it must not count, nearer than anything in a sector
OPEN = 5.0  # m: the nearest obstacle of a sector of which nothing is said
BACKGROUND = (0.2, 2.0)  # m that the other beams of a sector see farther than its nearest obstacle
INF, NAN = math.inf, math.nan


@dataclass(frozen=True)
class Scanner:
    """A laser scanner: how many beams it has, the angle of the first, and from each beam to the next (degrees).

    `beyond` is how many steps beyond its last beam its `angle_max` is: with many drivers, 1.
    """

    beams: int = 360
    first: float = 0.0
    step: float = 1.0
    beyond: int = 0

    def angle(self, beam: int) -> float:
        """Return the direction of a beam (degrees, -180 to 180; 0 is ahead, positive is left)."""
        return math.remainder(self.first + beam * self.step, 360.0)

    def inside(self, sector: str) -> list[int]:
        """The beams well inside a sector."""
        low, high = SECTORS[sector]
        return [beam for beam in range(self.beams) if low + EDGE <= self.angle(beam) <= high - EDGE]

    def look(self, rng: random.Random, /, **nearest: float) -> LaserScan:
        """A scan in which each sector's obstacle is as near as `nearest` says (m), somewhere in its middle."""
        return self._look(rng, {}, nearest, FAR)

    def flat(self, rng: random.Random, /, **distance: float) -> LaserScan:
        """A scan in which each sector has the same `distance` (m) everywhere, and nothing is nearer beside it."""
        ranges = [rng.uniform(*FAR) for _ in range(self.beams)]
        for sector, value in distance.items():
            for beam in self._around(sector):  # exactly on an edge too: such a beam may count or not
                ranges[beam] = value
        return self.scan(ranges)

    def look_at(self, rng: random.Random, angles: Mapping[str, float], /, **nearest: float) -> LaserScan:
        """The same with the sectors' obstacles at these angles (degrees).

        Everywhere outside the sectors something is closer, which must not count.
        """
        return self._look(rng, angles, nearest, OUTSIDE)

    def _look(
        self,
        rng: random.Random,
        angles: Mapping[str, float],
        nearest: Mapping[str, float],
        outside: tuple[float, float],
    ) -> LaserScan:
        ranges = [rng.uniform(*outside) for _ in range(self.beams)]
        for sector in SECTORS:
            for beam in self._around(sector):
                ranges[beam] = rng.uniform(*FAR)
            beams = self.inside(sector)
            for beam in beams:
                ranges[beam] = nearest.get(sector, OPEN) + rng.uniform(*BACKGROUND)
            if beams:
                angle = angles.get(sector, rng.uniform(*MIDDLE[sector]))
                off = {beam: abs(self.angle(beam) - angle) for beam in beams}
                ranges[min(beams, key=off.__getitem__)] = nearest.get(sector, OPEN)
        return self.scan(ranges)

    def _around(self, sector: str, margin: float = EDGE) -> list[int]:
        """The beams of a sector, and those beside it, up to `margin` degrees away."""
        low, high = SECTORS[sector]
        return [beam for beam in range(self.beams) if low - margin <= self.angle(beam) <= high + margin]

    def change(self, scan: LaserScan, rng: random.Random, sector: str, value: float, share: float = 1.0) -> LaserScan:
        """The scan with `value` in all beams of a sector and beside it, but not in other sectors.

        A `share` below 1 leaves out what is beside it, the beam that sees the nearest obstacle, and others at random.
        """
        others = {beam for other in SECTORS if other != sector for beam in self._around(other)}
        beams = [beam for beam in self._around(sector, AROUND) if beam not in others]
        if share < 1.0:
            nearest = min(self.inside(sector), key=lambda beam: scan.ranges[beam])
            beams = [beam for beam in self.inside(sector) if beam != nearest and rng.random() < share]
        for beam in beams:
            scan.ranges[beam] = value
        return scan

    def scan(self, ranges: list[float], least: float = MIN, most: float = MAX) -> LaserScan:
        """The message that holds these ranges (m), of a scanner that measures from `least` to `most` m."""
        scan = LaserScan(
            angle_min=math.radians(self.first),
            angle_increment=math.radians(self.step),
            angle_max=math.radians(self.first + self.step * (max(0, len(ranges) - 1) + self.beyond)),
            range_min=least,
            range_max=most,
            ranges=ranges,
        )
        scan.header.frame_id = "laser"
        return scan


PLAIN = Scanner()
