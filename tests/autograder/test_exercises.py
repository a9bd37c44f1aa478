"""The hidden suites as the coordinator knows them, and what the notebook and the solution say of the same."""

import json
from collections import Counter
from pathlib import Path

import pytest

from autograder import exercises

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("name", exercises.names())
def test_fits_notebook_and_solution(name):
    exercise = exercises.load(name)
    solution = ROOT / "solutions" / name
    assert all((solution / file).is_file() for file in exercise.files)
    for definition in exercise.interfaces:
        assert definition.read_text() == (solution / definition.name).read_text()
    points = Counter()
    for test in exercise.tests:
        points[test.cell] += test.points
    cells = [cell["metadata"].get("nbgrader", {}) for cell in
             json.loads((ROOT / "notebooks" / name / f"{name}.ipynb").read_text())["cells"]]
    graded = {cell["grade_id"]: cell["points"] for cell in cells if cell.get("grade") and not cell.get("solution")}
    assert points == graded


def test_unknown():
    with pytest.raises(exercises.UnknownExercise, match="there is no exercise 'nothing'"):
        exercises.load("nothing")
