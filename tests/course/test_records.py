"""Recorders keep what happened, in order, from any thread, as rows that need no library to read."""

import threading

import pytest
import rclpy
from course_interfaces.action import Fibonacci
from geometry_msgs.msg import Twist
from rclpy.action import ActionClient
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import LaserScan

from course.nodes.ai_robot_controller import AIRobotController
from course.nodes.dynamic_parameter_node import DynamicParameterNode
from course.nodes.fibonacci_action_server import FibonacciActionServer
from course.records import (
    ActionRecorder,
    CallRecorder,
    DecisionRecorder,
    ParameterRecorder,
    Recorder,
    TopicRecorder,
    plain,
)


class Spun:
    """A private context whose nodes a background thread spins."""

    def __init__(self):
        self.context = Context()
        rclpy.init(context=self.context, domain_id=35)
        self.executor = MultiThreadedExecutor(num_threads=6, context=self.context)
        self.thread = threading.Thread(target=self._spin)
        self.thread.start()

    def _spin(self):
        try:
            self.executor.spin()
        except ExternalShutdownException:
            pass

    def start(self, kind, *args, **kwargs):
        node = kind(*args, context=self.context, **kwargs)
        self.executor.add_node(node)
        return node

    def stop(self):
        self.executor.shutdown(timeout_sec=5.0)
        self.thread.join(10.0)
        rclpy.shutdown(context=self.context)


@pytest.fixture(scope="module")
def spun():
    spun = Spun()
    yield spun
    spun.stop()


def test_rows_are_in_order_and_the_table_is_the_readers_own():
    record = Recorder()
    record.add(x=1)
    record.add(x=2)
    table = record.table()
    table.clear()
    assert [row["x"] for row in record.table()] == [1, 2] and len(record) == 2
    assert record.column("x").tolist() == [1, 2]
    assert list(record.column("time")) == sorted(record.column("time"))
    with pytest.raises(KeyError):
        record.column("y")
    record.clear()
    assert record.table() == []
    assert Recorder(since=record).start == record.start


def test_threads_add_without_losing_a_row():
    record = Recorder()
    threads = [threading.Thread(target=lambda: [record.add(x=i) for i in range(500)]) for _ in range(4)]
    for thread in threads:
        thread.start()
    assert len(record.wait_for(2000)) == 2000
    assert list(record.column("time")) == sorted(record.column("time"))


def test_wait_for_returns_at_once_waits_for_a_condition_and_gives_up():
    record = Recorder("speed")
    record.add(x=1)
    assert len(record.wait_for(1, timeout=0.0)) == 1
    threading.Timer(0.05, lambda: record.add(x=7)).start()
    assert record.wait_for(lambda rows: rows[-1]["x"] == 7)[-1]["x"] == 7
    with pytest.raises(TimeoutError, match=r"speed: 9 rows did not come within 0.01 s, there are 2 rows"):
        record.wait_for(9, timeout=0.01)


def test_repr_of_a_recorder_does_not_vary():
    assert repr(Recorder("speed")) == "<recorder of speed>"


def test_a_message_becomes_plain_python():
    message = Fibonacci.Result(sequence=[0, 1, 1])
    assert plain(message) == {"sequence": [0, 1, 1]} and isinstance(plain(message)["sequence"], list)
    assert plain(Twist())["linear"] == {"x": 0.0, "y": 0.0, "z": 0.0}


def test_a_topic_becomes_columns_by_field(spun):
    node = spun.start(Node, "topics")
    twists = TopicRecorder(node, "speeds", Twist)
    scans = TopicRecorder(node, "scans", LaserScan)
    speeds, lasers = node.create_publisher(Twist, "speeds", 10), node.create_publisher(LaserScan, "scans", 10)
    twist, scan = Twist(), LaserScan(ranges=[1.0, 2.0])
    twist.angular.z, scan.header.stamp.sec, scan.header.stamp.nanosec = -0.5, 7, 250_000_000
    speeds.publish(twist)
    lasers.publish(scan)
    row = twists.wait_for(1)[0]
    assert row["angular.z"] == -0.5 and row["linear.x"] == 0.0 and "stamp" not in row
    row = scans.wait_for(1)[0]
    assert row["stamp"] == 7.25 and row["ranges"] == [1.0, 2.0]
    assert scans.messages == [scan]
    twists.close()
    scans.clear()
    assert len(scans) == 0 and scans.messages == []


