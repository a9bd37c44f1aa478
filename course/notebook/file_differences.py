"""Differences between exercise cells and their files: the file is what is handed in."""

from pathlib import Path

from course.foundation import cells
from course.foundation.untrusted import read_regular
from course.notebook.exercise_names import SUFFIXES

_written: dict[Path, bytes] = {}  # the texts that this kernel's cells have written


_refused: dict[Path, str] = {}  # why the last version of a cell was not written


def remember(file: Path, content: str) -> None:
    """Remember the text that an exercise cell has written: the saved notebook may not have that cell yet."""
    _written[file.resolve()] = content.encode()
    _refused.pop(file.resolve(), None)


def remember_refused(file: Path, why: str) -> None:
    """Remember that an exercise cell was run but not written: the file is still the one before it."""
    _refused[file.resolve()] = why


def refusal_of(file: Path) -> str:
    """Return why the last version of the cell of a file was not written, or ''."""
    return _refused.get(file.resolve(), "")


def last_written(file: Path) -> bytes | None:
    """Return the text that a cell of this kernel last wrote to a file, or None."""
    return _written.get(file.resolve())


def difference_of(file: Path) -> str:
    """Return the result of `differences` for one file, or ''."""
    return differences(file.parent).get(file.name, "")


def differences(folder: Path = Path()) -> dict[str, str]:
    """Return what is wrong with each exercise file of `folder`, compared with the cells of its saved notebooks.

    Files that equal their cell are left out, and so are those whose cell still is the stub.
    """
    found = {}
    for path, known in cells.readable(sorted(folder.glob("*.ipynb"))):
        for cell in known:
            name = written_by(cell)
            if name and (why := _difference(folder / name, path, cells.exercise_file([cell], name) or b"")):
                found[name] = why
    return found


EDITED = "edited since it was run: run its cell"
NOT_WRITTEN = "not written yet: run its cell"


def unlike(folder: Path, known: list[cells.Cell]) -> dict[str, str]:
    """Return for each exercise file in `folder` why it differs from its cell as given, saved or not; '' if it does not.

    A file that was edited elsewhere differs, too: only running its cell makes both equal.
    """
    found = {}
    for cell in known:
        if name := written_by(cell):
            try:
                same = read_regular(folder / name, cells.MOST) == cells.exercise_file([cell], name)
                found[name] = "" if same else EDITED
            except (OSError, ValueError):
                found[name] = NOT_WRITTEN
    return found


def written_by(cell: cells.Cell) -> str:
    """Return the name of the file that an exercise cell writes; '' for any other cell."""
    words = cell.source.lstrip("\n").partition("\n")[0].split()
    wanted = cell.kind == "code" and words[:1] == ["%%exercise"] and len(words) > 1 and words[1].endswith(SUFFIXES)
    return words[1] if wanted and Path(words[1]).name == words[1] else ""


def _difference(file: Path, notebook: Path, written: bytes) -> str:
    try:
        content, changed = read_regular(file, cells.MOST), file.stat().st_mtime
    except FileNotFoundError:
        return f"{file.name} is missing: run its cell."
    except OSError as error:
        return f"{file.name} cannot be read ({error.strerror})."
    except ValueError as error:
        return f"{file.name} cannot be handed in: {error}."
    newer = changed > notebook.stat().st_mtime
    if content == written or (newer and content == _written.get(file.resolve())):
        return ""
    if newer:
        return (
            f"{file.name} differs from its cell in the saved notebook, and is newer: save the notebook, or copy your "
            "change from the file into the cell. The file is what counts."
        )
    return (
        f"{file.name} differs from its cell: since the cell was run, the cell or the file was edited. The file is what "
        "counts; running the cell replaces it."
    )
