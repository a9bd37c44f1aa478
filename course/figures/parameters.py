"""Figures of section 3.3: the sets of a parameter, accepted or refused, over time; and an arm under a controller."""

import math
import textwrap
from collections.abc import Sequence
from operator import itemgetter
from typing import Any, TypeGuard

from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.transforms import blended_transform_factory

from course.errors import FigureError
from course.figures.misuse import expect_recorder, numbers
from course.figures.palette import BLACK, BLUE, GREEN, GREY, LINE, ORANGE, VERMILLION, legend, plain, style
from course.figures.picture import Picture
from course.foundation.calls import fitting, is_number
from course.recorders import ParameterRecorder, Recorder

LISTED = 4  # refusals listed at most, the newest ones
FAR = 1e6  # s, beyond the edge of any axis
REACH = 1.0  # of what the accepted values and the range cover: refused values no further away than this are on the axis
MARGIN = 0.12  # of what the axis covers, free above and below
EDGE = 0.06  # of the axis, between its edge and the arrow of a value beyond it
PLOT = 2.5  # inches: about the height of the axis
SWING = 0.02  # rad: an angle further than this beyond those before and after it is told
ROW = 0.17  # inches: a row of the list
LISTING: dict[str, Any] = {"width": LINE + 6, "subsequent_indent": "    ", "max_lines": 2}  # two rows each at most
REFUSED = {"X": "refused", "^": "refused, far above", "v": "refused, far below", "s": "refused, no number"}


