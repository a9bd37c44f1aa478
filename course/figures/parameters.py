"""Figures of section 3.3: the sets of a parameter, accepted or refused, over time; and an arm under a controller."""

import math
import textwrap
from collections.abc import Sequence

from matplotlib.lines import Line2D

from course.figures.palette import BLACK, BLUE, GREEN, GREY, LINE, ORANGE, VERMILLION, legend, plain, style
from course.figures.picture import Picture
from course.recorders import ParameterRecorder, Recorder

LISTED = 4  # refusals listed at most, the newest ones
FAR = 1e6  # s, beyond the edge of any axis
EDGE = 0.06  # of the axis, between its edge and the arrow of a value beyond it


@plain
def changes(
    record: ParameterRecorder,
    name: str,
    title: str = "A refused set leaves the value as it was",
    unit: str = "",
    beside: Recorder | None = None,
) -> Picture:
    """Draw the value of the numeric parameter `name` over time, with accepted and refused sets marked.

    The axis covers the accepted values and the declared range (dashed lines); a refused value beyond it is an arrow at
    its edge.  Refusals are numbered, and their values and reasons are listed below the axis.  The columns of `beside`,
    in the same `unit`, are drawn as well.
    """
    table = record.table()
    rows = [
        (time, value, accepted, reason)
        for time, parameter, value, accepted, reason in zip(*table.values(), strict=True)
        if parameter == name
    ]
    accepted = [(time, value) for time, value, ok, _ in rows if ok]
    refused = [(time, value, reason) for time, value, ok, reason in rows if not ok]
    picture = Picture(f"changes of {name}", 3.6 + 0.34 * min(LISTED, len(refused)))
    time, *others = (followed := beside.table() if beside is not None else {"time": []})
    quantity = ", ".join([name, *others]) + (f" ({unit})" if unit else "")
    axes = style(picture.figure.add_subplot(), title, "time since the recorder started (s)", quantity)
    limits = record.range(name) if isinstance(record, ParameterRecorder) else ()
    if accepted:
        axes.step(*zip(*accepted, strict=True), where="post", color=BLUE, label=name)
        # The value holds until it is set again: the line goes to the right edge, even if that is moved later.
        (last, value), line = accepted[-1], axes.lines[-1]
        axes.add_artist(
            Line2D([last, last + FAR], [value, value], color=BLUE, linewidth=line.get_linewidth(), zorder=line.zorder)
        )
        axes.plot(*zip(*accepted, strict=True), "o", color=GREEN, markersize=8, label="accepted")
    for other in others:
        axes.plot(followed[time], followed[other], "-.", color=ORANGE, label=other)
    for limit in limits:
        axes.axhline(limit, color=GREY, linestyle="--", zorder=1, label="limits" if limit == limits[0] else None)
    axes.margins(y=0.3)
    low, high = axes.get_ylim()
    axes.set_ylim(low, high)
    markers: list[str] = []
    for number, (time, value, _) in enumerate(refused, 1):
        drawable = isinstance(value, int | float) and not math.isnan(value)
        edge = EDGE * (high - low)  # the arrow is inside the axes, clear of the title
        shown = min(max(value, low + edge), high - edge) if drawable else low + edge
        markers.append("X" if not drawable or shown == value else "v" if value < shown else "^")
        axes.plot(time, shown, markers[-1], color=VERMILLION, markersize=9, clip_on=False, zorder=3)
        axes.annotate(str(number), (time, shown), xytext=(7, -3), textcoords="offset points", color=BLACK, fontsize=10)
    if refused:
        axes.plot([], [], markers[0], color=VERMILLION, markersize=9, label="refused")
    if rows:
        legend(picture.figure, 3, above=True)
    values = ", then ".join(f"{value} at {time:.1f} s" for time, value in accepted)
    picture.tell(
        title,
        f"{name} was set to {values}" if values else "",
        *(f"{value} at {time:.1f} s was refused: {reason or 'without a reason'}" for time, value, reason in refused),
        f"The declared range is {' to '.join(map(str, limits))}" if limits else "",
    )
    if refused:
        _list(picture, [f"{number}  {value} refused: {reason}" for number, (_, value, reason) in enumerate(refused, 1)])
    return picture


@plain
def response(
    track: Recorder,
    title: str = "The angle follows its target, and what each change of a gain does",
    limits: tuple[float, ...] = (),
) -> Picture:
    """Draw `angle` and `target` (rad) and `effort` (N m) of an arm over time, with a line at each `note`.

    The `limits` (N m) of the effort are dashed lines.
    """
    table = track.table()
    rows = list(zip(table["time"], table["angle"], table["target"], table["effort"], strict=True))
    moves = [row for row in rows if row[1] is not None]
    times = [row[0] for row in moves]
    picture = Picture("response of an arm", 4.4)
    upper, lower = picture.figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    style(upper, title, "", "angle (rad)")
    style(lower, "", "time since the arm started (s)", "effort (N m)")
    upper.plot(times, [row[2] for row in moves], color=BLACK, linestyle=":", label="target")
    upper.plot(times, [row[1] for row in moves], color=BLUE, label="angle")
    lower.plot(times, [row[3] for row in moves], color=GREEN)
    for limit in limits:
        lower.axhline(limit, color=GREY, linestyle="--", zorder=1, label="limit" if limit == limits[0] else None)
    facts = []
    for time, note in zip(table["time"], table["note"], strict=True):
        if note is not None:
            facts.append(f"{note} at {time:.1f} s{_hung(moves, time)}")
            for axes in (upper, lower):
                axes.axvline(time, color=VERMILLION, linewidth=1, zorder=1)
            upper.annotate(
                note,
                (time, 0.0),
                xycoords=("data", "axes fraction"),
                xytext=(4, 4),
                textcoords="offset points",
                color=BLACK,
                fontsize=10,
            )
    end = moves[-1][0] if moves else 0.0
    picture.tell(title, *facts, f"The end at {end:.1f} s{_hung(moves, end)}")
    legend(picture.figure, 3)
    return picture


def _list(picture: Picture, lines: list[str]) -> None:
    """Write the last few of `lines` below the axis, each on two rows at most."""
    picture.figure.supxlabel(
        "\n".join(textwrap.fill(line, LINE + 6, subsequent_indent="    ", max_lines=2) for line in lines[-LISTED:]),
        x=0.01,
        ha="left",
        fontsize=10,
        color=BLACK,
        parse_math=False,
    )


def _hung(moves: Sequence[tuple[float, ...]], time: float) -> str:
    """The angle and the effort of an arm at a time (s), in words."""
    before = [row for row in moves if row[0] <= time]
    if not before:
        return ""
    return f", with the angle at {before[-1][1]:.2f} rad and the effort at {before[-1][3] or 0.0:.1f} N m"
