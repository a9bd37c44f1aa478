"""A comparison with a list that is never true, and a method for its result, are told, and nothing else."""

from types import SimpleNamespace

import pytest
from course_interfaces.action import Fibonacci

from course.explaining.values_seen import misread
from course.recorders import Recorder

RESULT = Fibonacci.Result(sequence=[0, 1, 1])
NAMES = {"end": Fibonacci.Impl.GetResultService.Response(result=RESULT), "numbers": [0, 1, 1], "plain": RESULT.sequence}


class Goal(Recorder):
    feedback = (Fibonacci.Feedback(), Fibonacci.Feedback())


Goal.__module__ = Recorder.__module__
Goal.feedback = list(Goal.feedback)
FIELD = next(iter(Fibonacci.Feedback.get_fields_and_field_types()))


@pytest.mark.parametrize(
    ("line", "what"),
    [
        ("print(end.result.sequence == [0, 1, 1])", "end.result.sequence"),
        ("assert [0, 1, 1] != plain", "plain"),
        ("if plain == [0, 1, 1]:\n    print()", "plain"),
    ],
)
def test_an_array_is_compared_with_a_list_of_the_same_numbers(line, what):
    (told,) = misread(f"x = 1\n{line}\n", NAMES)
    assert told == (
        f"note: line 2: `{what}` has the same numbers, but it is an array, and an array is never equal to a list: "
        f"write `list({what})`."
    )


@pytest.mark.parametrize(
    "line",
    [
        "list(plain) == [0, 1, 1]",
        "plain == [0, 1]",  # other numbers
        "numbers == [0, 1, 1]",
        "missing.result == [1]",
        "other.sequence == [0, 1, 1]",  # reading it might do anything
        "plain == [0, 1, x]",
        "[plain == [0, 1, 1] for plain in ()]",
        "lambda plain: plain == [0, 1, 1]",
        "def f(plain):\n    return plain == [0, 1, 1]",
        "plain ==",
        "%%exercise a.py\nplain == [0, 1, 1]",
    ],
)
def test_what_may_be_right_is_left_alone(line):
    assert misread(line, NAMES | {"other": SimpleNamespace(sequence=RESULT.sequence)}) == []


def test_messages_are_compared_with_lists():
    (told,) = misread("goal.feedback == [[0], [0, 1]]", {"goal": Goal()})
    assert told.startswith("note: line 1: `goal.feedback` is a list of messages, and a message is never equal to")
    assert told.endswith(f"`[list(each.{FIELD}) for each in goal.feedback]`.")
    assert misread("goal.feedback == []", {"goal": Goal()}) == []


@pytest.mark.parametrize("line", ["print('at', rows.table)", "f'{rows.table}'", "rows.wait_for == 3"])
def test_a_method_that_is_printed_or_compared(line):
    name = "rows.wait_for" if "wait" in line else "rows.table"
    told = misread(line, {"rows": Recorder()})
    assert told == [f"note: line 1: `{name}` is the method itself. Call it: `{name}()`."]


@pytest.mark.parametrize(
    "line", ["print(rows.table())", "wait(rows.table)", "print(Rows.table, rows.start)", "rows.table"]
)
def test_a_method_that_is_called_or_passed_on(line):
    assert misread(line, {"rows": Recorder(), "Rows": Recorder}) == []
