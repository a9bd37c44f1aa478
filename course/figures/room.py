"""Figures of a drive: the path in the room with the robot's states over time, and distances over time."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.patches import Circle
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from course.figures.palette import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    GROUND,
    ORANGE,
    PURPLE,
    STATES,
    VERMILLION,
    legend,
    plain,
    style,
)
from course.figures.picture import Picture
from course.recorders import DecisionRecorder
from course.robot.sectors import wrap

Floats = NDArray[np.float64]
# Vermillion is for collisions.
MOTIONS = {"straight on": GREEN, "to the left": BLUE, "to the right": ORANGE, "standing": GREY}
STRAIGHT = 0.05  # rad/s: slower turns count as straight


@plain
def drive(simulation: Any, decisions: DecisionRecorder | None = None, title: str = "") -> Picture:
    """The room and path of a `course.world.Simulation` (m), with the states that a `DecisionRecorder` saw.

    Without decisions, the colours show how the robot moved: straight on, to the left, to the right, or not at all.  A
    dot on the path shows where the robot turned on the spot, or stood; x marks a collision.  Decisions are placed on
    the path by their scans' stamps (s): in simulated time, or by the wall clock, with the newest at the path's end. The
    default `title` says how far the robot came, and when it touched something.
    """
    path = simulation.path
    if decisions is None:
        lanes, stamps, decided = MOTIONS, path[:-1, 0], _motions(path)
    else:
        table = decisions.table()
        lanes, stamps, decided = STATES, np.asarray(table["stamp"], dtype=float), table["state"]
    if len(stamps) and stamps[0] > path[-1, 0] + 1.0:
        stamps = stamps - stamps[-1] + path[-1, 0]
    picture = Picture("drive through a room", 5.5 if decided else 4.4)
    if decided:
        axes, strip = picture.figure.subplots(2, 1, height_ratios=[4, 1])
        _strip(strip, stamps, decided, lanes)
    else:
        axes = picture.figure.add_subplot()
    style(axes, title or _told(simulation), "x (m)", "y (m)")
    axes.add_collection(LineCollection(list(simulation.room.segments), colors=BLACK, linewidths=2))
    colours = [lanes.get(state, GREY) for state in _states(path[:, 0], stamps, decided)]
    pieces = np.stack([path[:-1, 1:3], path[1:, 1:3]], axis=1)
    axes.add_collection(LineCollection(list(pieces), colors=colours[1:], linewidths=2.5))
    still = np.flatnonzero(np.all(pieces[:, 0] == pieces[:, 1], axis=1)) + 1
    if decided and len(still):
        axes.scatter(*path[still, 1:3].T, s=36, color=[colours[number] for number in still], zorder=2.5)
        axes.plot([], [], "o", color=GREY, label="turned on the spot, or stood")
    for number, collision in enumerate(simulation.collisions):
        axes.plot(
            collision.x,
            collision.y,
            "X",
            color=VERMILLION,
            markeredgecolor="white",
            markersize=12,
            linestyle="none",
            zorder=5,
            label="touched something" if not number else None,
        )
    _robot(axes, simulation.pose, simulation.robot.radius)
    axes.plot(*simulation.room.start[:2], "+", color=BLACK, markersize=10, zorder=2.8)
    axes.annotate(
        "start",
        simulation.room.start[:2],
        xytext=(0, 6),
        textcoords="offset points",
        ha="center",
        color=BLACK,
        fontsize=10,
        path_effects=[withStroke(linewidth=2, foreground=GROUND)],
        zorder=2.8,
    )
    axes.set_aspect("equal", adjustable="datalim")
    axes.autoscale_view()
    legend(picture.figure, 2)
    picture.tell(title or _told(simulation), *_facts(simulation, decided))
    return picture


def _told(simulation: Any) -> str:
    driven = f"{simulation.distance:.1f} m in {simulation.time:.0f} s"
    if not simulation.collisions:
        return f"{driven}: the robot touched nothing"
    first = simulation.collisions[0].time
    if len(simulation.collisions) == 1:
        return f"{driven}: at x, after {first:.1f} s, the robot touched something"
    return f"{driven}: the robot touched something {len(simulation.collisions)} times, first after {first:.1f} s"


def _facts(simulation: Any, decided: list[str]) -> list[str]:
    """The drive in sentences: where it began, ended and touched something, and how much of it was which motion."""
    (x, y, _), (end_x, end_y, _) = simulation.room.start, simulation.pose
    facts = [f"Seen from above, it starts at x {x:.1f} m, y {y:.1f} m and ends at x {end_x:.1f} m, y {end_y:.1f} m"]
    facts += [
        f"It touched something at x {each.x:.1f} m, y {each.y:.1f} m after {each.time:.1f} s"
        for each in simulation.collisions
    ]
    if decided:
        shares = ", ".join(f"{name} {decided.count(name) / len(decided):.0%}" for name in dict.fromkeys(decided))
        facts.append(f"Shares of the time: {shares}")
    return facts


def _robot(axes: Axes, pose: tuple[float, float, float], radius: float) -> None:
    """Draw the robot as a disc (m), with a line that shows its heading: obstacles are hollow."""
    x, y, heading = pose
    axes.add_patch(Circle((x, y), radius, facecolor=BLACK, edgecolor=BLACK, linewidth=1.5, zorder=3))
    axes.plot([x, x + radius * np.cos(heading)], [y, y + radius * np.sin(heading)], color="white", zorder=4)
    axes.plot([], [], "o", color=BLACK, markersize=9, label="robot, at the end")


def _strip(axes: Axes, stamps: Floats, decided: list[str], lanes: Mapping[str, str]) -> None:
    """Draw a lane for each state, filled while the robot was in it; also the legend of the path's colours."""
    style(axes, "", "time (s)")
    ends = np.append(stamps[1:], stamps[-1] + (np.median(np.diff(stamps)) if len(stamps) > 1 else 0.1))
    for lane, state in enumerate(lanes):
        spans = [(at, end - at) for at, end, name in zip(stamps, ends, decided, strict=True) if name == state]
        axes.broken_barh(spans, (lane - 0.4, 0.8), color=lanes[state])
    axes.set_yticks(range(len(lanes)), list(lanes), fontsize=10)
    axes.set_ylim(len(lanes) - 0.5, -0.5)
    axes.set_xlim(min(0.0, stamps[0]), ends[-1])


