"""The grader's reading of a lift's messages: the rules of the task, without ROS and without any program."""

import time
from types import SimpleNamespace

import pytest
from course_interfaces.action import Lift

from autograder.errors import TimedOut, Wrong
from autograder.hidden.actions import suite
from autograder.hidden.actions.busy import Blocking, Preemption
from autograder.hidden.actions.judging import (
    expect_no_other_step,
    expect_no_step_when_cancelled,
    expect_result_of_waiting,
    says_elsewhere,
)
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


@pytest.mark.parametrize(
    ("floors", "answered", "message"),
    [
        ((1, 2, 3), 0.75, ""),  # one message after the answer: of the step that was under way
        ((1, 2, 3), 0.45, "2 feedback messages were published after that"),
        ((1, 2, 3, 4), 0.45, "3 feedback messages were published after that"),
        ((1, 2, 2), 0.45, ""),  # a second message for the same floor is no step
        ((1, 2, 3), 1.0, ""),
        ((), 0.45, ""),
    ],
)
def test_a_step_that_begins_after_the_answer_is_one_too_many(floors, answered, message):
    """By the times at which messages were published: that they are read late, on a busy machine, makes no step."""
    goal, begun = Goal(lambda: True), time.time()
    goal.heard = [
        heard._replace(time=time.monotonic() + 60.0, published=begun + heard.published) for heard in told(*floors)
    ]
    answered += time.monotonic() - (time.time() - begun)
    if not message:
        expect_no_other_step(goal, answered, "After a cancel")
        return
    with pytest.raises(Wrong, match=f"After a cancel the step under way may be finished, .*{message}"):
        expect_no_other_step(goal, answered, "After a cancel")


def test_of_a_goal_whose_server_never_answered_no_step_is_counted():
    expect_no_other_step(goal_of(1, 2, 3), 0.0, "After a cancel")


def test_a_ride_without_a_result():
    ride = Ride([3], goal_of(1, 2, 3))
    assert ride.made
    assert not Ride([3], goal_of()).made
    ride.goal.fault = TimedOut("no result")
    with pytest.raises(TimedOut):
        _ = ride.end


@pytest.mark.parametrize(
    ("took", "said", "message"),
    [
        (0.9, "no server", "gave up 0.9 s after its start"),
        (1.1, "REJECTED", "in other cases"),
        (1.1, "Outcome: ABORTED", "in other cases"),
        (1.1, "no server", ""),
        (1.1, "no server\nOutcome: ABORTED", ""),
    ],
)
def test_a_client_waits_for_a_server_and_says_that_there_is_none(took, said, message):
    absent = Program(output=said)
    absent.duration = took
    clients = {
        "succeed": SimpleNamespace(works=lambda: True, again=lambda: None, output="Outcome: SUCCEEDED"),
        "reject": SimpleNamespace(output="REJECTED"),
        "abort": SimpleNamespace(output="Outcome: ABORTED"),
        "cancel": SimpleNamespace(output="Outcome: CANCELED"),
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
    client = SimpleNamespace(works=lambda: works[0], again=lambda: works.pop(0), output="")
    absent = Program(output="no server")
    absent.duration = 1.1
    bench = SimpleNamespace(early={"absent": run(absent, patience=1)})
    others = dict.fromkeys(("reject", "abort", "cancel"), SimpleNamespace(output=""))
    suite.test_client_without_server(bench, {"succeed": client, **others})
    assert works == [True]


@pytest.mark.parametrize(("floor", "elsewhere"), [(3, False), (4, False), (5, True)])
def test_a_cabin_that_a_blocked_goal_has_moved_untold_is_not_where_the_next_goals_look_for_it(floor, elsewhere):
    def ended(*floors, at):
        goal = Goal(lambda: True)
        goal.status, goal.result = "ABORTED", Lift.Result(floor=at)
        return Ride([*floors], goal)

    there = [ended(3, at=3), ended(4, at=4)]  # by the last step that was told of, and by the result of the first goal
    seen = Blocking(ended(9, at=4), True, 0.0, 0.0, 3, ended(3, 6, at=3), ended(6, at=floor), there, ended(6, at=6))
    assert says_elsewhere(seen) == elsewhere


@pytest.mark.parametrize(
    ("answered", "waited", "wrong"),
    [
        (0.5, [], False),
        (0.5, [3], False),  # where the goal before has ended
        (0.5, [4], True),
        (0.85, [4], False),  # too near to the end of the last step
        (1.5, [4], False),  # its own step may have been under way
    ],
)
def test_a_goal_that_is_cancelled_while_it_waits_makes_no_step(answered, waited, wrong):
    first, second = goal_of(1, 2, 3), goal_of(*waited)  # the first one's last step was over at 0.9 s
    second.cancel_accepted, second.cancel_answered = True, answered - time.time() + time.monotonic()
    if not wrong:
        expect_no_step_when_cancelled(first, second)
        return
    with pytest.raises(Wrong, match="must make no step"):
        expect_no_step_when_cancelled(first, second)


@pytest.mark.parametrize(("floor", "right"), [(2, True), (3, True), (4, True), (0, False)])
def test_the_result_of_a_goal_that_is_cancelled_while_it_waits_says_where_the_cabin_is(floor, right):
    first, second, third = Ride([1, 7], goal_of(1, 2, 3)), Ride([6, 0], goal_of()), Ride([2], goal_of(2))
    second.goal.status, second.goal.result = "CANCELED", Lift.Result(floor=floor)
    seen = Preemption([first, second, third], running=True)
    if right:
        assert expect_result_of_waiting(seen, "CANCELED", "cancelled")
        return
    with pytest.raises(Wrong, match="where the cabin is"):
        expect_result_of_waiting(seen, "CANCELED", "cancelled")
