"""Run the collection: `python -m tests.mistakes.run [--show] [NAME ...]` prints the table of all mistakes, or of some.

The table has each mistake, the first line of what is shown, and after how many seconds it was there.  With `--show` all
that the cells printed.
"""

import shutil
import sys
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from tests.kernels import Kernel
from tests.mistakes import INTERRUPT, SOLUTIONS, Mistake, Step, collection, exercise_cell

IMPORTS = {"calculator": "from calculator_interfaces.srv import Calculate"}
PATIENCE = 3  # times the limit, after which a cell is interrupted that does not show what it must
SESSION = "import course\nros = course.live()"


@dataclass
class Shown:
    """The lines that a step showed, and how long it took."""

    step: Step
    text: str
    seconds: float  # until it was there
    missing: str  # the first line that is not there and must be; '' when all are
    stayed: float = 0.0  # s from ■ to the end of the cell


# The reference answer is what lies there now, though a cell of the mistake before was refused.
WRITTEN = """
from pathlib import Path
from course.notebook.file_differences import remember, unwritten
for path in filter(unwritten, Path().glob("*.py")):
    remember(path, path.read_text())
"""


class Kernels:
    """A kernel for each exercise, in a folder with the reference answer and the notebook."""

    def __init__(self, folder: Path):
        self._folder = folder
        self._made: dict[str, Kernel] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for kernel in self._made.values():
            kernel.stop()

    def run(self, mistake: Mistake) -> list[Shown]:
        """Run the cells of a mistake, and return what each showed."""
        kernel = self._kernel(mistake.exercise)
        for file in (SOLUTIONS / mistake.exercise).iterdir():
            if file.is_file():
                shutil.copyfile(file, kernel.folder / file.name)
        kernel.run(f"{WRITTEN}%reset -f\n{SESSION}\nros.stop()")  # no mistake leans on the names of another
        for file in sorted((SOLUTIONS / mistake.exercise).glob("*.srv")):
            kernel.run(exercise_cell(mistake.exercise, file.name))
            kernel.run(IMPORTS[mistake.exercise])
        new: list[Kernel] = []
        shown: list[Shown] = []
        before, seconds = "", 0.0  # a node may die while it starts, or beneath the cell after that
        try:
            for step in mistake.steps:
                if step.new_kernel:
                    new.append(Kernel(self._folder_for(mistake.exercise)))
                each = _run(new[-1] if new else kernel, step)
                before, seconds = f"{before}\n{each.text}", seconds + each.seconds
                shown.append(Shown(step, before.strip(), seconds, step.differs(before), each.stayed))
                if step.shown:
                    before, seconds = "", 0.0
        finally:
            for each in new:
                each.stop()
        kept = kernel.run("print(course.live() is ros and ros.ok)\nros.stop()")
        assert "True" in kept, f"the session has ended: {kept}"
        return shown

    def _folder_for(self, exercise: str) -> Path:
        """Make a new folder with the exercise's notebook and the reference answer, in which nothing was built yet."""
        folder = Path(tempfile.mkdtemp(dir=self._folder, prefix=f"{exercise}-"))
        shutil.copy(SOLUTIONS.parent / "notebooks" / exercise / f"{exercise}.ipynb", folder)
        for file in (SOLUTIONS / exercise).iterdir():
            if file.is_file():
                shutil.copyfile(file, folder / file.name)
        return folder

    def _kernel(self, exercise: str) -> Kernel:
        if exercise not in self._made:
            folder = self._folder / exercise
            folder.mkdir()
            shutil.copy(SOLUTIONS.parent / "notebooks" / exercise / f"{exercise}.ipynb", folder)
            self._made[exercise] = Kernel(folder)
            # Each reset looks twice for garbage: not among all that was loaded before the first mistake.
            self._made[exercise].run(f"{SESSION}\nimport gc\ngc.collect()\ngc.freeze()")
        return self._made[exercise]


def _run(kernel: Kernel, step: Step) -> Shown:
    if not step.interrupted:
        text = kernel.run(step.cell)
        return Shown(step, text, kernel.seconds, "")
    began = time.monotonic()
    pressed = 0.0

    def press() -> None:
        nonlocal pressed
        if not pressed:
            pressed = time.monotonic()
            kernel.interrupt()

    def look(text: str) -> None:
        if text and not step.differs(text):
            press()

    patience = PATIENCE * step.limit
    limit = threading.Timer(patience, press)
    limit.start()
    text = kernel.run(step.cell, seen=look, timeout=patience + 2 * INTERRUPT)
    limit.cancel()
    ended = time.monotonic()
    return Shown(step, text, (pressed or ended) - began, "", ended - (pressed or ended))


def main() -> None:
    """Print the table."""
    names = [word for word in sys.argv[1:] if word != "--show"]
    with tempfile.TemporaryDirectory() as folder, Kernels(Path(folder)) as kernels:
        for mistake in collection():
            name = f"{mistake.exercise}/{mistake.name}"
            if names and not any(word in name for word in names):
                continue
            shown = kernels.run(mistake)
            told = [each for each in shown if each.step.shown]
            last = told[-1] if told else shown[-1]
            first = next((line for line in last.step.shown if line != "..."), "")
            print(f"| {name} | {first} | {last.seconds:.1f} |", *(f"MISSING {e.missing!r}" for e in shown if e.missing))
            if "--show" in sys.argv:
                for each in shown:
                    print(f"--- {each.seconds:.1f} s {each.stayed:.1f}\n{each.text}\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main()
