"""Figures of section 3.2: an action's feedback as it comes in, and goals over time."""

from course.figures.palette import BLACK, BLUE, EVENTS, GREY, plain, style
from course.figures.picture import Picture
from course.recorders import GoalRecorder

# Request and answer are less than a millisecond apart: bars of different heights keep both visible.
MARKERS = {
    "goal": (600, "|"),
    "accepted": (200, "|"),
    "feedback": (28, "o"),
    "cancel": (600, "|"),
    "rejected": (90, "X"),
}


@plain
def feedback(goal: GoalRecorder, title: str = "Each feedback message brings one element more") -> Picture:
    """The last element of the sequence at the time of each feedback message."""
    table = goal.table()
    rows = [
        (time, sequence)
        for time, event, sequence in zip(*table.values(), strict=True)
        if event == "feedback" and sequence
    ]
    picture = Picture("feedback of a goal")
    axes = style(picture.figure.add_subplot(), title, "time since the recorder started (s)", "newest element")
    times, values = [time for time, _ in rows], [sequence[-1] for _, sequence in rows]
    axes.step(times, values, where="post", color=BLUE, alpha=0.5)
    axes.plot(times, values, "o", color=BLUE)
    for time, value in list(zip(times, values, strict=True))[-8:]:
        axes.annotate(
            str(value), (time, value), xytext=(0, 6), textcoords="offset points", ha="center", color=BLACK, fontsize=9
        )
    axes.margins(y=0.15)
    return picture


@plain
def timeline(
    *goals: GoalRecorder, labels: tuple[str, ...] = (), title: str = "A goal's life: request, feedback, end"
) -> Picture:
    """One line for each goal: sent, accepted or rejected, feedback, cancel requested, and how it ended."""
    picture = Picture("timeline of goals", 1.4 + 0.6 * max(1, len(goals)))
    axes = style(picture.figure.add_subplot(), title, "time since the goal was sent (s)")
    seen = {}
    for row, goal in enumerate(goals):
        table = goal.table()
        start = table["time"][0] if table["time"] else 0.0
        times = [time - start for time in table["time"]]
        if times:
            axes.plot([0, times[-1]], [row, row], color=GREY, linewidth=1, zorder=1)
        for event, color in EVENTS.items():
            at = [time for time, name in zip(times, table["event"], strict=True) if name == event]
            if not at:
                continue
            size, marker = MARKERS.get(event, (90, "D"))
            seen[event] = axes.scatter(
                at,
                [row] * len(at),
                s=size,
                marker=marker,
                color=color,
                zorder=2 if event == "feedback" else 3,
                linewidths=2.5 if marker == "|" else None,
            )
    axes.set_yticks(range(len(goals)), labels or [f"goal {number + 1}" for number in range(len(goals))])
    axes.set_ylim(len(goals) - 0.5, -0.5)
    if seen:
        shown = [event for event in EVENTS if event in seen]
        picture.figure.legend(
            [seen[event] for event in shown],
            shown,
            loc="outside lower left",
            ncols=len(EVENTS),
            frameon=False,
            fontsize=9,
            markerscale=0.6,
            columnspacing=1.0,
            handletextpad=0.2,
        )
    return picture
