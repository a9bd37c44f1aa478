"""The grader's ends of a topic: what a student's node hears, and what is heard of it, each with its moment."""

import threading
import time
from collections.abc import Callable
from typing import Any, NamedTuple

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from autograder.suitekit.ros import Ros, graph, sensible
from course.waiting import wait_until

DEPTH = 50


class Heard(NamedTuple):
    """A message, and when it came (time.monotonic, s)."""

    time: float
    message: Any


def speaker(ros: Ros, topic: str, kind: type):
    """A publisher that fits every subscription: reliable, and late subscribers are told what was said before."""
    return ros.node.create_publisher(kind, topic, QoSProfile(depth=DEPTH, durability=DurabilityPolicy.TRANSIENT_LOCAL))


class Listener:
    """Every message that comes on a topic, in order."""

    def __init__(self, ros: Ros, topic: str, kind: type):
        """Make it before the clients of the same node: who has answered one of these is known to hear this as well."""
        self.heard: list[Heard] = []
        self._ros, self._topic, self._kind = ros, topic, kind
        self._news = threading.Condition()
        self._subscribe(ReliabilityPolicy.RELIABLE)

    @property
    def ready(self) -> bool:
        """Whether somebody publishes on the topic, and is heard."""
        publishers = graph(self._ros.node.get_publishers_info_by_topic, self._topic)
        offered = {publisher.qos_profile.reliability for publisher in publishers}
        if offered == {ReliabilityPolicy.BEST_EFFORT} and self._reliability == ReliabilityPolicy.RELIABLE:
            self._ros.node.destroy_subscription(self._subscription)
            self._subscribe(ReliabilityPolicy.BEST_EFFORT)
        return self._subscription.get_publisher_count() > 0

    def wait(self, enough: Callable[[list[Heard]], Any], timeout: float, alive: Callable[[], bool] = lambda: True):
        """Wait for `enough(heard)` to be true, and return it; None after `timeout` s or when no longer `alive`."""
        return wait_until(lambda: enough(self.heard), timeout, news=self._news, unless=lambda: not alive()) or None

    def _subscribe(self, reliability: ReliabilityPolicy) -> None:
        self._reliability = reliability
        self._subscription = self._ros.node.create_subscription(
            self._kind, self._topic, self._hear, QoSProfile(depth=DEPTH, reliability=reliability)
        )

    def _hear(self, message) -> None:
        with self._news:
            self.heard.append(Heard(time.monotonic(), sensible(message)))
            self._news.notify_all()
