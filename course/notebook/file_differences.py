"""Exercise cells and the files that they write, where the two have come apart: what is handed in is the file."""

from pathlib import Path

from course.errors import UnreadableNotebook
from course.foundation import cells
from course.foundation.untrusted import read_regular
from course.interfaces.definition import SECTIONS

SUFFIXES = (".py", *(f".{kind}" for kind in SECTIONS))


_written: dict[Path, bytes] = {}  # what this kernel's cells have written


_refused: dict[Path, str] = {}  # why the last version of a cell of this kernel was not written


def remember(file: Path, content: str) -> None:
    """Note what an exercise cell of this kernel has written: the notebook on the disk may not have that cell yet."""
    _written[file.resolve()] = content.encode()
    _refused.pop(file.resolve(), None)


def remember_refused(file: Path, why: str) -> None:
    """Note that an exercise cell of this kernel was run and could not be written: the file is the one before it."""
    _refused[file.resolve()] = why


def refusal_of(file: Path) -> str:
    """Return why the last version of the cell of a file was not written, or ''."""
    return _refused.get(file.resolve(), "")


def last_written(file: Path) -> bytes | None:
    """Return what a cell of this kernel has written last to a file, None if none has."""
    return _written.get(file.resolve())


def difference_of(file: Path) -> str:
    """Return what `differences` says of one file, or ''."""
    return differences(file.parent).get(file.name, "")


def differences(folder: Path = Path()) -> dict[str, str]:
    """Return what is wrong with each file of `folder` that an exercise cell of its saved notebooks should have written.

    A file that is as its cell says is left out, and so is one whose cell still has nothing but the stub in it.
    """
    found = {}
    for path in sorted(folder.glob("*.ipynb")):
        try:
            known = cells.read(path)
        except (UnreadableNotebook, OSError):
            continue
        for cell in known:
            name = written_by(cell)
            if name and (why := _difference(folder / name, path, cells.exercise_file([cell], name) or b"")):
                found[name] = why
    return found


EDITED = "edited since it was run: run its cell"
NOT_WRITTEN = "not written yet: run its cell"


def unlike(folder: Path, known: list[cells.Cell]) -> dict[str, str]:
    """Of each exercise cell's file in `folder` why it is not what its cell says now, saved or not; '' if it is.

    A file that was edited elsewhere counts as edited, too: it takes running its cell to have the two agree.
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
    """The file that an exercise cell writes; '' for any other cell."""
    words = cell.source.lstrip("\n").partition("\n")[0].split()
    wanted = cell.kind == "code" and words[:1] == ["%%exercise"] and len(words) > 1 and words[1].endswith(SUFFIXES)
    return words[1] if wanted and Path(words[1]).name == words[1] else ""


def _difference(file: Path, notebook: Path, written: bytes) -> str:
    try:
        content, changed = read_regular(file, cells.MOST), file.stat().st_mtime
    except FileNotFoundError:
        return f"{file.name} is not there: run its cell."
    except OSError as error:
        return f"{file.name} cannot be read ({error.strerror})."
    except ValueError as error:
        return f"{file.name} cannot be handed in: {error}."
    newer = changed > notebook.stat().st_mtime
    if content == written or (newer and content == _written.get(file.resolve())):
        return ""
    if newer:
        return (
            f"{file.name} is not what its cell in the saved notebook says, and is the newer of the two: save the "
            "notebook, or copy what you changed in the file into the cell. The file is what counts."
        )
    return f"{file.name} is not what its cell says: you edited the cell and did not run it. The file is what counts."
