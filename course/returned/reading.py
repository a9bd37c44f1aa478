"""`course feedback` and `course.feedback()`: finds what came back, keeps it beside the work, and shows it."""

import contextlib
from pathlib import Path

from course.errors import FeedbackError
from course.returned import nbgrader_exchange, pages
from course.returned.record import Feedback
from course.returned.shown import Shown


def feedback(cell: str = "") -> Shown:
    """The newest feedback on the exercise of this folder, of one cell or of all; raises FeedbackError.

    What was released in nbgrader's exchange is fetched first.
    """
    _, found = find(Path())
    if cell and cell not in found.cells and cell not in {mark.cell for mark in found.marks}:
        raise FeedbackError(f"the feedback has no cell {cell!r}; there are: {', '.join(found.cells)}")
    return Shown(found, cell)


def find(folder: Path) -> tuple[Path, Feedback]:
    """The newest feedback in an exercise's folder, with its page; raises FeedbackError when there is none."""
    unreadable = ""
    for assignment in _assignments(folder):
        try:
            for page in _fetched(assignment)[-1:]:
                pages.keep(page[1], page[0], folder)
        except FeedbackError as error:
            unreadable = str(error)
    names = _assignments(folder)
    found = [hit for name in names if (hit := pages.newest(folder, name))]
    if not found:
        raise FeedbackError(
            unreadable
            or f"there is no feedback in {folder.absolute()} yet: `course feedback FILE`, in a terminal, takes a page "
            "or an archive that came back to you"
        )
    return max(found, key=lambda hit: hit[0].stat().st_mtime_ns)


def take(file: Path, start: Path) -> tuple[Path, Feedback]:
    """Keep a page, or that of an archive, in the folder of its exercise, seen from `start`; raises FeedbackError."""
    found, page = pages.take(file)
    return pages.keep(page, found, pages.place_of(found, start)), found


def news(folder: Path) -> str:
    """A line about feedback that was released in the exchange and not read yet; '' for none.  Never raises."""
    with contextlib.suppress(Exception):  # a notebook's first cell calls it
        for assignment in _assignments(folder):
            for _, page in _fetched(assignment)[-1:]:
                kept = (folder / pages.FOLDER).rglob("*.html")
                if not any(path.stat().st_size == len(page) and path.read_bytes() == page for path in kept):
                    return f"Feedback on {assignment} has been released: course.feedback() shows it."
    return ""


def _fetched(assignment: str) -> list[tuple[Feedback, bytes]]:
    """The pages that the exchange has for this student, the newest hand-in last."""
    return [pages.take(released.path) for released in nbgrader_exchange.released(assignment)]


def _assignments(folder: Path) -> list[str]:
    """The exercises of a folder: its notebooks are called like them."""
    return sorted(path.stem for path in folder.glob("*.ipynb"))
