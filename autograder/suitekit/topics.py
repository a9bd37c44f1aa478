"""The grader's ends of a topic: a publisher for a student's node, and a listener that notes when each message came."""

import itertools
import statistics
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeVar, cast

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from autograder.suitekit.ros import Ros, graph, published, sensible
from course.foundation.waiting import wait_until

PUBLISH, SUBSCRIBE = True, False
OF_NODES = {"/rosout", "/parameter_events", "/clock"}  # topics that every node has, or any may have
RATED = 11  # gaps between messages, by which a rate is measured: an odd number, so that one of them is the median
DEPTH = 50  # messages that may wait to be read

Found = TypeVar("Found")


class Heard(NamedTuple):
    """A message, and when it came (s of time.monotonic)."""

    time: float
    message: Any
    published: float = 0.0  # s of its publisher's clock


class Rate(NamedTuple):
    """The rate (Hz) at which something was published, and whether it was right: that of bursts is not."""

    hertz: float
    right: bool


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

    def rate(self, low: float, high: float, timeout: float, alive: Callable[[], bool] = lambda: True) -> Rate | None:
        """Return how often messages are published, of those within `timeout` s; None when RATED or fewer came.

        It is right as soon as RATED in a row had a rate (Hz) from `low` to `high`: a busy machine delays some messages,
        and a later row is free of that, but a program of another rate never has such a row.
        """
        before = len(self.heard)
        found = self.wait(lambda heard: steady_rate(heard[before:], low, high), timeout, alive)
        times = [each.published for each in self.heard[before:]]
        if found or len(times) <= RATED:
            return Rate(found, True) if found else None
        return Rate((len(times) - 1) / (times[-1] - times[0] or 1e-9), False)

    def _subscribe(self, reliability: ReliabilityPolicy) -> None:
        self._reliability = reliability
        self._subscription = self._ros.node.create_subscription(
            # rclpy 7.1.6 declares one argument, and gives the message's times to a callback that takes two.
            self._kind,
            self._topic,
            cast(Callable[[Any], None], self._hear),
            QoSProfile(depth=DEPTH, reliability=reliability),
        )

    def _hear(self, message: Any, info: dict[str, int]) -> None:
        with self._news:
            self.heard.append(Heard(time.monotonic(), sensible(message), published(info)))
            self._news.notify_all()


def steady_rate(heard: Sequence[Heard], low: float, high: float) -> float:
    """Return the rate (Hz) at which the last messages were published, RATED gaps, if it lies between two; 0 otherwise.

    The mean of the gaps must, and their median, which messages in bursts do not have right.  Times are the publisher's,
    which no load of the grader's side changes; that of arrival must not tell something else altogether.
    """
    last = heard[-RATED - 1 :]
    if len(last) <= RATED or last[-1].published <= last[0].published or last[-1].time <= last[0].time:
        return 0.0
    gap = statistics.median(later.published - earlier.published for earlier, later in itertools.pairwise(last))
    mean = RATED / (last[-1].published - last[0].published)
    arrived = RATED / (last[-1].time - last[0].time)
    right = low <= mean <= high and 1 / high <= gap <= 1 / low and low / 2 <= arrived <= 2 * high
    return mean if right else 0.0


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
