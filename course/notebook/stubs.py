"""The stubs of exercise cells, as they were released, and a copy of what one has written before it is reset to them."""

from pathlib import Path

from course.errors import ExerciseError, UnreadableNotebook
from course.foundation import cells

RELEASED = ".released"  # beside the sections' folders: the notebooks as they were handed out


def stub_of(notebook: Path, name: str) -> str:
    """The text that the cell called `name` had when the notebook was handed out; raises ExerciseError."""
    released = notebook.parent.parent / RELEASED / notebook.stem / notebook.name
    try:
        known = cells.read(released)
    except (OSError, UnreadableNotebook):
        raise ExerciseError(f"there is no copy of {notebook.name} as it was handed out: ask your instructor") from None
    for cell in known:
        if cell.name == name:
            return cell.source
    raise ExerciseError(f"{notebook.name} had no cell called {name} when it was handed out")


def keep_copy(folder: Path, file: str, text: str) -> Path:
    """Write what the cell of `file` says into a file beside it that is not there yet; raises OSError."""
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
