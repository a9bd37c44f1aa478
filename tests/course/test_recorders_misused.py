"""A wrong argument of a recorder is reported at once, in the words of that recorder."""

import math
from types import SimpleNamespace

import pytest
from course_interfaces.action import Fibonacci
from geometry_msgs.msg import Twist
from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_srvs.srv import SetBool

from course.errors import CourseError
from course.nodes.fibonacci_action_server import FibonacciActionServer
from course.recorders import DecisionRecorder, GoalRecorder, ParameterRecorder, Recorder, TopicRecorder
from course.session.live import Session


@pytest.fixture(scope="module")
def given():
    session = Session()
    handle = session.start(FibonacciActionServer, threads=4, parameters={"step_period": 0.02})
    client = ActionClient(session.node, Fibonacci, "fibonacci")
    assert client.wait_for_server(10)
    goal = GoalRecorder(client).send(Fibonacci.Goal(order=2))
    assert goal.wait_end() == "succeeded"
    yield SimpleNamespace(ros=session, handle=handle, client=client, goal=goal, track=Recorder("speed", "turn"))
    session.close()


WRONG = {
    "columns in a list": (lambda at: Recorder(["angle", "effort"]), "`Recorder('angle', 'effort')`"),
    "a nameless value": (lambda at: at.track.add(1.0), "write `add(speed=1.0)`"),
    "nameless values": (lambda at: at.track.add(1.0, 2.0), "write `add(speed=1.0, turn=2.0)`"),
    "one named, one not": (lambda at: at.track.add(1.0, turn=2.0), "write `add(speed=1.0)`"),
    "a condition without the table": (lambda at: at.track.wait_for(lambda: True), "wait_for(lambda table:"),
    "the value of a condition": (lambda at: at.track.wait_for(len(at.track) > 3), "not for False"),
    "half a row": (lambda at: at.track.wait_for(2.5), "not for 2.5"),
    "rows in words": (lambda at: at.track.wait_for("3"), "not for '3'"),
    "no rows": (lambda at: at.track.wait_for(), "missing a required argument: 'wanted'"),
    "a limit in words": (lambda at: at.track.wait_for(1, "5"), "a number of seconds, such as `timeout=5.0`, not '5'"),
    "a limit without a number": (lambda at: at.track.wait_for(1, math.nan), "not nan"),
    "no limit": (lambda at: at.track.wait_for(1, None), "not None"),
    "a column of the recorder": (lambda at: at.track["speed"], "write `.table()['speed']`"),
    "the rows of the recorder": (lambda at: [*at.track], "the columns of a recorder are in its table"),
    "a function of nothing": (lambda at: record(at, Twist, "cmd", {"x": lambda: 3}), "`lambda message: ...`"),
    "no client": (lambda at: GoalRecorder(), "missing a required argument: 'client'"),
    "client and goal": (lambda at: GoalRecorder(at.client, Fibonacci.Goal()), "Its arguments are: client"),
    "the values of a goal": (lambda at: GoalRecorder(at.client).send(order=5), "write `send(Fibonacci.Goal(order=5))`"),
    "no goal": (lambda at: GoalRecorder(at.client).send(), "`Fibonacci.Goal(...)`, not None"),
    "two goals": (
        lambda at: GoalRecorder(at.client).send(Fibonacci.Goal(), Fibonacci.Goal()),
        "`Fibonacci.Goal(...)`, not course_interfaces",
    ),
    "an event in British spelling": (
        lambda at: at.goal.count("cancelled"),
        "feedback, cancel, rejected, succeeded, can",
    ),
    "an event of another name": (lambda at: at.goal.time_of("success"), "a goal has no event 'success'"),
    "no event": (lambda at: at.goal.count(), "missing a required argument: 'event'"),
    "an event that is no text": (lambda at: at.goal.count(["goal"]), "a goal has no event ['goal']"),
    "a condition as a count": (lambda at: at.goal.wait_feedback(lambda: True), "a number of feedback messages"),
    "a count in words": (lambda at: at.goal.wait_feedback("3"), "a number of feedback messages, not '3'"),
    "the end in words": (lambda at: GoalRecorder(at.client).send(Fibonacci.Goal()).wait_end("5"), "not '5'"),
    "type and topic swapped": (lambda at: record(at, "cmd", Twist), "`TopicRecorder(ros.node, Twist, 'cmd_vel', ...)`"),
    "a service's type": (lambda at: record(at, SetBool, "cmd"), "takes the type of a message"),
    "the fields in a list": (lambda at: record(at, Twist, "cmd", ["linear.x"]), "such as {'linear': 'linear.x'}"),
    "a misspelt field": (lambda at: record(at, Twist, "cmd", {"x": "liner.x"}), "Twist has linear, angular"),
    "a misspelt part": (lambda at: record(at, Twist, "cmd", {"x": "linear.w"}), "Vector3 has x, y, z"),
    "an index": (lambda at: record(at, Twist, "cmd", {"x": "linear.x.0"}), "a function can: `lambda message:"),
    "a number as a field": (lambda at: record(at, Twist, "cmd", {"x": 0}), "not 0"),
    "no fields": (lambda at: TopicRecorder(at.ros.node, Twist, "cmd"), "missing a required argument: 'fields'"),
    "the session": (lambda at: TopicRecorder(at.ros, Twist, "cmd", {}), "a node, such as `ros.node`"),
    "a node's name": (lambda at: ParameterRecorder("fibonacci"), "takes a node, such as `ros.node`, or `ros.start("),
    "a node's handle": (lambda at: ParameterRecorder(at.handle), "`ros.start(TheNode).node`"),
    "a node's class": (lambda at: ParameterRecorder(Node), "`ros.start(TheNode).node`"),
    "no node": (lambda at: ParameterRecorder(), "missing a required argument: 'node'"),
    "an unknown parameter": (lambda at: ParameterRecorder(at.handle.node).range("max"), "no parameter 'max'"),
    "a controller's handle": (lambda at: DecisionRecorder(at.handle), "`ros.start(AIRobotController).node`"),
}