@plain
@fitting
def changes(
    record: ParameterRecorder,
    name: str,
    title: str = "A refused set leaves the value as it was",
    unit: str = "",
    beside: Recorder | None = None,
) -> Picture:
    """Draw the value of the numeric parameter `name` over time, with accepted and refused sets marked.

    The value at the start has no mark, for it was not set.  Each value holds until the next: the last one to the edge
    of the axis, or with `beside` to the last of its rows.  The axis covers the accepted values, the declared range
    (dashed lines) and the refused values near these; one far away is an arrow at the edge.  Refusals are numbered, and
    their values and reasons are listed below the axis.  The columns of `beside`, in the same `unit`, are drawn as well.
    Raises FigureError for anything but recorders, and for a parameter that was not recorded or is not a number.
    """
    if isinstance(record, str) and isinstance(name, Recorder):
        raise FigureError(f"first the recorder, then the name: write `changes(sets, {record!r})`")
    expect_recorder(record, "changes", "name", "value", "accepted", "reason")
    if not isinstance(name, str):
        raise FigureError(
            f"`changes` takes the name of a parameter, such as `changes(sets, 'max_speed')`, not {name!r:.40}"
        )
    if beside is not None:
        expect_recorder(beside, "changes")
        numbers(dict(list(beside.table().items())[1:]), "changes", finite=False)
    table = record.table()
    rows = [
        (time, value, accepted, reason)
        for time, parameter, value, accepted, reason in zip(*table.values(), strict=True)
        if parameter == name
    ]
    if not rows and table["name"]:
        raise FigureError(f"this record has no parameter {name!r}: it has {', '.join(sorted({*table['name']}))}")
    if strange := [value for _, value, ok, _ in rows if ok and not isinstance(value, int | float)]:
        raise FigureError(f"`changes` draws numbers, and {name!r} has the value {strange[0]!r:.40}")
    at_start = name in table["name"][: record.at_start] if isinstance(record, ParameterRecorder) else False
    accepted = [(time, value) for time, value, ok, _ in rows if ok]
    sets = accepted[at_start:]
    refused = [(time, value, reason) for time, value, ok, reason in rows if not ok]
    notes = [f"{number}  {value} refused: {reason}" for number, (_, value, reason) in enumerate(refused, 1)]
    listed = [row for note in notes[-LISTED:] for row in textwrap.wrap(note, **LISTING)]
    picture = Picture(f"changes of {name}", 3.6 + ROW * len(listed))
    time, *others = (followed := beside.table() if beside is not None else {"time": []})
    if beside is not None:
        followed[time] = [each + beside.start - record.start for each in followed[time]]
    quantity = " and ".join([name, *others]) + (f" ({unit})" if unit else "")
    if refused:
        axes, below = picture.figure.subplots(2, 1, height_ratios=(PLOT, ROW * len(listed)))
        _list(below, listed)
    else:
        axes = picture.figure.add_subplot()
    style(axes, title, "Time since the recorder started (s)", textwrap.fill(f"Value of {quantity}", 36))
    limits = record.range(name) if isinstance(record, ParameterRecorder) else ()
    if accepted:
        axes.step(*zip(*accepted, strict=True), where="post", color=BLUE, label=name)
        (last, value), line = accepted[-1], axes.lines[-1]
        held = max([last, *followed[time]]) if followed[time] else last + FAR  # the edge may be moved later
        axes.add_artist(
            Line2D([last, held], [value, value], color=BLUE, linewidth=line.get_linewidth(), zorder=line.zorder)
        )
    if sets:
        axes.plot(*zip(*sets, strict=True), "o", color=GREEN, markersize=8, label="accepted")
    for other in others:
        axes.step(followed[time], followed[other], "-.", where="post", color=ORANGE, label=other)
    for limit in limits:
        axes.axhline(
            limit, color=GREY, linestyle="--", zorder=1, label="declared range" if limit == limits[0] else None
        )
    low, high = _covered(axes, [value for _, value, _ in refused])
    edge = EDGE * (high - low)  # an arrow is inside the axes, clear of the title
    marks: set[str] = set()
    for number, (time, value, _) in enumerate(refused, 1):
        shown, marker = low + edge, "s"
        if _is_number(value):
            shown = min(max(value, low + edge), high - edge)
            marker = "X" if shown == value else "v" if value < shown else "^"
        look: dict[str, Any] = {"color": VERMILLION, "markersize": 9, "fillstyle": "none" if marker == "s" else "full"}
        axes.plot(time, shown, marker, **look, zorder=3, label=None if marker in marks else REFUSED[marker])
        axes.annotate(str(number), (time, shown), xytext=(7, -3), textcoords="offset points", color=BLACK, fontsize=10)
        marks.add(marker)
    if rows:
        legend(picture.figure, 3)
    values = ", then ".join(f"{value} at {time:.1f} s" for time, value in sets)
    picture.tell(
        title,
        f"{name} begins at {accepted[0][1]}" if at_start else "",
        f"{name} was set to {values}" if values else "",
        *(f"{value} at {time:.1f} s was refused: {reason or 'without a reason'}" for time, value, reason in refused),
        f"The declared range is {' to '.join(map(str, limits))}" if limits else "",
    )
    return picture


@plain
@fitting
def response(track: Recorder, title: str = "", limits: Sequence[float] = ()) -> Picture:
    """Draw `angle` and `target` (rad) and `effort` (N m) of an arm over time, with a line at each `note`.

    The `limits` (N m) of the effort are dashed lines.  The default `title` says how far the arm is off its target
    before each note, and in the last row.  Raises FigureError for anything but a recorder of an arm.
    """
    expect_recorder(track, "response", "angle", "target", "effort", "note")
    if not isinstance(limits, list | tuple) or not all(map(is_number, limits)):
        raise FigureError(
            f"`response` takes limits of the effort (N m), such as limits=(-10.0, 10.0), not {limits!r:.40}"
        )
    table = track.table()
    rows = list(zip(table["time"], table["angle"], table["target"], table["effort"], strict=True))
    moves = [row for row in rows if row[1] is not None]
    times = [row[0] for row in moves]
    notes = [(time, note) for time, note in zip(table["time"], table["note"], strict=True) if note is not None]
    title = title or _offsets(moves, notes)
    picture = Picture("response of an arm", 4.4)
    upper, lower = picture.figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    style(upper, title, "", "Angle (rad)")
    style(lower, "", "Time since the arm started (s)", "Effort (N m)")
    upper.plot(times, [row[2] for row in moves], color=BLACK, linestyle=":", label="target")
    upper.plot(times, [row[1] for row in moves], color=BLUE, label="angle")
    lower.plot(times, [row[3] for row in moves], color=GREEN, label="effort")
    for limit in limits:
        lower.axhline(
            limit, color=GREY, linestyle="--", zorder=1, label="limit of the effort" if limit == limits[0] else None
        )
    facts = []
    end = moves[-1][0] if moves else 0.0
    for number, (time, note) in enumerate(notes):
        until = notes[number + 1][0] if number + 1 < len(notes) else end
        facts.append(f"{note} at {time:.1f} s{_hung(moves, time)}{_swung(moves, time, until)}")
        for axes in (upper, lower):
            label = "change of a gain" if axes is lower and not number else None
            axes.axvline(time, color=VERMILLION, linewidth=1, zorder=1, label=label)
        upper.annotate(
            note,
            (time, 0.0),
            xycoords=("data", "axes fraction"),
            xytext=(4, 4),
            textcoords="offset points",
            color=BLACK,
            fontsize=10,
        )
    picture.tell(title, *facts, f"The end at {end:.1f} s{_hung(moves, end)}")
    legend(picture.figure, 3)
    return picture


