"""The nearest obstacle ahead, to the left and to the right of a laser scan, whatever scanner it comes from.

A beam belongs to a sector by its angle, never by its index: angles start at `angle_min`, grow by `angle_increment`
(which may be negative), and 0 is forward, counter-clockwise positive (sensor_msgs/LaserScan, REP 103).
"""

import numpy as np

# Each sector holds its lower bound and not its upper one, so that a scanner of one beam a degree has 60 beams in each.
SECTORS = {
    "front": (np.radians(-30.0), np.radians(30.0)),
    "left": (np.radians(30.0), np.radians(90.0)),
    "right": (np.radians(-90.0), np.radians(-30.0)),
}
# A scan's angles are float32, and add up rounding over the beams: a beam this near below a bound counts as on it (rad).
ANGLE_TOLERANCE = 1e-5


def wrap(angles):
    """The same angles (rad, any shape) in (-pi, pi]."""
    angles = np.asarray(angles, dtype=float)
    return angles - 2.0 * np.pi * np.ceil((angles - np.pi) / (2.0 * np.pi))


def beam_angles(count, angle_min, angle_increment):
    """The angle of each beam (rad, shape (count,)), in (-pi, pi]."""
    return wrap(angle_min + angle_increment * np.arange(count))


def members(count, angle_min, angle_increment):
    """Which beams belong to each sector: {'front', 'left', 'right'}, each a boolean array of shape (count,)."""
    angles = beam_angles(count, angle_min, angle_increment) + ANGLE_TOLERANCE
    return {name: (angles >= low) & (angles < high) for name, (low, high) in SECTORS.items()}


def usable(ranges, range_min, range_max):
    """The ranges (m, shape (n,)) as distances to trust, NaN where there is none (REP 117).

    +inf is a beam with no return and stays inf, -inf is an obstacle too close to measure and becomes 0.0. NaN, and a
    finite value outside [range_min, range_max], is no measurement.
    """
    distances = np.array(ranges, dtype=float).reshape(-1)
    with np.errstate(invalid="ignore"):
        outside = np.isfinite(distances) & ((distances < range_min) | (distances > range_max))
    distances[outside] = np.nan
    distances[np.isneginf(distances)] = 0.0
    return distances


def sectors(ranges, angle_min, angle_increment, range_min, range_max):
    """The nearest distance (m) in each sector: {'front': float, 'left': float, 'right': float}.

    Args:
        ranges: what the beams measured (m), shape (n,), n may be 0.
        angle_min: angle of the first beam (rad).
        angle_increment: angle from one beam to the next (rad), negative for a scanner that turns clockwise.
        range_min, range_max: limits of the scanner (m); finite values outside them are discarded.

    Front is [-30, 30) degrees, left [30, 90), right [-90, -30). A sector in which no beam is usable counts as free
    (inf); see `usable` for inf, -inf and NaN.
    """
    distances = usable(ranges, range_min, range_max)
    distances = np.where(np.isnan(distances), np.inf, distances)
    inside = members(len(distances), angle_min, angle_increment)
    return {name: float(np.min(distances, where=beams, initial=np.inf)) for name, beams in inside.items()}


def from_scan(scan):
    """The `sectors` of a sensor_msgs/LaserScan, or of any object with its fields."""
    return sectors(scan.ranges, scan.angle_min, scan.angle_increment, scan.range_min, scan.range_max)
