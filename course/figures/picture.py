"""A finished figure, and one that is redrawn in place while a cell runs."""

import io
import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Self

from IPython.display import DisplayHandle, display
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from course.errors import FigureError
from course.figures.misuse import expect_recorder, positive
from course.figures.palette import GROUND, plain
from course.foundation.calls import fitting, takes
from course.foundation.waiting import tell_reader, wait_until
from course.recorders import Recorder

WIDTH = 5.0  # inches: on a telephone, which is 360 pixels wide, a text of 10 points is 10 pixels high
DPI = 120  # pixels of a page for each inch, where it is wide enough
redrawing: list[bool] = []  # not empty while a live figure is drawn: what is recorded may follow
SHARE = 4  # times as long as a drawing takes, from its begin to the next one: the nodes' callbacks need the rest
SHARP = 2  # pixels of a still figure for each of the page's, which screens and paper show


class Picture:
    """A still figure: a notebook shows it, `save` writes it.  Its text form is only its name, the same in every run."""

    def __init__(self, name: str, height: float = 3.2) -> None:
        """Make an empty figure, `height` inches high; draw on `figure`, and describe it in `alt` for blind readers."""
        self.name = name
        self.alt = ""
        self.sharpness = SHARP
        self.figure = Figure(figsize=(WIDTH, height), facecolor=GROUND, layout="constrained")
        FigureCanvasAgg(self.figure)

    def __repr__(self) -> str:
        return f"<figure: {self.name}>"

    @plain
    def _repr_png_(self) -> tuple[bytes, dict[str, str | int]]:
        """Return the picture, and as the output's metadata its alternative text and its width on the page (pixels)."""
        file = io.BytesIO()
        self.figure.savefig(file, format="png", dpi=DPI * self.sharpness)
        return file.getvalue(), {"alt": self.alt, "width": round(WIDTH * DPI)}

    def tell(self, title: str, *facts: str) -> None:
        """Set the alternative text: the title, then facts about the data."""
        self.alt = f"{title.rstrip('.')}. " + " ".join(f"{fact}." for fact in facts if fact)

    @plain
    @fitting
    def save(self, path: str | Path) -> None:
        """Write the figure to a file, in the format that the file's ending names; raises FigureError if that fails."""
        try:
            self.figure.savefig(path, dpi=150)
        except (OSError, TypeError, ValueError) as error:
            raise FigureError(f"the figure cannot be saved as {path!r:.60}: {error}") from error


class Live:
    """A figure that is redrawn in its place; after the `with` block it stays as a still picture.

    The main thread draws it, in `wait`, at most `rate` times a second and a quarter of the time; the nodes' callbacks
    only collect data.
    """

    def __init__(self, draw: Callable[[], Picture | Figure], recorder: Recorder, rate: float = 8.0) -> None:
        self._draw, self._recorder, self._pause = draw, recorder, 1.0 / rate
        self._shown: DisplayHandle | None = None
        self._begun = False
        self._rows = 0  # already drawn
        self._next = -math.inf  # s, when it may be drawn again

    def __enter__(self) -> Self:
        self._begun, self._shown = True, display(self._draw(), display_id=True)
        return self

    @fitting
    def wait(self, condition: Callable[[], bool], timeout: float = 30.0) -> bool:
        """Redraw whenever there is something new, until `condition()` holds; False after `timeout` s, which is told.

        Raises FigureError outside of a `with` block, and for a condition that is not a function.
        """
        if not self._begun:
            raise FigureError("nothing is shown yet: write `with live(figure, recorder) as shown:`, and wait below it")
        if not takes(condition):
            raise FigureError(
                "`wait` takes a function without arguments that it can call again and again, not "
                f"{condition!r:.40}: write `lambda:` before the condition"
            )

        def done() -> bool:
            if holds := condition():
                return holds
            if len(self._recorder) > self._rows and time.monotonic() >= self._next:
                self._update()
            return False

        if wait_until(done, timeout):
            return True
        tell_reader(f"`wait` has ended after {timeout:g} s, and its condition has not come true.")
        return False

    def _update(self, sharpness: int = 1) -> None:
        begin, self._rows = time.monotonic(), len(self._recorder)
        if self._shown is not None:  # None outside IPython
            picture = self._draw()
            if isinstance(picture, Picture):
                picture.sharpness = sharpness
            self._shown.update(picture)
        self._next = begin + max(self._pause, SHARE * (time.monotonic() - begin))

    def __exit__(self, kind: object, error: object, traceback: object) -> None:
        try:
            self._update(SHARP)
        except Exception:
            if error is None:  # or else it is told in place of this one
                raise

    def __repr__(self) -> str:
        return "<a live figure: it is shown by `with live(figure, recorder) as shown:`>"


@fitting
def live(figure: Callable[[Recorder], object], recorder: Recorder, rate: float = 8.0) -> Live:
    """Show `figure(recorder)`, and keep it up to date: `with live(feedback, recorder) as shown: shown.wait(...)`.

    Raises FigureError for anything but a function and a recorder, and when the function returns no figure.
    """
    if isinstance(figure, Recorder):
        raise FigureError("first the function that draws, then the recorder: write `live(feedback, recorder)`")
    if callable(figure) and not takes(figure, recorder):
        raise FigureError(
            "`live` gives the recorder to the function that draws: it takes one argument, as in `lambda record: ...`"
        )
    if not callable(figure):
        raise FigureError(
            f"`live` calls the function that draws again and again, and this is {figure!r:.40}: write the function's "
            "name without brackets, or `lambda record:` before the call"
        )
    expect_recorder(recorder, "live")

    def draw() -> Picture | Figure:
        redrawing.append(True)
        try:
            drawn = figure(recorder)
        finally:
            redrawing.pop()
        if not isinstance(drawn, Picture | Figure):
            raise FigureError(
                f"the function that `live` calls returns {drawn!r:.40}: it must return the figure that it makes"
            )
        return drawn

    return Live(draw, recorder, positive(rate, "rate", "live"))
