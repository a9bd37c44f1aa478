"""The figure of section 3.3: what was set, when, and whether the node accepted it."""

import math

from matplotlib.lines import Line2D

from course.figures.palette import BLACK, BLUE, GREEN, GREY, VERMILLION, plain, style
from course.figures.picture import Picture
from course.recorders import ParameterRecorder

LISTED = 4  # rejections listed at most, the newest ones
FAR = 1e6  # s, beyond every edge


@plain
def changes(record: ParameterRecorder, name: str, title: str = "A rejected set leaves the value as it was") -> Picture:
    """The value of the numeric parameter `name` over time, with accepted and rejected sets marked.

    The axis covers the accepted values and the declared range (dashed lines); a rejected value beyond it is an arrow at
    its edge.  Rejections are numbered, and their values and reasons are listed below the axis.
    """
    table = record.table()
    rows = [
        (time, value, accepted, reason)
        for time, parameter, value, accepted, reason in zip(*table.values(), strict=True)
        if parameter == name
    ]
    accepted = [(time, value) for time, value, ok, _ in rows if ok]
    rejected = [(time, value, reason) for time, value, ok, reason in rows if not ok]
    picture = Picture(f"changes of {name}", 3.2 + 0.18 * min(LISTED, len(rejected)))
    axes = style(picture.figure.add_subplot(), title, "time since the recorder started (s)", name)
    limits = record.range(name) if isinstance(record, ParameterRecorder) else ()
    if accepted:
        axes.step(*zip(*accepted, strict=True), where="post", color=BLUE, label="value")
        # The value holds until it is set again: to the right edge, wherever later drawing moves that edge.
        (last, value), line = accepted[-1], axes.lines[-1]
        axes.add_artist(
            Line2D([last, last + FAR], [value, value], color=BLUE, linewidth=line.get_linewidth(), zorder=line.zorder)
        )
        axes.plot(*zip(*accepted, strict=True), "o", color=GREEN, markersize=8, label="accepted")
    for limit in limits:
        axes.axhline(limit, color=GREY, linestyle="--", zorder=1, label="range" if limit == limits[0] else None)
    axes.margins(y=0.2)
    low, high = axes.get_ylim()
    axes.set_ylim(low, high)
    for number, (time, value, _) in enumerate(rejected, 1):
        drawable = isinstance(value, int | float) and not math.isnan(value)
        shown = min(max(value, low), high) if drawable else low
        marker = "X" if not drawable or shown == value else "v" if value < low else "^"
        axes.plot(time, shown, marker, color=VERMILLION, markersize=9, clip_on=False, zorder=3)
        axes.annotate(
            str(number),
            (time, shown),
            xytext=(7, -9 if marker == "^" else 2),
            textcoords="offset points",
            color=BLACK,
            fontsize=9,
        )
    if rejected:
        axes.plot([], [], "X", color=VERMILLION, markersize=9, label="rejected")
    if rows:
        picture.figure.legend(frameon=False, ncols=4, loc="outside upper right")
    if rejected:
        _list(
            picture, [f"{number}  {value} rejected: {reason}" for number, (_, value, reason) in enumerate(rejected, 1)]
        )
    return picture


def _list(picture: Picture, lines: list[str]) -> None:
    """Write the last few of `lines` below the axis, each cut to the width of the figure."""
    picture.figure.supxlabel(
        "\n".join(line if len(line) < 110 else line[:107] + "..." for line in lines[-LISTED:]),
        x=0.01,
        ha="left",
        fontsize=9,
        color=BLACK,
        parse_math=False,
    )
