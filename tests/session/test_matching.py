"""Why nothing passes on a topic: another name, another type, or qualities of service that do not fit."""

import os
from collections.abc import Iterator

import pytest
from example_interfaces.action import Fibonacci
from rclpy.action import ActionClient, ActionServer
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Float64, String

from course.errors import LiveError
from course.session.live import Session
from course.session.matching import unmatched, unserved

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
    assert says in unmatched(session.node, listener)


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
    assert unmatched(session.node, listener) == says


def test_what_keeps_a_publisher_from_its_subscription(session):
    class Listener(Node):
        def __init__(self):
            super().__init__("listener")
            self.create_subscription(String, "chatter", print, 10)

    talker = session.node.create_publisher(String, "chatter", BEST_EFFORT)
    assert unmatched(session.node, talker) == "No node subscribes /chatter (std_msgs/msg/String)."
    session.start(Listener)
    assert session.until(lambda: session.node.get_subscriptions_info_by_topic("/chatter"))
    assert "listener subscribes /chatter, but the qualities of service (QoS) do not fit" in unmatched(
        session.node, talker
    )


def test_what_keeps_an_action_client_from_its_server(session):
    class Counter(Node):
        def __init__(self, name):
            super().__init__("counter")
            self.server = ActionServer(self, Fibonacci, name, print)

    client = ActionClient(session.node, Fibonacci, "count")
    assert unserved(session.node, client) == "No node serves the action /count (example_interfaces/action/Fibonacci)."
    session.start(Counter, "counts")
    assert session.until(lambda: "/counts" in unserved(session.node, client))
    assert "Served here: /counts (example_interfaces/action/Fibonacci)." in unserved(session.node, client)


@pytest.mark.parametrize("domain", ["999", "-1", "my robot", "4²"])
def test_a_number_that_is_no_domain_is_told_at_once(monkeypatch, domain):
    monkeypatch.setenv("ROS_DOMAIN_ID", domain)
    with pytest.raises(LiveError, match="a ROS domain is a number from 0 to 232"):
        Session()


def test_a_domain_that_was_changed_in_a_cell_is_told_before_a_program_starts_in_it(session, monkeypatch, tmp_path):
    file = tmp_path / "program.py"
    file.write_text("raise SystemExit")
    monkeypatch.setitem(os.environ, "ROS_DOMAIN_ID", "42")
    with pytest.raises(LiveError, match=r"ROS_DOMAIN_ID was changed to 42 since.*os\.environ\['ROS_DOMAIN_ID'\] = "):
        session.start(file)
