"""Records: what happened comes out as a plain table, whichever thread saw it."""

import threading
import time

import pytest
from course_interfaces.action import Fibonacci
from geometry_msgs.msg import Twist
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.parameter import Parameter

from course.errors import CallTimeout, CourseError, NodeFailed
from course.foundation.waiting import wait_until
from course.nodes.dynamic_parameter_node import DynamicParameterNode
from course.nodes.fibonacci_action_server import FibonacciActionServer
from course.recorders import GoalRecorder, ParameterRecorder, Recorder, TopicRecorder
from course.session.live import Session


@pytest.fixture(scope="module")
def session():
    session = Session()
    yield session
    session.close()


@pytest.fixture(scope="module")
def fibonacci(session):
    session.start(FibonacciActionServer, threads=4, parameters={"step_period": 0.02})
    client = ActionClient(session.node, Fibonacci, "fibonacci")
    assert client.wait_for_server(10)
    return client


def test_a_table_has_a_list_for_each_column_and_times_that_grow():
    record = Recorder("value", "note")
    record.add(value=1)
    record.add(value=2, note="second")
    table = record.table()
    assert table["value"] == [1, 2] and table["note"] == [None, "second"]
    assert 0 <= table["time"][0] <= table["time"][1]


def test_a_column_that_there_is_not_is_refused():
    with pytest.raises(TypeError, match="no column speed: the columns are time, value"):
        Recorder("value").add(speed=1)


def test_rows_of_several_threads_are_all_kept():
    record = Recorder("value")
    threads = [threading.Thread(target=lambda: [record.add(value=n) for n in range(200)]) for _ in range(4)]
    for thread in threads:
        thread.start()
    assert record.wait_for(800)
    assert sorted(record.table()["value"]) == sorted(list(range(200)) * 4)


def test_waiting_ends_with_the_row_or_with_the_time_limit():
    record = Recorder("value")
    threading.Timer(0.05, lambda: record.add(value=7)).start()
    assert record.wait_for(lambda table: 7 in table["value"], timeout=10)
    assert not record.wait_for(2, timeout=0.05)


def test_a_topic_is_recorded_by_the_paths_of_its_fields(session):
    record = TopicRecorder(session.node, Twist, "cmd", {"speed": "linear.x", "turn": lambda twist: twist.angular.z})
    publisher = session.node.create_publisher(Twist, "cmd", 10)
    assert session.until(lambda: publisher.get_subscription_count() == 1)
    message = Twist()
    message.linear.x, message.angular.z = 0.3, -0.5
    publisher.publish(message)
    assert record.wait_for(1)
    assert (record.table()["speed"], record.table()["turn"]) == ([0.3], [-0.5])
    record.close()
    assert session.until(lambda: publisher.get_subscription_count() == 0)


def test_a_goal_is_recorded_from_the_request_to_the_result(fibonacci):
    goal = GoalRecorder(fibonacci).send(Fibonacci.Goal(order=5))
    assert goal.wait_end() == "succeeded"
    assert goal.wait_feedback(5)
    events = goal.table()["event"]
    assert events[0] == "goal" and events.count("accepted") == events.count("succeeded") == 1
    assert goal.result == list(goal.response.sequence) == [0, 1, 1, 2, 3, 5]
    assert [len(message.partial_sequence) for message in goal.feedback] == [2, 3, 4, 5, 6]
    assert goal.time_of("goal") <= goal.time_of("succeeded") and goal.time_of("canceled") is None


def test_a_cancelled_and_a_rejected_goal_end_as_such(fibonacci):
    goal = GoalRecorder(fibonacci).send(Fibonacci.Goal(order=40))
    assert goal.wait_feedback(3)
    answer = goal.cancel()
    assert wait_until(answer.done, 5.0) and len(answer.result().goals_canceling) == 1
    assert goal.wait_end() == "canceled" and goal.count("cancel") == 1
    assert 4 <= len(goal.result) < 41
    assert GoalRecorder(fibonacci).send(Fibonacci.Goal(order=-1)).wait_end() == "rejected"


def test_a_wait_for_feedback_is_over_soon_after_the_end_of_the_goal(fibonacci, capsys):
    goal = GoalRecorder(fibonacci).send(Fibonacci.Goal(order=3))
    began = time.monotonic()
    assert not goal.wait_feedback(10, timeout=30.0)
    assert goal.wait_end() == "succeeded"
    assert time.monotonic() - began < 15.0
    said = "This goal has ended as succeeded, after 3 feedback messages: wait_feedback(10) stopped waiting."
    assert said in capsys.readouterr().err


def test_a_cancel_of_a_goal_that_was_never_sent_says_so(fibonacci):
    with pytest.raises(CourseError, match=r"no goal was sent: `GoalRecorder\(client\).send\(goal\)` sends one"):
        GoalRecorder(fibonacci).cancel()
    with pytest.raises(CourseError, match="no goal was sent"):
        GoalRecorder(fibonacci).wait_end()


def test_a_recorder_keeps_one_goal(fibonacci):
    goal = GoalRecorder(fibonacci).send(Fibonacci.Goal(order=2))
    with pytest.raises(CourseError, match="make a new one for each goal"):
        goal.send(Fibonacci.Goal(order=3))
    assert goal.wait_end() == "succeeded"


def test_a_recorder_that_is_given_something_else(fibonacci):
    with pytest.raises(CourseError, match=r"`Fibonacci\.Goal\(\.\.\.\)`, not 5"):
        GoalRecorder(fibonacci).send(5)
    with pytest.raises(CourseError, match="GoalRecorder takes an action client, .* not 'fibonacci'"):
        GoalRecorder("fibonacci")


