"""What a start in a cell ends, and what it never begins, is told."""

import sys
import threading

import pytest
from course_interfaces.action import Fibonacci
from rclpy.action import ActionClient, ActionServer, GoalResponse
from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import Trigger

from course.errors import NodeFailed
from course.foundation.waiting import wait_until
from course.session import started_nodes
from course.session.live import Session


class Motor(Node):
    def __init__(self, side, name="motor"):
        super().__init__(name)
        self.create_service(Trigger, f"motor_{side}", lambda request, response: response)


class Counter(Node):
    def __init__(self, **callbacks):
        super().__init__("counter")
        self.server = ActionServer(self, Fibonacci, "count", self.execute, **callbacks)

    def execute(self, goal_handle):
        goal_handle.succeed()
        return Fibonacci.Result()


@pytest.fixture
def session():
    made = Session()
    yield made
    made.close()


def run_cell(session: Session, number: int, *lines: str) -> str:
    """Run lines as a cell does, and return what the reader is told at its end."""
    text = "\n".join(lines)
    exec(compile(text, f"/tmp/ipykernel_1/{number}.py", "exec"), {"ros": session, "Motor": Motor, "Counter": Counter})
    return "\n".join(session.watch.notices())


def test_one_cell_starts_several_nodes_of_a_class(session):
    both = "for side in ('left', 'right'):", "    ros.start(Motor, side, name=side)"
    for _ in range(2):  # the cell is run again
        assert run_cell(session, 1, *both) == ""
        assert session.nodes() == ["/left", "/right"]
    session.restart("left")
    assert session.nodes() == ["/left", "/right"]
    told = run_cell(session, 2, "ros.start(Motor, 'front', name='front')")
    assert session.nodes() == ["/front"]
    assert "The start of 'front' has ended 'left': both are of the class Motor" in told and "has ended 'right'" in told


def test_a_node_that_takes_the_place_of_another_one_with_other_services_is_told(session):
    told = run_cell(session, 1, "ros.start(Motor, 'left')", "ros.start(Motor, 'right')")
    assert "A new 'motor' has replaced the one before, and with it /motor_left" in told
    assert run_cell(session, 2, "ros.start(Motor, 'right')", "ros.start(Motor, 'right')") == ""


def test_a_goal_callback_that_decides_nothing_is_told(session):
    client = ActionClient(session.node, Fibonacci, "count")
    session.start(Counter, goal_callback=lambda goal: goal.order > 0)
    with pytest.raises(NodeFailed, match="counter rejected a goal, because its goal callback did not return a Goal"):
        session.wait(client.send_goal_async(Fibonacci.Goal(order=3)))

    async def decide(goal):
        return GoalResponse.REJECT

    session.start(Counter, goal_callback=decide)
    assert not session.wait(client.send_goal_async(Fibonacci.Goal(order=3))).accepted
    session.start(Counter)
    assert session.wait(client.send_goal_async(Fibonacci.Goal(order=3))).accepted
    client.destroy()


def test_a_constructor_that_does_not_return_is_told_with_its_line(session, monkeypatch, capsys):
    said = threading.Event()
    monkeypatch.setattr(started_nodes, "PATIENCE", 0.2)
    monkeypatch.setattr(started_nodes, "say", lambda text: (print(text, file=sys.stderr), said.set()))
    cell = "class Late(Motor):\n    def __init__(self):\n        super().__init__('late')\n        said.wait(20)\n"
    space = {"ros": session, "Motor": Motor, "said": said}
    exec(compile(f"{cell}ros.start(Late)", "/tmp/ipykernel_1/3.py", "exec"), space)
    told = capsys.readouterr().err
    assert "The `__init__` of Late has not returned after 0.2 s" in told and "the cell, line 4, in __init__" in told


def test_a_callback_of_the_sessions_own_node_that_raises_is_told(session):
    heard = []
    session.node.create_subscription(String, "words", lambda message: heard.append(message.word), 10)
    publisher = session.node.create_publisher(String, "words", 10)

    def told() -> str:
        publisher.publish(String())
        return "".join(session.watch.notices())

    found = wait_until(told, 5.0)
    assert found.startswith("ros.node raised an exception in a callback: AttributeError: 'String' object has no")
