"""Helpers of public checks: whether a program publishes too often, and whether it limits the step between messages."""

import ast
from collections.abc import Sequence
from itertools import combinations
from pathlib import Path

from course.explaining.failure_report import frame_at
from course.explaining.source import argument, calls, name_of, parse, text_at
from course.foundation.syntax import walk
from course.notebook.judging import PERIOD, value_of

ENOUGH = 24  # messages from which a rate can be told
FAST, SURELY_FAST = 11.05, 11.4  # Hz above which 10 Hz are not kept: if the text of the program says so, and anyhow
SHORTEST = 1 / 11  # s between two commands
LIMITS = 1.0, 5.0  # s between which a limit of the step is looked for
LIMIT = ("min", "max", "clip")  # functions that limit a value


def steady_rate(published: Sequence[float]) -> float:
    """Return how often messages come (Hz), by the times at which they were published (s); 0 for a few of them.

    It is the rate in all parts of the time that have half of the messages or more, without the tenth of the parts in
    which they came the most slowly, or a computer that is busy for a while would make them seem to come faster: what it
    holds up follows closely.
    """
    if len(published) < ENOUGH:
        return 0.0
    times = [*enumerate(sorted(published))]
    pairs = ((one, other) for one, other in combinations(times, 2) if other[0] - one[0] >= len(times) // 2)
    periods = sorted((later - before) / (number - first) for (first, before), (number, later) in pairs)
    return 1 / max(periods[len(periods) * 9 // 10], 1e-9)


def too_fast(file: str, published: Sequence[float]) -> str:
    """Return how often the commands of `file` come, with the line of its timer, if that is surely above 11 Hz; or ''.

    `published` are the times at which they were published (s).
    """
    rate, where = steady_rate(published), short_period(file)
    if rate <= (FAST if where else SURELY_FAST):
        return ""
    return f"commands come at {rate:.1f} Hz, not at 10{where}"


def short_period(file: str) -> str:
    """Return lines on a timer with a period below that of 11 Hz, if all are so by their text; '' otherwise."""
    source = text_at(Path(file))
    tree = parse(source)
    made = [*calls(tree, "create_timer")]
    periods = [value_of(argument(call, *PERIOD), tree) for call in made]
    if not made or any(period is None or period >= SHORTEST for period in periods):
        return ""
    return (
        f"\n{frame_at(file, made[0].lineno, source)}\nThe period of a timer is in seconds: 0.1 for 10 Hz; this one "
        f"fires every {periods[0]:g} s."
    )


def step_limit(file: str) -> tuple[float, str]:
    """Return the number (s) to which a program may limit a step, and lines on it; 0 and '' if its text has none.

    It is a number to try: another value may be compared with it.
    """
    source = text_at(Path(file))
    tree = parse(source)
    kept = {ast.unparse(target): node.value for node in walk(tree) if isinstance(node, ast.Assign)
            for target in node.targets if isinstance(target, ast.Attribute)}  # fmt: skip
    for node in walk(tree):
        parts: list[ast.expr] = []
        if isinstance(node, ast.Call) and name_of(node.func) in LIMIT:
            parts = node.args
        elif isinstance(node, ast.Compare):
            parts = [node.left, *node.comparators]
        for part in parts:
            limit = value_of(kept.get(ast.unparse(part), part), tree) or 0.0
            if LIMITS[0] < limit <= LIMITS[1]:
                why = "The step has no limit: it is the whole time since the previous message."
                return limit, f"\n{frame_at(file, part.lineno, source)}\n{why}"
    return 0.0, ""
