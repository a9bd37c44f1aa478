"""The chapter's nodes do what the chapter says, as programs and in a private context."""

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
import rclpy
from action_msgs.msg import GoalStatus
from course_interfaces.action import Fibonacci
from example_interfaces.srv import AddTwoInts
from geometry_msgs.msg import Twist
from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import GetParameters
from rclpy.action import ActionClient
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Float64

import course.nodes
from course.foundation.waiting import wait_until
from course.nodes import fibonacci_action_client
from course.nodes.add_two_ints_client import AddTwoIntsClient
from course.nodes.add_two_ints_server import AddTwoIntsServer
from course.nodes.ai_robot_controller import AIRobotController
from course.nodes.arm import Arm
from course.nodes.dynamic_parameter_node import DynamicParameterNode
from course.nodes.fibonacci_action_server import FibonacciActionServer
from course.nodes.parameter_node import ParameterNode
from course.session.domains import claim_domain

CLAIMS, (DOMAIN, PROGRAMS, NOBODY) = zip(*(claim_domain() for _ in range(3)), strict=True)  # held while this runs
FOLDER = Path(course.nodes.__file__).parent
SERVERS = {
    "add_two_ints_server": "Add Two Ints Server started",
    "fibonacci_action_server": "Fibonacci Action Server started",
    "parameter_node": "Debug Mode: False",
    "dynamic_parameter_node": "Dynamic Parameter Node started",
    "arm": "Arm started",
    "ai_robot_controller": "AI Robot Controller started",
    "world": "World started in room 'hall'",
}


