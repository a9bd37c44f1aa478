"""Feedback for a reader: as text in a terminal, and as a table below the exercise in a notebook.

It is made only from the record, not from the page, and everything is escaped, because a page may come from anywhere.
"""

from functools import cache
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, Template

from course.returned.record import Feedback, Mark, Test

HERE = Path(__file__).resolve().parent
OTHER = "other tests"


class Shown:
    """Feedback that a notebook shows; `cell` chooses one of the notebook's cells, "" all of them."""

    def __init__(self, feedback: Feedback, cell: str = ""):
        self.feedback, self.cell = feedback, cell

    def __repr__(self) -> str:
        return text(self.feedback, self.cell)

    def _repr_html_(self) -> str:
        return html(self.feedback, self.cell)


def heading(feedback: Feedback) -> str:
    """Return the exercise, and its points or why there are none."""
    if feedback.status == "infrastructure_error":
        return f"{feedback.title}: no points yet; it will be graded again"
    so_far = " so far" if feedback.waiting else ""
    return f"{feedback.title}: {_share(feedback.points, feedback.max_points)} points{so_far}"


def text(feedback: Feedback, cell: str = "") -> str:
    """Return the points of each cell, the instructor's comments, and what to correct."""
    lines = [heading(feedback), f"handed in by {feedback.student}", ""]
    tests, marks = _chosen(feedback, cell)
    if feedback.status == "invalid_submission":
        return "\n".join([*lines, f"It could not be graded. {_first(feedback)}"])
    names = [name for name in feedback.cells if cell in ("", name)]
    width = max((len(name or OTHER) for name in names), default=0)
    lines += [f"  {name or OTHER:{width}}  {_said(feedback, name)}" for name in names]
    if marks:
        lines += ["", "From your instructor:"]
        lines += [f"  {_mark(mark)}" for mark in marks]
    if causes := _causes(tests):
        lines += ["", "What to correct:"]
        for number, (message, lost) in enumerate(causes.items(), 1):
            said = message.replace("\n", "\n     ")
            lines += [f"  {number}. {said}", f"     cost {_cost(lost)}: {'; '.join(test.title for test in lost)}"]
    return "\n".join(lines)


def html(feedback: Feedback, cell: str = "") -> str:
    """Return the same as an HTML table, with every test below its cell."""
    tests, marks = _chosen(feedback, cell)
    causes = _causes(tests)
    return _template().render(
        feedback=feedback,
        heading=heading(feedback),
        refused=_first(feedback) if feedback.status == "invalid_submission" else None,
        marks=[_mark(mark) for mark in marks],
        causes={message: (_cost(lost), [test.title for test in lost]) for message, lost in causes.items()},
        numbers={message: number for number, message in enumerate(causes, 1)},
        cells=[(name or OTHER, _said(feedback, name), _of_cell(tests, name)) for name in feedback.cells],
        of=_share,
    )


@cache  # compiling it takes longer than filling it
def _template() -> Template:
    environment = Environment(loader=FileSystemLoader(HERE), autoescape=True, trim_blocks=True, lstrip_blocks=True)
    return environment.get_template("notebook.html")


def _chosen(feedback: Feedback, cell: str) -> tuple[list[Test], list[Mark]]:
    return (
        [test for test in feedback.tests if cell in ("", test.cell)],
        [mark for mark in feedback.marks if cell in ("", mark.cell)],
    )


def _said(feedback: Feedback, cell: str) -> str:
    """Return the points of a cell, and who gave them if not the tests."""
    if any(mark.cell == cell and mark.waiting for mark in feedback.marks):
        return "still to be marked"
    by_hand = any(mark.cell == cell and mark.points is not None for mark in feedback.marks)
    tested = any(test.cell == cell for test in feedback.tests)
    return _points(*feedback.cells[cell]) + (", by your instructor" if by_hand and tested else "")


def _of_cell(tests: list[Test], cell: str) -> list[Test]:
    return [test for test in tests if test.cell == cell]


def _causes(tests: list[Test]) -> dict[str, list[Test]]:
    return Feedback("", "", "", "", 0, 0, tests).causes


def _first(feedback: Feedback) -> str:
    return feedback.tests[0].message if feedback.tests else ""


def _mark(mark: Mark) -> str:
    if mark.waiting:
        said = "still to be marked"
    elif mark.points is None:
        said = ""
    else:
        said = f"{_points(mark.points, mark.max_points)}"
    return ". ".join(part for part in (f"{mark.cell}: {said}" if said else mark.cell, mark.comment) if part)


def _cost(lost: list[Test]) -> str:
    points = sum(test.max_points - test.points for test in lost)
    return f"{points:g} {'point' if points == 1 else 'points'}"


def _points(points: float, most: float) -> str:
    return f"{_share(points, most)} points" if most else f"{points:g} points"


def _share(points: float, most: float) -> str:
    return f"{points:g} of {most:g}"
