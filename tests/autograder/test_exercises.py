"""The hidden suites as the coordinator knows them, and what the notebook and the solution say of the same."""

import json
import shutil
from pathlib import Path

import pytest

from autograder.errors import BrokenExercise, UnknownExercise
from autograder.grading import single
from autograder.paths import HIDDEN
from autograder.records import INFRASTRUCTURE_ERROR, Submission
from autograder.results.text import describe
from autograder.submissions import exercises

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("name", exercises.names())
def test_fits_notebook_and_solution(name):
    exercise = exercises.load(name)
    solution = ROOT / "solutions" / name
    assert all((solution / file).is_file() for file in exercise.files)
    for definition in exercise.interfaces:
        assert definition.read_text() == (solution / definition.name).read_text()
    assert exercises.difference(name, ROOT / "notebooks" / name / f"{name}.ipynb") == ""


@pytest.mark.parametrize(
    ("file", "text", "message"),
    [
        ("exercise.toml", "title = 'Greets'\nfils = []\n", r"exercise\.toml has no 'files'"),
        ("exercise.toml", "title =\n", "cannot be read: .*line 1"),
        ("suite.py", "def test_a():\n    pass)\n", r"suite\.py, line 2: unmatched '\)'"),
        ("suite.py", "def test_a():\n    pass\n", "test_a needs one @points"),
    ],
)
def test_a_mistake_in_an_exercise_is_told_in_a_line(tmp_path, file, text, message):
    shutil.copytree(HIDDEN / "services", tmp_path / "services")
    (tmp_path / "services" / file).write_text(text)
    with pytest.raises(BrokenExercise, match=message) as told:
        exercises.load("services", tmp_path)
    assert "\n" not in str(told.value)


def test_a_mistake_in_a_test_is_no_score_and_is_told_the_instructor_alone(box, tmp_path, caplog):
    shutil.copytree(HIDDEN, tmp_path / "hidden")
    suite = tmp_path / "hidden" / "services" / "suite.py"
    name = exercises.load("services").tests[0].id
    suite.write_text(suite.read_text() + f"\n\n{name}.__globals__['twice_two'] = undefined_name\n")
    files = {path.name: path.read_bytes() for path in (ROOT / "solutions" / "services").iterdir() if path.is_file()}
    exercise = exercises.load("services", tmp_path / "hidden")
    report = single.grade(Submission("ada", "services", files), box, exercise=exercise)
    assert (report.status, report.score) == (INFRASTRUCTURE_ERROR, None)
    assert "undefined_name" not in str(report.public()) and "undefined_name" in describe(report, report.details)
    assert [record.getMessage().count("\n") for record in caplog.records] == [0] * single.TRIES


def test_a_difference_between_notebook_and_suite_is_told(tmp_path):
    book = ROOT / "notebooks" / "services" / "services.ipynb"
    assert exercises.difference("services", book) == ""
    changed = json.loads(book.read_text())
    cell = next(cell for cell in changed["cells"] if cell["metadata"].get("nbgrader", {}).get("grade_id") == "relay")
    points, cell["metadata"]["nbgrader"]["points"] = cell["metadata"]["nbgrader"]["points"], 3
    (tmp_path / "services.ipynb").write_text(json.dumps(changed))
    assert exercises.difference("services", tmp_path / "services.ipynb") == (
        f"cell relay has 3 points in the notebook, {points} in the suite"
    )


def test_unknown():
    with pytest.raises(UnknownExercise, match="there is no exercise 'nothing'"):
        exercises.load("nothing")
