"""Figures of section 3.2: an action's feedback as it comes in, and goals over time."""

from collections.abc import Sequence

from matplotlib.lines import Line2D

from course.errors import FigureError
from course.figures.misuse import expect_recorder
from course.figures.palette import BLACK, BLUE, EVENTS, GREY, GROUND, legend, plain, style
from course.figures.picture import Picture, redrawing
from course.foundation.calls import fitting
from course.foundation.waiting import tell_reader
from course.recorders import GoalRecorder, Recorder

# The look of each event: size (points²), marker, and place in rows below the goal's line.  Messages of the client are
# above the line and the server's answers below it, because a goal and its answer are less than a millisecond apart.
ABOVE, BELOW = -0.24, 0.24
MARKERS = {
    "request": (70, "v", ABOVE),
    "goal": (70, "v", ABOVE),
    "accepted": (70, "^", BELOW),
    "feedback": (28, "o", 0.0),
    "cancel": (70, "v", ABOVE),
    "response": (90, "D", 0.0),
    "rejected": (90, "X", 0.0),
    "canceled": (90, "s", 0.0),
    "aborted": (110, "P", 0.0),
}
LABELS = {"request": "sent", "goal": "sent", "cancel": "cancel requested"}
HOLLOW = ("cancel",)  # told from a goal by more than its colour
SEEN = "Each mark: when the client sends it, or receives it"
COLUMNS = 3  # of the legend
LABELLED = 12  # the newest points of a feedback figure


@plain
@fitting
def feedback(goal: GoalRecorder, title: str = "Each feedback message brings one element more") -> Picture:
    """Draw the last element of the sequence at the time of each feedback message.

    Raises FigureError for anything but a recorder of a goal, and if the feedback has no sequence.
    """
    expect_recorder(goal, "feedback", "event", "sequence")
    table = goal.table()
    rows = [
        (time, sequence)
        for time, event, sequence in zip(table["time"], table["event"], table["sequence"], strict=True)
        if event == "feedback" and sequence
    ]
    if "feedback" in table["event"] and all(sequence is None for sequence in table["sequence"]):
        raise FigureError("`feedback` draws the last element of a list, and the feedback of this goal has no list")
    picture = Picture("feedback of a goal")
    axes = style(picture.figure.add_subplot(), title, "Time since the recorder started (s)", "Newest element")
    times, values = [time for time, _ in rows], [sequence[-1] for _, sequence in rows]
    axes.step(times, values, where="post", color=BLUE, alpha=0.6, label="until the next message")
    axes.plot(times, values, "o", color=BLUE, label="feedback message")
    for time, value in list(zip(times, values, strict=True))[-LABELLED:]:
        axes.annotate(
            str(value), (time, value), xytext=(0, 6), textcoords="offset points", ha="center", color=BLACK, fontsize=10
        )
    axes.margins(y=0.15)
    legend(picture.figure, COLUMNS)
    told = f"from {values[0]} to {values[-1]} within {times[-1] - times[0]:.1f} s" if rows else ""
    picture.tell(title, f"{len(rows)} feedback messages, the newest element of each as a point{told and f', {told}'}")
    return picture


@plain
@fitting
def timeline(
    *goals: Recorder,
    labels: Sequence[str] = (),
    title: str = "A goal's life: request, feedback, end",
    together: bool = False,
) -> Picture:
    """Draw one line for each goal or service call: the client's messages above it, the server's answers below it.

    A recorder's events are those of a GoalRecorder, or `request` and `response` for a service call, each at the time at
    which the client sent or received it.  Each line begins when its goal was sent; with `together` all have a common
    time axis, which begins with the first goal.  Raises FigureError for anything but recorders of events, and for more
    or fewer `labels` than these.
    """
    if len(goals) == 1 and isinstance(goals[0], list | tuple):
        raise FigureError(
            "`timeline` draws one recorder after the other: write a star before a list, `timeline(*goals)`"
        )
    if not goals:
        raise FigureError("`timeline` draws recorders, one after the other, such as `timeline(goal)`")
    for goal in goals:
        expect_recorder(goal, "timeline", "event")
        if unknown := {str(event) for event in goal.table()["event"]} - {*EVENTS}:
            raise FigureError(
                f"`timeline` has no mark for the event {', '.join(sorted(map(repr, unknown)))}: its events are "
                f"{', '.join(EVENTS)}"
            )
    if isinstance(labels, str) or (labels and len(labels) != len(goals)):
        one = len(goals) == 1
        raise FigureError(
            f"`timeline` needs {len(goals)} label{'' if one else 's'} here, such as "
            f"labels=({', '.join(repr(f'goal {number + 1}') for number in range(len(goals)))}{',' if one else ''}), "
            f"not {labels!r:.60}"
        )
    if not redrawing and not any(len(goal) for goal in goals):
        tell_reader("Nothing is recorded here yet, so the timeline is empty: was the goal sent, with `.send(...)`?")
    picture = Picture("timeline of goals", 2.5 + 0.65 * max(1, len(goals)))
    since = "the first was sent" if together else "sending"
    axes = style(picture.figure.add_subplot(), title, f"Time since {since} (s)")
    first = min((goal.start for goal in goals), default=0.0)
    names = labels or tuple(f"goal {number + 1}" for number in range(len(goals)))
    seen, facts = {}, []
    for row, goal in enumerate(goals):
        table = goal.table()
        start = first - goal.start if together else next(iter(table["time"]), 0.0)
        times = [time - start for time in table["time"]]
        if times:
            axes.plot([times[0], times[-1]], [row, row], color=GREY, linewidth=1, zorder=1)
            facts.append(f"{names[row]}: {_story(times, table['event'])}")
        for event, color in EVENTS.items():
            at = [time for time, name in zip(times, table["event"], strict=True) if name == event]
            if not at:
                continue
            size, marker, offset = MARKERS.get(event, (90, "D", 0.0))
            seen[LABELS.get(event, event)] = axes.scatter(
                at,
                [row + offset] * len(at),
                s=size,
                marker=marker,
                facecolor=GROUND if event in HOLLOW else color,
                edgecolor=color,
                linewidth=1.5,
                zorder=2 if event == "feedback" else 3,
            )
    axes.set_yticks(range(len(goals)), names)
    axes.set_ylim(len(goals) - 0.5, -0.5)
    picture.tell(title, *facts, "Each time is when the client sends or receives the message" if facts else "")
    if seen:
        shown = [label for label in dict.fromkeys(LABELS.get(event, event) for event in EVENTS) if label in seen]
        handles = [*(seen[label] for label in shown), Line2D([], [], color=GREY, linewidth=1)]
        legend(picture.figure, COLUMNS, handles, [*shown, "under way"], SEEN)
    return picture


def _story(times: list[float], events: list[str]) -> str:
    """The events in words, each with its time (s); the feedback messages are counted."""
    told = [
        f"{LABELS.get(event, event)} at {time:.1f} s"
        for time, event in zip(times, events, strict=True)
        if event != "feedback"
    ]
    count = events.count("feedback")
    return ", ".join([*told, f"{count} feedback message{'' if count == 1 else 's'}"] if count else told)
