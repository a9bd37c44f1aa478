"""How the grader reads what a lift tells: the rules of the task, without ROS and without any program."""

from types import SimpleNamespace

import pytest
from course_interfaces.action import Lift

from autograder.errors import TimedOut, Wrong
from autograder.hidden.actions import suite
from autograder.hidden.actions.rides import Ride, follows, lengths, steps, stops_made, way
from autograder.suitekit import Goal, Heard
from tests.suitekit.test_runs import Program, run


def told(*floors, every=0.3):
    """Feedback for these floors, one after the other."""
    return [
        Heard(0.0, Lift.Feedback(floor=floor), published=every * number) for number, floor in enumerate(floors, start=1)
    ]


def goal_of(*floors):
    goal = Goal(lambda: True)
    goal.heard = told(*floors)
    return goal


@pytest.mark.parametrize(
    ("start", "floors", "right"),
    [
        (0, [2, 1], [(1, 2), (2, 1), (1, 0)]),
        (0, [0], []),
        (3, [3, 4, 4, 3], [(4, 1), (3, 0)]),  # stops at once, before the first step and after it
        (0, [2, 2], [(1, 2), (2, 0)]),
    ],
)
def test_steps(start, floors, right):
    assert steps(start, floors) == right


@pytest.mark.parametrize(
    ("path", "floors", "made"),
    [([0, 1, 2], [1, 5], [1]), ([0], [0, 0, 1], [0, 0]), ([2, 1, 0], [5], []), ([0, 1, 2, 3], [3, 1], [3])],
)
def test_stops_made(path, floors, made):
    assert stops_made(path, floors) == made


def test_a_way_is_floor_by_floor():
    assert way(goal_of(1, 2, 3, 2)) == [1, 2, 3, 2]
    assert way(goal_of(1, 3)) == way(goal_of(1, 1)) == way(goal_of(1)) == way(goal_of()) == []


def test_a_goal_follows_its_floors():
    assert follows(goal_of(3, 4), [3, 5], 9)
    assert follows(goal_of(), [3, 5], 9)
    assert not follows(goal_of(1, 2, 1), [5, 0], 9), "back on the way"
    assert not follows(goal_of(1, 2, 3), [2, 0], 9), "past its stop"


def test_lengths_are_those_of_steps():
    assert lengths(told(1, 2, 2, 3)) == pytest.approx([0.3, 0.6])
    assert lengths(told(1, 1)) == lengths(told(1)) == lengths([]) == []


def test_a_ride_without_a_result():
    ride = Ride([3], goal_of(1, 2, 3))
    assert ride.made
    assert not Ride([3], goal_of()).made
    ride.goal.fault = TimedOut("no result")
    with pytest.raises(TimedOut):
        _ = ride.end


@pytest.mark.parametrize(
    ("took", "said", "message"),
    [(0.9, "no server", "gave up 0.9 s after its start"), (1.1, "REJECTED", "in other cases"), (1.1, "no server", "")],
)
def test_a_client_waits_for_a_server_and_says_that_there_is_none(took, said, message):
    absent = Program(output=said)
    absent.duration = took
    clients = {
        "succeed": SimpleNamespace(works=lambda: True, again=lambda: None),
        "reject": SimpleNamespace(output="REJECTED"),
    }
    bench = SimpleNamespace(early={"absent": run(absent, patience=1)})
    if not message:
        suite.test_client_without_server(bench, clients)
        return
    with pytest.raises(Wrong, match=message):
        suite.test_client_without_server(bench, clients)


def test_a_client_that_works_when_it_is_run_again_is_judged():
    """On a busy machine it may not have found the server."""
    works = [False, True]
    client = SimpleNamespace(works=lambda: works[0], again=lambda: works.pop(0))
    absent = Program(output="no server")
    absent.duration = 1.1
    bench = SimpleNamespace(early={"absent": run(absent, patience=1)})
    suite.test_client_without_server(bench, {"succeed": client, "reject": SimpleNamespace(output="")})
    assert works == [True]
