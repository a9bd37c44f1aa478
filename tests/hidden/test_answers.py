"""Right answers in several styles earn all points; wrong ones lose the points of what is wrong, and no others.

In every run, each hidden test judges an answer that no other test catches, several such answers as one program; and the
answers in a module's QUICK go through the whole suite, the reference among them.  With the marker `matrix`, all answers
go through the whole suite.
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
TOGETHER = {exercise: answers.together(exercise) for exercise in answers.names()}
PROOFS = [
    (exercise, test, name) for exercise, groups in TOGETHER.items() for group in groups for test, name in group.items()
]


def beside(exercise: str, test: str) -> dict[str, str]:
    """The proofs that are judged together with that of a hidden test, which is one of them."""
    return next(group for group in TOGETHER[exercise] if test in group)


@pytest.fixture(scope="module")
def begun(request, grade, judge):
    """The gradings of the chosen tests, all begun at once, by exercise and by answers, with the spared test, if any."""
    begun = {}
    for asked in chosen.parameters(request, "name"):
        exercise, name, test = asked["exercise"], asked["name"], asked.get("test")
        how = {"patience": answers.patience(exercise, name), "seed": answers.seed(exercise, name)}
        if spared := asked.get("spared"):
            others = [each for each in beside(exercise, spared).values() if each != name]
            files = answers.merged(exercise, others)
            begun[exercise, name, spared] = judge(files, exercise, f"test_{spared}", seed=how["seed"])
        elif test:
            group = beside(exercise, test)
            names = tuple(group.values())
            if (exercise, names) not in begun:
                tests = [f"test_{each}" for each in group]
                begun[exercise, names] = judge(answers.merged(exercise, names), exercise, *tests, **how)
        else:
            begun[exercise, name] = grade(answers.files(exercise, name), exercise, **how)
    return begun


@pytest.mark.parametrize("exercise", answers.names())
def test_each_hidden_test_has_an_answer_that_it_alone_catches(exercise):
    proofs, wrong = answers.proofs(exercise), answers.load(exercise).WRONG
    assert {*proofs} == {test.id.removeprefix("test_") for test in exercises.load(exercise).tests}
    assert {name: wrong[name][1] for test, name in proofs.items() if wrong[name][1] != {test}} == {}


@pytest.mark.parametrize("exercise", answers.names())
def test_what_is_judged_together_is_each_an_answer_that_one_hidden_test_alone_catches(exercise):
    proofs, sets = answers.proofs(exercise), answers.sets(exercise)
    assert sorted(name for names in sets for name in names) == sorted({*proofs.values()} & set().union(*sets))
    judged = [test for group in answers.together(exercise) for test in group]
    assert sorted(judged) == sorted(proofs)
    assert {answers.patience(exercise, name) for names in sets for name in names} <= {1.0}


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
    """A wrong answer loses the one hidden test that is there to catch it, judged by that test and no other.

    The mistakes that other tests are there to catch, in other places of the same programs, are judged with it.
    """
    group = beside(exercise, test)
    verdicts = begun[exercise, tuple(group.values())].result().verdicts
    assert {*verdicts} == {f"test_{each}" for each in group}
    verdict = verdicts[f"test_{test}"]
    assert verdict.outcome in LOST
    assert verdict.message
    assert messages.others(exercise, name, {test: verdict.message}) == {}


@pytest.mark.matrix
@pytest.mark.parametrize(("exercise", "spared", "name"), PROOFS)
def test_the_mistakes_judged_beside_it_do_not_cost_it(begun, exercise, spared, name):
    """So that it is its own mistake that loses a hidden test in `test_only`."""
    (verdict,) = begun[exercise, name, spared].result().verdicts.values()
    assert (verdict.outcome, verdict.message) == (PASSED, "")


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