def test_a_goal_whose_server_is_gone_has_no_end(session):
    session.start(FibonacciActionServer, threads=2, parameters={"step_period": 0.2})
    client = ActionClient(session.node, Fibonacci, "fibonacci")
    assert client.wait_for_server(10)
    goal = GoalRecorder(client).send(Fibonacci.Goal(order=40))
    assert goal.wait_feedback(1)
    session.stop("fibonacci_action_server")
    start = time.monotonic()
    with pytest.raises(NodeFailed, match="no node serves the action /fibonacci any more.* last event is 'feedback'"):
        goal.wait_end(60.0)
    with pytest.raises(CallTimeout, match=r"nothing will arrive\. No node serves the action /fibonacci"):
        session.wait(client.send_goal_async(Fibonacci.Goal(order=1)), timeout=60.0)
    assert time.monotonic() < start + 20.0
    client.destroy()


SLOW_END = """import threading

import rclpy
from course_interfaces.action import Fibonacci
from rclpy.action import ActionServer
from rclpy.executors import MultiThreadedExecutor

def execute(handle):
    handle.succeed()

rclpy.init()
node = rclpy.create_node('slow_end')
server = ActionServer(node, Fibonacci, 'slow_end', execute)
executor = MultiThreadedExecutor(3)
executor.add_node(node)
try:
    executor.spin()
finally:
    server.destroy()
    threading.Event().wait(1.5)  # the interpreter's own end takes as long on a busy machine
"""


@pytest.mark.parametrize("waits", ["for the goal", "for a future"])
def test_a_program_that_dies_in_execute_is_told_though_it_ends_long_after_its_server(session, tmp_path, waits):
    (tmp_path / "slow_end.py").write_text(SLOW_END)
    session.start(tmp_path / "slow_end.py")
    client = ActionClient(session.node, Fibonacci, "slow_end")
    assert client.wait_for_server(10)
    with pytest.raises(NodeFailed, match=r"slow_end\.py ended with exit status 1: AssertionError"):
        if waits == "for the goal":
            GoalRecorder(client).send(Fibonacci.Goal(order=1)).wait_end(60.0)
        else:
            handle = session.wait(client.send_goal_async(Fibonacci.Goal(order=1)))
            session.wait(handle.get_result_async(), timeout=60.0)
    client.destroy()


LATE = """import time
import rclpy
from course_interfaces.action import Fibonacci
from rclpy.action import ActionServer
from rclpy.executors import MultiThreadedExecutor

def execute(handle):
    for number in range(handle.request.order):
        time.sleep(0.5)
    if handle.request.order == 1:
        time.sleep(60)
    while handle.request.order > 1:
        time.sleep(0.1)

rclpy.init()
node = rclpy.create_node('late')
server = ActionServer(node, Fibonacci, 'late', execute)
executor = MultiThreadedExecutor(3)
executor.add_node(node)
executor.spin()
"""


def test_a_goal_whose_server_cannot_go_on_in_time_is_told_before_the_limit(session, tmp_path, capsys, monkeypatch):
    (tmp_path / "late.py").write_text(LATE)
    session.start(tmp_path / "late.py")
    client = ActionClient(session.node, Fibonacci, "late")
    assert client.wait_for_server(10)
    asleep = GoalRecorder(client).send(Fibonacci.Goal(order=1))
    assert asleep.wait_end(0.5) is None
    assert capsys.readouterr().err == ""
    monkeypatch.setattr("course.recorders.NO_LOOK", 0.5)
    assert asleep.wait_end(0.5) is None and not asleep.wait_feedback(2, 0.5)
    over = "The wait for a goal of /late ended after 0.5 s:"
    here = "\nlate.py is here:\n  late.py, line 11, in execute\n    time.sleep(60)\n"
    assert capsys.readouterr().err == (
        f"{over} the goal has not ended: its last event is 'accepted'.{here}"
        f"{over} only 0 of 2 feedback messages have come.{here}"
    )
    start = time.monotonic()
    with pytest.raises(NodeFailed, match=r"no further within 10 s: its last event is 'accepted'\.\n") as told:
        asleep.wait_end(10.0)
    assert str(told.value).endswith("late.py is here:\n  late.py, line 11, in execute\n    time.sleep(60)")
    loops = GoalRecorder(client).send(Fibonacci.Goal(order=2))  # beside the other one
    with pytest.raises(NodeFailed, match=r"late.py is here:\n  late\.py, line 1[123], in execute\n"):
        loops.wait_for(9, 10.0)
    assert time.monotonic() < start + 12.0
    client.destroy()


def test_every_attempt_to_set_a_parameter_is_recorded_whoever_makes_it(session):
    node = session.start(DynamicParameterNode).node
    record = ParameterRecorder(node)
    node.set_parameters([Parameter("threshold", value=60.0)])
    session.call(
        "/dynamic_parameter_node/set_parameters_atomically",
        SetParametersAtomically,
        parameters=[Parameter("threshold", value=120.0).to_parameter_msg()],
    )
    table = record.table()
    assert table["name"] == ["threshold"] * 3 and record.at_start == 1
    assert table["value"] == [50.0, 60.0, 120.0]
    assert table["accepted"] == [True, True, False]
    assert "0 to 100" in table["reason"][2]
    record.close()
    node.set_parameters([Parameter("threshold", value=70.0)])
    assert len(record) == 3


def test_the_range_of_a_parameter_is_its_descriptors(session):
    class Ranged(Node):
        def __init__(self):
            super().__init__("ranged")
            limits = [FloatingPointRange(from_value=0.0, to_value=5.0)]
            self.declare_parameter("speed", 1.0, ParameterDescriptor(floating_point_range=limits))
            self.declare_parameter("free", 1.0)

    record = ParameterRecorder(session.start(Ranged).node)
    assert record.range("speed") == (0.0, 5.0) and record.range("free") == ()
