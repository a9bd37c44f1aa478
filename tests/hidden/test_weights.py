"""What an exercise is about costs a quarter of its points or more, a detail little; and the task tells the weights.

Nothing is graded here: that the answers lose what their lists say is held by `test_answers.py`.
"""

import re

import pytest

from autograder.submissions import exercises
from course.foundation import cells

from . import answers, sentences

ABOUT = 1 / 4  # of the points: the least that a mistake costs in what the exercise is about
DETAIL = 1.5  # points: the most that a mistake in a detail costs, of 20
MARKED = re.compile(r"<details><summary>How it is marked.*?</details>", re.DOTALL)
ROW = re.compile(r"^\| *([\d.]+)( each)? *\| *(.*?) *\|$", re.MULTILINE)

WEIGHED = [name for name in answers.names() if answers.named(name, "ABOUT") or answers.named(name, "DETAIL")]


@pytest.mark.parametrize("exercise", WEIGHED)
def test_what_an_exercise_is_about_costs_a_quarter(exercise):
    least, lost = ABOUT * exercises.load(exercise).max_score, sentences.lost(exercise)
    about = answers.named(exercise, "ABOUT")
    assert about and about <= {*lost}
    assert {name: lost[name] for name in about if lost[name] < least} == {}


@pytest.mark.parametrize("exercise", WEIGHED)
def test_a_detail_costs_little(exercise):
    most, lost = DETAIL * exercises.load(exercise).max_score / 20, sentences.lost(exercise)
    detail = answers.named(exercise, "DETAIL")
    assert detail and detail <= {*lost} - answers.named(exercise, "ABOUT")
    assert {name: lost[name] for name in detail if lost[name] > most} == {}


@pytest.mark.parametrize("exercise", WEIGHED)
def test_the_task_tells_the_points_of_each_hidden_test(exercise):
    told = []
    for cell in cells.read(sentences.NOTEBOOKS / exercise / f"{exercise}.ipynb"):
        for fold in MARKED.findall(cell.source if cell.kind == "markdown" else ""):
            for points, each, what in ROW.findall(fold):
                told += [float(points)] * (len(what.split(";")) if each else 1)
    assert sorted(told) == sorted(test.points for test in exercises.load(exercise).tests)
