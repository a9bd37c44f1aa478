"""The grader's ends of a topic: a publisher, and a listener that keeps messages with their times."""

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
OF_NODES = {"/rosout", "/parameter_events", "/clock"}  # topics that every node has or may have
RATED = 11  # gaps between messages for measuring a rate: an odd number, so that one gap is the median
DEPTH = 50  # messages that may wait to be read

Found = TypeVar("Found")


class Heard(NamedTuple):
    """A message, and its arrival time (s of time.monotonic)."""

    time: float
    message: Any
    published: float = 0.0  # s of its publisher's clock


class Rate(NamedTuple):
    """A publishing rate (Hz), and whether it was right; publishing in bursts is not."""

    hertz: float
    right: bool


def speaker(ros: Ros, topic: str, kind: type) -> Any:
    """Return a publisher that fits every subscription: reliable, and transient local for late subscribers."""
    return ros.node.create_publisher(kind, topic, QoSProfile(depth=DEPTH, durability=DurabilityPolicy.TRANSIENT_LOCAL))


class Listener:
    """A subscription that keeps every message of a topic, in order."""

    def __init__(self, ros: Ros, topic: str, kind: type):
        """Subscribe, before the node's clients are made: a program that answers one of them has found this, too."""
        self.heard: list[Heard] = []
        self._ros, self._topic, self._kind = ros, topic, kind
        self._news = threading.Condition()
        self._subscribe(ReliabilityPolicy.RELIABLE)

    @property
    def ready(self) -> bool:
        """Return True if somebody publishes on the topic with a compatible quality of service."""
        publishers = graph(self._ros.node.get_publishers_info_by_topic, self._topic)
        offered = {publisher.qos_profile.reliability for publisher in publishers}
        if offered == {ReliabilityPolicy.BEST_EFFORT} and self._reliability == ReliabilityPolicy.RELIABLE:
            self._ros.node.destroy_subscription(self._subscription)
            self._subscribe(ReliabilityPolicy.BEST_EFFORT)
        return self._subscription.get_publisher_count() > 0

    @property
    def best_effort(self) -> bool:
        """Return True if `ready` has found that the topic is published best effort alone."""
        return self._reliability == ReliabilityPolicy.BEST_EFFORT

    def wait(
        self, enough: Callable[[list[Heard]], Found], timeout: float, alive: Callable[[], bool] = lambda: True
    ) -> Found | None:
        """Wait until `enough(heard)` is true, and return it; None after `timeout` s or when no longer `alive`."""
        return wait_until(lambda: enough(self.heard), timeout, news=self._news, unless=lambda: not alive()) or None

    def rate(self, low: float, high: float, timeout: float, alive: Callable[[], bool] = lambda: True) -> Rate | None:
        """Return the rate of the messages within `timeout` s; None if RATED or fewer came.

        It is right as soon as RATED consecutive gaps have a rate (Hz) from `low` to `high`: a busy machine may delay
        some messages but not all, whereas a program of another rate never has such gaps.
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
            # rclpy 7.1.6 declares callbacks of one argument, but passes the message's times to a callback that takes
            # two.
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
    """Return the rate (Hz) of the last messages, over RATED gaps, if it is from `low` to `high`; 0 otherwise.

    Both the mean and the median of the gaps must fit, so that bursts do not.  The publisher's times are used, because
    load on the grader's side does not change them; the arrival times must not contradict them altogether.
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
    """Return the topics with types that the program's nodes subscribe to, or publish, without those of every node."""
    query = (
        ros.node.get_publisher_names_and_types_by_node if publish else ros.node.get_subscriber_names_and_types_by_node
    )
    found = {(topic, kinds[0]) for node in ros.others() for topic, kinds in graph(query, *node)}
    return sorted((topic, kind) for topic, kind in found if topic not in OF_NODES and "/_action/" not in topic)


def short(kind: str) -> str:
    """Return the name of a message type in the form of the tasks: std_msgs/Float64."""
    return kind.replace("/msg/", "/")