@pytest.fixture(scope="module")
def fibonacci(spun):
    spun.start(FibonacciActionServer, parameter_overrides=[Parameter("step_period", value=0.02)])
    client = ActionClient(spun.start(Node, "fibonacci_watcher"), Fibonacci, "fibonacci")
    assert client.wait_for_server(timeout_sec=10.0)
    return client


def test_a_goal_is_recorded_from_sending_to_result(fibonacci):
    record = ActionRecorder()
    assert record.send_goal(fibonacci, Fibonacci.Goal(order=4)) == "A"
    assert record.outcome("A")["value"] == [0, 1, 1, 2, 3]
    events = [row["event"] for row in record.table()]
    assert events[0] == "sent" and events[-1] == "succeeded" and events.count("feedback") == 4
    assert [row["value"] for row in record.table() if row["event"] == "feedback"][-1] == [0, 1, 1, 2, 3]
    assert record.table()[0]["value"] == 4


def test_cancelling_and_rejection_are_recorded_by_goal(fibonacci):
    record = ActionRecorder()
    record.send_goal(fibonacci, Fibonacci.Goal(order=40))
    assert record.send_goal(fibonacci, Fibonacci.Goal(order=47)) == "B"
    assert record.outcome("B")["event"] == "rejected"
    record.wait_for(lambda rows: sum(row["event"] == "feedback" for row in rows) >= 3)
    record.cancel("A")
    last = record.outcome("A")
    assert last["event"] == "canceled" and 3 <= len(last["value"]) < 41
    events = [row["event"] for row in record.table() if row["goal"] == "A"]
    assert events.index("cancel requested") < len(events) - 1
    record.wait_for(lambda rows: any(row["event"] == "cancel accepted" for row in rows))


def test_decisions_are_recorded_with_what_they_were_decided_on(spun):
    controller = spun.start(AIRobotController)
    record = DecisionRecorder(controller)
    publisher = controller.create_publisher(LaserScan, "scan", 10)
    scan = LaserScan(angle_increment=0.0174533, range_max=10.0, ranges=[0.3] * 30 + [2.0] * 330)
    scan.header.stamp.sec = 5
    publisher.publish(scan)
    row = record.wait_for(2)[1]
    assert row["stamp"] == 5.0 and row["state"] == "TURNING_RIGHT" and row["angular"] == -0.5
    assert row["front"] == pytest.approx(0.3) and row["left"] == pytest.approx(2.0)
    assert 0.0 < row["latency"] < 1.0
    record.close()
    assert controller.observers == []


def test_every_attempt_to_set_a_parameter_is_recorded_with_its_reason(spun):
    node = spun.start(DynamicParameterNode)
    record = ParameterRecorder(node)
    node.set_parameters([Parameter("threshold", value=70.0), Parameter("threshold", value=500.0)])
    node.set_parameters_atomically([Parameter("threshold", value=10.0), Parameter("threshold", value=-1.0)])
    node.set_parameters([Parameter("threshold", value="high")])
    with pytest.raises(rclpy.exceptions.ParameterNotDeclaredException):
        node.set_parameters([Parameter("gain", value=1.0)])
    rows = record.table()
    assert [(row["set"], row["value"], row["accepted"]) for row in rows] == [
        (0, 50.0, True), (1, 70.0, True), (2, 500.0, False), (3, 10.0, False), (3, -1.0, False), (4, "high", False),
        (5, 1.0, False),
    ]  # fmt: skip
    assert "from 0 to 100" in rows[2]["reason"] and all(row["reason"] for row in rows if not row["accepted"])
    assert node.threshold == 70.0 and {row["parameter"] for row in rows} == {"threshold", "gain"}
    record.close()
    node.set_parameters([Parameter("threshold", value=20.0)])
    assert len(record) == len(rows)


def test_a_pre_set_callback_shows_as_requested_and_stored(spun):
    node = spun.start(Node, "clamper")
    node.declare_parameter("gain", 1.0)
    node.add_pre_set_parameters_callback(lambda params: [Parameter(p.name, value=min(p.value, 5.0)) for p in params])
    record = ParameterRecorder(node)
    node.set_parameters([Parameter("gain", value=9.0)])
    assert (record.table()[-1]["requested"], record.table()[-1]["value"]) == (9.0, 5.0)


def test_calls_are_timed_also_when_they_fail():
    record = CallRecorder()
    assert record.call(sum, [1, 2], label="sum") == 3
    with pytest.raises(ZeroDivisionError):
        record.call(lambda: 1 / 0)
    assert [row["label"] for row in record.table()] == ["sum", "call"]
    assert all(row["duration"] >= 0.0 for row in record.table())
