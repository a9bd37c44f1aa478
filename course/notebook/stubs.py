"""The stubs of exercise cells as released, and copies of a student's text before it is replaced."""

import contextlib
import glob
from pathlib import Path

from course.errors import ExerciseError, UnreadableNotebook
from course.foundation import cells
from course.foundation.untrusted import read_regular

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
    """Return a file beside it with `content`, a text of `file` or of its cell; raises OSError.

    That is a new one, unless an earlier copy has this text.  `before` says in its name why: "before-reset".
    """
    name = Path(file)
    for copy in sorted(folder.glob(f"{glob.escape(f'{name.stem}.{before}-')}*{glob.escape(name.suffix)}")):
        with contextlib.suppress(OSError, ValueError):
            if read_regular(copy, cells.MOST) == content:
                return copy
    number = 1
    while True:
        copy = folder / f"{name.stem}.{before}-{number}{name.suffix}"
        try:
            with copy.open("xb") as opened:
                opened.write(content)
            return copy
        except FileExistsError:
            number += 1
