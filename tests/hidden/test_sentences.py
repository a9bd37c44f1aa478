"""Every sentence of a task is judged by a hidden test, and a mistake costs what it is worth: by the answers' lists.

Nothing is graded here: that the answers lose what their lists say is held by `test_answers.py`.
"""

import pytest

from autograder.submissions import exercises

from . import answers, sentences

FLOOR = 1 / 10  # of the points that an answer may keep that does nothing of what is asked for
MEDIAN = 1 / 10  # of the points that one mistake may cost, in the median
BROADEST = 0.7  # of the points: the most that a mistake in all that the exercise is about costs


@pytest.fixture(params=answers.names())
def exercise(request):
    return request.param


def test_every_sentence_of_the_task_is_guarded(exercise):
    assert exercise in sentences.names(), f"there is no tests/hidden/sentences/{exercise}.toml yet"
    assert sentences.faults(exercise) == []


def test_every_hidden_test_judges_a_sentence(exercise):
    judging = {test for entry in sentences.table(exercise) for test in entry.tests}
    assert {*sentences.points(exercise)} - judging == set()


def test_the_sets_of_answers_name_wrong_answers(exercise):
    for kind in ("NOTHING", "SEVERAL", "USELESS", "BROAD", "SILENT"):
        assert answers.named(exercise, kind) <= {*answers.load(exercise).WRONG}, kind
    assert not answers.named(exercise, "NOTHING") & answers.named(exercise, "SEVERAL")


def test_an_answer_that_does_nothing_earns_next_to_nothing(exercise):
    most, lost = exercises.load(exercise).max_score, sentences.lost(exercise)
    nothing = answers.named(exercise, "NOTHING")
    assert nothing
    assert {name: most - lost[name] for name in nothing if most - lost[name] > FLOOR * most} == {}


def test_one_mistake_costs_a_tenth_in_the_median(exercise):
    found = sentences.losses(exercise, sentences.lost(exercise))
    assert found and found.median <= MEDIAN * exercises.load(exercise).max_score


def test_only_a_program_that_does_nothing_useful_loses_more_than_half(exercise):
    most, lost = exercises.load(exercise).max_score, sentences.lost(exercise)
    others = answers.named(exercise, "NOTHING") | answers.named(exercise, "SEVERAL")
    useless, broad = answers.named(exercise, "USELESS"), answers.named(exercise, "BROAD")
    assert {name for name in lost if lost[name] > most / 2} - others - useless - broad == set()
    assert {name: lost[name] for name in broad if lost[name] > BROADEST * most} == {}
    for name in useless:  # it has lost what one of the exercise's files can earn, but for the floor
        assert min(_kept(exercise, name).values()) <= FLOOR * most, name


def _kept(exercise, name):
    """The points that a wrong answer keeps, by the notebook's grade cell."""
    wrong = answers.load(exercise).WRONG[name][1]
    kept = dict.fromkeys(exercises.load(exercise).cells, 0.0)
    for test in exercises.load(exercise).tests:
        if test.id.removeprefix("test_") not in wrong:
            kept[test.cell] += test.points
    return kept


@pytest.mark.parametrize(
    ("text", "blocks"),
    [
        ("One.\ntwo\n\nThree", ["One. two", "Three"]),
        ("- a\n  b\n- c\n1. d", ["a b", "c", "d"]),
        ("| x | y |\n|---|:--|\n| 1 | 2  |", ["| 1 | 2 |"]),
        ("# Head\ntext\n```\nint32 a   # b\n---\n```\nmore", ["# Head", "text", "int32 a # b", "more"]),
        ("```mermaid\na --> b\n```", []),
    ],
)
def test_blocks(text, blocks):
    assert list(sentences._blocks(text)) == blocks


@pytest.mark.parametrize(
    ("block", "parts"),
    [
        ("A `b.c` is 0.5 m. `success` is.", ["A `b.c` is 0.5 m.", "`success` is."]),
        ("**One cabin.** It starts. (It is.) Then: `x`.", ["**One cabin.**", "It starts.", "(It is.)", "Then: `x`."]),
        ("Serve it, e.g. `x`; done", ["Serve it, e.g. `x`; done"]),
        ("| a. B | c |", ["| a. B | c |"]),
    ],
)
def test_sentences(block, parts):
    assert sentences._sentences(block) == parts


STUB = '''"""A. B."""
def f():
    """C."""
    ### BEGIN SOLUTION
    # no
    ### END SOLUTION
    # yes
    return 1
'''


def test_a_stub_is_read_without_the_solution():
    assert list(sentences._of_stub(STUB)) == ["A.", "B.", "C.", "yes"]
