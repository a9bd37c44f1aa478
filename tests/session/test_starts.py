"""The reader is told what a start in a cell ends, and what it never begins."""

import linecache
import signal
import sys
import threading
import time

import pytest
from course_interfaces.action import Fibonacci
from example_interfaces.action import Fibonacci as Released
from rclpy.action import ActionClient, ActionServer, GoalResponse
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger

from course.errors import LiveError, NodeFailed
from course.explaining.failure_report import hint_on
from course.foundation import waiting
from course.foundation.waiting import wait_until
from course.recorders import ParameterRecorder, TopicRecorder
from course.ros.rclpy_internals import RCLError
from course.session import node_process, started_nodes
from course.session.live import Session, live


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


def test_a_node_that_takes_the_place_of_another_one_with_other_services_is_told(session, monkeypatch):
    told = run_cell(session, 1, "ros.start(Motor, 'left')", "ros.start(Motor, 'right')")
    assert "A new 'motor' has replaced the one before, and with it /motor_left" in told
    assert run_cell(session, 2, "ros.start(Motor, 'right')", "ros.start(Motor, 'right')") == ""
    monkeypatch.setattr(Motor, "__module__", "course.world.node")  # where parameters say what a world offers
    assert run_cell(session, 3, "ros.start(Motor, 'right')", "ros.start(Motor, 'left')") == ""


def test_a_goal_callback_that_decides_nothing_is_told(session):
    client = ActionClient(session.node, Fibonacci, "count")
    session.start(Counter, goal_callback=lambda goal: goal.order > 0)
    assert client.wait_for_server(timeout_sec=10.0)
    try:  # the answer may come before the cause is known
        session.wait(client.send_goal_async(Fibonacci.Goal(order=3)))
        told = "".join(session.watch.pending())
    except NodeFailed as error:
        told = str(error)
    assert "counter rejected a goal, because its goal callback did not return a GoalResponse" in told

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


DIES_WHEN_ITS_NODE_IS_THERE = """import rclpy
from rclpy.node import Node
class Slow(Node):
    def __init__(self):
        super().__init__("slow")
        sum(number * number for number in range(3_000_000))
        self.nonsense()
rclpy.init()
rclpy.spin(Slow())
"""


def test_a_constructor_that_raises_when_its_node_is_there_is_the_answer_to_the_start(session, tmp_path):
    (tmp_path / "slow.py").write_text(DIES_WHEN_ITS_NODE_IS_THERE)
    with pytest.raises(NodeFailed, match=r"'Slow' object has no attribute 'nonsense'"):
        session.start(tmp_path / "slow.py")


def test_a_recorder_of_parameters_that_a_restart_leaves_behind(session):
    handle = session.start(Motor, "left")
    session.restart("motor")
    assert session.watch.notices() == []
    ParameterRecorder(session.start(Motor, "left").node)
    session.restart("motor")
    (told,) = session.watch.notices()
    assert told.startswith("A ParameterRecorder of 'motor' records the node before the restart, not the new one")
    assert not handle.alive


def test_a_recorder_that_waits_in_vain_for_a_misspelt_topic(session):
    session.node.create_publisher(String, "words_here", 10)
    heard = TopicRecorder(session.node, String, "wordshere", {"word": "data"})
    assert not heard.wait_for(1, timeout=2.0)
    (told,) = session.watch.notices()
    assert "subscribes to /wordshere, which no node publishes. Did you mean /words_here" in told


def test_a_node_that_a_cell_destroys_leaves_the_session_as_it_is(session):
    session.start(Motor, "left")
    other = session.start(Motor, "right", name="other").node
    client = other.create_client(Trigger, "motor_right")
    other.destroy_node()
    assert "/other" not in session.nodes()
    with pytest.raises(InvalidHandle) as error:
        client.call_async(Trigger.Request())
    assert hint_on(error.value).startswith("Hint: What this line uses was destroyed, by itself or with its node")
    session.start(Motor, "left")
    session.call("motor_left", Trigger)
    with pytest.raises(LiveError, match="ros.node is the session's own node, and nothing was destroyed"):
        session.node.destroy_node()
    session.call("motor_left", Trigger)


