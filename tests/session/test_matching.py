"""Reasons why no message passes on a topic: another name, another type, or qualities of service that do not fit."""

import json
import os
import re
import threading
import time
from collections.abc import Iterator

import pytest
import rclpy
from example_interfaces.action import Fibonacci
from rclpy.action import ActionClient, ActionServer
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Float64, Int32, String
from std_srvs.srv import Trigger

from course.errors import CallTimeout, LiveError
from course.explaining.failure_report import hint_on
from course.ros.rclpy_internals import RCLError
from course.session import guards, live, matching
from course.session.live import TELLING, Session
from course.session.matching import listing, unfit_service, unfit_topics, unlike_clients
from course.session.no_world import no_world
from course.session.offered import may_act, may_serve
from course.world.node import World

BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)


class Talker(Node):
    def __init__(self, topic="chatter", kind=String, qos=10):
        super().__init__("talker")
        self.create_publisher(kind, topic, qos)


@pytest.fixture
def session() -> Iterator[Session]:
    made = Session()
    yield made
    made.close()


@pytest.mark.parametrize(
    ("talker", "says"),
    [
        ({"qos": BEST_EFFORT}, "the publisher offers best_effort and volatile, the subscription asks for reliable"),
        ({"topic": "chat"}, "No node publishes /chatter (std_msgs/msg/String). Of this type, talker publishes /chat."),
        ({"topic": "chat", "kind": Float64}, "No node publishes /chatter (std_msgs/msg/String)."),
    ],
)  # fmt: skip
def test_what_keeps_a_subscription_from_its_publisher(session, talker, says):
    listener = session.node.create_subscription(String, "chatter", print, 10)
    session.start(Talker, **talker)
    topic = f"/{talker.get('topic', 'chatter')}"
    assert session.until(lambda: session.node.get_publishers_info_by_topic(topic))
    assert says in session.apart(listener)


def test_the_line_of_a_node_of_the_course_is_in_its_file_and_in_no_cell(session):
    session.start(World, parameters={"room": "hall"})
    asked = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    session.node.create_subscription(LaserScan, "scan", print, asked)
    assert session.until(lambda: unfit_topics(session.node, {"world": session._handles["world"]}))
    (told,) = unfit_topics(session.node, {"world": session._handles["world"]})
    assert re.search(r"\n  node\.py, line \d+\n    self\._\w+ = self\.create_publisher\(LaserScan", told), told


def test_another_type_is_named(session, tmp_path):
    file = tmp_path / "talker.py"
    file.write_text(
        "import rclpy\nfrom std_msgs.msg import Float64\n"
        "rclpy.init()\nnode = rclpy.create_node('talker')\n"
        "node.create_publisher(Float64, 'chatter', 10)\nrclpy.spin(node)\n"
    )
    listener = session.node.create_subscription(String, "chatter", print, 10)
    session.start(file)
    assert session.until(lambda: session.node.get_publishers_info_by_topic("/chatter"))
    says = "talker publishes /chatter with the type std_msgs/msg/Float64; it must be std_msgs/msg/String."
    assert session.apart(listener) == says


def test_a_client_of_another_type_than_the_server_is_told_after_a_wait_in_vain(session, tmp_path):
    """Its requests go nowhere, and neither side hears of it."""
    file = tmp_path / "asker.py"
    file.write_text(
        "import rclpy\nfrom std_srvs.srv import SetBool\n"
        "rclpy.init()\nnode = rclpy.create_node('asker')\n"
        "node.create_client(SetBool, 'served')\nrclpy.spin(node)\n"
    )
    session.node.create_service(Trigger, "served", print)
    session.start(file)
    assert session.until(lambda: unlike_clients(session.node))
    assert not session.until(lambda: False, timeout=TELLING)
    says = "asker has a client of /served with the type std_srvs/srv/SetBool, and this notebook serves it with"
    assert any(text.startswith(says) for text in session.watch.notices())


