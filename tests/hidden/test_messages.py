"""Each wrong answer has a message that is written down, of the first test that it loses.

That the grader says these words is held by `test_answers.py`, which grades the answers.
"""

import math
import random
import re

import pytest

from autograder.hidden.calculator.arithmetic import likeness, plain_numbers
from autograder.submissions import exercises

from . import answers, messages

MOST_OPEN = 3  # numbers or words of a message that are left open


@pytest.mark.parametrize("exercise", messages.names())
def test_each_wrong_answer_has_the_message_of_the_first_test_that_it_loses(exercise):
    order = [test.id.removeprefix("test_") for test in exercises.load(exercise).tests]
    wrong, known = answers.load(exercise).WRONG, messages.table(exercise)
    first = {name: min(lost, key=order.index) for name, (_, lost) in wrong.items()}
    assert {name: test for name, test in first.items() if test not in known.get(name, {})} == {}
    assert {name: [*told] for name, told in known.items() if not {*told} <= wrong.get(name, ((), set()))[1]} == {}


@pytest.mark.parametrize("exercise", messages.names())
def test_a_message_that_is_written_down_tells_something(exercise):
    for name, told in messages.table(exercise).items():
        for test, pattern in [(test, pattern) for test, patterns in told.items() for pattern in patterns]:
            assert len(pattern.replace("...", "")) >= 20, f"{name}: {test}"
            assert messages.open_places(pattern) <= MOST_OPEN, f"{name}: {test}: write more of it out, or in a list"
            assert not re.search(r"\d\.\.\.(?!\.)", pattern), f"{name}: {test}: the number may be drawn otherwise"


@pytest.mark.parametrize(
    ("pattern", "message", "fits"),
    [
        ("It says 'on'.", "It says 'on'. Go on.", True),
        ("It says 'on'.", "It says 'off'.", False),
        ("It took ... s and ended.", "It took 4.0 s and ended.", True),
        ("It took ... s and ended.", "It took 4.0 s.", False),
        ("says", "It says", False),
    ],
)
def test_fits(pattern, message, fits):
    assert messages.fits(pattern, message) is fits


@pytest.mark.parametrize(
    ("pattern", "count"),
    [
        ("It took ... s, and must take ... to ... s.", 2),
        ("... step... sent ... feedback message....", 2),
        ("Call `Lift.Result(...)` (--ros-args ...), with a:=...: it was ....", 1),
        ("It says 'on'.", 0),
    ],
)
def test_open_places(pattern, count):
    assert messages.open_places(pattern) == count


def test_one_of_several_messages_must_come(monkeypatch):
    monkeypatch.setattr(
        messages, "table", lambda exercise: {"asks twice": {"asks": ["It sent 2.", "It sent ... more."]}}
    )
    assert messages.others("services", "asks twice", {"asks": "It sent 2 more.", "says": "It says 'on'."}) == {}
    assert messages.others("services", "asks twice", {"asks": "It sent 7."}) == {"asks": "It sent 7."}


def test_how_far_a_quotient_is_rounded_is_told_also_when_its_last_digits_are_0():
    """Rounded to 12 decimals, of which the twelfth is 0, it was told as rounded to 11."""
    assert likeness(round(50 / 7, 2), 50.0, "divide", 7.0) == "that, rounded to 2 decimals"
    for a in range(1000, 2000):
        for digits in range(1, 13):
            if (rounded := round(a / 997, digits)) != a / 997:
                said = likeness(rounded, float(a), "divide", 997.0)
                assert re.search(rf"\b{digits} (?:or \d+ )*decimals?$", said) or said.startswith("a"), (a, digits, said)


def test_a_rounded_quotient_is_never_taken_for_another_number():
    """Whatever is drawn: a // b may be b, and a student was told that the result is b."""
    for drawn in map(plain_numbers, map(random.Random, range(3000))):
        for rounded in (math.floor, round):
            said = likeness(float(rounded(drawn[0] / drawn[1])), drawn[0], "divide", drawn[1])
            assert said.startswith("that, rounded"), (drawn, said)


@pytest.mark.parametrize(
    ("a", "b", "said"),
    [
        (2.5, 4.25, "a number that more than one formula makes of a and b"),  # a, too
        (6.25, 4.5, "a number that more than one formula makes of a and b"),  # a - b, too
        (8.5, 1.75, "a % b"),
    ],
)
def test_a_formula_is_named_only_when_no_other_makes_the_same(a, b, said):
    assert likeness(a % b, a, "modulo", b) == said
    assert likeness(a - b, a, "modulo", b) == (said if a - b == a % b else "a - b")
