"""The student's page: score, and each test with its outcome and what to do.  Everything in it is escaped."""

from collections.abc import Iterable

from markupsafe import escape

from autograder.records import Report
from autograder.results import pages
from autograder.submissions.exercises import load
from course.returned import record
from course.returned.record import Mark


def page(report: Report, by_hand: Iterable[Mark] = ()) -> str:
    """Return the feedback on one submission as an HTML page, with the instructor's manual marks.

    The page also contains the feedback as data, which `course feedback` reads.
    """
    found = feedback(report, by_hand)
    return pages.render(
        "feedback.html",
        report=report,
        by_hand=found.marks,
        exercise=load(report.assignment),
        causes=found.causes,
        points=found.points,
        most=found.max_points,
        meta=record.META,
        data=escape(found.to_text()),  # all of it, not cut
        number=lambda points: f"{points:g}",
    )


def feedback(report: Report, by_hand: Iterable[Mark] = ()) -> record.Feedback:
    """Return the part of a report that the student may see, with the instructor's manual marks."""
    by_hand = list(by_hand)
    points, most = total(report, by_hand)
    cells = {test.id: test.cell for test in load(report.assignment).tests}
    return record.Feedback(
        report.student,
        report.assignment,
        load(report.assignment).title,
        report.status,
        points,
        most,
        [
            record.Test(test.title, test.outcome, test.points, test.max_points, test.message, cells.get(test.id, ""))
            for test in report.tests
        ],
        by_hand,
    )


def total(report: Report, by_hand: Iterable[Mark]) -> tuple[float, float]:
    """Return the points of tests and marks together, at least 0, and their maximum, as the gradebook counts them.

    A cell that was marked by hand counts with its mark, not with its tests.
    """
    marks = {mark.cell: mark for mark in by_hand if mark.points is not None}
    cells = {test.id: test.cell for test in load(report.assignment).tests}
    tests = [test for test in report.tests if cells.get(test.id) not in marks]
    points = sum(test.points for test in tests) + sum(mark.points or 0.0 for mark in marks.values())
    most = sum(test.max_points for test in tests) + sum(mark.max_points for mark in marks.values())
    return max(0.0, points), most
