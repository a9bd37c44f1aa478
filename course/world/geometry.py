"""Straight segments in the plane, and the distances from them that a laser and a round robot need.

Segments are an array of shape (n, 2, 2): n segments, two end points each, x and y (m).
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Pose = tuple[float, float, float]  # x (m), y (m), heading (rad): 0 looks along x, counter-clockwise positive
MOST_ANGLE = 4.0 * math.pi  # rad: a larger one is taken for degrees


def polyline(points: ArrayLike, closed: bool = False) -> Floats:
    """Return the segments that join `points` (m, shape (k, 2)) in turn; `closed` also joins the last to the first."""
    points = np.asarray(points, dtype=float).reshape(-1, 2)
    if closed:
        points = np.vstack([points, points[:1]])
    return np.stack([points[:-1], points[1:]], axis=1)


def box(x_min: float, y_min: float, x_max: float, y_max: float) -> Floats:
    """Return the four sides of a rectangle (m), as segments of shape (4, 2, 2)."""
    return polyline([(x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max)], closed=True)


def circle(x: float, y: float, radius: float, sides: int = 16) -> Floats:
    """Return a regular polygon circumscribed about a circle (m): segments of shape (`sides`, 2, 2)."""
    angles = 2.0 * np.pi * np.arange(sides) / sides
    outer = float(radius) / np.cos(np.pi / sides)
    with np.errstate(invalid="ignore"):  # an infinite circle gives NaN, which Room.from_data refuses
        points = np.column_stack([x + outer * np.cos(angles), y + outer * np.sin(angles)])
    return polyline(points, closed=True)


def clearance(point: ArrayLike, segments: Floats) -> float:
    """Return the distance (m) from `point` (x m, y m) to the nearest of `segments`; inf if there are none."""
    if not len(segments):
        return np.inf
    gaps = _gaps(point, segments)
    return float(np.sqrt(np.einsum("ij,ij->i", gaps, gaps).min()))


def outlines(segments: Floats) -> list[Floats]:
    """Return the closed outlines among `segments` (m), each as its corners (m, shape (k, 2)).

    An outline is found if its segments come in turn, as `polyline` makes them; single walls are left out.
    """
    found: list[Floats] = []
    chain: list[tuple[float, float]] = []
    for (x, y), (to_x, to_y) in segments.tolist():
        if not chain or chain[-1] != (x, y):
            chain = [(x, y)]
        chain.append((to_x, to_y))
        if chain[-1] in chain[:-1]:
            first = chain.index(chain[-1])
            found.append(np.array(chain[first:-1]))
            chain = chain[-1:]
    return found


def is_inside(point: tuple[float, float], outline: Floats) -> bool:
    """Return True if `point` (x m, y m) is inside of a closed outline (m, shape (k, 2))."""
    x, y = point
    begin, end = outline, np.roll(outline, -1, axis=0)
    crosses = (begin[:, 1] > y) != (end[:, 1] > y)  # the line through the point along x
    rise = np.where(crosses, end[:, 1] - begin[:, 1], 1.0)
    at = begin[:, 0] + (y - begin[:, 1]) / rise * (end[:, 0] - begin[:, 0])
    return bool(np.count_nonzero(crosses & (at > x)) % 2)


def nearest_point(point: ArrayLike, segments: Floats) -> tuple[float, float]:
    """Return the point (x m, y m) of `segments`, at least one, that is nearest to `point` (x m, y m)."""
    gaps = _gaps(point, segments)
    x, y = np.asarray(point, dtype=float) - gaps[np.einsum("ij,ij->i", gaps, gaps).argmin()]
    return float(x), float(y)


def _gaps(point: ArrayLike, segments: Floats) -> Floats:
    """Return the way (m, shape (n, 2)) to `point` from the nearest point of each segment."""
    start, along = segments[:, 0], segments[:, 1] - segments[:, 0]
    offset = np.asarray(point, dtype=float) - start
    length2 = np.einsum("ij,ij->i", along, along)
    share = np.einsum("ij,ij->i", offset, along) / np.where(length2 > 0.0, length2, 1.0)
    return offset - np.clip(share, 0.0, 1.0)[:, None] * along


class RayCaster:
    """Distances along many beams to the nearest of many segments, by matrix products into reused buffers.

    Seen from a beam's origin, with end points p and q of a segment and c = p x q, the line through p and q lies at
    1/distance = d x (q - p) / c in direction d: linear in d, as are d x p and d x q, whose signs differ when the
    segment crosses the beam's line.  So three products of (beams, 2) by (2, segments) solve all pairs at once.
    """

    def __init__(self, segments: ArrayLike) -> None:
        """Prepare for `segments` (m, shape (n, 2, 2))."""
        self._segments: Floats = np.asarray(segments, dtype=float).reshape(-1, 2, 2)
        self._buffers = np.empty((3, 0, 0))

    def distances(self, origin: Sequence[float], angles: Floats) -> Floats:
        """Return the distance (m, shape (beams,)) from `origin` (x, y in m) along each of `angles` (rad), or inf."""
        beams, count = len(angles), len(self._segments)
        if count == 0:
            return np.full(beams, np.inf)
        if self._buffers.shape[1:] != (beams, count):
            self._buffers = np.empty((3, beams, count))
        first, second, inverse = self._buffers

        directions = np.column_stack([np.cos(angles), np.sin(angles)])
        p = self._segments[:, 0] - origin
        q = self._segments[:, 1] - origin
        area = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
        # A segment that points at the origin cannot be hit from the side: a beam hits its neighbours' ends instead.
        scale = np.divide(1.0, area, out=np.zeros(count), where=np.abs(area) > 1e-12)
        turned = np.stack([np.column_stack([p[:, 1], -p[:, 0]]), np.column_stack([q[:, 1], -q[:, 0]])])
        np.matmul(directions, turned[0].T, out=first)
        np.matmul(directions, turned[1].T, out=second)
        np.matmul(directions, ((turned[1] - turned[0]) * scale[:, None]).T, out=inverse)

        np.multiply(first, second, out=first)
        # A little past each end, so that no beam slips between two segments that share a corner.
        inverse[first > 1e-12] = 0.0
        nearest = inverse.max(axis=1)
        return np.divide(1.0, nearest, out=np.full(beams, np.inf), where=nearest > 1e-9)
