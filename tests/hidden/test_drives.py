"""A drive of a student's robot ends early only for what its node does not do, or when the node has died."""

from types import SimpleNamespace

import pytest

from autograder.hidden.ai_integration.conversation import IDLE, StandstillError, StandstillWatch, of_the_living


@pytest.fixture
def drive():
    """A world that hears a command at each tick, as far as the test says so, and who watches it."""
    world, living = SimpleNamespace(received=3), [True]
    return world, living, StandstillWatch(world, lambda: living[0])


def test_a_drive_goes_on_while_the_world_hears_commands(drive):
    world, _, watch = drive
    for tick in range(10 * IDLE):
        world.received += tick % IDLE == 0
        watch.look()


def test_a_drive_ends_when_the_world_hears_no_command_any_more(drive):
    _, _, watch = drive
    for _ in range(IDLE):
        watch.look()
    with pytest.raises(StandstillError):
        watch.look()


def test_a_drive_ends_when_the_node_is_dead(drive):
    world, living, watch = drive
    living[:] = [False]
    world.received += 1
    with pytest.raises(StandstillError):
        watch.look()


def answer(looks, gone):
    """Return the answer that counts if the program lives for so many looks after it, or is `gone` from its topic."""
    left = iter([True] * looks)
    return of_the_living(lambda limit, alive: "4.4 m", lambda: gone, 5.0)(10.0, lambda: next(left, False))


def test_a_node_that_has_left_its_topic_and_ends_later_has_given_no_answer():
    """It was told how far the robot drove until then, and not that the node had died."""
    assert answer(looks=3, gone=True) is None


def test_the_answer_of_a_node_that_lives_counts():
    assert answer(looks=100, gone=False) == "4.4 m"


def test_a_node_that_lives_without_its_topic_has_answered():
    assert of_the_living(lambda limit, alive: 0, lambda: True, 0.05)(10.0, lambda: True) == 0