@pytest.mark.parametrize(
    ("service", "source", "may"),
    [
        ("/add", "import rclpy\nnode.create_service(Add, 'add', f)\n", True),
        ("/add", "import rclpy\nnode.create_service(Add, name, f)\n", True),
        ("/add", "import rclpy\nnode.create_service(Add, 'sum', f)\n", False),
        (
            "/add",
            "class Client(Node):\n    def __init__(self):\n        self.create_client(Add, 'add')\nrclpy\n",
            False,
        ),
        ("/add", "print('x')\n", False),
        ("/add", "from course.nodes.adder import main\nmain()\n", True),
        ("/add", "", True),
        ("/cruise/set_parameters", "import rclpy\nrclpy.create_node('cruise')\n", True),
        ("/cruise/set_parameters", "import rclpy\nrclpy.create_node('pid')\n", False),
    ],
)
def test_a_program_that_has_died_is_the_cause_only_if_it_may_have_served_this(service, source, may):
    assert may_serve(source, service) is may


@pytest.mark.parametrize(
    ("source", "may"),
    [
        ("ActionServer(self, Lift, '/lift', self.execute)", True),
        ("ActionServer(self, Lift, '/left', self.execute)", False),
        ("from rclpy.action import ActionServer\nclass Lift(Node):\n    pass\n", False),
        ("", True),
    ],
)
def test_a_program_that_has_died_is_the_cause_only_if_it_may_have_had_this_action(source, may):
    assert may_act(source, "/lift") is may


def test_what_keeps_a_publisher_from_its_subscription(session):
    class Listener(Node):
        def __init__(self):
            super().__init__("listener")
            self.create_subscription(String, "chatter", print, 10)

    talker = session.node.create_publisher(String, "chatter", BEST_EFFORT)
    assert session.apart(talker) == "No node subscribes to /chatter (std_msgs/msg/String)."
    session.start(Listener)
    assert session.until(lambda: session.node.get_subscriptions_info_by_topic("/chatter"))
    assert (
        "listener subscribes to /chatter, but the quality of service (QoS) settings are incompatible"
        in session.apart(talker)
    )


def test_what_keeps_an_action_client_from_its_server(session):
    class Counter(Node):
        def __init__(self, name):
            super().__init__("counter")
            self.server = ActionServer(self, Fibonacci, name, print)

    client = ActionClient(session.node, Fibonacci, "count")
    assert session.apart(client) == "No node serves the action /count (example_interfaces/action/Fibonacci)."
    session.start(Counter, "counts")
    assert session.until(lambda: "/counts" in session.apart(client))
    assert "Served here: /counts (example_interfaces/action/Fibonacci)." in session.apart(client)


@pytest.mark.parametrize("domain", ["999", "-1", "my robot", "4²"])
def test_a_number_that_is_no_domain_is_told_at_once(monkeypatch, domain):
    monkeypatch.setenv("ROS_DOMAIN_ID", domain)
    with pytest.raises(LiveError, match="a ROS domain is a number from 0 to 232"):
        Session()


def test_a_domain_that_was_changed_in_a_cell_is_told_before_a_program_starts_in_it(session, monkeypatch, tmp_path):
    file = tmp_path / "program.py"
    file.write_text("raise SystemExit")
    other = "42" if session.domain_id != 42 else "43"
    monkeypatch.setitem(os.environ, "ROS_DOMAIN_ID", other)
    changed = rf"ROS_DOMAIN_ID has been changed to {other} since.*os\.environ\['ROS_DOMAIN_ID'\] = "
    with pytest.raises(LiveError, match=changed):
        session.start(file)


def test_a_wait_in_vain_tells_once_of_topics_whose_qualities_of_service_do_not_fit(session):
    session.node.create_subscription(String, "chatter", print, 10)
    session.start(Talker, qos=BEST_EFFORT)
    assert session.until(lambda: session.node.get_publishers_info_by_topic("/chatter"))
    assert session.watch.notices() == []
    assert not session.until(lambda: False, timeout=TELLING)
    assert not session.until(lambda: False, timeout=TELLING)
    (told,) = session.watch.notices()
    assert told.startswith("talker publishes /chatter and this notebook subscribes to it, but the quality of")
    assert "offers best_effort and volatile, the subscription asks for reliable and volatile." in told


