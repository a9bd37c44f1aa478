"""The stubs of exercise cells as released, and copies of a student's text before a reset to the stub."""

from pathlib import Path

from course.errors import ExerciseError, UnreadableNotebook
from course.foundation import cells

RELEASED = ".released"  # beside the sections' folders: the notebooks as released


def stub_of(notebook: Path, name: str) -> str:
    """Return the released text of the cell called `name`; raises ExerciseError."""
    released = notebook.parent.parent / RELEASED / notebook.stem / notebook.name
    try:
        known = cells.read(released)
    except (OSError, UnreadableNotebook):
        raise ExerciseError(f"there is no copy of {notebook.name} as it was released: ask your instructor") from None
    for cell in known:
        if cell.name == name:
            return cell.source
    raise ExerciseError(f"{notebook.name} had no cell called {name} when it was released")


def keep_copy(folder: Path, file: str, text: str) -> Path:
    """Write the text of the cell of `file` into a new file beside it; raises OSError."""
    name = Path(file)
    number = 1
    while True:
        copy = folder / f"{name.stem}.before-reset-{number}{name.suffix}"
        try:
            with copy.open("x", encoding="utf-8") as opened:
                opened.write(text)
            return copy
        except FileExistsError:
            number += 1
