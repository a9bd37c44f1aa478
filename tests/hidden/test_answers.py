"""Right answers in several styles earn all points; wrong ones lose the points of what is wrong, and no others.

In every run, each hidden test alone judges an answer that no other test catches; and the answers in a module's QUICK go
through the whole suite, the reference among them.  With the marker `matrix`, all answers go through the whole suite.
"""

import pytest

from autograder.records import CRASHED, FAILED, GRADED, PASSED, TIMED_OUT
from autograder.submissions import exercises
from tests import chosen

from . import answers, messages

LOST = (FAILED, CRASHED, TIMED_OUT)


def cases(kind: str) -> list:
    """All answers of a kind; those that are not in their module's QUICK run only with `-m matrix`, for many minutes."""
    return [
        pytest.param(exercise, name, marks=() if answers.is_quick(exercise, name) else pytest.mark.matrix)
        for exercise in answers.names()
        for name in getattr(answers.load(exercise), kind)
    ]


RIGHT, WRONG = cases("RIGHT"), cases("WRONG")
PROOFS = [(exercise, test, name) for exercise in answers.names() for test, name in answers.proofs(exercise).items()]


@pytest.fixture(scope="module")
def begun(request, grade, judge):
    """What the chosen tests ask for, by exercise, answer and perhaps hidden test: all begins at once."""
    begun = {}
    for asked in chosen.parameters(request, "name"):
        exercise, name, test = asked["exercise"], asked["name"], asked.get("test")
        how = {"patience": answers.patience(exercise, name), "seed": answers.seed(exercise, name)}
        files = answers.files(exercise, name)
        if test:
            begun[exercise, name, test] = judge(files, exercise, f"test_{test}", **how)
        else:
            begun[exercise, name] = grade(files, exercise, **how)
    return begun


@pytest.mark.parametrize("exercise", answers.names())
def test_each_hidden_test_has_an_answer_that_it_alone_catches(exercise):
    proofs, wrong = answers.proofs(exercise), answers.load(exercise).WRONG
    assert {*proofs} == {test.id.removeprefix("test_") for test in exercises.load(exercise).tests}
    assert {name: wrong[name][1] for test, name in proofs.items() if wrong[name][1] != {test}} == {}


@pytest.mark.parametrize("exercise", answers.names())
def test_the_reference_goes_through_the_whole_suite_in_every_run(exercise):
    module = answers.load(exercise)
    assert {*module.RIGHT, *module.WRONG} >= module.QUICK
    assert "reference" in module.QUICK


def test_wrong_answers_go_through_the_whole_suite_in_every_run():
    """So that partial credit is proven: the points that are kept beside those that are lost, of one and of several."""
    modules = map(answers.load, answers.names())
    lost = [len(module.WRONG[name][1]) for module in modules for name in module.QUICK if name in module.WRONG]
    assert len(lost) >= 3 and min(lost) >= 1 and max(lost) > 1


@pytest.mark.parametrize(("exercise", "test", "name"), PROOFS)
def test_only(begun, exercise, test, name):
    """A wrong answer loses the one hidden test that is there to catch it, judged by that test alone."""
    verdicts = begun[exercise, name, test].result().verdicts
    assert {*verdicts} == {f"test_{test}"}
    verdict = verdicts[f"test_{test}"]
    assert verdict.outcome in LOST
    assert verdict.message
    assert messages.others(exercise, name, {test: verdict.message}) == {}


def test_a_hidden_test_alone_starts_only_the_programs_that_it_uses(judge):
    """Neither the client's other runs nor the one without a server, which would print something."""
    judgement = judge(answers.files("calculator", "reference"), "calculator", "test_add").result()
    assert judgement.verdicts["test_add"].outcome == PASSED
    assert {*judgement.logs} == {"calculator_server.py"}


@pytest.mark.parametrize(("exercise", "name"), RIGHT)
def test_right(begun, exercise, name):
    report = begun[exercise, name].result()
    assert [(test.id, test.message) for test in report.tests if test.outcome != PASSED] == []
    most = exercises.load(exercise).max_score
    assert (report.status, report.score, report.max_score, report.flags) == (GRADED, most, most, [])


@pytest.mark.parametrize(("exercise", "name"), WRONG)
def test_wrong(begun, exercise, name):
    report = begun[exercise, name].result()
    lost = {test.id.removeprefix("test_"): test for test in report.tests if test.outcome != PASSED}
    assert report.status == GRADED
    wanted = answers.load(exercise).WRONG[name][1]
    assert {test: verdict.message for test, verdict in lost.items() if test not in wanted} == {}
    assert set(lost) == wanted
    assert all(test.outcome in LOST and test.points == 0 and test.message for test in lost.values())
    assert report.score == report.max_score - sum(test.max_points for test in lost.values())
    assert messages.others(exercise, name, {test: verdict.message for test, verdict in lost.items()}) == {}


def test_crash_is_explained(begun):
    crash = ("calculator", "crash on division by zero")
    if crash not in begun:
        pytest.skip("not graded")
    lost = [test for test in begun[crash].result().tests if test.outcome != PASSED]
    assert {test.outcome for test in lost} == {CRASHED}
    assert "ZeroDivisionError" in lost[0].message
    assert "calculator_server.py, line" in lost[0].message
    assert "/" not in lost[0].message.replace("/calculator", "")
