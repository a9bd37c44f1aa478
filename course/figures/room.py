"""Figures of a drive: the path in the room with the robot's states over time, and distances over time."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, PathPatch
from matplotlib.path import Path
from matplotlib.typing import LineStyleType
from numpy.typing import NDArray

from course.figures.misuse import expect_recorder, expect_simulation, numbers, positive
from course.figures.palette import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    GROUND,
    ORANGE,
    STATES,
    VERMILLION,
    Overlaid,
    in_lines,
    legend,
    plain,
    style,
)
from course.figures.picture import Picture
from course.foundation.calls import fitting
from course.recorders import DecisionRecorder
from course.robot.sectors import wrap

Floats = NDArray[np.float64]
# Vermillion is for collisions.
MOTIONS = {"straight on": GREEN, "to the left": BLUE, "to the right": ORANGE, "not moving": GREY}
COLLISION: dict[str, Any] = {
    "marker": "x",
    "color": VERMILLION,
    "markersize": 8,
    "markeredgewidth": 2.5,
    "linestyle": "",
    "zorder": 3.0,
}


class Look(NamedTuple):
    """The look of a state besides its colour; lengths in points.

    Marks at the same place have different sizes, so that each is seen: a dot in a ring in a square in a diamond.
    """

    line: float  # width of the path
    core: float  # width of the path's light core
    dashes: LineStyleType  # of the path
    mark: str
    size: float  # of the mark
    filled: bool = False  # the mark

    def path(self, colour: str) -> list[tuple[str, float, LineStyleType]]:
        """Return what is drawn over each other: colour, width and dashes."""
        layers = [(colour, self.line, self.dashes)]
        if self.core:
            layers.append((GROUND, self.core, "-"))
        return layers

    def spot(self, colour: str) -> dict[str, Any]:
        """Return the mark of a place where the robot has not moved."""
        face = colour if self.filled else "none"
        return {"marker": self.mark, "markersize": self.size, "markerfacecolor": face, "markeredgecolor": colour}


LOOKS = {
    GREEN: Look(2.0, 0.0, "-", "D", 13.0),
    BLUE: Look(4.0, 0.0, "-", "o", 7.0, filled=True),
    ORANGE: Look(4.8, 1.8, "-", "o", 10.5),
    VERMILLION: Look(2.0, 0.0, ":", "s", 12.0),
    GREY: Look(2.0, 0.0, "--", "s", 12.0),
}
DISC = "#bbbbbb"
FRONT = 0.65  # of the robot's radius: how far the line to its front reaches
EDGE = 1.5  # points: edge of a mark, and of the robot
ROW = 0.2  # inches: a row of the legend
STRAIGHT = 0.05  # rad/s: slower turns count as straight
CREEP = 0.02  # m/s: slower is on the spot


@plain
@fitting
def drive(simulation: Any, decisions: DecisionRecorder | None = None, title: str = "") -> Picture:
    """The room and path of a `course.world.Simulation` (m), with the states that a `DecisionRecorder` saw.

    Without decisions, the path shows how the robot moved: straight on, to the left, to the right, or not at all.  A
    mark on the path shows where it turned on the spot, or stood; a cross, where it touched something.  Each state has a
    line and a mark of its own, which can be told apart without the colours.  Decisions are placed on the path by their
    scans' stamps (s): in simulated time, or by the wall clock, with the newest at the path's end.  The default `title`
    says how far the robot came, and when it touched something.  Raises FigureError for anything else in their places.
    """
    expect_simulation(simulation)
    if decisions is not None:
        expect_recorder(decisions, "drive", "stamp", "state")
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
    robot = _robot(axes, simulation.pose, simulation.robot.radius)
    walls = Path.make_compound_path(*_outlines(simulation.room.segments))
    axes.add_patch(PathPatch(walls, fill=False, edgecolor=BLACK, linewidth=2, joinstyle="miter", zorder=1.8))
    short = {"wall or obstacle": Line2D([], [], color=BLACK, linewidth=2)}
    (short["start"],) = axes.plot(*simulation.room.start[:2], "+", color=BLACK, markersize=10, zorder=2.8)
    for collision in simulation.collisions:
        (short["touched something"],) = axes.plot(*collision.contact, **COLLISION)
    long = _path(axes, path, _states(path[:, 0], stamps, decided)[1:], lanes if decided else {})
    long["robot at the end, line: front"] = robot
    axes.set_aspect("equal", adjustable="datalim")
    axes.autoscale_view()
    rows = max(len(short), len(long))  # of the legend: the short phrases on its left, the long ones on its right
    picture.figure.set_figheight(picture.figure.get_figheight() + ROW * (rows - 3))
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
        f"It touched something at x {each.contact[0]:.1f} m, y {each.contact[1]:.1f} m after {each.time:.1f} s"
        for each in simulation.collisions
    ]
    if decided:
        shares = ", ".join(f"{name} {decided.count(name) / len(decided):.0%}" for name in dict.fromkeys(decided))
        facts.append(f"Shares of the time: {shares}")
        changes = len(_runs(decided)) - 1
        facts.append(f"It changed from one to another {changes} time{'' if changes == 1 else 's'}")
    return facts


def _outlines(segments: Floats) -> Iterator[Path]:
    """Join segments, each of which begins where the one before ends, to lines; one that returns to its start closes."""
    points: list[Floats] = []
    for start, end in segments:
        if points and not np.array_equal(points[-1], start):
            yield Path(points)
            points = []
        points = points or [start]
        points.append(end)
        if np.array_equal(points[0], end):
            yield Path(points, closed=True)
            points = []
    if points:
        yield Path(points)


def _path(axes: Axes, path: Floats, states: list[str], lanes: Mapping[str, str]) -> dict[str, Any]:
    """Draw the path in the looks of its states, over marks where it hardly moved; return the entries of a legend."""
    stood = ~_moved(path)
    moved = {state for state, still in zip(states, stood, strict=True) if not still}
    still = {state for state, still in zip(states, stood, strict=True) if still} if lanes else set()
    pieces, layers = [], []
    for first, last in _runs(states):
        colour = lanes.get(states[first], GREY)
        for layer in LOOKS[colour].path(colour) if states[first] in moved else ():
            pieces.append(path[first : last + 1, 1:3])
            layers.append(layer)
    colours, widths, dashes = zip(*layers, strict=True) if layers else ((), (), ())
    lines = LineCollection(pieces, colors=colours, linewidths=widths, linestyles=list(dashes), zorder=2.5)
    lines.set(capstyle="butt", joinstyle="round")
    axes.add_collection(lines)
    marks: dict[str, Any] = {}
    before = "before the first decision" if lanes else "path"
    for state in [*lanes, *((moved | still) - set(lanes))]:
        colour = lanes.get(state, GREY)
        name = state if state in lanes else before
        if state in moved:
            layers = LOOKS[colour].path(colour)
            marks[name] = Overlaid(Line2D([], [], color=c, linewidth=w, linestyle=d) for c, w, d in layers)
        if state in still:
            here = path[1:][stood & (np.array(states) == state)]
            label = name if colour in (VERMILLION, GREY) else f"{name}, on the spot"
            spot = LOOKS[colour].spot(colour) | {"linestyle": "", "markeredgewidth": EDGE}
            # The larger the mark, the further below: each can be seen around the others.
            (dots,) = axes.plot(here[:, 1], here[:, 2], **spot, zorder=2.4 - 0.01 * LOOKS[colour].size)
            marks[label] = (marks[label], dots) if label in marks else dots
    return marks


def _robot(axes: Axes, pose: tuple[float, float, float], radius: float) -> Overlaid:
    """Draw the robot as a grey disc (m), for obstacles are hollow, with a line to its front; return its legend's mark.

    Its edge is inside of it, so that a gap between it and a wall is seen; the line ends before the edge, where a cross
    may be.
    """
    x, y, heading = pose
    disc = Circle((x, y), radius, facecolor=DISC, edgecolor=BLACK, linewidth=2 * EDGE, zorder=1.5)
    axes.add_patch(disc)
    disc.set_clip_path(disc)
    front = [x, x + FRONT * radius * np.cos(heading)], [y, y + FRONT * radius * np.sin(heading)]
    axes.plot(*front, color=BLACK, linewidth=2, solid_capstyle="butt", zorder=2.9)
    mark = Line2D([], [], marker="o", markersize=10, color=DISC, markeredgecolor=BLACK, linestyle="")
    line = Path([(0, 0), (1, 0)])
    ahead = Line2D([], [], marker=line, markersize=10 * FRONT, color=BLACK, markeredgewidth=2, linestyle="")
    return Overlaid((mark, ahead))


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
    moved = _moved(path)
    turned = wrap(np.diff(path[:, 3])) / np.maximum(np.diff(path[:, 0]), 1e-9)
    sides = np.where(turned > STRAIGHT, "to the left", "to the right")
    return np.where(np.abs(turned) > STRAIGHT, sides, np.where(moved, "straight on", "not moving")).tolist()


def _moved(path: Floats) -> NDArray[np.bool_]:
    """Return True where the robot moved from a point of the path to the next, and did not just creep."""
    _, x, y, _ = np.diff(path, axis=0).T
    return np.asarray(np.hypot(x, y) > CREEP * np.diff(path[:, 0]))


def _runs(states: Sequence[str]) -> list[tuple[int, int]]:
    """Return where each run of equal states begins, and where the next one does."""
    starts = [number for number, state in enumerate(states) if not number or state != states[number - 1]]
    return list(zip(starts, [*starts[1:], len(states)], strict=False))


def _states(times: Floats, stamps: Floats, decided: list[str]) -> list[str]:
    """The state of the last decision before each time (s); "" before the first."""
    last = np.searchsorted(stamps, times - 1e-6, side="right") - 1
    return [decided[number] if number >= 0 else "" for number in last]


@plain
@fitting
def distances(
    series: Mapping[str, Sequence[float]], aim: float, period: float = 0.1, title: str = "How a distance is kept"
) -> Picture:
    """Draw a distance (m) over time for each name in `series`, one value every `period` s, and the desired distance.

    Raises FigureError for anything but numbers.
    """
    drawable = numbers(series, "distances", finite=False)
    aim, period = positive(aim, "aim", "distances"), positive(period, "period", "distances")
    rows = max(1, len(series))
    picture = Picture("distances over time", 1.3 + 1.3 * rows)
    picture.figure.suptitle(in_lines(title), x=0.01, ha="left", fontsize=11, color=BLACK)
    drawn = picture.figure.subplots(rows, 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    facts = [f"The aim is {aim:g} m"]
    for axes, (name, values) in zip(drawn, drawable.items(), strict=False):
        style(axes, "").set_title(name, loc="left", fontsize=10, color=BLACK)
        (line,) = axes.plot(period * np.arange(len(values)), values, color=BLUE)
        dashes = axes.axhline(aim, color=VERMILLION, linestyle="--", zorder=1)
        last = values[len(values) // 2 :]
        if len(last):
            facts.append(f"{name}: in the second half between {last.min():.2f} and {last.max():.2f} m")
    drawn[-1].set_xlabel("Time (s)")
    picture.figure.supylabel("Distance (m)", fontsize="medium")
    if series:
        legend(picture.figure, 2, [line, dashes], ["distance", f"aim, {aim:g} m"])
    picture.tell(title, *facts)
    return picture
