"""Reading the output of a program."""

import re

from autograder.sandbox.cleaning import NUMBER

STAMP = re.compile(r"\[\d{9,}\.\d+\]")  # the time in a ROS log line
GROUPED = re.compile(r"(?<![\d.])\d{1,3}(?:([,_])\d{3})(?:\1\d{3})*(?!\d)")  # 1,234,567 or 1_234_567


def numbers(text: str) -> list[float]:
    """Return the numbers in a text, 1,234.5 and 1_234.5 as one each, without the times of ROS log lines.

    1234.0,432.0 are two numbers: only groups of three digits before the point belong together.
    """
    joined = GROUPED.sub(lambda found: re.sub("[,_]", "", found[0]), STAMP.sub("", text))
    return [float(number) for number in NUMBER.findall(joined)]
