"""The figure of a drive: the path in the room, coloured by state, above the states over time."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.patches import Circle
from numpy.typing import NDArray

from course.figures.palette import BLACK, GREY, STATES, VERMILLION, plain, style
from course.figures.picture import Picture
from course.recorders import DecisionRecorder

Floats = NDArray[np.float64]


@plain
def drive(
    simulation: Any,
    decisions: DecisionRecorder | None = None,
    title: str = "Where the robot has been, and in which state",
) -> Picture:
    """The room and path of a `course.world.Simulation` (m), with the states that a `DecisionRecorder` saw.

    A dot on the path shows where the robot turned on the spot, or stood; x marks a collision.  Decisions are placed on
    the path by their scans' stamps (s): in simulated time, or by the wall clock, and the newest is then the path's end.
    """
    path = simulation.path
    table = decisions.table() if decisions is not None else {"stamp": [], "state": []}
    stamps, decided = np.asarray(table["stamp"], dtype=float), table["state"]
    if len(stamps) and stamps[0] > path[-1, 0] + 1.0:
        stamps = stamps - stamps[-1] + path[-1, 0]
    picture = Picture("drive through a room", 6.4 if decided else 4.6)
    if decided:
        axes, strip = picture.figure.subplots(2, 1, height_ratios=[4, 1])
        _strip(strip, stamps, decided)
    else:
        axes = picture.figure.add_subplot()
    style(axes, title, "x (m)", "y (m)")
    axes.add_collection(LineCollection(list(simulation.room.segments), colors=BLACK, linewidths=2))
    colours = [STATES.get(state, GREY) for state in _states(path[:, 0], stamps, decided)]
    pieces = np.stack([path[:-1, 1:3], path[1:, 1:3]], axis=1)
    axes.add_collection(LineCollection(list(pieces), colors=colours[1:], linewidths=2.5))
    still = np.flatnonzero(np.all(pieces[:, 0] == pieces[:, 1], axis=1)) + 1
    if decided:
        axes.scatter(*path[still, 1:3].T, s=36, color=[colours[number] for number in still], zorder=2.5)
    for collision in simulation.collisions:
        axes.plot(collision.x, collision.y, "X", color=VERMILLION, markeredgecolor="white", markersize=12, zorder=5)
    _robot(axes, simulation.pose, simulation.robot.radius)
    axes.plot(*simulation.room.start[:2], "+", color=BLACK, markersize=10, zorder=2.8)
    ahead = np.cos(simulation.room.start[2]) >= 0  # the word stands on the side away from the path
    axes.annotate(
        "start",
        simulation.room.start[:2],
        xytext=(-7 if ahead else 7, 0),
        textcoords="offset points",
        ha="right" if ahead else "left",
        va="center",
        color=BLACK,
        fontsize=9,
    )
    axes.set_aspect("equal", adjustable="datalim")
    axes.autoscale_view()
    return picture


def _robot(axes: Axes, pose: tuple[float, float, float], radius: float) -> None:
    """The robot as a circle (m), with a line that shows where it looks."""
    x, y, heading = pose
    axes.add_patch(Circle((x, y), radius, facecolor="white", edgecolor=BLACK, linewidth=1.5, zorder=3))
    axes.plot([x, x + radius * np.cos(heading)], [y, y + radius * np.sin(heading)], color=BLACK, zorder=4)


def _strip(axes: Axes, stamps: Floats, decided: list[str]) -> None:
    """A lane for each state, filled while the robot was in it; it is also the legend of the path's colours."""
    style(axes, "", "time (s)")
    ends = np.append(stamps[1:], stamps[-1] + (np.median(np.diff(stamps)) if len(stamps) > 1 else 0.1))
    for lane, state in enumerate(STATES):
        spans = [(at, end - at) for at, end, name in zip(stamps, ends, decided, strict=True) if name == state]
        axes.broken_barh(spans, (lane - 0.4, 0.8), color=STATES[state])
    axes.set_yticks(range(len(STATES)), STATES, fontsize=9)
    axes.set_ylim(len(STATES) - 0.5, -0.5)
    axes.set_xlim(min(0.0, stamps[0]), ends[-1])


def _states(times: Floats, stamps: Floats, decided: list[str]) -> list[str]:
    """The state of the last decision before each time (s); "" before the first."""
    last = np.searchsorted(stamps, times - 1e-6, side="right") - 1
    return [decided[number] if number >= 0 else "" for number in last]
