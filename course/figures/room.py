"""The figure of a drive: the path in the room, coloured by state, above a strip of states over time."""

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.patches import Circle, Patch

from .palette import BLACK, GREY, STATES, VERMILLION, style
from .picture import Picture


def drive(simulation, decisions=None, title: str = "Where the robot has been, and in which state") -> Picture:
    """The room and path of a `course.world.Simulation` (m), with the states that a `DecisionRecorder` saw.

    A decision belongs to the path by its scan's stamp (s): of simulated time, or of the wall clock, whose newest
    decision then counts as of now.
    """
    path = simulation.path
    table = decisions.table() if decisions is not None else {"stamp": [], "state": []}
    stamps, decided = np.asarray(table["stamp"], dtype=float), table["state"]
    if len(stamps) and stamps[0] > path[-1, 0] + 1.0:
        stamps = stamps - stamps[-1] + path[-1, 0]
    picture = Picture("drive through a room", 5.4 if decided else 4.6)
    if decided:
        axes, strip = picture.figure.subplots(2, 1, height_ratios=[8, 1])
    else:
        axes, strip = picture.figure.add_subplot(), None
    style(axes, title, "x (m)", "y (m)")
    axes.add_collection(LineCollection(simulation.room.segments, colors=BLACK, linewidths=2))
    states = _states(path[:, 0], stamps, decided)
    pieces = np.stack([path[:-1, 1:3], path[1:, 1:3]], axis=1)
    axes.add_collection(LineCollection(pieces, colors=[STATES.get(state, GREY) for state in states[1:]], linewidths=2.5))
    for collision in simulation.collisions:
        axes.plot(collision.x, collision.y, "X", color=VERMILLION, markersize=12)
    x, y, heading = simulation.pose
    axes.add_patch(Circle((x, y), simulation.robot.radius, facecolor="white", edgecolor=BLACK, zorder=3))
    axes.plot([x, x + simulation.robot.radius * np.cos(heading)], [y, y + simulation.robot.radius * np.sin(heading)],
              color=BLACK, zorder=4)
    axes.plot(*simulation.room.start[:2], "+", color=BLACK, markersize=10)
    axes.set_aspect("equal")
    axes.autoscale_view()
    if strip is not None:
        style(strip, "", "time (s)")
        widths = np.diff(stamps, append=stamps[-1] + (np.median(np.diff(stamps)) if len(stamps) > 1 else 0.1))
        strip.bar(stamps, 1, widths, align="edge", color=[STATES[state] for state in decided])
        strip.set_yticks([])
        strip.set_ylim(0, 1)
        present = [state for state in STATES if state in decided]
        axes.legend(handles=[Patch(color=STATES[state], label=state) for state in present], frameon=False,
                    loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return picture


def _states(times: np.ndarray, stamps: np.ndarray, decided: list[str]) -> list[str]:
    """The state of the last decision before each time; "" before the first."""
    last = np.searchsorted(stamps, times - 1e-6, side="right") - 1
    return [decided[number] if number >= 0 else "" for number in last]
