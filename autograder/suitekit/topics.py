"""The grader's ends of a topic: a publisher for a student's node, and a listener that notes when each message came."""

import threading
import time
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from autograder.suitekit.ros import Ros, graph, sensible
from course.foundation.waiting import wait_until

PUBLISH, SUBSCRIBE = True, False
OF_NODES = {"/rosout", "/parameter_events", "/clock"}  # topics that every node has, or any may have
DEPTH = 50  # messages that may wait to be read

Found = TypeVar("Found")


class Heard(NamedTuple):
    """A message, and when it came (s of time.monotonic)."""

    time: float
    message: Any
    published: float = 0.0  # s of its publisher's clock; only of an action's feedback


def speaker(ros: Ros, topic: str, kind: type) -> Any:
    """A publisher that fits every subscription: reliable, and late subscribers get what was published before."""
    return ros.node.create_publisher(kind, topic, QoSProfile(depth=DEPTH, durability=DurabilityPolicy.TRANSIENT_LOCAL))


class Listener:
    """A subscription that keeps every message of a topic, in order."""

    def __init__(self, ros: Ros, topic: str, kind: type):
        """Make it before the node's clients: a program that has answered one of them has then found this as well."""
        self.heard: list[Heard] = []
        self._ros, self._topic, self._kind = ros, topic, kind
        self._news = threading.Condition()
        self._subscribe(ReliabilityPolicy.RELIABLE)

    @property
    def ready(self) -> bool:
        """Return True if somebody publishes on the topic, with a quality of service that is heard here."""
        publishers = graph(self._ros.node.get_publishers_info_by_topic, self._topic)
        offered = {publisher.qos_profile.reliability for publisher in publishers}
        if offered == {ReliabilityPolicy.BEST_EFFORT} and self._reliability == ReliabilityPolicy.RELIABLE:
            self._ros.node.destroy_subscription(self._subscription)
            self._subscribe(ReliabilityPolicy.BEST_EFFORT)
        return self._subscription.get_publisher_count() > 0

    def wait(
        self, enough: Callable[[list[Heard]], Found], timeout: float, alive: Callable[[], bool] = lambda: True
    ) -> Found | None:
        """Wait until `enough(heard)` is true, and return it; None after `timeout` s or when no longer `alive`."""
        return wait_until(lambda: enough(self.heard), timeout, news=self._news, unless=lambda: not alive()) or None

    def _subscribe(self, reliability: ReliabilityPolicy) -> None:
        self._reliability = reliability
        self._subscription = self._ros.node.create_subscription(
            self._kind, self._topic, self._hear, QoSProfile(depth=DEPTH, reliability=reliability)
        )

    def _hear(self, message: Any) -> None:
        with self._news:
            self.heard.append(Heard(time.monotonic(), sensible(message)))
            self._news.notify_all()


def own_topics(ros: Ros, publish: bool = SUBSCRIBE) -> list[tuple[str, str]]:
    """The topics with their types that the program's nodes subscribe, or publish; not those that every node has."""
    query = (
        ros.node.get_publisher_names_and_types_by_node if publish else ros.node.get_subscriber_names_and_types_by_node
    )
    found = {(topic, kinds[0]) for node in ros.others() for topic, kinds in graph(query, *node)}
    return sorted((topic, kind) for topic, kind in found if topic not in OF_NODES and "/_action/" not in topic)


def short(kind: str) -> str:
    """The name of a message type as the tasks have it: std_msgs/Float64."""
    return kind.replace("/msg/", "/")
