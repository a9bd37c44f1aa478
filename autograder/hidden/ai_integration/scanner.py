"""Scans for which the right command is known: a scanner, and how near the obstacles in each of its sectors are."""

import math
import random
from collections.abc import Mapping
from dataclasses import dataclass

from sensor_msgs.msg import LaserScan

SECTORS = {"front": (-30.0, 30.0), "left": (30.0, 90.0), "right": (-90.0, -30.0)}  # degrees
MIDDLE = {"front": (-20.0, 20.0), "left": (50.0, 80.0), "right": (-80.0, -50.0)}  # degrees, far from any edge
EDGE = 1.5  # degrees on both sides of a sector's edge: no obstacle is there, so rounding at the edge is not judged
MIN, MAX = 0.12, 10.0  # m, of every scanner
FAR = (6.0, 8.0)  # m: what is seen between the sectors, where nothing is near
FAR_BEHIND, NEAR_BEHIND = 6.0, MIN + 0.1  # m
OPEN = 5.0  # m: the nearest obstacle of a sector of which nothing is said
BACKGROUND = (0.2, 2.0)  # m that the other beams of a sector see farther than its nearest obstacle
CLEAR_BACKGROUND = (1.5, 3.0)  # m, the same where it matters which beam sees the obstacle
INF, NAN = math.inf, math.nan


@dataclass(frozen=True)
class Scanner:
    """A laser scanner: how many beams it has, the angle of the first, and from each beam to the next (degrees)."""

    beams: int = 360
    first: float = 0.0
    step: float = 1.0

    def angle(self, beam: int) -> float:
        """Where a beam points (degrees, -180 to 180; 0 is ahead, positive is left)."""
        return math.remainder(self.first + beam * self.step, 360.0)

    def inside(self, sector: str) -> list[int]:
        """The beams well inside a sector."""
        low, high = SECTORS[sector]
        return [beam for beam in range(self.beams) if low + EDGE <= self.angle(beam) <= high - EDGE]

    def look(self, rng: random.Random, /, **nearest: float) -> LaserScan:
        """A scan in which each sector's obstacle is as near as `nearest` says (m), somewhere in the sector's middle."""
        return self._look(rng, {}, nearest)

    def look_at(self, rng: random.Random, angles: Mapping[str, float], /, **nearest: float) -> LaserScan:
        """The same with the obstacles of some sectors at these angles (degrees).

        Something is close behind the robot then, which must not count.
        """
        return self._look(rng, angles, nearest)

    def _look(self, rng: random.Random, angles: Mapping[str, float], nearest: Mapping[str, float]) -> LaserScan:
        behind, background = (NEAR_BEHIND, CLEAR_BACKGROUND) if angles else (FAR_BEHIND, BACKGROUND)
        ranges = [behind if abs(self.angle(beam)) >= 90.0 + EDGE else rng.uniform(*FAR) for beam in range(self.beams)]
        for sector, middle in MIDDLE.items():
            beams = self.inside(sector)
            if not beams:
                continue
            for beam in beams:
                ranges[beam] = nearest.get(sector, OPEN) + rng.uniform(*background)
            angle = angles.get(sector, rng.uniform(*middle))
            off = {beam: abs(self.angle(beam) - angle) for beam in beams}
            ranges[min(beams, key=off.__getitem__)] = nearest.get(sector, OPEN)
        return self.scan(ranges)

    def change(self, scan: LaserScan, rng: random.Random, sector: str, value: float, share: float = 1.0) -> LaserScan:
        """The scan with `value` in all beams of a sector and at its edges.

        A `share` below 1 leaves out the edges, the beam that sees the nearest obstacle, and some others at random.
        """
        low, high = SECTORS[sector]
        beams = [beam for beam in range(self.beams) if low - EDGE <= self.angle(beam) <= high + EDGE]
        if share < 1.0:
            nearest = min(self.inside(sector), key=lambda beam: scan.ranges[beam])
            beams = [beam for beam in self.inside(sector) if beam != nearest and rng.random() < share]
        for beam in beams:
            scan.ranges[beam] = value
        return scan

    def scan(self, ranges: list[float]) -> LaserScan:
        """The message that holds these ranges (m)."""
        scan = LaserScan(
            angle_min=math.radians(self.first),
            angle_increment=math.radians(self.step),
            angle_max=math.radians(self.first + self.step * max(0, len(ranges) - 1)),
            range_min=MIN,
            range_max=MAX,
            ranges=ranges,
        )
        scan.header.frame_id = "laser"
        return scan


PLAIN = Scanner()