@pytest.mark.parametrize("others", [[], ["ros.node.create_subscription(String, 'chatter', heard, 10)\n"]])
def test_the_line_of_one_end_is_told_only_if_no_other_cell_could_have_made_it(session, monkeypatch, others):
    line = "ros.node.create_subscription(String, 'chatter', print, 10)\n"
    monkeypatch.setattr(matching, "cells_run", lambda: [*others, line, line])  # a cell that was run again
    session.node.create_subscription(String, "chatter", print, 10)
    session.start(Talker, qos=BEST_EFFORT)
    assert session.until(lambda: session.node.get_publishers_info_by_topic("/chatter"))
    (told,) = matching.unfit_topics(session.node, {})
    assert (line.strip() in told) == (not others)


def test_a_wait_in_vain_tells_once_of_a_topic_of_nearly_the_name_of_a_published_one(session):
    class Own(Node):
        """It publishes what it subscribes to nearly, and does not mean it."""

        def __init__(self):
            super().__init__("own")
            self.create_subscription(String, "said", print, 10)
            self.create_publisher(String, "saids", 10)

    for topic in ("chater", "robot_2/chatter", "robot_1/chatter"):
        session.node.create_subscription(String, topic, print, 10)
    session.node.create_publisher(String, "robot_1/chatter", 10)
    session.start(Own)
    session.start(Talker)
    assert session.until(lambda: session.node.count_publishers("/chatter"))
    for _ in range(2):
        assert not session.until(lambda: False, timeout=TELLING)
    assert session.watch.notices() == [
        "this notebook subscribes to /chater, which no node publishes. Did you mean /chatter, which talker publishes?"
    ]


def test_a_call_that_no_server_meets_tells_the_qualities_of_service_of_both_and_the_line(session, tmp_path):
    file = tmp_path / "server.py"
    file.write_text(
        "import rclpy\nfrom rclpy.qos import qos_profile_sensor_data\nfrom std_srvs.srv import Trigger\n"
        "rclpy.init()\nnode = rclpy.create_node('server')\n"
        "node.create_service(Trigger, '/ask', print, qos_profile=qos_profile_sensor_data)\nrclpy.spin(node)\n"
    )
    session.start(file)
    with pytest.raises(CallTimeout) as told:
        session.call("/ask", Trigger, timeout=1.0)
    assert "the server has best_effort and volatile, the client reliable and volatile" in str(told.value)
    assert "\n  server.py, line 6\n    node.create_service(Trigger, '/ask'" in str(told.value)


def test_a_server_whose_qualities_of_service_fit_is_never_blamed_for_them(session, tmp_path):
    """On a busy machine the graph may know a server a while before the client is matched."""
    file = tmp_path / "server.py"
    file.write_text(
        "import rclpy\nfrom std_srvs.srv import Trigger\nrclpy.init()\nnode = rclpy.create_node('server')\n"
        "node.create_service(Trigger, '/ask', lambda request, response: response)\nrclpy.spin(node)\n"
    )
    session.start(file)
    session.call("/ask", Trigger)
    assert session.node.get_publishers_info_by_topic("rr/askReply", no_mangle=True)
    assert unfit_service(session.node, "/ask", {}) == ""


def test_the_lines_of_both_ends_are_told(session, tmp_path):
    for name, end in {"talker": "publisher(String, '/chatter', qos_profile_sensor_data)",
                      "listener": "subscription(String, 'chatter', print, 10)"}.items():  # fmt: skip
        file = tmp_path / f"{name}.py"
        file.write_text(
            "import rclpy\nfrom rclpy.qos import qos_profile_sensor_data\nfrom std_msgs.msg import String\n"
            f"rclpy.init()\nnode = rclpy.create_node('{name}')\nnode.create_{end}\nrclpy.spin(node)\n"
        )
        session.start(file)
    assert not session.until(lambda: False, timeout=1.0)
    (told,) = session.watch.notices()
    assert "\n  talker.py, line 6\n    node.create_publisher(" in told
    assert "\n  listener.py, line 6\n    node.create_subscription(" in told


class Asleep(Node):
    """A node without a service of its own."""

    def __init__(self, **kwargs):
        super().__init__("asleep", start_parameter_services=False, **kwargs)


def test_a_call_to_a_node_that_has_created_no_service_names_the_node(session):
    with pytest.raises(CallTimeout, match=r"There are no services here: has the node been started\?"):
        session.call("/ask", Trigger, timeout=0.5)
    session.start(Asleep)
    with pytest.raises(
        CallTimeout, match=r"asleep: running, but without any service. Is `create_service\(...\)` reached"
    ):
        session.call("/ask", Trigger, timeout=0.5)


