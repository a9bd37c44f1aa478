"""The message on a relay whose message has a sum that does not count."""

import pytest

from autograder.hidden.services.conversation import parted


@pytest.mark.parametrize(
    ("message", "told"),
    [
        ("1.000 + 2 = -1.234.567", True),
        ("the sum is -1 234 567", True),
        ("-1'234'567", True),
        ("-1.234.568", False),
        ("the sum is 1.234.567", False),
        ("", False),
    ],
)
def test_a_sum_in_other_groups_of_digits_is_told(message, told):
    assert bool(parted(message, [5, -1_234_567])) == told
