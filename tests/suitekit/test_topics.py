"""The rate of a topic: a busy machine delays messages, which does not change the rate."""

import itertools
import random

import pytest

from autograder.suitekit.topics import RATED, Heard, steady_rate

LOW, HIGH = 4.0, 6.0  # Hz


def ever(times: list[float]) -> float:
    """Return what is found while the messages come one after the other."""
    return next(filter(None, (rate(times[:count]) for count in range(len(times)))), 0.0)


def rate(published: list[float], came: list[float] | None = None) -> float:
    heard = [Heard(at, None, time) for at, time in zip(came or published, published, strict=True)]
    return steady_rate(heard, LOW, HIGH)


def published(period: float, count: int, late: dict[int, float] | None = None, jitter: float = 0.0) -> list[float]:
    """Return the times of a timer's messages: some are late (s), and those behind them wait until they are there."""
    draw = random.Random(1)
    times = [period * n + (late or {}).get(n, 0.0) + draw.uniform(0, jitter) for n in range(count)]
    return list(itertools.accumulate(times, max))


@pytest.mark.parametrize(
    "times",
    [
        published(0.2, 13),
        published(0.2, 40, late={5: 1.5, 14: 0.7}),  # it stood still twice
        published(0.2, 30, jitter=0.15),
        published(0.24, 20),
    ],
)
def test_five_times_a_second_is_seen(times):
    assert LOW <= ever(times) <= HIGH


@pytest.mark.parametrize(
    "times",
    [
        published(0.1, 60),
        published(0.3, 30),
        published(1.0, 20),
        published(0.1, 60, late={7: 0.9, 30: 0.5}),
        sorted(published(0.4, 30) + published(0.4, 30)),  # two at a time: the mean is right
        sorted(time + shift for time in published(1.0, 12) for shift in (0, 0.01, 0.02, 0.03, 0.04)),
        [0.0] * 40,
        published(0.2, RATED),
    ],
)
def test_another_rate_is_not(times):
    assert ever(times) == 0.0


def test_the_publisher_s_times_count_and_those_of_arrival_must_not_contradict_them():
    steady, doubled = published(0.2, 13), sorted(published(0.4, 7) + published(0.4, 7))[:13]
    late = [time + 0.15 * (number % 2) for number, time in enumerate(doubled)]  # where the grader is busy
    assert rate(steady, late) and not rate(doubled, late)
    assert not rate(steady, [time / 10 for time in steady]) and not rate(steady, [time * 10 for time in steady])
