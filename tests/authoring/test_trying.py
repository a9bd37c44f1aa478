"""`autograder try` says which answers surprise, and which hidden test no wrong answer loses."""

from pathlib import Path

import pytest

from autograder.authoring import trying
from autograder.errors import UsageError
from autograder.records import FAILED, GRADED, PASSED, Report, Result, Submission
from autograder.submissions import exercises

NAME = "calculator"
TESTS = exercises.load(NAME).tests
MOST = sum(test.points for test in TESTS)


def report(submission: Submission) -> Report:
    """A grading without programs: each line `loses: TEST` of an answer loses that hidden test."""
    text = b"\n".join(submission.files.values()).decode()
    results = [
        Result(test.id, test.title, FAILED, 0.0, test.points, "It is wrong.")
        if f"loses: {test.id}\n" in text
        else Result(test.id, test.title, PASSED, test.points, test.points)
        for test in TESTS
    ]
    score = sum(result.points for result in results)
    return Report(submission.student, NAME, GRADED, score, MOST, 1, 0.0, tests=results)


class Graded:
    """A dispatcher that grades at once."""

    def __init__(self, pool: object, tasks: list):
        self.tasks = tasks

    def begin(self) -> None:
        """Nothing is to be sent."""

    def run(self):
        return (report(task.submission) for task in self.tasks)


@pytest.fixture
def answer(tmp_path, monkeypatch):
    """Write an answer that loses some hidden tests; its other files are the solution's."""
    monkeypatch.setattr(trying, "Dispatcher", Graded)

    def write(name: str, *lost: str) -> None:
        (tmp_path / name).mkdir(parents=True)
        (tmp_path / name / "calculator_server.py").write_text("".join(f"loses: {test}\n" for test in lost))

    return write


def run(folder: Path) -> trying.Trial:
    return trying.run(folder, NAME, None, 1)


def test_what_a_right_and_a_wrong_answer_lose_is_shown(answer, tmp_path):
    first, *others = [test.id for test in TESTS]
    answer("right/compact")
    answer("wrong/first", first)
    answer("wrong/others", *others)
    trial = run(tmp_path)
    assert trial.right
    lines = trial.describe().splitlines()
    assert lines[0] == f"right/compact: {MOST:g} of {MOST:g}"
    assert f"wrong/first: {MOST - TESTS[0].points:g} of {MOST:g}" in lines
    assert f"  -{TESTS[0].points:g} {first}: It is wrong." in lines
    assert lines[-1] == "Each hidden test is lost by a wrong answer."


def test_surprises_are_named(answer, tmp_path):
    first, second, *others = [test.id for test in TESTS]
    answer("right/unlucky", first)
    answer("wrong/unnoticed")
    answer("wrong/others", second, *others)
    trial = run(tmp_path)
    assert not trial.right
    text = trial.describe()
    assert f"right/unlucky: {MOST - TESTS[0].points:g} of {MOST:g}: it should keep all points" in text
    assert f"wrong/unnoticed: {MOST:g} of {MOST:g}: no hidden test notices it" in text
    assert text.endswith(f"Hidden tests that no wrong answer loses: {first}.")


def test_right_answers_alone_ask_nothing_of_the_hidden_tests(answer, tmp_path):
    answer("right/compact")
    trial = run(tmp_path)
    assert trial.right and "Hidden tests" not in trial.describe()


def test_an_answer_with_a_file_that_is_not_handed_in_is_told(answer, tmp_path):
    answer("wrong/misnamed")
    (tmp_path / "wrong/misnamed/calculator_sever.py").touch()
    with pytest.raises(UsageError, match="misnamed has calculator_sever.py; handed in are Calculate.srv, "):
        run(tmp_path)


def test_a_folder_without_answers_is_told(tmp_path):
    with pytest.raises(UsageError, match="there are no answers in .*: put each into a folder of .*/right or .../wrong"):
        run(tmp_path)
