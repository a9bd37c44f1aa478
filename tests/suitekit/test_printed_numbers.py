"""The numbers that hidden suites read from what a program has printed."""

import pytest

from autograder.suitekit.printed_numbers import numbers, when_changed


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("1,234.5 and 12_345", [1234.5, 12345]),
        ("1,234,567", [1234567]),
        ("1234.0,4321.0,add", [1234, 4321]),  # values with commas between them
        ("1234,4321", [1234, 4321]),
        ("15.5,432.0", [15.5, 432]),
        ("1234.0add-4321.0=-3087.0", [1234, -4321, -3087]),
        ("1.234e+03", [1234]),
        ("[INFO] [1700000000.123456789] [server]: a=5", [5]),
        ("\x1b[32m7.5\x1b[0m", [32, 7.5, 0]),
    ],
)
def test_numbers(text, found):
    assert numbers(text) == found


def test_what_has_not_changed_is_not_looked_through_again():
    texts, seen = iter(["a", "a", "ab", "ab"]), []
    condition = when_changed(lambda: next(texts), lambda text: bool(seen.append(text)) or text == "ab")
    assert [condition() for _ in range(4)] == [False, False, True, True]
    assert seen == ["a", "ab"]
