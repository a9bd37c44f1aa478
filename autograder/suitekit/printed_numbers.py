"""Reading the output of a program."""

import re
from collections.abc import Callable
from typing import TypeVar

from autograder.sandbox.cleaning import NUMBER

STAMP = re.compile(r"\[\d{9,}\.\d+\]")  # the time in a ROS log line
GROUPED = re.compile(r"(?<![\d.])\d{1,3}(?:([,_])\d{3})(?:\1\d{3})*(?!\d)")  # 1,234,567 or 1_234_567

Read = TypeVar("Read")


def when_changed(read: Callable[[], Read], found: Callable[[Read], bool]) -> Callable[[], bool]:
    """Return a condition to wait for: `found` of what `read` returns, asked again only when that has changed.

    Looking through what a talkative program has printed takes longer than the time between two looks.
    """
    known: tuple[Read, bool] | None = None

    def condition() -> bool:
        nonlocal known
        now = read()
        if known is None or known[0] != now:
            known = now, found(now)
        return known[1]

    return condition


def numbers(text: str) -> list[float]:
    """Return the numbers in a text, 1,234.5 and 1_234.5 as one each, without the times of ROS log lines.

    1234.0,432.0 are two numbers: only groups of three digits before the point belong together.
    """
    joined = GROUPED.sub(lambda found: re.sub("[,_]", "", found[0]), STAMP.sub("", text))
    return [float(number) for number in NUMBER.findall(joined)]
