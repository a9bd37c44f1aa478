"""`progress()`: the results of all sections' public checks, as last saved in the notebooks.

Nothing is run or stored elsewhere: a notebook file contains the outputs of its checks.
"""

import html
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from course.errors import UnreadableNotebook
from course.foundation import cells
from course.foundation.cells import FAILED, PASSED, STUB, Cell
from course.notebook import file_record
from course.notebook.file_differences import CELL_OLDER, FILE_EDITED, refused, unlike, written_by

ORDER = ("services", "actions", "parameters", "ai_integration", "calculator")
ANSWERED = "answered"
CHANGED = "changed since the check"
AGAIN = "run it again: {} was written again since"
HINT = "Hint: "  # begins what is printed below an error
LONGEST = 4000  # characters of a message that are shown
STUBS = ("YOUR ANSWER HERE", STUB)
HEAD = ("section", "part", "so far", "points")


@dataclass(frozen=True)
class Part:
    """A part of an exercise that gives points: one public check, or one question in words."""

    section: str
    name: str
    state: str  # passed, answered, or what is missing
    points: float  # the points that the hidden tests, or the marker of the answer, can give
    more: str = ""  # the further lines of the message of a check that has failed

    @property
    def done(self) -> bool:
        """Return True if its public check has passed, or its question has an answer."""
        return self.state in (PASSED, ANSWERED)

    @property
    def failed(self) -> bool:
        """Return True if its public check has failed for the files as they are."""
        return self.state.startswith(FAILED)

    def texts(self) -> tuple[str, str, str, str]:
        """Return the texts of the part's row in the table."""
        return self.section, self.name, self.state, f"{self.points:g}"


@dataclass(frozen=True)
class Ran:
    """A run of the public checks beside the notebook, as a hand-in does it."""

    files: Mapping[str, str]  # the digest of each, by its name; one that was missing has none
    outcomes: Mapping[str, str]  # by the name of the check


class Progress(list[Part]):
    """The parts of all exercises, in the order of the course; a notebook shows them as a table.

    `unread` are the sections whose notebooks could not be read, each with the reason: the table has them, too.
    """

    def __init__(self, parts: Iterable[Part] = (), unread: Iterable[tuple[str, str]] = ()):
        super().__init__(parts)
        self.unread = list(unread)

    @property
    def summary(self) -> str:
        """Return a sentence on the progress so far."""
        if not self and not self.unread:
            return "There are no exercises here: run this in the folder that holds the sections."
        done = [part for part in self if part.done]
        reached, all_points = (sum(part.points for part in parts) for parts in (done, self))
        return (
            f"{len(done)} of {len(self)} parts done: so far {reached:g} of {all_points:g} points at most. "
            "Your instructor's tests decide."
            + (f" Not counted: {', '.join(section for section, _ in self.unread)}." if self.unread else "")
        )

    def _rows(self) -> list[tuple[tuple[str, ...], bool]]:
        """Return the texts of each row, and whether the part is done."""
        parts: list[tuple[tuple[str, ...], bool]] = [(part.texts(), part.done) for part in self]
        return parts + [((section, f"{section}.ipynb", why, ""), False) for section, why in self.unread]

    def __repr__(self) -> str:
        lines = [HEAD, *(texts for texts, _ in self._rows())]
        widths = [max(len(line[column]) for line in lines) for column in range(len(HEAD))]
        padded = ("  ".join(text.ljust(width) for text, width in zip(line, widths, strict=True)) for line in lines)
        return "\n".join([*(line.rstrip() for line in padded if len(lines) > 1), self.summary])

    def _repr_html_(self) -> str:
        def row(texts: tuple[str, ...], tag: str) -> str:
            inner = "".join(f'<{tag} style="text-align:left">{html.escape(text)}</{tag}>' for text in texts)
            return f"<tr>{inner}</tr>"

        rows = self._rows()
        body = "\n".join(row((*texts[:2], ("✓ " if done else "") + texts[2], texts[3]), "td") for texts, done in rows)
        table = f"<table><thead>{row(HEAD, 'th')}</thead>\n<tbody>{body}</tbody></table>" if rows else ""
        return f"{table}<p>{html.escape(self.summary)}</p>"


def progress(folder: Path = Path()) -> Progress:
    """Read the sections' saved notebooks, in the folders of `folder`, or beside it if it is a section's own folder.

    A section of the course whose notebook is missing, or cannot be read, is named with the reason.
    """
    if not list(_notebooks(folder)) and list(_notebooks(folder.resolve().parent)):
        folder = folder.resolve().parent
    found = Progress()
    for name in in_order({path.stem for path in _notebooks(folder)} | {*ORDER}):
        path = folder / name / f"{name}.ipynb"
        try:
            found += parts(name, cells.read(path), path.parent)
        except UnreadableNotebook as error:
            found.unread.append((name, f"is damaged: {error}"))
        except OSError as error:
            if why := _missing(path) if isinstance(error, FileNotFoundError) else f"cannot be read: {error.strerror}":
                found.unread.append((name, why))
    return found


def _missing(path: Path) -> str:
    """Return why a section's notebook is not at `path`: renamed, moved or deleted; '' for a section that is not here.

    A course may be handed out without some of the sections.
    """
    folder, section = path.parent, path.stem
    if folder.is_dir():
        others = [each.name for each in cells.notebooks(folder)]
        called = f"if {' or '.join(others)} is meant, rename it" if others else "it was deleted or moved"
        return f"is missing: {called}"
    elsewhere = sorted(each.parent.name for each in folder.parent.glob(f"*/{path.name}"))
    return f"is in the folder {elsewhere[0]}: rename that folder to {section}" if elsewhere else ""


