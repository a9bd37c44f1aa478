"""A finished figure as a value, and one that is redrawn in place while a cell runs."""

import io
import time
from collections.abc import Callable
from pathlib import Path
from typing import Self

from IPython.display import display
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from course.figures.palette import GROUND, plain
from course.recorders import Recorder

WIDTH = 8.0  # inches: the width of a notebook


class Picture:
    """A still figure; a notebook shows it, `save` writes it.  As text it is its name alone, the same every time."""

    def __init__(self, name: str, height: float = 3.2):
        """`height` in inches; draw on `figure`."""
        self.name = name
        self.figure = Figure(figsize=(WIDTH, height), facecolor=GROUND, layout="constrained")
        FigureCanvasAgg(self.figure)

    def __repr__(self) -> str:
        return f"<figure: {self.name}>"

    @plain
    def _repr_png_(self) -> bytes:
        file = io.BytesIO()
        self.figure.savefig(file, format="png", dpi=100)
        return file.getvalue()

    @plain
    def save(self, path: str | Path) -> None:
        """Write the figure in the format of the path's ending."""
        self.figure.savefig(path, dpi=150)


class Live:
    """A figure that is redrawn where it stands; it ends as one still picture.

    Drawing is done by the main thread, in `wait`, at most `rate` times a second; callbacks only collect.
    """

    def __init__(self, draw: Callable[[], Picture], recorder: Recorder, rate: float = 8.0):
        self._draw, self._recorder, self._pause = draw, recorder, 1.0 / rate
        self._shown = None
        self._rows = 0

    def __enter__(self) -> Self:
        self._shown = display(self._draw(), display_id=True)
        return self

    def wait(self, condition: Callable[[], bool], timeout: float = 30.0) -> bool:
        """Redraw whenever there is something new, until `condition()` holds; False after `timeout` s."""
        deadline = time.monotonic() + timeout
        while not condition():
            if time.monotonic() > deadline:
                return False
            began = time.monotonic()
            if len(self._recorder) > self._rows:
                self._update()
            self._recorder.wait_for(self._rows + 1, max(0.02, self._pause - (time.monotonic() - began)))
        return True

    def _update(self) -> None:
        self._rows = len(self._recorder)
        if self._shown is not None:  # None outside IPython
            self._shown.update(self._draw())

    def __exit__(self, *exception) -> None:
        self._update()


def live(figure: Callable[[Recorder], Picture], recorder: Recorder, rate: float = 8.0) -> Live:
    """Show `figure(recorder)` and keep it up to date: `with live(feedback, recorder) as shown: shown.wait(...)`."""
    return Live(lambda: figure(recorder), recorder, rate)
