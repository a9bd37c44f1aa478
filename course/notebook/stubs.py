"""The stubs of exercise cells as released, and copies of a student's text before it is replaced."""

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


def keep_copy(folder: Path, file: str, content: bytes, before: str) -> Path:
    """Write `content`, a text of `file` or of its cell, into a new file beside it; raises OSError.

    `before` says in its name why: "before-reset".
    """
    name = Path(file)
    number = 1
    while True:
        copy = folder / f"{name.stem}.{before}-{number}{name.suffix}"
        try:
            with copy.open("xb") as opened:
                opened.write(content)
            return copy
        except FileExistsError:
            number += 1