def parts(section: str, known: list[Cell], folder: Path, ran: Ran | None = None) -> Progress:
    """Return the parts of one section from the cells of its notebook, and the files that they have written to `folder`.

    A check judges files of cells above it, so it says nothing about a cell that was edited and not run since.
    It does say something about a file that was edited elsewhere, if it passed for that very text.
    A check that has failed in `ran` has failed, if the notebook has not run it on the files as they are.
    """
    differ = unlike(folder, [cell for cell in known if cell.solution])
    return Progress(
        Part(section, cell.name, state, _points(cell), more)
        for at, cell in enumerate(known)
        if cell.mark.get("grade")
        for state, more in [_state_and_more(cell, known[:at], differ, folder, ran)]
    )


def in_order(sections: Iterable[str]) -> list[str]:
    """Return the sections in the course's order; added ones come last, in the given order."""
    return sorted(sections, key=lambda name: ORDER.index(name) if name in ORDER else len(ORDER))


def _notebooks(folder: Path) -> Iterator[Path]:
    """Yield the sections' notebooks: those of the course in order, then added ones."""
    for name in in_order(path.stem for path in sorted(folder.glob("*/*.ipynb")) if path.stem == path.parent.name):
        yield folder / name / f"{name}.ipynb"


def unanswered(known: list[Cell]) -> dict[str, float]:
    """Return the points of each question in words, by name, that has no answer in the cells of a notebook."""
    questions = [cell for cell in known if cell.mark.get("grade") and cell.solution]
    return {cell.name: _points(cell) for cell in questions if not _answered(cell)}


def _answered(question: Cell) -> bool:
    return bool(question.source.strip()) and not any(stub in question.source for stub in STUBS)


def _points(cell: Cell) -> float:
    points = cell.mark.get("points", 0)
    return float(points) if isinstance(points, (int, float)) else 0.0


def _judged_by(cell: Cell, before: list[Cell]) -> list[str]:
    """Return the files of the cells above that a check names, and those that they use; all of them if it names none."""
    texts = {name: above.source for above in before if (name := written_by(above))}
    used = [name for name in texts if name in cell.source]
    for name in used:  # which grows meanwhile
        used += [each for each in texts if each not in used and re.search(rf"\b{Path(each).stem}\b", texts[name])]
    return [name for name in texts if name in used] or [*texts]


def error_of(cell: Cell) -> list[str]:
    """Return the lines of the error with which a cell has ended; none if it has ended well."""
    error = next((output for output in cell.outputs if output.get("output_type") == "error"), None)
    if error is None:
        return []
    return cells.text_of(error.get("evalue", "")).strip().splitlines() or [str(error.get("ename", "an error"))]


def _more(cell: Cell) -> str:
    """Return what follows the first line of the message of a check: its further lines, and the hint below them."""
    printed = "".join(
        cells.text_of(output.get("text", "")) for output in cell.outputs if output.get("output_type") == "stream"
    )
    hints = printed[printed.index(HINT) :] if HINT in printed else ""
    return "\n".join([*error_of(cell)[1:], *hints.splitlines()]).strip()[:LONGEST]


def _is_later(above: Cell, cell: Cell) -> bool:
    """Return True if a cell that may have written a file was run after the check `cell`."""
    return above.solution and (above.count or 0) > (cell.count or 0) and not refused(above)


def _state_and_more(
    cell: Cell, before: list[Cell], differ: dict[str, str], folder: Path, ran: Ran | None
) -> tuple[str, str]:
    """Return the state of a graded cell, and what follows the first line of the message of a check that has failed."""
    if ran and not cell.solution and (outcome := ran.outcomes.get(cell.name, PASSED)) != PASSED:
        now = {name: file_record.digest_of(folder / name) for name in _judged_by(cell, before)}
        here = cell.count is not None and file_record.judged(folder, cell.name).items() >= now.items()
        passes = file_record.checked(folder, cell.name).items() >= now.items()
        if not here and not passes and all(ran.files.get(name, "") == digest for name, digest in now.items()):
            state, _, more = outcome.partition("\n")
            return state, more.strip()[:LONGEST]
    state = _state(cell, before, differ, folder)
    return state, _more(cell) if state.startswith(FAILED) else ""


def _state(cell: Cell, before: list[Cell], differ: dict[str, str], folder: Path) -> str:
    """Return the state of a graded cell; `before` are the cells above it, `differ` the result of `unlike`."""
    if cell.solution:
        return ANSWERED if _answered(cell) else "not answered"
    files = _judged_by(cell, before)
    now = {name: file_record.digest_of(folder / name) for name in files}
    judged, passed = file_record.judged(folder, cell.name), file_record.checked(folder, cell.name)
    passes = bool(now) and passed.items() >= now.items()  # here, or in a hand-in since: the outputs may be older
    if cell.count is None and not passes:
        return "not run"
    if judged.keys() >= {*files}:  # the numbers of the cells say nothing: another kernel may have run some of them
        written = [name for name in files if judged[name] != now[name]]
        if written:
            return f"{CHANGED}: {written[0]}" if differ.get(written[0]) else AGAIN.format(written[0])
    elif later := [above for above in before if _is_later(above, cell)]:
        return AGAIN.format(written_by(later[0]) or "a file above")
    if not passes and (lines := error_of(cell)):
        return f"{FAILED}{lines[0]}"
    changed = [
        name
        for name in files
        if (why := differ.get(name))
        if why not in (FILE_EDITED, CELL_OLDER) or passed.get(name) != now[name]
    ]
    return f"{CHANGED}: {changed[0]}" if changed else PASSED