@pytest.mark.parametrize("others", [True, False])
def test_a_program_that_has_created_no_service_is_named_soon(session, tmp_path, others):
    """Also while another node serves something; and that one is not offered as if it were meant."""
    if others:
        session.start(Asking)
    file = tmp_path / "motor.py"
    file.write_text(
        "import rclpy\nfrom rclpy.node import Node\nfrom std_srvs.srv import Trigger\n\n\nclass Motor(Node):\n"
        "    def __init__(self):\n        super().__init__('motor')\n\n    def setup(self):\n"
        "        self.create_service(Trigger, '/motor', print)\n\n\nrclpy.init()\nrclpy.spin(Motor())\n"
    )
    session.start(file)
    began = time.monotonic()
    with pytest.raises(CallTimeout) as told:
        session.call("/motor", Trigger, timeout=9.0)
    assert time.monotonic() - began < 4.0
    assert str(told.value).endswith("motor.py: running, but without any service. Is `create_service(...)` reached?")


def test_every_program_without_a_service_is_named_also_one_whose_text_makes_none(session, tmp_path):
    for name, line in {"maker": "lambda: node.create_service(Trigger, '/motor', print)", "stub": "pass"}.items():
        text = f"import rclpy\nfrom std_srvs.srv import Trigger\nrclpy.init()\nnode = rclpy.create_node('{name}')\n"
        (tmp_path / f"{name}.py").write_text(f"{text}{line}\nrclpy.spin(node)\n")
        session.start(tmp_path / f"{name}.py")
    with pytest.raises(CallTimeout, match=r"maker\.py and stub\.py: running, but without any service\."):
        session.call("/motor", Trigger, timeout=0.5)


def test_a_program_that_creates_its_service_later_is_waited_for(session, tmp_path):
    file = tmp_path / "motor.py"
    file.write_text(
        "import rclpy\nfrom std_srvs.srv import Trigger\nrclpy.init()\nnode = rclpy.create_node('motor')\n"
        "node.create_timer(2.0, lambda: node.create_service(Trigger, '/motor', lambda asked, answer: answer))\n"
        "rclpy.spin(node)\n"
    )
    session.start(file)
    session.call("/motor", Trigger, timeout=9.0)


class Asking(Node):
    """A node that serves something else."""

    def __init__(self):
        super().__init__("asking")
        self.create_service(Trigger, "/camera", print)


def test_a_service_of_another_type_is_told_before_the_time_is_over(session, tmp_path):
    file = tmp_path / "server.py"
    file.write_text(
        "import rclpy\nfrom std_srvs.srv import SetBool\n"
        "rclpy.init()\nnode = rclpy.create_node('server')\n"
        "node.create_service(SetBool, 'ask', print)\nrclpy.spin(node)\n"
    )
    session.start(file)
    began = time.monotonic()
    says = "no server for /ask. It is served with the type std_srvs/srv/SetBool, but you use std_srvs/srv/Trigger."
    with pytest.raises(CallTimeout, match=re.escape(says)):
        session.call("/ask", Trigger, timeout=30.0)
    file.write_text(file.read_text().replace("SetBool, 'ask'", "SetBool, 'asks'"))
    session.start(file)
    with pytest.raises(CallTimeout, match=r"no server for /ask\. Served here: /asks\."):
        session.call("/ask", Trigger, timeout=30.0)
    assert time.monotonic() - began < 20.0


@pytest.mark.matrix  # test_a_service_that_is_not_made_is_told_with_its_line
def test_a_service_that_only_a_callback_makes_is_told_when_it_is_missing(session, tmp_path):
    (tmp_path / "server.py").write_text(
        "import rclpy\nfrom std_srvs.srv import Trigger\n"
        "def later(request, response):\n    node.create_service(Trigger, 'ask', print)\n"
        "rclpy.init()\nnode = rclpy.create_node('server')\n"
        "node.create_service(Trigger, 'asks', later)\nrclpy.spin(node)\n"
    )
    session.start(tmp_path / "server.py")
    with pytest.raises(
        CallTimeout, match=r"Served here: /asks\.\n  server.py, line 4, in later\n.*\nThis is in a callback"
    ):
        session.call("/ask", Trigger, timeout=1.0)