def program(name, *arguments, domain=PROGRAMS):
    """A node as its own process, its output unbuffered and in one stream."""
    return subprocess.Popen(
        [sys.executable, "-u", "-m", f"course.nodes.{name}", *arguments],
        env={**os.environ, "ROS_DOMAIN_ID": str(domain)},
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip


class Spun:
    """Nodes in a private context, each spun by an executor of its own in a background thread."""

    def __init__(self):
        self.context = Context()
        rclpy.init(context=self.context, domain_id=DOMAIN)
        self.running = []

    def start(self, kind, *args, threads=1, **kwargs):
        node = kind(*args, context=self.context, **kwargs)
        single = SingleThreadedExecutor(context=self.context) if threads == 1 else None
        executor = single or MultiThreadedExecutor(num_threads=threads, context=self.context)
        executor.add_node(node)
        thread = threading.Thread(target=self._spin, args=(executor,))
        thread.start()
        self.running.append((executor, thread, node))
        return node

    def _spin(self, executor):
        with contextlib.suppress(ExternalShutdownException):
            executor.spin()

    def stop(self):
        for executor, thread, node in self.running:
            executor.shutdown(timeout_sec=5.0)
            thread.join(10.0)
            node.destroy_node()
        rclpy.shutdown(context=self.context)


@pytest.fixture
def spun():
    spun = Spun()
    yield spun
    spun.stop()


def result_of(future, timeout=10.0):
    """The result of a future whose node a background thread spins."""
    done = threading.Event()
    future.add_done_callback(lambda _: done.set())
    assert future.done() or done.wait(timeout), "no result in time"
    return future.result()


# As programs


@pytest.fixture(scope="module")
def asker():
    """A node in the domain of the programs, for asking whether they are spinning."""
    context = Context()
    rclpy.init(context=context, domain_id=PROGRAMS)
    executor = SingleThreadedExecutor(context=context)
    node = Node("asker", context=context)
    executor.add_node(node)
    yield node
    executor.shutdown()
    rclpy.shutdown(context=context)


@pytest.mark.parametrize("name", SERVERS)
def test_a_node_starts_as_a_program_and_ctrl_c_ends_it_without_a_traceback(name, asker):
    process = program(name)
    try:
        started = next(line for line in process.stdout if SERVERS[name] in line)
        client = asker.create_client(GetParameters, f"/{name}/get_parameters")
        assert client.wait_for_service(timeout_sec=10.0)
        for _ in range(3):  # rmw_fastrtps drops an answer whose reader the server has not found within 0.1 s
            answer = client.call_async(GetParameters.Request())
            asker.executor.spin_until_future_complete(answer, timeout_sec=3.0)
            if answer.done():
                break
        assert answer.done()
        process.send_signal(signal.SIGINT)
        output = started + process.communicate(timeout=10.0)[0]
    finally:
        process.kill()
    assert "Traceback" not in output and "terminate called" not in output, output
    assert process.returncode == 0, output


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.py")), ids=lambda path: path.stem)
def test_a_node_is_short_enough_to_read(path):
    assert len(path.read_text().splitlines()) < 100 and "import *" not in path.read_text()


def test_client_program_adds_two_numbers():
    server = program("add_two_ints_server")
    try:
        next(line for line in server.stdout if "started" in line)
        client = program("add_two_ints_client", "5", "-3")
        output = client.communicate(timeout=15.0)[0]
        assert client.returncode == 0 and "Result: 5 + -3 = 2" in output
    finally:
        server.kill()
        server.wait()


@pytest.mark.parametrize("arguments", [(), ("1",), ("1", "2", "3"), ("1", "two"), ("1", str(2**63))])
def test_client_program_explains_its_command_line(arguments):
    client = program("add_two_ints_client", *arguments)
    assert client.communicate(timeout=10.0)[0].startswith("Usage: ") and client.returncode == 2


@pytest.mark.parametrize("arguments", [("ten",), ("1", "2"), (str(2**31),)])
def test_action_client_program_explains_its_command_line(arguments):
    client = program("fibonacci_action_client", *arguments)
    assert client.communicate(timeout=10.0)[0].startswith("Usage: ") and client.returncode == 2


def test_client_program_fails_when_there_is_no_server():
    client = program("add_two_ints_client", "1", "2", domain=NOBODY)
    assert "No service add_two_ints within 5 s" in client.communicate(timeout=15.0)[0] and client.returncode == 1


def test_action_client_program_ends_by_the_outcome():
    server = program("fibonacci_action_server", "--ros-args", "-p", "step_period:=0.01")
    try:
        next(line for line in server.stdout if "started" in line)
        client = program("fibonacci_action_client", "10")
        output = client.communicate(timeout=15.0)[0]
        assert client.returncode == 0
        *steps, result = (json.loads(each) for each in re.findall(r"(?:Received feedback|Result): (.*)", output))
        assert result == [0, 1, 1, 2, 3, 5, 8, 13, 21, 34, 55]
        assert steps == [result[: len(each)] for each in sorted(steps, key=len)]
        assert 0 < len(steps) <= 10  # on a busy machine the result may overtake the last steps
        client = program("fibonacci_action_client", "47")
        assert "Goal rejected" in client.communicate(timeout=15.0)[0] and client.returncode == 1
    finally:
        server.kill()
        server.wait()


def test_parameters_come_from_the_command_line():
    process = program("parameter_node", "--ros-args", "-p", "robot_name:=optimus", "-p", "max_speed:=2.0")
    try:
        lines = [next(process.stdout) for _ in range(4)]
    finally:
        process.kill()
    assert re.search(
        r"Robot: optimus.*Max Speed: 2.0 m/s.*Debug Mode: False.*Max speed: 2.0", "".join(lines), re.DOTALL
    )


# Service


def test_service_adds_and_survives_a_sum_too_large(spun):
    spun.start(AddTwoIntsServer)
    client = spun.start(AddTwoIntsClient)
    assert client.wait_for_service()
    assert result_of(client.send_request(5, 3)).sum == 8
    assert result_of(client.send_request(2**63 - 1, 1)).sum == -(2**63)
    first, second = client.send_request(1, 2), client.send_request(10, 20)
    assert (result_of(first).sum, result_of(second).sum) == (3, 30)
    assert isinstance(result_of(first), AddTwoInts.Response)


def test_client_tells_in_time_that_no_service_is_there(spun):
    assert spun.start(AddTwoIntsClient).wait_for_service(timeout_sec=0.1) is False


# Action


class Goals:
    """A client of /fibonacci that keeps the feedback of its goals."""

    def __init__(self, spun, threads=10, step_period=0.02):
        spun.start(
            FibonacciActionServer, threads=threads, parameter_overrides=[Parameter("step_period", value=step_period)]
        )
        self.client = ActionClient(spun.start(Node, "goals"), Fibonacci, "fibonacci")
        assert self.client.wait_for_server(timeout_sec=10.0)
        self.feedback = []
        self.changed = threading.Condition()

    def send(self, order):
        return result_of(self.client.send_goal_async(Fibonacci.Goal(order=order), feedback_callback=self.on_feedback))

    def on_feedback(self, message):
        with self.changed:
            self.feedback.append(list(message.feedback.partial_sequence))
            self.changed.notify_all()

    def wait_for(self, count):
        with self.changed:
            assert self.changed.wait_for(lambda: len(self.feedback) >= count, 10.0)


@pytest.mark.parametrize("order, last", [(0, [0]), (1, [0, 1]), (2, [0, 1, 1]), (10, 55), (46, 1836311903)])
def test_order_n_gives_elements_0_to_n_with_feedback_for_each_step(spun, order, last):
    goals = Goals(spun, step_period=0.0 if order == 46 else 0.02)
    response = result_of(goals.send(order).get_result_async())
    sequence = list(response.result.sequence)
    assert response.status == GoalStatus.STATUS_SUCCEEDED and len(sequence) == order + 1
    assert sequence == last if isinstance(last, list) else sequence[-1] == last
    if order != 46:  # feedback as fast as it can be computed may outrun its queue of ten
        assert goals.feedback == [sequence[:count] for count in range(min(2, order + 1), order + 2)]


@pytest.mark.parametrize("order", [-1, 47])
def test_what_cannot_be_computed_is_rejected_when_the_goal_comes(spun, order):
    assert not Goals(spun).send(order).accepted


def test_cancel_is_honoured_within_a_step_and_returns_what_there_is(spun):
    goals = Goals(spun, step_period=2.0)
    handle = goals.send(46)
    goals.wait_for(2)
    begin = time.monotonic()
    cancelling = handle.cancel_goal_async()
    response = result_of(handle.get_result_async())
    assert time.monotonic() - begin < 2.0
    assert response.status == GoalStatus.STATUS_CANCELED and len(result_of(cancelling).goals_canceling) == 1
    assert list(response.result.sequence) == goals.feedback[-1]


def test_several_goals_run_at_once_and_are_cancelled_apart(spun):
    goals = Goals(spun, step_period=0.05)
    handles = [goals.send(order) for order in (46, 5, 6)]
    short = [result_of(handle.get_result_async()) for handle in handles[1:]]
    assert [response.result.sequence[-1] for response in short] == [5, 8]
    result_of(handles[0].cancel_goal_async())
    assert result_of(handles[0].get_result_async()).status == GoalStatus.STATUS_CANCELED


def test_with_one_thread_a_cancel_request_is_heard_too_late(spun):
    goals = Goals(spun, threads=1, step_period=0.02)
    handle = goals.send(8)
    goals.wait_for(1)
    handle.cancel_goal_async()
    assert result_of(handle.get_result_async()).status == GoalStatus.STATUS_SUCCEEDED


def test_action_client_node_tells_the_outcome(spun, monkeypatch):
    monkeypatch.setattr(fibonacci_action_client, "TIMEOUT", 0.2)
    client = spun.start(fibonacci_action_client.FibonacciActionClient, namespace="/alone")
    assert result_of(client.send_goal(3)) is None  # no server
    monkeypatch.setattr(fibonacci_action_client, "TIMEOUT", 10.0)
    spun.start(
        FibonacciActionServer, threads=4, namespace="/alone", parameter_overrides=[Parameter("step_period", value=0.02)]
    )
    assert list(result_of(client.send_goal(3)).result.sequence) == [0, 1, 1, 2]
    assert result_of(client.send_goal(-1)) is None  # rejected


# Parameters


def test_parameter_node_has_the_chapters_parameters(spun):
    node = spun.start(ParameterNode, parameter_overrides=[Parameter("max_speed", value=3.0)])
    assert [node.get_parameter(name).value for name in ("robot_name", "max_speed", "debug_mode")] == [
        "atlas",
        3.0,
        False,
    ]


def test_threshold_is_checked_with_a_reason_and_used_after(spun):
    node = spun.start(DynamicParameterNode)
    assert node.set_parameters([Parameter("threshold", value=0.0)])[0].successful and node.threshold == 0.0
    assert node.set_parameters([Parameter("threshold", value=100.0)])[0].successful and node.threshold == 100.0
    for value in (-0.1, 100.1, float("nan"), float("inf"), "high", 7, True, None):
        result = node.set_parameters([Parameter("threshold", value=value)])[0]
        assert not result.successful and result.reason, value
    assert node.threshold == node.get_parameter("threshold").value == 100.0


def test_the_arm_falls_until_an_effort_holds_it(spun):
    arm = spun.start(Arm)
    efforts = arm.create_publisher(Float64, "effort", 10)
    assert arm.track.wait_for(20, 20.0) and arm.error > 1.0  # it has fallen below 0
    assert wait_until(lambda: efforts.publish(Float64(data=10.0)) or arm.error < 0.5, 20.0)
    arm.note("lifted")
    table = arm.track.table()
    row = table["note"].index("lifted")  # the simulation goes on: rows may follow
    assert table["angle"][row] is None
    assert table["target"][0] == pytest.approx(1.0) and 10.0 in table["effort"]  # it is error and angle together


def test_a_set_with_one_fault_changes_nothing(spun):
    node = spun.start(DynamicParameterNode)
    node.declare_parameter("other", 1)
    result = node.set_parameters_atomically([Parameter("other", value=2), Parameter("threshold", value=200.0)])
    assert not result.successful and "0 to 100" in result.reason
    assert node.get_parameter("other").value == 1 and node.threshold == 50.0


def test_another_callback_that_rejects_leaves_the_threshold_in_use(spun):
    node = spun.start(DynamicParameterNode)
    node.add_on_set_parameters_callback(lambda _: SetParametersResult(successful=False, reason="not now"))
    assert not node.set_parameters([Parameter("threshold", value=10.0)])[0].successful
    assert node.threshold == 50.0


# Controller


class Driver:
    """Publishes scans to a controller and collects its commands."""

    def __init__(self, spun, **parameters):
        self.controller = spun.start(
            AIRobotController, parameter_overrides=[Parameter(name, value=value) for name, value in parameters.items()]
        )
        node = spun.start(Node, "driver")
        self.publisher = node.create_publisher(LaserScan, "scan", 10)
        self.commands, self.changed = [], threading.Condition()
        node.create_subscription(Twist, "cmd_vel", self.on_command, 10)

    def on_command(self, message):
        with self.changed:
            self.commands.append((message.linear.x, message.angular.z))
            self.changed.notify_all()

    def scan(self, **distances):
        ranges = [5.0] * 360
        for name, angle in (("front", 0), ("left", 60), ("right", -60)):
            ranges[angle] = distances.get(name, 5.0)
        self.publisher.publish(LaserScan(angle_increment=0.0174533, range_max=9.0, ranges=ranges))

    def wait_for(self, command, timeout=10.0):
        with self.changed:
            arrived = self.changed.wait_for(lambda: self.commands and self.commands[-1] == command, timeout)
            assert arrived, self.commands[-3:]


def test_controller_drives_turns_and_stops_when_scans_stop(spun):
    driver = Driver(spun, scan_timeout=0.3)
    driver.scan()
    driver.wait_for((0.3, 0.0))
    driver.scan(front=0.4, right=0.3)
    driver.wait_for((0.0, 0.5))
    driver.scan(front=0.4, left=0.3)
    driver.wait_for((0.0, -0.5))
    driver.wait_for((0.0, 0.0))
    assert driver.controller.ai_agent.state.name == "STOPPED"
    assert all(0.0 < latency < 0.1 for latency in driver.controller.latencies)


def test_controller_is_silent_before_the_first_scan(spun):
    controller = spun.start(AIRobotController)
    sent = []
    controller.cmd_vel_pub.publish = sent.append
    controller.control_loop()
    assert sent == [] and not controller.latencies


def test_controller_takes_a_new_threshold_while_it_drives(spun):
    driver = Driver(spun, obstacle_threshold=1.0, scan_timeout=30.0)
    driver.scan(front=0.8, right=0.3)
    driver.wait_for((0.0, 0.5))
    assert driver.controller.set_parameters([Parameter("obstacle_threshold", value=0.5)])[0].successful
    driver.wait_for((0.3, 0.0))
    assert not driver.controller.set_parameters([Parameter("obstacle_threshold", value=-1.0)])[0].successful