def record(at, msg_type, topic, fields=None):
    TopicRecorder(at.ros.node, msg_type, topic, fields or {"speed": "linear.x"})


@pytest.mark.parametrize("name", WRONG)
def test_what_is_meant_is_written_out(given, name):
    wrong, told = WRONG[name]
    with pytest.raises(CourseError) as error:
        wrong(given)
    assert told in str(error.value)
    assert len(given.track) == 0  # no row was added


def test_events_that_did_not_occur_are_counted(given):
    assert [given.goal.count(event) for event in ("cancel", "canceled", "aborted", "rejected")] == [0] * 4
    assert given.goal.time_of("canceled") is None


def test_a_rejected_goal_is_not_cancelled(given, capsys):
    goal = GoalRecorder(given.client).send(Fibonacci.Goal(order=-1))
    assert goal.wait_end() == "rejected"
    with pytest.raises(CourseError, match="the goal was rejected"):
        goal.cancel()
    assert not capsys.readouterr().err


def test_an_event_of_ones_own_is_found(given):
    goal = GoalRecorder(given.client)
    goal.add(event="thought")
    assert goal.count("thought") == 1 and goal.time_of("thought") >= 0.0


def test_a_recorder_may_be_closed_twice_and_after_its_node(given):
    class Short(Node):
        def __init__(self):
            super().__init__("short")
            self.declare_parameter("speed", 1.0)

    node = given.ros.start(Short).node
    sets, topic = ParameterRecorder(node), TopicRecorder(node, Twist, "cmd", {"speed": "linear.x"})
    given.ros.stop("short")
    for each in (sets, topic) * 2:
        each.close()
    assert sets.table()["value"] == [1.0]
    with pytest.raises(CourseError, match="this node has been ended"):
        ParameterRecorder(node)
    with pytest.raises(CourseError, match="this node has been ended"):
        TopicRecorder(node, Twist, "cmd", {"speed": "linear.x"})


@pytest.mark.parametrize("first", [0, 1])
def test_two_recorders_of_one_node_end_in_any_order(given, first):
    node = given.handle.node
    both = [ParameterRecorder(node), ParameterRecorder(node)]
    rows = len(both[0])
    both[first].close()
    node.set_parameters([Parameter("step_period", value=0.02)])
    assert (len(both[first]), len(both[1 - first])) == (rows, rows + 1)
    both[1 - first].close()
    node.set_parameters([Parameter("step_period", value=0.02)])
    assert (len(both[first]), len(both[1 - first])) == (rows, rows + 1)


def test_a_client_that_was_destroyed_sends_no_goal(given):
    client = ActionClient(given.ros.node, Fibonacci, "fibonacci")
    recorder = GoalRecorder(client)
    client.destroy()
    with pytest.raises(CourseError, match="has been destroyed"):
        recorder.send(Fibonacci.Goal(order=1))
