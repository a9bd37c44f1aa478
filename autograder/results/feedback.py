"""The page that a student reads: score, and each test with its outcome and what to do.  Everything in it is escaped."""

from collections.abc import Iterable
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, Template

from autograder.records import Mark, Report
from autograder.submissions.exercises import load

TEMPLATES = Path(__file__).resolve().with_name("templates")  # now: nbgrader changes the working folder


def template(name: str) -> Template:
    """One of the pages' templates."""
    environment = Environment(loader=FileSystemLoader(TEMPLATES), autoescape=True, trim_blocks=True, lstrip_blocks=True)
    return environment.get_template(name)


def page(report: Report, by_hand: Iterable[Mark] = ()) -> str:
    """The feedback on one submission as an HTML page, with what the instructor has marked by hand."""
    by_hand = list(by_hand)
    points, most = total(report, by_hand)
    return template("feedback.html").render(
        report=report,
        by_hand=by_hand,
        exercise=load(report.assignment),
        points=points,
        most=most,
        number=lambda points: f"{points:g}",
    )


def total(report: Report, by_hand: Iterable[Mark]) -> tuple[float, float]:
    """The points of tests and marks together, at least 0, and the most there are, as the gradebook counts them.

    A cell that was marked by hand counts with its mark, not with its tests.
    """
    marks = {mark.cell: mark for mark in by_hand if mark.points is not None}
    cells = {test.id: test.cell for test in load(report.assignment).tests}
    tests = [test for test in report.tests if cells.get(test.id) not in marks]
    points = sum(test.points for test in tests) + sum(mark.points for mark in marks.values())
    return max(0.0, points), sum(part.max_points for part in (*tests, *marks.values()))
