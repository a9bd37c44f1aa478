"""Right answers in several styles earn all points; wrong ones lose those of what is wrong."""

import pytest

from autograder.records import CRASHED, FAILED, GRADED, PASSED, TIMED_OUT

from .answers import RIGHT, WRONG


@pytest.fixture(scope="module")
def reports(request, grade):
    """The gradings of the answers that the chosen tests ask about, all begun at once."""
    chosen = {item.callspec.params["name"] for item in request.session.items
              if item.path == request.path and "name" in getattr(getattr(item, "callspec", None), "params", {})}
    answers = RIGHT | {name: files for name, (files, _) in WRONG.items()}
    return {name: grade(files) for name, files in answers.items() if name in chosen}


@pytest.mark.parametrize("name", RIGHT)
def test_right(reports, name):
    report = reports[name].result()
    assert [(test.id, test.message) for test in report.tests if test.outcome != PASSED] == []
    assert (report.status, report.score, report.max_score, report.flags) == (GRADED, 20, 20, [])


@pytest.mark.parametrize("name", WRONG)
def test_wrong(reports, name):
    report = reports[name].result()
    lost = {test.id.removeprefix("test_"): test for test in report.tests if test.outcome != PASSED}
    assert report.status == GRADED
    assert set(lost) == WRONG[name][1]
    assert all(test.outcome in (FAILED, CRASHED, TIMED_OUT) and test.points == 0 and test.message
               for test in lost.values())
    assert report.score == report.max_score - sum(test.max_points for test in lost.values())


def test_crash_is_explained(reports):
    if "crash on division by zero" not in reports:
        pytest.skip("not graded")
    lost = [test for test in reports["crash on division by zero"].result().tests if test.outcome != PASSED]
    assert {test.outcome for test in lost} == {CRASHED}
    assert "ZeroDivisionError" in lost[0].message
    assert "calculator_server.py, line" in lost[0].message
    assert "/" not in lost[0].message.replace("/calculator", "")
