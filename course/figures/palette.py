"""Colours and lines of every figure."""

import matplotlib.style
from matplotlib.axes import Axes

# Okabe and Ito, Color Universal Design, 2008.
BLACK, ORANGE, SKY, GREEN, BLUE, VERMILLION, PURPLE = (
    "#222222",
    "#E69F00",
    "#56B4E9",
    "#009E73",
    "#0072B2",
    "#D55E00",
    "#CC79A7",
)
GREY, GROUND = "#8a8a8a", "#fbfaf7"

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


def style(axes: Axes, title: str, xlabel: str = "", ylabel: str = "") -> Axes:
    """Give `axes` the look that all figures share; the title says what is shown, the labels have units."""
    axes.set_title(title, loc="left", fontsize=11, color=BLACK)
    axes.set_xlabel(xlabel)
    axes.set_ylabel(ylabel)
    axes.set_facecolor(GROUND)
    for side in ("top", "right"):
        if side in axes.spines:
            axes.spines[side].set_visible(False)
    axes.grid(alpha=0.25)
    axes.set_axisbelow(True)
    return axes
