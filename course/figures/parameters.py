"""The figure of section 3.3: what was set, when, and whether the node took it."""

from ..records import ParameterRecorder
from .palette import BLUE, GREEN, VERMILLION, style
from .picture import Picture


def changes(record: ParameterRecorder, name: str, title: str = "A rejected set leaves the value as it was") -> Picture:
    """The value of the numeric parameter `name` over time, with accepted and rejected sets marked."""
    table = record.table()
    rows = [row for row in zip(table["time"], table["name"], table["value"], table["accepted"], strict=True)
            if row[1] == name]
    picture = Picture(f"changes of {name}")
    axes = style(picture.figure.add_subplot(), title, "time since the recorder started (s)", name)
    accepted = [(time, value) for time, _, value, ok in rows if ok]
    rejected = [(time, value) for time, _, value, ok in rows if not ok]
    if accepted:
        end = max(time for time, *_ in rows)
        times, values = zip(*accepted, (end, accepted[-1][1]), strict=True)
        axes.step(times, values, where="post", color=BLUE, label="value")
        axes.plot(*zip(*accepted, strict=True), "o", color=GREEN, markersize=8, label="accepted")
    if rejected:
        axes.plot(*zip(*rejected, strict=True), "X", color=VERMILLION, markersize=9, label="rejected")
    if rows:
        axes.legend(frameon=False, ncols=3, loc="lower right", bbox_to_anchor=(1, 1))
    axes.margins(y=0.15)
    return picture
