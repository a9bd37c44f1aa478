"""Right answers in several styles earn all points; wrong ones lose the points of what is wrong, and no others."""

import pytest

from autograder.records import CRASHED, FAILED, GRADED, PASSED, TIMED_OUT
from autograder.submissions import exercises

from . import answers


def cases(kind: str) -> list:
    """All answers of a kind; those that are not in their module's QUICK run only with `-m matrix`, for many minutes."""
    return [
        pytest.param(exercise, name, marks=() if answers.is_quick(exercise, name) else pytest.mark.matrix)
        for exercise in answers.names()
        for name in getattr(answers.load(exercise), kind)
    ]


RIGHT, WRONG = cases("RIGHT"), cases("WRONG")


@pytest.fixture(scope="module")
def reports(request, grade):
    """The future reports on the answers that the chosen tests ask about; all gradings begin at once."""
    reports = {}
    for item in request.session.items:
        asked = getattr(getattr(item, "callspec", None), "params", {})
        if item.path == request.path and "name" in asked:
            exercise, name = asked["exercise"], asked["name"]
            module = answers.load(exercise)
            files = module.RIGHT[name] if name in module.RIGHT else module.WRONG[name][0]
            reports[exercise, name] = grade(
                files, exercise, patience=answers.patience(exercise, name), seed=answers.seed(exercise, name)
            )
    return reports


@pytest.mark.parametrize(("exercise", "name"), RIGHT)
def test_right(reports, exercise, name):
    report = reports[exercise, name].result()
    assert [(test.id, test.message) for test in report.tests if test.outcome != PASSED] == []
    most = exercises.load(exercise).max_score
    assert (report.status, report.score, report.max_score, report.flags) == (GRADED, most, most, [])


@pytest.mark.parametrize(("exercise", "name"), WRONG)
def test_wrong(reports, exercise, name):
    report = reports[exercise, name].result()
    lost = {test.id.removeprefix("test_"): test for test in report.tests if test.outcome != PASSED}
    assert report.status == GRADED
    assert set(lost) == answers.load(exercise).WRONG[name][1]
    assert all(
        test.outcome in (FAILED, CRASHED, TIMED_OUT) and test.points == 0 and test.message for test in lost.values()
    )
    assert report.score == report.max_score - sum(test.max_points for test in lost.values())


def test_crash_is_explained(reports):
    crash = ("calculator", "crash on division by zero")
    if crash not in reports:
        pytest.skip("not graded")
    lost = [test for test in reports[crash].result().tests if test.outcome != PASSED]
    assert {test.outcome for test in lost} == {CRASHED}
    assert "ZeroDivisionError" in lost[0].message
    assert "calculator_server.py, line" in lost[0].message
    assert "/" not in lost[0].message.replace("/calculator", "")
