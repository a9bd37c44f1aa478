"""The page that a student reads: score, and each test with its outcome and what to do.  Everything in it is escaped."""

from collections.abc import Iterable

from autograder.records import Mark, Report, Result
from autograder.results import pages
from autograder.submissions.exercises import load


def page(report: Report, by_hand: Iterable[Mark] = ()) -> str:
    """The feedback on one submission as an HTML page, with the marks that the instructor gave by hand."""
    by_hand = list(by_hand)
    points, most = total(report, by_hand)
    return pages.render(
        "feedback.html",
        report=report,
        by_hand=by_hand,
        exercise=load(report.assignment),
        causes=causes(report),
        points=points,
        most=most,
        number=lambda points: f"{points:g}",
    )


def causes(report: Report) -> dict[str, list[Result]]:
    """What is to be mended: each message once, with the tests that it cost."""
    found: dict[str, list[Result]] = {}
    for test in report.tests:
        if test.message:
            found.setdefault(test.message, []).append(test)
    return found


def total(report: Report, by_hand: Iterable[Mark]) -> tuple[float, float]:
    """The points of tests and marks together, at least 0, and their maximum, as the gradebook counts them.

    A cell that was marked by hand counts with its mark, not with its tests.
    """
    marks = {mark.cell: mark for mark in by_hand if mark.points is not None}
    cells = {test.id: test.cell for test in load(report.assignment).tests}
    tests = [test for test in report.tests if cells.get(test.id) not in marks]
    points = sum(test.points for test in tests) + sum(mark.points or 0.0 for mark in marks.values())
    most = sum(test.max_points for test in tests) + sum(mark.max_points for mark in marks.values())
    return max(0.0, points), most
