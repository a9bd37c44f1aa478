"""The grader's end of an action: which actions a program offers or asks for, and how far a goal has come."""

from types import SimpleNamespace

import pytest
import rclpy
from action_msgs.srv import CancelGoal
from course_interfaces.action import Fibonacci, Lift
from rclpy.action import ActionClient, ActionServer
from rclpy.context import Context
from rclpy.node import Node
from rclpy.task import Future

from autograder.suitekit import ActionCaller, Goal, Heard, Ros, offered_actions, sought_actions
from autograder.suitekit.ros import published
from course.foundation.waiting import wait_until
from course.session.domains import claim_domain

FOUND = 20.0  # s


@pytest.fixture
def pair():
    """The grader's end of ROS, and a student's node in the same domain."""
    lock, domain = claim_domain()
    ros, context = Ros(domain), Context()
    rclpy.init(context=context, domain_id=domain)
    yield ros, Node("student", context=context, use_global_arguments=False)
    context.try_shutdown()
    ros.close()
    lock.close()


def test_an_action_of_another_type_is_told_and_not_taken(pair):
    ros, student = pair
    caller = ActionCaller(ros, "/lift", Lift)
    server = ActionServer(student, Fibonacci, "/lift", print)
    assert wait_until(lambda: offered_actions(ros), FOUND) == ["the action /lift (course_interfaces/action/Fibonacci)"]
    assert sought_actions(ros) == []
    assert not caller.ready()
    server.destroy()
    ActionServer(student, Lift, "/lift", print)
    assert wait_until(caller.ready, FOUND)


def test_what_a_client_asks_for_is_told(pair):
    ros, student = pair
    ActionClient(student, Lift, "/elevator")
    assert wait_until(lambda: sought_actions(ros), FOUND) == ["the action /elevator (course_interfaces/action/Lift)"]
    assert offered_actions(ros) == []


@pytest.mark.parametrize(
    ("said", "counts"),
    [(99.9, 99.9), (99.2, 99.2), (90.0, 99.0), (0.0, 99.0), (100.5, 100.0)],
    ids=["honest", "on a busy machine", "long before it came", "never", "after it came"],
)
def test_a_program_that_shifts_its_clock_is_not_believed(said, counts):
    times = {"received_timestamp": round(100e9), "source_timestamp": round(said * 1e9)}
    assert published(times) == pytest.approx(counts)


def test_a_goal_tells_how_far_it_has_come():
    goal = Goal(lambda: True)
    assert goal.phase == "was neither accepted nor rejected"
    goal.accepted = False
    assert goal.phase == "was rejected"
    goal.accepted = True
    assert goal.phase == "was accepted, but neither feedback nor a result came"
    goal.heard.append(Heard(0.0, Lift.Feedback()))
    assert goal.phase == "was accepted and sent feedback, but no result came"
    goal.status = "ABORTED"
    assert goal.phase == "ended as ABORTED"


def test_news_of_a_goal():
    goal = Goal(lambda: True)
    assert not goal.wait_for_news(0.05)
    goal.on_feedback(SimpleNamespace(feedback=Lift.Feedback(floor=2)))
    assert not goal.wait_for_news(0.05), "that had come before"
    goal.status = "SUCCEEDED"
    assert goal.wait_for_news(0.05)


@pytest.mark.parametrize(
    ("code", "refusals"),
    [(CancelGoal.Response.ERROR_NONE, 2), (CancelGoal.Response.ERROR_GOAL_TERMINATED, 0)],
    ids=["refused by its server", "the goal has ended"],
)
def test_who_refuses_to_cancel_a_goal_that_has_not_ended(code, refusals):
    goal, answer = Goal(lambda: True), Future()
    answer.set_result(CancelGoal.Response(return_code=code))
    goal.on_answer(SimpleNamespace(result=lambda: SimpleNamespace(accepted=False, cancel_goal_async=lambda: answer)))
    for _ in range(2):
        goal.cancel()
    assert (goal.cancel_accepted, goal.refusals) == (False, refusals)
