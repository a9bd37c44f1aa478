"""Figures of a drive: the path in the room with the robot's states over time, and distances over time."""

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from matplotlib.path import Path as MarkerPath
from numpy.typing import NDArray

from course.figures.palette import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    LINE,
    ORANGE,
    STATES,
    VERMILLION,
    Overlaid,
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
# The arms of a collision's cross are longer than the robot's radius, and the robot is drawn over it.
COLLISION: dict[str, Any] = {
    "marker": "X",
    "color": VERMILLION,
    "markeredgecolor": "white",
    "markersize": 18,
    "linestyle": "",
    "zorder": 2.9,
}
STRAIGHT = 0.05  # rad/s: slower turns count as straight


@plain
def drive(simulation: Any, decisions: DecisionRecorder | None = None, title: str = "") -> Picture:
    """The room and path of a `course.world.Simulation` (m), with the states that a `DecisionRecorder` saw.

    Without decisions, the colours show how the robot moved: straight on, to the left, to the right, or not at all.  A
    dot on the path shows where the robot turned on the spot, or stood; a cross marks a collision.  Decisions are placed
    on the path by their scans' stamps (s): in simulated time, or by the wall clock, with the newest at the path's end.
    The default `title` says how far the robot came, and when it touched something.
    """
    path = simulation.path
    if decisions is None:
        lanes, stamps, decided = MOTIONS, path[:-1, 0], _motions(path)
    else:
        table = decisions.table()
        lanes, stamps, decided = STATES, np.asarray(table["stamp"], dtype=float), table["state"]
    if len(stamps) and stamps[0] > path[-1, 0] + 1.0:
        stamps = stamps - stamps[-1] + path[-1, 0]
    picture = Picture("drive through a room", 6.0 if decided else 4.6)
    if decided:
        axes, strip = picture.figure.subplots(2, 1, height_ratios=[4, 1])
        _strip(strip, stamps, decided, lanes)
    else:
        axes = picture.figure.add_subplot()
    style(axes, title or _told(simulation), "x (m)", "y (m)")
    axes.add_collection(LineCollection(list(simulation.room.segments), colors=BLACK, linewidths=2))
    short = {"wall or obstacle": Line2D([], [], color=BLACK, linewidth=2)}
    (short["start"],) = axes.plot(*simulation.room.start[:2], "+", color=BLACK, markersize=10, zorder=2.8)
    for collision in simulation.collisions:
        axes.plot(collision.x, collision.y, **COLLISION)
        short["touched something"] = Line2D([], [], **COLLISION | {"markersize": 11})
    long = _path(axes, path, _states(path[:, 0], stamps, decided)[1:], lanes if decided else {})
    long["robot at the end, line: front"] = _robot(axes, simulation.pose, simulation.robot.radius)
    axes.set_aspect("equal", adjustable="datalim")
    axes.autoscale_view()
    rows = max(len(short), len(long))  # of the legend: the short phrases on its left, the long ones on its right
    handles = [*short.values(), *[Line2D([], [], linestyle="")] * (rows - len(short)), *long.values()]
    legend(picture.figure, 2, handles, [*short, *[""] * (rows - len(short)), *long])
    picture.tell(title or _told(simulation), *_facts(simulation, decided))
    return picture


def _told(simulation: Any) -> str:
    driven = f"{simulation.distance:.1f} m in {simulation.time:.0f} s"
    if not simulation.collisions:
        return f"{driven}: the robot touched nothing"
    first = simulation.collisions[0].time
    if len(simulation.collisions) == 1:
        return f"{driven}: the robot touched something after {first:.1f} s"
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
        changes = len(_runs(decided)) - 1
        facts.append(f"It changed from one to another {changes} time{'' if changes == 1 else 's'}")
    return facts


def _path(axes: Axes, path: Floats, states: list[str], lanes: Mapping[str, str]) -> dict[str, Any]:
    """Draw the path in the colours of its states, with dots where it has no length; return the entries of a legend."""
    runs = _runs(states)
    pieces = [path[first : last + 1, 1:3] for first, last in runs]
    colours = [lanes.get(states[first], GREY) for first, _ in runs]
    axes.add_collection(LineCollection(pieces, colors=colours, linewidths=2.5, capstyle="butt", joinstyle="round"))
    marks: dict[str, Any] = {}
    stood = np.all(path[:-1, 1:3] == path[1:, 1:3], axis=1)
    moved = {state for state, still in zip(states, stood, strict=True) if not still}
    if seen := [colour for state, colour in lanes.items() if state in moved]:
        marks["path, coloured as the rows above"] = tuple(Line2D([], [], color=each, linewidth=2.5) for each in seen)
    if moved - set(lanes):
        marks["path before the first decision" if lanes else "path"] = Line2D([], [], color=GREY, linewidth=2.5)
    if lanes and stood.any():
        still = np.flatnonzero(stood)
        dots = [lanes.get(states[number], GREY) for number in still]
        axes.scatter(path[still + 1, 1], path[still + 1, 2], s=36, color=dots, zorder=2.5)
        marks["stood, or turned on the spot"] = tuple(
            Line2D([], [], marker="o", markersize=5, color=each, linestyle="")
            for each in dict.fromkeys([*lanes.values(), GREY])
            if each in dots
        )
    return marks


