"""The main points of an exercise cost a quarter of its points or more, a detail little; the task tells the weights.

Nothing is graded here: that the answers lose what their lists say is held by `test_answers.py`.
"""

import re
import tomllib
from pathlib import Path
from typing import NamedTuple

import pytest

from autograder.submissions import exercises
from course.foundation import cells

from . import answers, sentences

ABOUT = 1 / 4  # of the points: the least that a mistake costs in what the exercise is about
DETAIL = 1.5  # points: the most that a mistake in a detail costs, of 20
MARKS = Path(__file__).with_name("marks.toml")
MARKED = re.compile(r"<details><summary>How it is marked.*?</details>", re.DOTALL)
ROW = re.compile(r"^\| *([\d.]+)( each)? *\| *(?:(?:a|the) main (point|part): )?(.*?) *\|$", re.MULTILINE)

WEIGHED = [name for name in answers.names() if answers.named(name, "ABOUT") or answers.named(name, "DETAIL")]


class Row(NamedTuple):
    """The task's statement on the points of one hidden test."""

    what: str
    points: float
    main: str  # "point", "part" or empty


def rows(exercise):
    """Return the rows below "How it is marked", in their order."""
    found = []
    for cell in cells.read(sentences.NOTEBOOKS / exercise / f"{exercise}.ipynb"):
        for fold in MARKED.findall(cell.source if cell.kind == "markdown" else ""):
            for points, each, main, what in ROW.findall(fold):
                found += [Row(one, float(points), main) for one in (what.split("; ") if each else [what])]
    return found


def judged_by(exercise):
    """The hidden test of each of these rows, by what the task says."""
    return tomllib.loads(MARKS.read_text(encoding="utf-8"))[exercise]


def main_points(exercise):
    """The hidden tests that the task calls a main point."""
    return {judged_by(exercise)[row.what] for row in rows(exercise) if row.main == "point"}


def classes(exercise):
    """Return the kind of each wrong answer, by its cost and the module's sets: about, part, detail or several."""
    most, lost, wrong = exercises.load(exercise).max_score, sentences.lost(exercise), answers.load(exercise).WRONG
    about, useless, broad, nothing, several = (
        answers.named(exercise, kind) for kind in ("ABOUT", "USELESS", "BROAD", "NOTHING", "SEVERAL")
    )
    main, found = main_points(exercise), {name: set() for name in wrong}
    for name, kinds in found.items():
        if name in (nothing | several) - about:
            kinds.add("several")
            continue
        if name in about | useless | broad or wrong[name][1] & main:
            kinds.add("about")
        if lost[name] < ABOUT * most:
            kinds.add("detail" if lost[name] <= DETAIL * most / 20 else "part")
    return found


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
def test_each_wrong_answer_is_about_the_exercise_a_part_a_detail_or_several_mistakes(exercise):
    """An answer loses a quarter exactly if it has a main point wrong or is in one of the module's sets."""
    assert {name: kinds for name, kinds in classes(exercise).items() if len(kinds) != 1} == {}


@pytest.mark.parametrize("exercise", answers.names())
def test_the_task_tells_the_points_of_each_hidden_test(exercise):
    worth, told = sentences.points(exercise), rows(exercise)
    assert [row.what for row in told] == [*judged_by(exercise)]
    assert {judged_by(exercise)[row.what]: row.points for row in told} == worth
    assert len(told) == len(worth)


@pytest.mark.parametrize("exercise", answers.names())
def test_a_main_point_is_what_the_exercise_is_about(exercise):
    worth, wrong = sentences.points(exercise), answers.load(exercise).WRONG
    least = ABOUT * exercises.load(exercise).max_score
    main = main_points(exercise)
    assert main == {test for test in worth if worth[test] >= least}
    assert main - set().union(*(wrong[name][1] for name in answers.named(exercise, "ABOUT"))) == set()
