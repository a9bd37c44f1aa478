"""Colours, lines and legend of every figure."""

import textwrap
from collections.abc import Sequence
from typing import Any

import matplotlib.style
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend_handler import HandlerTuple

from course.errors import FigureError

# After Okabe and Ito, Color Universal Design, 2008.  Orange, sky blue, vermillion and purple are darker than theirs: a
# dark theme turns the lightness of each colour round, and each has at least 3:1 on both grounds.
BLACK, ORANGE, SKY, GREEN, BLUE, VERMILLION, PURPLE = (
    "#222222",
    "#C96F00",
    "#2A8FCB",
    "#009E73",
    "#0072B2",
    "#B33000",
    "#BB5F93",
)
GREY, GROUND = "#808080", "#fbfaf7"
LINE = 50  # letters of a line of text that fit into a figure, beside the labels of its axis

STATES = {"FORWARD": GREEN, "TURNING_LEFT": BLUE, "TURNING_RIGHT": ORANGE, "STOPPED": VERMILLION}
SECTORS = {"front": GREEN, "left": BLUE, "right": ORANGE}
EVENTS = {
    "request": BLACK,
    "goal": BLACK,
    "accepted": BLUE,
    "rejected": VERMILLION,
    "feedback": SKY,
    "cancel": ORANGE,
    "response": GREEN,
    "succeeded": GREEN,
    "canceled": PURPLE,
    "aborted": VERMILLION,
    "unknown": GREY,
}

# A decorator: with a notebook's own style (`dark_background`), text would be white on our light background.
plain = matplotlib.style.context("default")


def in_lines(title: object) -> str:
    """Return the title in lines that fit into a figure; raises FigureError unless it is text."""
    if not isinstance(title, str):
        raise FigureError(f"the title of a figure is text, `title='...'`, not {title!r:.40}")
    return textwrap.fill(title, LINE)


def style(axes: Axes, title: str, xlabel: str = "", ylabel: str = "") -> Axes:
    """Give `axes` the look that all figures share; the title says what is shown, the labels have units."""
    axes.set_title(in_lines(title), loc="left", fontsize=11, color=BLACK)
    axes.set_xlabel(xlabel)
    axes.set_ylabel(ylabel)
    axes.set_facecolor(GROUND)
    for side in ("top", "right"):
        if side in axes.spines:
            axes.spines[side].set_visible(False)
    axes.grid(alpha=0.25)
    axes.set_axisbelow(True)
    return axes


class Overlaid(tuple[Any, ...]):
    """The artists of one mark, drawn over each other in the legend."""

    __slots__ = ()


def legend(
    figure: Figure, columns: int, handles: Sequence[Any] = (), labels: Sequence[str] = (), title: str | None = None
) -> None:
    """Explain the marks of a figure below its axes, under a `title`: never over the data.

    Without `handles`, the labels are those that were given when the axes were drawn.  A handle that is a tuple stands
    for marks of several colours, drawn side by side.
    """
    look: dict[str, Any] = {"loc": "outside lower left", "ncols": columns, "frameon": False, "alignment": "left"}
    if handles:
        look |= {"handles": handles, "labels": labels}
    several = {tuple: HandlerTuple(ndivide=None, pad=0.2), Overlaid: HandlerTuple(ndivide=1)}
    look |= {"title": title, "title_fontsize": 10, "fontsize": 10}
    figure.legend(**look, handler_map=several, columnspacing=1.2, handlelength=1.6, handletextpad=0.4)
