"""`course feedback` and `course.feedback()`: find feedback, keep it beside the work, and show it."""

import contextlib
from pathlib import Path

from course.errors import FeedbackError
from course.foundation import cells
from course.returned import nbgrader_exchange, pages
from course.returned.record import Feedback
from course.returned.shown import Shown


def feedback(cell: str = "") -> Shown:
    """Return the newest feedback on the exercise of this folder, on one cell or on all; raises FeedbackError.

    Pages released in nbgrader's exchange are fetched first.
    """
    _, found = find(Path())
    if cell and cell not in found.cells and cell not in {mark.cell for mark in found.marks}:
        raise FeedbackError(f"the feedback has no cell {cell!r}; there are: {', '.join(found.cells)}")
    return Shown(found, cell)


def find(folder: Path) -> tuple[Path, Feedback]:
    """Return the newest feedback in an exercise's folder, with its page; raises FeedbackError if there is none."""
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
        raise FeedbackError(unreadable or _none_yet(folder, names))
    return max(found, key=lambda hit: hit[0].stat().st_mtime_ns)


def take(file: Path, start: Path) -> tuple[Path, Feedback]:
    """Keep a page, or the page in an archive, in its exercise's folder (`start` or one in it); raises FeedbackError."""
    found, page = pages.take(file)
    return pages.keep(page, found, pages.place_of(found, start)), found


def unread_line(folder: Path) -> str:
    """Return a line about unread feedback in the exchange; '' for none.  Never raises."""
    with contextlib.suppress(Exception):  # a notebook's first cell calls it
        for assignment in _assignments(folder):
            for _, page in _fetched(assignment)[-1:]:
                kept = (folder / pages.FOLDER).rglob("*.html")
                if not any(pages.holds(path, page) for path in kept):
                    return f"Feedback on {assignment} has been released: course.feedback() shows it."
    return ""


def _none_yet(folder: Path, assignments: list[str]) -> str:
    """Return why there is no feedback in a folder, and what to do."""
    if not assignments or nbgrader_exchange.folder() is None:
        return (
            f"there is no feedback in {folder.absolute()} yet: `course feedback FILE` in a terminal shows the page "
            "or archive that you received"
        )
    exercise = assignments[0]
    if not nbgrader_exchange.handed_in(exercise):
        return f"there is no feedback on {exercise}, because you have not handed it in"
    return (
        f"there is no feedback on {exercise} yet: your instructor has not released it. As soon as it is released, "
        "course.feedback() shows it"
    )


def _fetched(assignment: str) -> list[tuple[Feedback, bytes]]:
    """Return the exchange's pages for this student, the newest hand-in last."""
    return [pages.take(released.path) for released in nbgrader_exchange.released(assignment)]


def _assignments(folder: Path) -> list[str]:
    """Return the exercises of a folder, which are named like its notebooks."""
    return [path.stem for path in cells.notebooks(folder)]
