"""Scans of which it is known what must be done: a scanner, and what is how near in each of its sectors."""

import math
import random
from dataclasses import dataclass

from sensor_msgs.msg import LaserScan

SECTORS = {"front": (-30.0, 30.0), "left": (30.0, 90.0), "right": (-90.0, -30.0)}  # degrees
MIDDLE = {"front": (-20.0, 20.0), "left": (50.0, 80.0), "right": (-80.0, -50.0)}  # degrees, far from any edge
EDGE = 1.5  # degrees on both sides of a sector's edge where nothing is: to which sector they belong is not judged
MIN, MAX = 0.12, 10.0  # m, of every scanner
INF, NAN = math.inf, math.nan


@dataclass(frozen=True)
class Scanner:
    """A laser scanner: its beams, the angle of the first one, and from each to the next (degrees)."""

    beams: int = 360
    first: float = 0.0
    step: float = 1.0

    def angle(self, beam: int) -> float:
        """Where a beam points (degrees, -180 to 180)."""
        return math.remainder(self.first + beam * self.step, 360.0)

    def inside(self, sector: str) -> list[int]:
        """The beams well inside a sector."""
        low, high = SECTORS[sector]
        return [beam for beam in range(self.beams) if low + EDGE <= self.angle(beam) <= high - EDGE]

    def look(self, rng: random.Random, *, at: dict[str, float] | None = None, **nearest: float) -> LaserScan:
        """A scan in which each sector's nearest obstacle is as said (m), somewhere in the middle of it.

        With `at`, these obstacles are at these angles (degrees) instead; and then something is near behind the robot,
        which must not count.
        """
        behind = MIN + 0.1 if at else 6.0
        ranges = [
            behind if abs(self.angle(beam)) >= 90.0 + EDGE else rng.uniform(6.0, 8.0) for beam in range(self.beams)
        ]
        for sector, middle in MIDDLE.items():
            distance, beams = nearest.get(sector, 5.0), self.inside(sector)
            if not beams:
                continue
            for beam in beams:
                ranges[beam] = distance + (rng.uniform(1.5, 3.0) if at else rng.uniform(0.2, 2.0))
            angle = (at or {}).get(sector, rng.uniform(*middle))
            ranges[min(beams, key=lambda beam, angle=angle: abs(self.angle(beam) - angle))] = distance
        return self.scan(ranges)

    def change(self, scan: LaserScan, rng: random.Random, sector: str, value: float, share: float = 1.0) -> LaserScan:
        """The scan with `value` in a share of the beams of a sector: in all of them with the beams at its edges."""
        low, high = SECTORS[sector]
        beams = [beam for beam in range(self.beams) if low - EDGE <= self.angle(beam) <= high + EDGE]
        if share < 1.0:
            nearest = min(self.inside(sector), key=lambda beam: scan.ranges[beam])
            beams = [beam for beam in self.inside(sector) if beam != nearest and rng.random() < share]
        for beam in beams:
            scan.ranges[beam] = value
        return scan

    def scan(self, ranges: list[float]) -> LaserScan:
        """The message of these ranges (m)."""
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