def _motions(path: Floats) -> list[str]:
    """Describe how the robot moved from each point of the path to the next."""
    moved = np.any(path[1:, 1:3] != path[:-1, 1:3], axis=1)
    turned = wrap(np.diff(path[:, 3])) / np.maximum(np.diff(path[:, 0]), 1e-9)
    sides = np.where(turned > STRAIGHT, "to the left", "to the right")
    return np.where(np.abs(turned) > STRAIGHT, sides, np.where(moved, "straight on", "standing")).tolist()


def _states(times: Floats, stamps: Floats, decided: list[str]) -> list[str]:
    """The state of the last decision before each time (s); "" before the first."""
    last = np.searchsorted(stamps, times - 1e-6, side="right") - 1
    return [decided[number] if number >= 0 else "" for number in last]


@plain
def distances(
    series: Mapping[str, Sequence[float]], aim: float, period: float = 0.1, title: str = "How a distance is kept"
) -> Picture:
    """Draw a distance (m) over time for each name in `series`, one value every `period` s, and the desired distance."""
    rows = max(1, len(series))
    picture = Picture("distances over time", 0.9 + 1.2 * rows)
    drawn = picture.figure.subplots(rows, 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    facts = [f"The aim is {aim:g} m"]
    colors = (ORANGE, BLUE, GREEN, PURPLE)
    for axes, (name, values), color in zip(drawn, series.items(), colors, strict=False):
        axes.plot(period * np.arange(len(values)), values, color=color)
        axes.axhline(aim, color=VERMILLION, linestyle="--", zorder=1)
        axes.annotate(name, (0.99, 0.86), xycoords="axes fraction", ha="right", va="top", color=BLACK)
        last = values[len(values) // 2 :]
        if last:
            facts.append(f"{name}: in the second half between {min(last):.2f} and {max(last):.2f} m")
    for axes in drawn:
        style(axes, "")
    style(drawn[0], f"{title} (dashed: the aim, {aim:g} m)")
    drawn[-1].set_xlabel("time (s)")
    picture.figure.supylabel("distance (m)", fontsize="medium")
    picture.tell(title, *facts)
    return picture
