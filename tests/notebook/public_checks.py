"""Run an exercise's public checks in this process: with the notebook's cells that they need, on given files."""

import contextlib
import functools
import io
import re
from collections.abc import Mapping
from pathlib import Path

from course.errors import CourseError
from course.foundation import cells
from course.notebook.exercise_magic import exercise
from course.notebook.file_differences import written_by
from course.notebook.needed_cells import needed_cells
from course.session.live import live

NOTEBOOKS = Path(__file__).parents[2] / "notebooks"

SHELL = re.compile(r"^[!%].*$", re.MULTILINE)  # a cell's lines for the shell: no check relies on them


@functools.cache
def cells_of(name: str) -> list[cells.Cell]:
    """The cells of an exercise's notebook that its checks need."""
    known = cells.read(NOTEBOOKS / name / f"{name}.ipynb")
    return [known[number] for number in needed_cells(known)]


class Page:
    """The notebook of an exercise; the current folder must be an empty one."""

    def __init__(self, name: str):
        self._cells = cells_of(name)
        self._names: dict[str, object] = {}

    def judge(self, files: Mapping[str, bytes], only: str = "") -> dict[str, str]:
        """Return for each public check, or for the one called `only`, "passed" or what it says of `files`."""
        self._names = {}
        found: dict[str, str] = {}
        live().stop()
        for cell in self._cells:
            if name := written_by(cell):
                self.write(name, files.get(name, b""))
            elif not cell.public_check:
                self._run(cell)
            elif only in ("", cell.name):
                found[cell.name] = self._run(cell)
        return found

    def write(self, name: str, content: bytes) -> None:
        """Run the exercise cell of a file, with this content; nothing is started."""
        first = next(cell.source.lstrip("\n").partition("\n")[0] for cell in self._cells if written_by(cell) == name)
        with contextlib.suppress(CourseError), contextlib.redirect_stdout(io.StringIO()):
            exercise(f"{first.partition(' ')[2]} --no-start", content.decode(errors="replace"))

    def check(self, name: str) -> str:
        """Run the public check of this name again, and return "passed" or what it says."""
        return self._run(next(cell for cell in self._cells if cell.name == name))

    def _run(self, cell: cells.Cell) -> str:
        try:
            with contextlib.redirect_stdout(io.StringIO()):
                exec(compile(SHELL.sub("", cell.source), cell.name or "a cell", "exec"), self._names)
        except Exception as error:
            if not cell.public_check:
                raise
            return str(error) or type(error).__name__
        return cells.PASSED
