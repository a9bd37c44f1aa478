"""A wrong argument of a session's method is reported at once, in the words of that method."""

import math
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator

import pytest
import rclpy
from example_interfaces.srv import AddTwoInts
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.task import Future
from std_msgs.msg import Int32
from std_srvs.srv import Trigger

from course.errors import CallTimeout, CourseError, LiveError, NodeFailed
from course.session.live import Session
from course.session.misuse import no_node
from course.session.spinner import KEPT

PROGRAM = """
import rclpy
from std_srvs.srv import Trigger


def tell(request, response):
    response.message = "WORD"
    node.get_logger().info("WORD")
    return response


rclpy.init()
node = rclpy.create_node("teller")
node.create_service(Trigger, "tell", tell)
rclpy.spin(node)
"""


class Adder(Node):
    def __init__(self):
        super().__init__("adder")
        self.create_service(AddTwoInts, "add", self.add)

    def add(self, request, response):
        response.sum = request.a + request.b
        return response


@pytest.fixture(scope="module")
def session() -> Iterator[Session]:
    made = Session()
    made.start(Adder)
    yield made
    made.close()


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        (lambda ros: ros.call(AddTwoInts, "/add", a=1, b=2), "write ros.call('/add', AddTwoInts, ...)"),
        (lambda ros: ros.wait_for_service(AddTwoInts, "/add"), "write ros.wait_for_service('/add', AddTwoInts, ...)"),
        (lambda ros: ros.call(AddTwoInts, AddTwoInts), "the name of a service is text"),
        (lambda ros: ros.call("/add", AddTwoInts, {"a": 1, "b": 2}), "ros.call('/add', AddTwoInts, a=1, b=2)"),
        (lambda ros: ros.call("/add", AddTwoInts, 1), "ros.call('/add', AddTwoInts, a=1, b=...)"),
        (lambda ros: ros.until([]), "this is a list: its value now. To wait for a condition, write `lambda:` before"),
        (
            lambda ros: ros.until(True),
            "this is True, which stays so. To wait for a condition, leave out the brackets after its last name, as in",
        ),
        (lambda ros: ros.until(False), "as in `ros.until(future.done)`, or write `lambda:` before it, as in `ros."),
        (lambda ros: ros.until(Future()), "ros.wait(future)"),
        (lambda ros: ros.until(lambda: Future().done), "call it, `done()`"),
        (
            lambda ros: ros.start(Adder, parameters={"ros__parameters": {"a": 2.0, "b": {"c": 1}}}),
            "must not contain nested dicts: write parameters={'a': 2.0, 'b.c': 1}",
        ),
        (
            lambda ros: ros.start("a.py", parameters={"adder": {"ros__parameters": {"a": 2.0}}}),
            "write parameters={'a': 2.0}",
        ),
        (lambda ros: ros.stop(Adder), "write ros.stop('adder')"),
        (lambda ros: ros.restart(Adder), "write ros.restart('adder')"),
        (lambda ros: ros.logs(3), "write ros.logs('name')"),
        (lambda ros: ros.logs("adder", until=lambda: True), "`until` is a text"),
        (lambda ros: ros.start("relay.py", a=40), "ros.start('relay.py', parameters={'a': 40})"),
        (
            lambda ros: ros.call("/add/set_parameters", SetParameters, parameters=[Parameter("a", value=1.0)]),
            "write `.to_parameter_msg()` after it",
        ),
        (
            lambda ros: ros.call("/add/set_parameters", SetParameters, parameters=Parameter("a", value=1.0)),
            "as in [Parameter('max_speed', value=2.0).to_parameter_msg()]",
        ),
        (
            lambda ros: ros.start("relay.py", "-p", "a:=40"),
            "would not read `-p a:=40`: write ros.start('relay.py', '--ros-args', '-p', 'a:=40')",
        ),
        (
            lambda ros: ros.start("relay.py", "--ros-args -p a:=40"),
            "would not read `--ros-args -p a:=40`: write ros.start('relay.py', '--ros-args', '-p', 'a:=40')",
        ),
        (
            lambda ros: ros.start("relay.py", "-p", "a:=40", "--ros-args"),
            "would not read `-p a:=40`: write ros.start('relay.py', '--ros-args', '-p', 'a:=40')",
        ),
        (
            lambda ros: ros.start("relay.py", "--params-file", "pid.yaml"),
            "would not read `--params-file pid.yaml`: write ros.start('relay.py', '--ros-args', '--params-file', ",
        ),
        (lambda ros: ros.start("relay.py", threads=4), "MultiThreadedExecutor(num_threads=4)"),
        (lambda ros: ros.start(Adder, parameters={"max_speed", 2.0}), "`parameters` is a dict"),
        (lambda ros: ros.call("/add", AddTwoInts, a=1, timeout="2"), "a time limit is a number of seconds"),
        (lambda ros: ros.until(lambda: True, timeout=None), "such as `timeout=5.0`, not None"),
        (lambda ros: ros.wait(Future(), "2"), "a time limit is a number of seconds"),
        (lambda ros: ros.wait_for_service("/add", AddTwoInts, []), "a time limit is a number of seconds"),
        (lambda ros: ros.logs("adder", until="x", timeout=True), "a time limit is a number of seconds"),
        (lambda ros: ros.until(lambda: True, timeout=math.nan), "not nan"),
        (lambda ros: ros.start("relay.py", timeout="long"), "a time limit is a number of seconds"),
    ],
)
def test_what_is_meant_is_written_out(session, wrong, told):
    with pytest.raises(CourseError) as error:
        wrong(session)
    assert told in str(error.value)
    assert session.call("add", AddTwoInts, a=1, b=2).sum == 3  # nothing was started or ended