@pytest.mark.parametrize("make", ["client", "goals", "server"])
def test_another_type_of_a_service_or_an_action_in_this_kernel_is_told(make):
    session = live()
    try:
        session.start(Motor, "left")
        session.start(Counter)
        with pytest.raises((RCLError, ValueError)) as error:
            if make == "client":
                session.node.create_client(SetBool, "motor_left")
            elif make == "server":
                session.node.create_service(SetBool, "motor_left", print)
            else:
                ActionClient(session.node, Released, "count")
        kind = "course_interfaces/action/Fibonacci" if make == "goals" else "std_srvs/srv/Trigger"
        assert f" is served with the type {kind}, and your line uses " in hint_on(error.value)
    finally:
        session.close()


def test_a_callback_of_the_sessions_own_node_that_raises_is_told(session):
    heard = []
    session.node.create_subscription(String, "words", lambda message: heard.append(message.word), 10)
    publisher = session.node.create_publisher(String, "words", 10)

    def told() -> str:
        publisher.publish(String())
        return "".join(session.watch.notices())

    found = wait_until(told, 5.0)
    assert found.startswith("ros.node raised an exception in a callback: AttributeError: 'String' object has no")


LOOPS = """from rclpy.node import Node
class Loop(Node):
    def __init__(self):
        super().__init__("loop")
        self.go_on = False
        self.create_timer(0.01, self.turn)
    def turn(self):
        while not self.go_on:
            pass
loop = ros.start(Loop).node
"""


def cell(number: int, text: str, **names) -> dict:
    """Run a cell, with its text as IPython keeps it; return its names."""
    name = f"/tmp/ipykernel_1/{number}.py"
    linecache.cache[name] = (len(text), None, text.splitlines(keepends=True), name)
    exec(compile(text, name, "exec"), names)
    return names


def test_a_stop_tells_of_a_callback_that_does_not_return(session):
    node = cell(31, LOOPS, ros=session)["loop"]
    try:
        assert wait_until(session._handles["loop"].doing, 10.0)
        session.stop("loop")
        (told,) = session.watch.notices()
    finally:
        node.go_on = True
    assert told.startswith("'loop' is stopped, but one of its callbacks has not returned, and its thread goes on")
    assert "only a restart of the kernel" in told and "in turn\n" in told


def test_a_stop_says_nothing_of_a_callback_that_has_returned_since(session):
    node = cell(31, LOOPS, ros=session)["loop"]
    handle = session._handles["loop"]
    try:
        assert wait_until(handle.doing, 10.0)
        session.stop("loop")
    finally:
        node.go_on = True
    assert wait_until(lambda: not handle.goes_on(), 10.0)
    assert session.watch.notices() == []


THREAD = """import threading
from rclpy.node import Node
from std_msgs.msg import String
class Thread(Node):
    def __init__(self):
        super().__init__("thread")
        self.out = self.create_publisher(String, "out", 10)
        self.go_on = threading.Event()
        self.thread = threading.Thread(target=self.run)
        self.thread.start()
    def run(self):
        self.go_on.wait(20)
        self.out.publish(String())
    def destroy_node(self):
        if not {late}:
            self.go_on.set()
            self.thread.join()
        super().destroy_node()
node = ros.start(Thread).node
"""


@pytest.mark.parametrize("late", [True, False])
def test_a_thread_that_outlives_its_node_is_told_what_ends_it(session, late, capsys, monkeypatch):
    """And what is told does so."""
    session._guards.remove()
    monkeypatch.setattr(threading, "excepthook", threading.__excepthook__)  # pytest has its own
    session._guards.install()
    node = cell(51 + late, THREAD.format(late=late), ros=session)["node"]
    session.stop("thread")
    node.go_on.set()
    node.thread.join(10.0)
    said = capsys.readouterr().err
    assert ("Hint: This thread uses a node that has been stopped" in said) == late
    assert ("InvalidHandle" in said) == late


