"""The figure of a laser scan: the distances, the sectors, and the robot's decision."""

from collections.abc import Mapping
from typing import Any, cast

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.projections.polar import PolarAxes

from course.errors import FigureError
from course.figures.misuse import expect_action, positive
from course.figures.palette import BLACK, SECTORS, VERMILLION, Overlaid, in_lines, legend, plain, style
from course.figures.picture import Picture
from course.foundation.calls import fitting
from course.robot import sectors as course_sectors

HEAD = "-|>,head_length=0.7,head_width=0.4"  # of an arrow


@plain
@fitting
def sectors(
    scan: course_sectors.Scan,
    action: Mapping[str, float] | None = None,
    title: str = "What the robot sees, and what it decides",
    reach: float = 3.0,
) -> Picture:
    """Draw a sensor_msgs/LaserScan in polar coordinates, forward at the top and left at the left.

    The three sectors are shaded up to their nearest obstacle; `action` ({'linear': m/s, 'angular': rad/s}) is an arrow:
    forward, or bent to the side that the robot turns to.  Obstacles beyond `reach` (m) are not shown.  Raises
    FigureError for anything else in their places.
    """
    if isinstance(scan, type) or not all(hasattr(scan, name) for name in course_sectors.Scan.__annotations__):
        raise FigureError(f"`sectors` draws a scan, a sensor_msgs/LaserScan, not {scan!r:.60}")
    count, step = len(np.atleast_1d(scan.ranges)), abs(scan.angle_increment)
    if not scan.range_max > scan.range_min:
        raise FigureError("this scan measures nothing: its `range_max` (m) must be above its `range_min` (m)")
    if count > 1 and not 0.0 < step * (count - 1) <= 2.0 * np.pi + step:
        raise FigureError(
            f"the {count} beams of this scan are {step:g} rad apart, its `angle_increment`: they must be spread over "
            "one turn at most, 2π rad"
        )
    if action is not None:
        expect_action(action)
    reach = positive(reach, "reach", "sectors")
    ranges = course_sectors.usable(scan.ranges, scan.range_min, scan.range_max)
    angles = scan.angle_min + scan.angle_increment * np.arange(len(ranges))
    seen = np.isfinite(ranges) & (ranges < reach)
    picture = Picture("sectors of a scan", 6.1)
    axes = cast(PolarAxes, picture.figure.add_subplot(projection="polar"))
    style(axes, "", "Direction (°), distance (m)")
    picture.figure.suptitle(in_lines(title), x=0.01, ha="left", fontsize=11, color=BLACK)
    axes.set_theta_zero_location("N")
    axes.set_ylim(0, reach)
    axes.tick_params(axis="x", pad=8)
    facts, shown = [], dict[str, Any]()
    for name, nearest in course_sectors.from_scan(scan).items():
        low, high = course_sectors.SECTORS[name]
        arc = np.linspace(low, high, 40)
        free = not np.isfinite(nearest)
        label = f"{name}: {'free' if free else f'{nearest:.2f} m'}"
        facts.append(label)
        edge = min(nearest, reach)
        area = axes.fill_between(arc, 0, edge, color=SECTORS[name], alpha=0.25)
        arcs = axes.plot(arc, np.full(40, edge), color=SECTORS[name], linewidth=2)
        shown[label if free else f"{name}: nearest {nearest:.2f} m"] = Overlaid((area, *arcs))
    axes.plot(angles[seen], ranges[seen], ".", color=BLACK, markersize=3)
    (shown["what a beam met"],) = axes.plot([], [], ".", color=BLACK)
    if action is not None:
        turn = float(action["angular"])
        straight = "straight on" if action["linear"] else "at a stop"
        way = "to the left" if turn > 0 else "to the right" if turn < 0 else straight
        facts.append(f"the arrow points {way}")
        mark = {"linewidth": 3} if turn or action["linear"] else {"marker": "s", "markersize": 9, "linestyle": ""}
        shown[f"decision: {way}"] = Line2D([], [], color=VERMILLION, **mark)
        _arrow(axes, turn, float(action["linear"]), reach)
    picture.tell(title, f"Nearest obstacles: {'; '.join(facts)}")
    axes.set_thetagrids(
        range(0, 360, 30),
        [f"{angle}°" if angle <= 180 else f"−{360 - angle}°" for angle in range(0, 360, 30)],
        color=BLACK,
        fontsize=10,
    )
    axes.set_rgrids(
        np.arange(1, np.ceil(reach)),
        [f"{ring:g} m" for ring in np.arange(1, np.ceil(reach))],
        angle=195,
        color=BLACK,
        fontsize=10,
    )
    legend(picture.figure, 2, [*shown.values()], [*shown])
    return picture


def _arrow(axes: PolarAxes, angular: float, linear: float, reach: float) -> None:
    """Draw a decision; the shaft of the arrow ends inside the head, whose tip is sharp."""
    length = 0.45 * reach
    if angular:
        sweep = np.copysign(np.radians(np.linspace(0, 75, 31)), angular)
        shaft, head = (sweep[:-3], np.full(28, length)), ((sweep[-6], length), (sweep[-1], length))
    elif linear:
        shaft, head = (np.zeros(2), np.array([0.0, 0.95 * length])), ((0.0, 0.8 * length), (0.0, length))
    else:
        axes.plot([0], [0], "s", color=VERMILLION, markersize=12)
        return
    axes.plot(*shaft, color=VERMILLION, linewidth=3, solid_capstyle="butt")
    behind, tip = head
    look = {"arrowstyle": HEAD, "color": VERMILLION, "linewidth": 0, "mutation_scale": 18, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", tip, behind, arrowprops=look)