def test_an_argument_that_a_class_does_not_take_may_be_a_parameter(session):
    class Plain(Node):
        def __init__(self):
            super().__init__("plain")

    class Handed(Node):
        def __init__(self, **kwargs):
            super().__init__("handed", **kwargs)

    class Taken(Node):
        def __init__(self, max_speed):
            super().__init__("taken", max_speed=max_speed)

    for cls in (Plain, Handed):
        with pytest.raises(LiveError, match=rf"ros\.start\({cls.__name__}, parameters=\{{'max_speed': 2\.0\}}\)"):
            session.start(cls, max_speed=2.0)
    with pytest.raises(TypeError, match="unexpected keyword argument 'max_speed'"):
        session.start(Taken, max_speed=2.0)
    with pytest.raises(LiveError, match=r"Taken needs max_speed, .*: ros\.start\(Taken, max_speed=\.\.\.\)"):
        session.start(Taken)


def test_a_file_without_its_ending_is_named_with_it(session, tmp_path):
    (tmp_path / "relay.py").write_text("")
    with pytest.raises(LiveError, match=r"write ros.start\('.*/relay.py'\)"):
        session.start(tmp_path / "relay")


def test_a_class_in_quotation_marks_is_told(session, monkeypatch):
    monkeypatch.setattr(sys.modules["__main__"], "Camera", Node, raising=False)
    with pytest.raises(LiveError, match=r"Camera: it is a class, so write ros.start\(Camera\), without quotation"):
        session.start("Camera")


