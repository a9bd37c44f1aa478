"""Checks of what a cell gives to a figure: a wrong argument is reported at once."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from course.errors import FigureError
from course.foundation.calls import is_number
from course.recorders import Recorder


def expect_recorder(given: object, figure: str, *columns: str) -> None:
    """Raise FigureError for anything but a recorder that has these columns."""
    if not isinstance(given, Recorder):
        table = isinstance(given, Mapping) and "time" in given
        how = " Give it the recorder itself, without `.table()`" if table else ""
        own = [name for name, value in getattr(given, "__dict__", {}).items() if isinstance(value, Recorder)]
        if own and not own[0].startswith("_"):
            how = f" Give it its recorder, `.{own[0]}`"
        raise FigureError(f"`{figure}` draws a recorder, not {given!r:.40}.{how}".removesuffix("."))
    if missing := [column for column in columns if column not in given.columns]:
        raise FigureError(
            f"`{figure}` draws the columns {', '.join(columns)}, and this recorder lacks {', '.join(missing)}"
        )


def expect_simulation(given: object) -> None:
    """Raise FigureError for anything but a simulation, such as the world that has it."""
    if not (hasattr(given, "room") and hasattr(given, "path") and hasattr(given, "pose")):
        raise FigureError(f"`drive` draws a simulation, such as `world.node.simulation`, not {given!r:.40}")


def expect_action(given: object) -> None:
    """Raise FigureError for anything but the decision of an agent."""
    fits = isinstance(given, Mapping) and all(is_number(given.get(name)) for name in ("linear", "angular"))
    if not fits:
        raise FigureError(
            f"`sectors` takes an agent's decision, such as {{'linear': 0.3, 'angular': 0.0}}, not {given!r:.60}"
        )


def numbers(
    series: object, figure: str, most: int | None = None, finite: bool = True
) -> dict[str, NDArray[np.float64]]:
    """Return the numbers for each name in `series`; raises FigureError for anything else, and for more than `most`."""
    if not isinstance(series, Mapping):
        raise FigureError(
            f"`{figure}` draws a dict of names and numbers, such as `{figure}({{'rule': [0.1, 0.2]}}, ...)`, not "
            f"{series!r:.40}"
        )
    if most is not None and len(series) > most:
        raise FigureError(f"`{figure}` draws {most} series at most, not {len(series)}")
    found = {}
    for name, values in series.items():
        try:
            found[str(name)] = array = np.asarray(values, dtype=float)
        except (TypeError, ValueError):
            array = np.empty((0, 0))
        if array.ndim != 1:
            raise FigureError(f"`{figure}` draws a list of numbers for each name, and {name!r} has {values!r:.40}")
        if finite and not np.isfinite(array).all():
            raise FigureError(f"`{figure}` cannot draw {name!r}: {array[~np.isfinite(array)][0]} is among its numbers")
        if finite and (array < 0.0).any():
            raise FigureError(
                f"`{figure}` draws times, and {name!r} has {array[array < 0.0][0]:g}, which is below zero"
            )
    return found


def positive(value: float, name: str, figure: str) -> float:
    """Return the number; raises FigureError unless it is finite and above 0."""
    if is_number(value) and value > 0.0:
        return float(value)
    raise FigureError(f"`{figure}` takes a number above 0 for `{name}`, not {value!r:.40}")
