"""Messages on a wall follower that stops: only on what it has done."""

from types import SimpleNamespace

import pytest

from autograder.errors import Wrong
from autograder.hidden.ai_integration.conversation import STOP, Follower, code_command
from autograder.hidden.ai_integration.suite import stops

DECIDED = code_command(1.25, 0.75)


def follower(*commands, times=(0.0, 0.0, 0.0)):
    """Sends these commands when scans stop coming; `times` are those of its last drive, first zero and last command."""
    return SimpleNamespace(simulate=lambda *_: [*commands], times_to_stop=lambda _: times)


@pytest.mark.parametrize(
    ("times", "message"),
    [
        (
            (0.5, float("inf"), 0.5),
            "in the 3 s after the last scan, the last one, which was not zero, came 0.5 s after",
        ),
        ((0.0, float("inf"), 0.0), "in the 3 s after the last scan, no command came."),
        ((2.9, float("inf"), 2.9), "it was still driving 3 s after the last one."),
        ((0.0, 0.5, 0.5), "none other than zero came after the last scan, and the first zero Twist 0.5 s after it."),
        ((0.1, 0.6, 2.9), "the last other than zero came 0.1 s after the last scan, and the first zero Twist 0.6 s"),
        ((0.1, 0.2, 2.9), "the robot was told to stand still when the last one was 0.2 s old."),
    ],
)
def test_what_a_node_does_without_scans_is_told(times, message):
    with pytest.raises(Wrong) as told_wrong:
        stops(follower(DECIDED), follower(times=times), None, 1.5)
    assert message in told_wrong.value.message


def test_a_node_that_stops_in_time_is_right():
    assert stops(follower(*[DECIDED] * 4, *[STOP] * 11), follower(), None, 1.5)


@pytest.mark.parametrize("expect", [Follower.expect_leaves_it_as_it_is, Follower.expect_leaves_the_opposite])
def test_old_distances_are_not_told_as_a_changed_decision(expect):
    """A node that gave old distances was told that it had published something else than its agent decided."""
    node = SimpleNamespace(changes_decisions=False, _show_until=lambda *_: [DECIDED])
    with pytest.raises(Wrong) as told_wrong:
        expect(node, None, reads=True)
    message = told_wrong.value.message
    assert "decides for 1.25 m in front and 0.75 m on the right: it was given other distances than" in message
    assert message.endswith("or the node published something else than its newest decision.")
    assert not node.changes_decisions
