"""Figures of how long things take: service round trips, and decisions against their limit."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator

from course.figures.misuse import numbers, positive
from course.figures.palette import BLUE, GREEN, ORANGE, PURPLE, VERMILLION, legend, plain, style
from course.figures.picture import Picture
from course.foundation.calls import fitting

LIMIT = 0.1  # s, one decision of a 10 Hz loop
MOST = 4  # series, each with a look of its own
AROUND = 10  # calls before and after one that count for its median


@plain
@fitting
def round_trips(series: Mapping[str, Sequence[float]], title: str = "How long a call takes, call by call") -> Picture:
    """Round-trip times (s) of calls, in order, with a colour and a marker for each name in `series`.

    A marker is a call, and the line is the median of the calls around it: a call delayed by another program on the
    machine is a marker far from the line.  The axis is logarithmic.  Raises FigureError for anything but numbers, and
    for more than four series.
    """
    drawable = numbers(series, "round_trips", MOST)
    picture = Picture("service round trips", 3.6)
    axes = style(picture.figure.add_subplot(), title, "Number of the call", "Round-trip time (ms, logarithmic)")
    facts, dots, lines = [], [], []
    looks = zip((BLUE, ORANGE, GREEN, PURPLE), ("-", "--", ":", "-."), (".", "x", "+", "|"), strict=True)
    for (name, times), (color, line, marker) in zip(drawable.items(), looks, strict=False):
        calls, values = np.arange(1, len(times) + 1), 1e3 * times
        dots += axes.plot(calls, values, marker, markersize=3, alpha=0.5, color=color)
        medians = [np.median(values[max(0, call - AROUND) : call + AROUND + 1]) for call in range(len(values))]
        lines += axes.plot(calls, medians, line, color=color, linewidth=2, label=name)
        if len(values):
            ends = (f"{np.median(part):.3g} ms" for part in (values[:30], values[-30:]))
            facts.append(f"{name}: {len(values)} calls, medians of the first and the last 30: " + " and ".join(ends))
    picture.tell(title, *facts)
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_formatter("")
    if lines:
        sizeable = tuple(Line2D([], [], marker=dot.get_marker(), linestyle="", color=dot.get_color()) for dot in dots)
        around = f"median of {2 * AROUND + 1} calls"
        legend(picture.figure, 2, [*lines, sizeable, (*lines,)], [*series, "one call", around])
    return picture


@plain
@fitting
def latencies(
    series: Mapping[str, Sequence[float]],
    limit: float = LIMIT,
    title: str = "Every decision must stay left of the limit",
) -> Picture:
    """The distribution of decision latencies (s) for each name in `series`, against `limit` (s).

    Raises FigureError for anything but numbers, and for more than four series.
    """
    drawable, limit = numbers(series, "latencies", MOST), positive(limit, "limit", "latencies")
    picture = Picture("decision latencies", 3.6)
    axes = style(picture.figure.add_subplot(), title, "Latency of a decision (ms, logarithmic)", "Number of decisions")
    values = [1e3 * times for times in drawable.values()]
    every = np.concatenate([*values, [1e3 * limit]]) if values else np.array([1e3 * limit])
    bins = np.geomspace(max(1e-3, every[every > 0].min() * 0.8), every.max() * 1.25, 50).tolist()
    facts = [f"The limit is {1e3 * limit:g} ms"]
    looks = zip((BLUE, ORANGE, GREEN, PURPLE), ("", "////", "....", "xxxx"), strict=True)
    for (name, _), times, (color, hatch) in zip(drawable.items(), values, looks, strict=False):
        if len(times):
            facts.append(f"{name}: {len(times)} decisions, median {np.median(times):.3g} ms")
        late = float(np.mean(times > 1e3 * limit)) if len(times) else 0.0
        label = f"{name}: {late:.0%} too late"
        axes.hist(times, bins=bins, facecolor=color, hatch=hatch, edgecolor="white" if hatch else color, label=label)
        facts.append(f"{name}: {late:.0%} too late")
    picture.tell(title, *facts)
    axes.axvline(1e3 * limit, color=VERMILLION, linestyle="--", label=f"limit, {1e3 * limit:g} ms")
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter("{x:g}")
    legend(picture.figure, 2)
    return picture
