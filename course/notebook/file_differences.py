"""Differences between exercise cells and their files: the file is what is handed in."""

from pathlib import Path

from course.errors import ExerciseError
from course.foundation import cells
from course.foundation.untrusted import read_regular
from course.notebook import file_record
from course.notebook.exercise_names import SUFFIXES

_written: dict[Path, bytes] = {}  # the texts that this kernel's cells have written


_unwritten: dict[Path, str] = {}  # what became of the last run of a cell that was not written


def remember(file: Path, content: str) -> None:
    """Remember the text that an exercise cell has written: the saved notebook may not have that cell yet."""
    _written[file.resolve()] = content.encode("utf-8", errors="replace")
    file_record.note_written(file, _written[file.resolve()])
    _unwritten.pop(file.resolve(), None)


def remember_unwritten(file: Path, why: str) -> None:
    """Remember that an exercise cell was run but not written, so that the file is still the one before it.

    `why` is "interrupted", or "refused: " and the reason.
    """
    _unwritten[file.resolve()] = why


def unwritten(file: Path) -> str:
    """Return what became of the last run of the cell of a file, if it was not written, as given; or ''."""
    return _unwritten.get(file.resolve(), "")


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
    for path, known in cells.readable(cells.notebooks(folder)):
        for cell in known:
            name = written_by(cell)
            if name and (why := _difference(folder / name, path, cells.exercise_file([cell], name) or b"")):
                found[name] = why
    return found


EDITED = "edited since it was run: run its cell"
REPLACES = "running the cell replaces the file, and keeps a copy of it"
FILE_EDITED = f"the file was edited, its cell was not: copy the change into the cell ({REPLACES})"
CELL_OLDER = f"the file is newer: its cell has an earlier text. Copy the file's text into the cell ({REPLACES})"
BOTH_EDITED = f"the file was edited, and its cell, too: copy the file's change into the cell ({REPLACES})"
DIFFERS = "differs from its cell: since the cell was run, the cell or the file was edited"
NOT_WRITTEN = "not written yet: run its cell"
REFUSED = "its cell had an error when it was last run, and nothing was written"


def unlike(folder: Path, known: list[cells.Cell]) -> dict[str, str]:
    """Return for each exercise file in `folder` why it differs from its cell as given, saved or not; '' if it does not.

    A file that was edited elsewhere differs, too: only running its cell makes both equal.
    """
    last = file_record.written(folder)
    return {name: _unlike(folder / name, cell, last.get(name, "")) for cell in known if (name := written_by(cell))}


def _unlike(file: Path, cell: cells.Cell, last: str) -> str:
    """Return why a file differs from its cell, or ''; `last` is the digest of what a cell last wrote to it, or ''."""
    now, wanted = file_record.digest_of(file), file_record.digest(cells.exercise_file([cell], file.name) or b"")
    if now == wanted:
        return ""
    if why := refused(cell):
        return f"{REFUSED}: {why}"
    if not now:
        return NOT_WRITTEN
    if not last:
        return DIFFERS
    if now == last:  # a page that was loaded again may show a cell as it was saved before
        return CELL_OLDER if wanted in file_record.earlier(file.parent, file.name) else EDITED
    return FILE_EDITED if wanted == last else BOTH_EDITED


def refused(cell: cells.Cell) -> str:
    """Return the first line of the error with which the last run of an exercise cell wrote nothing; '' for none."""
    for output in cell.outputs:
        if output.get("output_type") == "error" and output.get("ename") == ExerciseError.__name__:
            return cells.text_of(output.get("evalue", "")).strip().partition("\n")[0]
    return ""


def only_in_the_file(file: Path, content: str) -> bytes | None:
    """Return what `file` holds if writing `content` would lose it; else None.

    That is a text that no cell wrote, and one that a cell wrote, if the cell has an earlier text again and no saved
    notebook has the later one.
    """
    try:
        present = read_regular(file, cells.MOST)
    except (OSError, ValueError):
        return None
    saved = [cells.exercise_file(known, file.name) for _, known in cells.readable(cells.notebooks(file.parent))]
    new = content.encode("utf-8", errors="replace")
    if present in (new, *saved):
        return None
    if file_record.digest(new) in file_record.earlier(file.parent, file.name):
        return present
    ours = present == last_written(file)
    return None if ours or file_record.written(file.parent).get(file.name) == file_record.digest(present) else present


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
    if why := unwritten(file):
        was, colon, reason = why.partition("\n")[0].partition(":")
        what = f"the last run of the cell was {was}, and wrote nothing{colon}{reason}"
        return f"{file.name} is not what its cell says: {what}"
    if newer:
        return (
            f"{file.name} differs from its cell in the saved notebook, and is newer: save the notebook, or copy your "
            "change from the file into the cell. The file is what counts."
        )
    return (
        f"{file.name} differs from its cell: since the cell was run, {_edited(file, content, written)}. The file is "
        "what counts; running the cell replaces it."
    )


def _edited(file: Path, content: bytes, wanted: bytes) -> str:
    """Return which of the two was edited since a cell last wrote a file, as far as the record tells."""
    last = file_record.written(file.parent).get(file.name)
    in_file, in_cell = (last != file_record.digest(text) for text in (content, wanted))
    if not last or file_record.digest(wanted) in file_record.earlier(file.parent, file.name):
        return "the cell or the file was edited"
    return "both were edited" if in_file and in_cell else "the file was edited" if in_file else "the cell was edited"
