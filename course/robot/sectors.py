"""The nearest obstacle ahead, to the left and to the right, from the scan of any laser scanner.

A beam belongs to a sector by its angle, never by its index: angles start at `angle_min`, grow by `angle_increment`
(which may be negative), and 0 is forward, counter-clockwise positive (sensor_msgs/LaserScan, REP 103).
"""

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

# A sector includes its lower bound and not its upper one, so that a scanner with one beam a degree has 60 in each.
SECTORS = {
    "front": (np.radians(-30.0), np.radians(30.0)),
    "left": (np.radians(30.0), np.radians(90.0)),
    "right": (np.radians(-90.0), np.radians(-30.0)),
}
# A scan's angles are float32, and rounding adds up over the beams: a beam this close below a bound counts as on it.
ANGLE_TOLERANCE = 1e-5  # rad


class Scan(Protocol):
    """The fields of a sensor_msgs/LaserScan that count here: angles in rad, distances in m."""

    ranges: ArrayLike
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float


def wrap(angles: ArrayLike) -> NDArray[np.float64]:
    """Return the angles (rad, of any shape) wrapped to (-pi, pi]."""
    angles = np.asarray(angles, dtype=float)
    with np.errstate(invalid="ignore"):  # an infinite angle becomes NaN
        return angles - 2.0 * np.pi * np.ceil((angles - np.pi) / (2.0 * np.pi))


def beam_angles(count: int, angle_min: float, angle_increment: float) -> NDArray[np.float64]:
    """The angle of each beam (rad, shape (count,)), in (-pi, pi]; NaN where the scan does not give a finite one."""
    with np.errstate(invalid="ignore", over="ignore"):
        return wrap(angle_min + angle_increment * np.arange(count))


def members(count: int, angle_min: float, angle_increment: float) -> dict[str, NDArray[np.bool_]]:
    """Return the beams of each sector: {'front', 'left', 'right'}, each a boolean array of shape (count,)."""
    angles = beam_angles(count, angle_min, angle_increment) + ANGLE_TOLERANCE
    return {name: (angles >= low) & (angles < high) for name, (low, high) in SECTORS.items()}


def usable(ranges: ArrayLike, range_min: float, range_max: float) -> NDArray[np.float64]:
    """Return the usable distances (m, shape (n,)), NaN elsewhere (REP 117).

    +inf is a beam with no return and stays inf; -inf is an obstacle too close to measure and becomes 0.0.  NaN, and a
    finite value outside [range_min, range_max], is not a measurement and becomes NaN.
    """
    distances = np.array(ranges, dtype=float).reshape(-1)
    with np.errstate(invalid="ignore"):
        outside = np.isfinite(distances) & ((distances < range_min) | (distances > range_max))
    distances[outside] = np.nan
    distances[np.isneginf(distances)] = 0.0
    return distances


def sectors(
    ranges: ArrayLike, angle_min: float, angle_increment: float, range_min: float, range_max: float
) -> dict[str, float]:
    """The nearest distance (m) in each sector: {'front': float, 'left': float, 'right': float}.

    Args:
        ranges: what the beams measured (m), shape (n,), n may be 0.
        angle_min: angle of the first beam (rad).
        angle_increment: angle from one beam to the next (rad), negative for a scanner that turns clockwise.
        range_min, range_max: limits of the scanner (m); finite values outside them are discarded.

    Front is [-30, 30) degrees, left [30, 90), right [-90, -30).  A sector in which no beam is usable counts as free
    (inf); see `usable` for inf, -inf and NaN.
    """
    distances = usable(ranges, range_min, range_max)
    distances = np.where(np.isnan(distances), np.inf, distances)
    inside = members(len(distances), angle_min, angle_increment)
    return {name: float(np.min(distances, where=beams, initial=np.inf)) for name, beams in inside.items()}


def from_scan(scan: Scan) -> dict[str, float]:
    """The nearest distance (m) in each sector of a sensor_msgs/LaserScan, as `sectors` returns it."""
    return sectors(scan.ranges, scan.angle_min, scan.angle_increment, scan.range_min, scan.range_max)