def _robot(axes: Axes, pose: tuple[float, float, float], radius: float) -> Overlaid:
    """Draw the robot as a disc (m) with a line to its front, for obstacles are hollow; return its mark for a legend."""
    x, y, heading = pose
    axes.add_patch(Circle((x, y), radius, facecolor=BLACK, edgecolor=BLACK, linewidth=1.5, zorder=3))
    axes.plot([x, x + radius * np.cos(heading)], [y, y + radius * np.sin(heading)], color="white", zorder=4)
    disc = Line2D([], [], marker="o", markersize=10, color=BLACK, linestyle="")
    ahead = Line2D([], [], marker=MarkerPath([(0, 0), (1, 0)]), markersize=10, color="white", linestyle="")
    return Overlaid((disc, ahead))


def _strip(axes: Axes, stamps: Floats, decided: list[str], lanes: Mapping[str, str]) -> None:
    """Draw a lane for each state, filled while the robot was in it; also the legend of the path's colours.

    A bar is as wide as its time, without a line around it.  One thinner than a pixel is paler, and in a lane of its
    own, so that no two of them cover each other.
    """
    style(axes, "", "Time (s)")
    ends = np.append(stamps[1:], stamps[-1] + (np.median(np.diff(stamps)) if len(stamps) > 1 else 0.1))
    runs = [(decided[first], stamps[first], ends[last - 1]) for first, last in _runs(decided)]
    for lane, state in enumerate(lanes):
        spans = [(at, end - at) for name, at, end in runs if name == state]
        axes.broken_barh(spans, (lane - 0.4, 0.8), facecolor=lanes[state], linewidth=0, snap=False)
    axes.set_yticks(range(len(lanes)), list(lanes), fontsize=10)
    axes.set_ylim(len(lanes) - 0.5, -0.5)
    axes.set_xlim(min(0.0, stamps[0]), ends[-1])


def _motions(path: Floats) -> list[str]:
    """Describe how the robot moved from each point of the path to the next."""
    moved = np.any(path[1:, 1:3] != path[:-1, 1:3], axis=1)
    turned = wrap(np.diff(path[:, 3])) / np.maximum(np.diff(path[:, 0]), 1e-9)
    sides = np.where(turned > STRAIGHT, "to the left", "to the right")
    return np.where(np.abs(turned) > STRAIGHT, sides, np.where(moved, "straight on", "standing")).tolist()


def _runs(states: Sequence[str]) -> list[tuple[int, int]]:
    """Return where each run of equal states begins, and where the next one does."""
    starts = [number for number, state in enumerate(states) if not number or state != states[number - 1]]
    return list(zip(starts, [*starts[1:], len(states)], strict=False))


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
    picture = Picture("distances over time", 1.3 + 1.3 * rows)
    picture.figure.suptitle(textwrap.fill(title, LINE), x=0.01, ha="left", fontsize=11, color=BLACK)
    drawn = picture.figure.subplots(rows, 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    facts = [f"The aim is {aim:g} m"]
    for axes, (name, values) in zip(drawn, series.items(), strict=False):
        style(axes, "").set_title(name, loc="left", fontsize=10, color=BLACK)
        (line,) = axes.plot(period * np.arange(len(values)), values, color=BLUE)
        dashes = axes.axhline(aim, color=VERMILLION, linestyle="--", zorder=1)
        last = values[len(values) // 2 :]
        if last:
            facts.append(f"{name}: in the second half between {min(last):.2f} and {max(last):.2f} m")
    drawn[-1].set_xlabel("Time (s)")
    picture.figure.supylabel("Distance (m)", fontsize="medium")
    if series:
        legend(picture.figure, 2, [line, dashes], ["distance", f"aim, {aim:g} m"])
    picture.tell(title, *facts)
    return picture
