"""A program's rate is found from the times of its messages, also on a busy computer; and a limited step."""

import random

import pytest

from course.notebook.periods import ENOUGH, steady_rate, step_limit, too_fast

MESSAGES = 40


def held_up(period: float, late: list[float]) -> list[float]:
    """Return the times of messages of a timer, each of them late by this."""
    return [number * period + each for number, each in enumerate(late)]


def at_random(most: float, seed: int) -> list[float]:
    rng = random.Random(seed)
    return [rng.uniform(0.0, most) for _ in range(MESSAGES)]


ON_A_BUSY_COMPUTER = {
    "quiet": [0.0] * MESSAGES,
    **{f"each up to 0.2 s late, {seed}": at_random(0.2, seed) for seed in range(5)},
    "the first ones late": [*[0.4] * 10, *[0.0] * (MESSAGES - 10)],
    "a second's messages at once": [max(0.0, 1.0 - 0.1 * number) for number in range(MESSAGES)],
    "the same in the middle": [max(0.0, 1.0 - 0.1 * abs(number - 15)) * (number >= 15) for number in range(MESSAGES)],
}


@pytest.fixture
def program(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path / "node.py"


@pytest.mark.parametrize("late", ON_A_BUSY_COMPUTER.values(), ids=[*ON_A_BUSY_COMPUTER])
@pytest.mark.parametrize(("period", "text"), [(0.1, "0.1"), (0.1, "0.02"), (0.1, "period"), (0.0925, "period")])
def test_a_rate_of_ten_is_never_taken_for_a_higher_one(program, period, text, late):
    program.write_text(f"self.create_timer({text}, self.tick)\n")
    assert too_fast("node.py", held_up(period, late)) == ""


@pytest.mark.parametrize("late", [ON_A_BUSY_COMPUTER["quiet"], at_random(0.05, 1)])
@pytest.mark.parametrize(
    ("period", "text", "says"),
    [
        (0.0847, "0.0847", "Hz, not at 10\n  node.py, line 1\n    self.create_timer(0.0847, self.tick)\nThe period of"),
        (0.0847, "period", "Hz, not at 10"),
        (0.0895, "1 / 11.2", "Hz, not at 10\n  node.py, line 1"),
    ],
)
def test_a_rate_above_eleven_is_told(program, period, text, says, late):
    program.write_text(f"self.create_timer({text}, self.tick)\n")
    assert says in too_fast("node.py", held_up(period, late))


def test_a_few_messages_have_no_rate():
    assert steady_rate([0.01 * number for number in range(ENOUGH - 1)]) == 0.0
    assert steady_rate([0.0] * ENOUGH) > 0.0


@pytest.mark.parametrize(
    ("text", "limit"),
    [
        ("step = min(now - self.last, 2.0)", 2.0),
        ("MOST = 3.0\nstep = min(now - last, MOST)", 3.0),
        ("self.most = 1.5\nstep = min(step, self.most)", 1.5),
        ("if step > 2.5: step = 2.5", 2.5),
        ("effort = max(low, min(high, effort))", 0.0),
        ("effort = max(-10.0, min(10.0, effort))", 0.0),
        ("self.create_timer(2.0, self.tick)", 0.0),
        ("if step > 0.0: slope = change / step", 0.0),
    ],
)
def test_the_number_to_which_a_step_may_be_limited(program, text, limit):
    program.write_text(text)
    found, why = step_limit("node.py")
    assert found == limit
    assert why.endswith("The step has no limit: it is the whole time since the previous message.") == (limit > 0.0)