def _covered(axes: Axes, refused: Sequence[object]) -> tuple[float, float]:
    """Set the limits of the vertical axis to what is drawn and the `refused` values near it, and return them."""
    axes.margins(y=0)
    low, high = axes.get_ylim()
    reach = REACH * (high - low)
    near = [value for value in refused if _is_number(value) and low - reach <= value <= high + reach]
    low, high = min([low, *near]), max([high, *near])
    space = MARGIN * (high - low)
    axes.set_ylim(low - space, high + space)
    return low - space, high + space


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not math.isnan(value)


def _list(axes: Axes, lines: list[str]) -> None:
    """Write `lines` from the left edge of the figure on."""
    axes.axis("off")
    axes.text(
        0.01,
        1.0,
        "\n".join(lines),
        transform=blended_transform_factory(axes.figure.transFigure, axes.transAxes),
        va="top",
        fontsize=10,
        color=BLACK,
        parse_math=False,
        in_layout=False,
    )


def _offsets(moves: Sequence[tuple[float, ...]], notes: Sequence[tuple[float, str]]) -> str:
    """Return how far an arm is off its target before each of `notes`, times (s) and texts, and in the last row."""
    told = []
    now = [(moves[-1][0], f"at {moves[-1][0]:.1f} s")] if moves else []
    for time, moment in [*((time, f"before {note}") for time, note in notes), *now]:
        if before := [row for row in moves if row[0] <= time]:
            told.append(f"{abs(before[-1][2] - before[-1][1]):.2f} rad {moment}")
    return f"Off its target: {', '.join(told)}" if told else "The angle of an arm and its target"


def _swung(moves: Sequence[tuple[float, ...]], begin: float, end: float) -> str:
    """The lowest and the highest angle of an arm between two times (s), in words, unless it began or ended there."""
    during = [(time, angle) for time, angle, *_ in moves if begin <= time <= end]
    if not during:
        return ""
    ends = during[0][1], during[-1][1]
    lowest, highest = (pick(during, key=itemgetter(1)) for pick in (min, max))
    turns = {
        lowest: "falls" if lowest[1] < min(ends) - SWING else "",
        highest: "rises" if highest[1] > max(ends) + SWING else "",
    }
    told = [f"{way} to {angle:.2f} rad at {time:.1f} s" for (time, angle), way in sorted(turns.items()) if way]
    return f"; then the angle {' and '.join(told)}" if told else ""


def _hung(moves: Sequence[tuple[float, ...]], time: float) -> str:
    """The angle and the effort of an arm at a time (s), in words."""
    before = [row for row in moves if row[0] <= time]
    if not before:
        return ""
    return f", with the angle at {before[-1][1]:.2f} rad and the effort at {before[-1][3] or 0.0:.1f} N m"
