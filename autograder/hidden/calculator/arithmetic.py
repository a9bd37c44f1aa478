"""The arithmetic that the hidden tests ask for: numbers to draw, and words for a wrong result."""

import math
import random
from collections.abc import Callable

ANSWERS: dict[str, Callable[[float, float], float]] = {
    "add": lambda a, b: a + b,
    "subtract": lambda a, b: a - b,
    "multiply": lambda a, b: a * b,
    "divide": lambda a, b: a / b,
}
SIGNS = {"add": "+", "subtract": "-", "multiply": "*", "divide": "/"}
ABOUT_RIGHT = 1e-2  # relative error of a result that the right operation may have given, rounded
UNLIKE = "a number that none of the four operations makes of them"


def plain_numbers(rng: random.Random) -> tuple[float, float]:
    """Two whole numbers whose sum, difference, product and quotient are far from each other and from whole.

    The quotient is never b when it is rounded.
    """
    b = rng.randrange(7, 40)
    times = rng.choice([number for number in range(2, 10) if b not in (number, number + 1)])
    return float(b * times + rng.randint(round(0.3 * b), round(0.7 * b))), float(b)


def likeness(result: float, a: float, operation: str, b: float) -> str:
    """Return what a wrong result is, in words that do not give the numbers away."""
    right = ANSWERS[operation](a, b) if operation in ANSWERS and not (operation == "divide" and b == 0.0) else math.nan
    if not math.isfinite(result) or result == 0.0:
        return str(result)
    like = {f"a {SIGNS[other]} b": answer(a, b) for other, answer in ANSWERS.items() if b or other != "divide"}
    like |= {"b - a": b - a} | ({"b / a": b / a} if a else {})
    # A server that knows modulo: a % b is a, or a - b, when b is as large as that.
    remainder = {"a % b": a % b} if b and operation not in ANSWERS else {}
    like |= {"the sum of a and b without their signs": abs(a) + abs(b), "a": a, "b": b}
    like |= {f"a {SIGNS[operation]} b with the other sign": -right} if operation in SIGNS else {}
    fits, is_remainder = (
        [words for words, value in ways.items() if value != right and math.isclose(result, value, rel_tol=1e-12)]
        for ways in (like, remainder)
    )
    if fits and is_remainder:
        return "a number that more than one formula makes of a and b"
    if fits or is_remainder:
        return (fits or is_remainder)[0]
    if rounded := [digits for digits in range(16) if result == round(right, digits)]:
        return f"that, rounded to {_decimals(rounded)}"
    if math.isfinite(right) and result == math.floor(right):
        return "that, rounded down"
    if math.isclose(result, right, rel_tol=ABOUT_RIGHT):
        return "close to that, but not the same"
    return UNLIKE


def _decimals(numbers: list[int]) -> str:
    """Return to how many decimals a number may have been rounded: several, when the last ones are 0."""
    some = " or ".join(str(digits) for digits in numbers if digits)
    ways = ["a whole number"] * (0 in numbers) + [f"{some} decimal{'s' * (some != '1')}"] * bool(some)
    return " or to ".join(ways)