ENDS = """from rclpy.action import ActionServer
from rclpy.node import Node
class Ends(Node):
    def __init__(self):
        super().__init__("ends")
        self.server = ActionServer(self, Fibonacci, "ends", self.execute)
    def execute(self, handle):
        handle.succeed()
        {last}
ros.start(Ends)
"""


@pytest.mark.parametrize(
    ("last", "says", "line"),
    [
        ("return [0, 1]", "returned [0, 1], a list, and no result from an execute callback.", 9),
        ("pass", "ended an execute callback without returning a result.", 7),
        ("return list(range(999))", "returned [0, 1, 2, 3, 4, 5, ...], a list, and no result", 9),
    ],
)
def test_what_an_execute_callback_returns_instead_of_a_result(session, last, says, line):
    cell(41, ENDS.format(last=last), ros=session, Fibonacci=Fibonacci)
    client = ActionClient(session.node, Fibonacci, "ends")
    assert client.wait_for_server(10.0)
    handle = session.wait(client.send_goal_async(Fibonacci.Goal()))
    with pytest.raises(NodeFailed) as raised:
        session.wait(handle.get_result_async())
        session.look()
    assert f"The node ends {says}" in str(raised.value) and f"the cell, line {line}\n" in str(raised.value)
    assert "End the execute callback with `return TheType.Result(...)`" in str(raised.value)


class Seldom(Node):
    """A node whose timer has a period that is meant in Hz, and another one."""

    def __init__(self):
        super().__init__("seldom")
        self.create_timer(20, print)
        self.create_timer(0.5, lambda: None)


def test_a_timer_that_fires_seldom_is_told_once_after_a_wait_in_vain(session, capsys):
    session.start(Motor, "left")
    session.start(Seldom)
    for _ in range(2):
        for tell in waiting.in_vain:
            tell()
    told = capsys.readouterr().err
    says = "A timer of seldom runs every 20 s: `create_timer` takes the period in seconds.\n  test_starts.py, line "
    assert told.count(says) == 1 and "    self.create_timer(20, print)\n" in told


DOES_NOT_END = """import threading
import time
import rclpy
from course_interfaces.action import Fibonacci
from rclpy.action import ActionServer
from rclpy.node import Node
class Stays(Node):
    def __init__(self):
        super().__init__("stays")
        self.server = ActionServer(self, Fibonacci, "count", print)
        threading.Thread(target=self.work).start()
    def work(self):
        while rclpy.ok():
            time.sleep(0.02)
        while True:
            {}
rclpy.init()
try:
    rclpy.spin(Stays())
except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
    pass
"""


@pytest.mark.parametrize("limit", ["BUSY", "GRACE"])
def test_a_program_that_does_not_end_is_ended_soon_and_leaves_the_graph_at_once(session, tmp_path, monkeypatch, limit):
    monkeypatch.setattr(node_process, "GRACE", 60.0)
    monkeypatch.setattr(node_process, "LEAVING", 60.0)
    monkeypatch.setattr(node_process, limit, 0.2)
    path = tmp_path / "stays.py"
    path.write_text(DOES_NOT_END.format("pass" if limit == "BUSY" else "time.sleep(1.0)"))
    process = session.start(path)
    session.stop("stays.py")
    assert process.returncode == -signal.SIGKILL and session.nodes() == []
    assert process.over is not None and time.time() - process.over < 4.0  # a killed node's lease is 5 s


ENDS_WHEN_ASKED = """
import time
import rclpy

rclpy.init()
node = rclpy.create_node('ends')
node.declare_parameter('top', 1)
while not node.count_clients('/ends/list_parameters'):
    time.sleep(0.02)
"""


def test_the_next_wait_tells_of_a_program_that_ends_while_its_parameters_are_asked_for(session, tmp_path):
    (path := tmp_path / "ends.py").write_text(ENDS_WHEN_ASKED)
    session.start(path, parameters={"top": 2})
    with pytest.raises(NodeFailed, match=r"ends\.py ended with exit status 0"):
        session.until(lambda: False)
