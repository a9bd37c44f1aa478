"""What ends a drive of a student's robot before its time: only what its node does not do."""

from types import SimpleNamespace

import pytest

from autograder.hidden.ai_integration.conversation import IDLE, StandstillError, StandstillWatch


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