def test_a_wait_for_what_nobody_has_received_names_the_server_that_is_missing(session, monkeypatch, capsys):
    client = ActionClient(session.node, Fibonacci, "fibonaci")
    says = "No node serves the action /fibonaci (example_interfaces/action/Fibonacci)."
    with pytest.raises(CallTimeout, match=re.escape(f"nothing arrived within 0.1 s. {says}")):
        session.wait(client.send_goal_async(Fibonacci.Goal()), timeout=0.1)
    asks = session.node.create_client(Trigger, "/ask")
    with pytest.raises(CallTimeout, match=r"nothing arrived within 0.1 s. No node serves /ask."):
        session.wait(asks.call_async(Trigger.Request()), timeout=0.1)
    monkeypatch.setattr(guards, "TELLING", 0.1)
    threading.Timer(1.0, ActionServer, (session.node, Fibonacci, "fibonaci", print)).start()
    assert client.wait_for_server()
    assert f"still waiting for a server. {says}" in capsys.readouterr().err


def test_a_blocking_call_to_a_service_that_nobody_serves_says_so_and_one_that_is_served_says_nothing(
    session, monkeypatch, capsys
):
    monkeypatch.setattr(guards, "TELLING", 0.3)
    asks = session.node.create_client(Trigger, "/ask")
    assert asks.call(Trigger.Request(), 1.0) is None
    said = capsys.readouterr().err
    assert said.startswith("`call(...)` still waits for an answer from /ask. There are no services here")
    future = asks.call_async(Trigger.Request())
    rclpy.spin_until_future_complete(session.node, future, timeout_sec=1.0)
    assert "The future is still not done. There are no services here" in capsys.readouterr().err

    class Late(Node):
        def __init__(self):
            super().__init__("late")
            self.go_on = threading.Event()
            self.create_service(Trigger, "/ask", self.ask)

        def ask(self, request, response):
            self.go_on.wait(20)
            return response

    late = session.start(Late)
    assert asks.wait_for_service(10.0)
    threading.Timer(1.0, late.node.go_on.set).start()
    assert asks.call(Trigger.Request(), 20.0) is not None
    assert capsys.readouterr().err == ""


def test_scans_that_are_waited_for_without_a_world(session, tmp_path, capsys):
    cell = {"cell_type": "code", "source": "seen = []\nros.start(World)", "metadata": {}, "outputs": [], "id": "a"}
    page = {"cells": [cell | {"execution_count": None}], "metadata": {}, "nbformat": 4, "nbformat_minor": 5}
    listener = session.node.create_subscription(LaserScan, "scan", print, 10)
    says = "No node publishes /scan, because no world is running. "
    start = "Start one: `ros.start(World)`, with `from course.world.node import World`."
    assert no_world(session.node, tmp_path) == says + start
    (tmp_path / "ai.ipynb").write_text(json.dumps(page))
    assert no_world(session.node, tmp_path) == f"{says}Run the cell of ai.ipynb that begins with `seen = []`."
    for _ in range(2):
        assert not session.until(lambda: False, timeout=1.2)
    assert capsys.readouterr().err.count(says) == 1
    publisher = session.node.create_publisher(LaserScan, "scan", 10)
    assert session.until(lambda: not no_world(session.node, tmp_path))
    session.node.destroy_subscription(listener)
    session.node.destroy_publisher(publisher)


def test_a_topic_that_has_another_type_in_this_kernel_is_named_with_both_types(monkeypatch):
    session = live.live()
    session.node.create_publisher(Int32, "numbers", 10)

    class Listener(Node):
        def __init__(self):
            super().__init__("listener")
            self.create_subscription(String, "numbers", print, 10)

    try:
        with pytest.raises(RCLError) as refused:
            session.start(Listener)
        assert hint_on(refused.value) == (
            "Hint: this notebook publishes /numbers with the type std_msgs/msg/Int32, and your line uses "
            "std_msgs/msg/String. A topic has one type: use the same on both sides, or another name."
        )
    finally:
        session.close()


def test_of_many_names_those_most_like_the_wanted_one_are_listed():
    names = [f"/motor_service/{name}" for name in "abcdefghij"] + ["/motors/enable"]
    assert listing(names, "/motors/enabled").endswith(", /motors/enable and 3 more")
    assert listing(["/b", "/a"], "/c") == "/a, /b"