def test_a_file_of_another_folder_is_named_where_it_is(session, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(session, "_folder", tmp_path)
    (tmp_path / "relay.py").write_text("")
    with pytest.raises(LiveError, match=r"there is no file files/relay.py: write ros.start\('relay.py'\)"):
        session.start("files/relay.py")
    with pytest.raises(LiveError, match=r"has no node or file called relay.py"):
        session.restart("relay.py")


def test_changed_variables_that_programs_need_are_told(session, monkeypatch):
    monkeypatch.setitem(os.environ, "RMW_IMPLEMENTATION", "rmw_other")
    with pytest.raises(LiveError, match="RMW_IMPLEMENTATION has been changed to rmw_other since this session began"):
        session.start(Adder)
    monkeypatch.undo()
    monkeypatch.setitem(os.environ, "PATH", os.environ["PATH"] + ":/nowhere")
    session.start(Adder)
    monkeypatch.setitem(os.environ, "PATH", "/nowhere")
    with pytest.raises(LiveError, match="PATH has been changed to /nowhere since this session began: a program could"):
        session.start(Adder)


def test_a_changed_discovery_range_is_told_at_once(session, monkeypatch):
    monkeypatch.setitem(os.environ, "ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF")
    with pytest.raises(LiveError, match="changed to OFF since this session began with LOCALHOST"):
        session.start(Adder)


def test_a_program_that_was_edited_since_its_start_is_told_at_the_next_call(session, tmp_path):
    path = tmp_path / "teller.py"
    path.write_text(PROGRAM.replace("WORD", "old"))
    session.start(path)
    session.call("tell", Trigger)
    assert session.watch.notices() == []
    path.write_text(PROGRAM.replace("WORD", "new"))
    assert session.call("tell", Trigger).message == "old"
    (notice,) = session.watch.notices()
    assert "still runs the old version of teller.py: start it" in notice and "ros.restart('teller.py')" in notice
    session.restart("teller.py")
    assert session.call("tell", Trigger).message == "new" and session.watch.notices() == []


def test_the_log_of_a_node_has_nothing_of_an_earlier_program_with_its_name(session, tmp_path):
    path = tmp_path / "teller.py"
    path.write_text(PROGRAM.replace("WORD", "old"))
    session.start(path)
    session.call("tell", Trigger)
    assert session.logs("teller", until="old")
    session.stop()
    path.write_text(PROGRAM.replace('    node.get_logger().info("WORD")\n', "").replace("WORD", "new"))
    session.start(path)
    session.call("tell", Trigger)
    assert session.logs("teller") == []
    session.start(Adder)


def test_two_services_of_one_name_in_a_node_are_told(session):
    class Twice(Node):
        def __init__(self):
            super().__init__("twice")
            for _ in range(2):
                self.create_service(Trigger, "same", lambda _, response: response)

    session.start(Twice)
    assert session.watch.notices() == [
        "twice makes 2 services with the name /same: any of them may answer. Give each a name of its own."
    ]
    session.stop("twice")


def test_a_long_wait_for_a_misspelt_service_says_soon_what_there_is(session, capsys):
    began = time.monotonic()
    with pytest.raises(CallTimeout):
        session.call("/addd", AddTwoInts, a=1, b=2, timeout=7.0)
    said = capsys.readouterr().err
    assert "/add" in said or time.monotonic() - began < 3.0


def test_an_exception_that_is_raised_again_is_told_again(session):
    class Raises(Node):
        def __init__(self):
            super().__init__("raises")
            self.create_service(Trigger, "raises", self.tell)

        def tell(self, request, response):
            response.message = reqest  # noqa: F821
            return response

    handle = session.start(Raises)
    for _ in range(2):
        began = time.monotonic()
        with pytest.raises(NodeFailed, match="name 'reqest' is not defined"):
            session.call("raises", Trigger)
        assert time.monotonic() - began < 4.0
    for _ in range(KEPT):
        handle.goal_failed(handle.errors[0])
    assert len(handle.errors) == KEPT and handle.raised == KEPT + 2
    with pytest.raises(NodeFailed, match="name 'reqest' is not defined"):
        session.call("raises", Trigger)
    # An exception that is there before the call goes on to wait, as on a busy machine.
    client = session._calls._client("raises", Trigger)
    send = client.call_async

    def and_wait(request):
        seen, future = handle.raised, send(request)
        assert session.until(lambda: handle.raised > seen)
        return future

    client.call_async = and_wait
    began = time.monotonic()
    with pytest.raises(NodeFailed, match="name 'reqest' is not defined"):
        session.call("raises", Trigger)
    assert time.monotonic() - began < 4.0
    session.stop("raises")


def test_a_program_that_was_killed_is_told_again(session, tmp_path):
    path = tmp_path / "teller.py"
    path.write_text(PROGRAM)
    started = session.start(path)
    os.kill(started.pid, signal.SIGKILL)
    for _ in range(2):
        with pytest.raises(NodeFailed, match="SIGKILL"):
            session.call("tell", Trigger, timeout=3.0)


def test_an_exception_in_a_callback_of_the_sessions_own_node_is_told_once(session):
    heard = []

    def hear(message):
        heard.append(message)
        raise ValueError("no such number")

    publisher = session.node.create_publisher(Int32, "numbers", 10)
    listener = session.node.create_subscription(Int32, "numbers", hear, 10)
    assert session.until(lambda: publisher.get_subscription_count() == 1)
    told = []
    for count in (1, 2, 3):
        publisher.publish(Int32(data=count))
        assert session.until(lambda wanted=count: len(heard) == wanted)
        if count == 1:
            assert session.until(lambda: told.extend(session.watch.notices()) or told)
    assert session.until(lambda: len(session._spinner.errors) == 3)
    session.node.destroy_subscription(listener)
    assert "ros.node raised an exception in a callback: ValueError: no such number" in told[0]
    assert len(told) == 1 and not session.watch.notices()


def test_a_node_that_the_session_spins_is_not_spun_in_a_thread_of_the_reader(session):
    session.watch.notices()
    thread = threading.Thread(target=rclpy.spin, args=(session.node,))
    thread.start()
    thread.join(10.0)
    (told,) = session.watch.notices()
    assert told.startswith("rclpy.spin('_course_session') in a thread does nothing here: ")
    assert not thread.is_alive() and session.call("add", AddTwoInts, a=1, b=2).sum == 3


def test_a_class_without_node_is_told_with_its_line():
    base = type("Base", (), {})
    derived = type("Derived", (base,), {})
    assert no_node(base).endswith("and Base is a class without Node: write `class Base(Node):`")
    assert no_node(derived).endswith("and Derived is a class without Node: derive Derived from Node (from rclpy.node)")
    assert no_node(3).endswith("not int")
