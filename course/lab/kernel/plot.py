"""The plot: any number in the messages of any topic, over the arrival time by the plot's clock."""

import math
import re
import time
from collections import deque
from statistics import median
from typing import Any

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from rclpy.topic_endpoint_info import TopicEndpointInfo

from course.errors import LiveError
from course.lab.kernel import forms
from course.lab.kernel.nodes import of_interest, session
from course.lab.kernel.panels import Changes, Panels, Topic
from course.lab.kernel.plot_clock import CLOCK
from course.ros.names import full
from course.session.live import Session, current
from course.session.logs import decoded

PERIOD = 0.1  # s between two looks
WAITING = 2000  # messages kept between two looks
POINTS = 100  # messages of these that are read, evenly spaced
LONGEST = 1 << 20  # bytes of a message that is read
GAP = 5  # times the usual distance between two messages: a longer one is a gap
LEAST = 0.5  # s that a gap lasts, or each hiccup of a busy machine would be one
USUAL = 5  # last distances, the middle one of which is the usual one
KNOWN = 3  # distances without which nothing is usual yet
NEAR = 0.2  # s by which a page may be wrong about the clock
FIELDS = 500  # of a type that are offered
COMMANDS = "/cmd_vel"
ANY = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)  # compatible with every publisher
KEPT = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)  # gets what was published before, too
NUMBER = re.compile(r"(u?int(8|16|32|64)|float(32|64)|bool|byte|char)\b")
PART = re.compile(r"([A-Za-z]\w*)((?:\[\d+\])?)")


def add(panels: Panels) -> None:
    """Add the plot's method and topics."""
    panels.methods |= {"plot.fields": fields}
    panels.topics |= {"plot": Topic(PlotFeed, PERIOD), "plot.topics": Topic(lambda: Changes(topics), 0.5)}


def topics() -> list[list[str]]:
    """Return the topics with a publisher, each with its type; none without a session.

    Commands are among them as soon as a robot takes some: driving by hand, their publisher exists only meanwhile.
    """
    if (live := current()) is None:
        return []
    found = live.node.get_topic_names_and_types()

    def is_heard(name: str) -> bool:
        return live.node.count_publishers(name) > 0 or (name == COMMANDS and live.node.count_subscribers(name) > 0)

    return sorted([name, kinds[0]] for name, kinds in found if of_interest(name, kinds[0]) and is_heard(name))


def fields(type_name: str) -> list[str]:
    """Return the paths of the numbers in a message, such as `linear.x`; of a list the first, such as `ranges[0]`.

    Raises LiveError when the type cannot be imported.
    """
    return _paths(forms.fields_of(forms.interface("topic", type_name).message))[:FIELDS]


def _paths(found: list[dict[str, Any]], before: str = "") -> list[str]:
    paths = []
    for each in found:
        path = f"{before}{each['name']}"
        match each["kind"]:
            case "message":
                paths += _paths(each["fields"], f"{path}.")
            case "messages":
                paths += _paths(each["fields"], f"{path}[0].")
            case kind if NUMBER.match(each["type"]):
                paths.append(f"{path}[0]" if kind == "list" else path)
    return paths


def parts_of(path: str) -> list[tuple[str, int | None]]:
    """Return the names and numbers on the way to a value: `points[2].x` is [("points", 2), ("x", None)].

    Raises LiveError when the path is invalid.
    """
    found = [PART.fullmatch(part) for part in path.strip().split(".")]
    if not all(found):
        raise LiveError(f"{path!r} is not a field. Write it as in linear.x or ranges[0].")
    return [(part[1], int(part[2][1:-1]) if part[2] else None) for part in found if part]


def value_of(message: Any, parts: list[tuple[str, int | None]]) -> float | None:
    """Return the number at this path; None if there is none, or it is not finite."""
    try:
        for name, number in parts:
            message = getattr(message, name)
            message = message if number is None else message[number]
        value = float(message[0] if isinstance(message, bytes) else message)
    except (AttributeError, IndexError, TypeError, ValueError):
        return None
    return value if math.isfinite(value) else None


def end_of_list(message: Any, parts: list[tuple[str, int | None]]) -> str:
    """Return where the list ends that is too short for this path, as "ranges ends at ranges[359]"; "" if none is."""
    path = ""
    for name, number in parts:
        path += name
        message = getattr(message, name, None)
        if number is None:
            path += "."
            continue
        if not hasattr(message, "__len__"):
            return ""
        if number >= len(message):
            return f"{path} ends at {path}[{len(message) - 1}]" if len(message) else f"{path} is empty"
        message, path = message[number], f"{path}[{number}]."
    return ""


def has_number(found: list[dict[str, Any]], parts: list[tuple[str, int | None]]) -> bool:
    """Return True if there is a number at this path in a message with these fields (`forms.fields_of`)."""
    (name, number), *rest = parts
    each = next((each for each in found if each["name"] == name), None)
    if each is None or (number is not None) != (each["kind"] in ("list", "messages")):
        return False
    if each["kind"] in ("message", "messages"):
        return bool(rest) and has_number(each["fields"], rest)
    return not rest and NUMBER.match(each["type"]) is not None


class Rhythm:
    """The usual distance between the messages of a topic."""

    def __init__(self) -> None:
        """Begin without a message."""
        self._last: float | None = None
        self._distances: deque[float] = deque(maxlen=USUAL)

    def breaks(self, at: float) -> bool:
        """Add the time (s) of the next message; return True if there was a gap before it."""
        last, self._last = self._last, at
        if last is None:
            return False
        distance, known = at - last, self._distances
        gap = len(known) >= KNOWN and distance > max(LEAST, GAP * median(known))
        known.append(distance)
        return gap


def _keeps(publisher: TopicEndpointInfo) -> bool:
    """Return True if a publisher keeps its messages for who comes later."""
    qos = publisher.qos_profile
    return (qos.reliability, qos.durability) == (ReliabilityPolicy.RELIABLE, DurabilityPolicy.TRANSIENT_LOCAL)


class PlotFeed:
    """A feed of one field of one topic."""

    def __init__(self, name: str, field: str):
        """Read `field` of the topic `name`, such as `linear.x` or `ranges[0]`; raises LiveError for an invalid path."""
        self._topic, self._field, self._parts = name, field, parts_of(field)
        self._live: Session | None = None
        self._kind = ""
        self._type: type[Any] | None = None
        self._subscription: Subscription | None = None
        self._qos = ANY  # of the subscription
        self._waiting: deque[tuple[float, float, bytes]] = deque(maxlen=WAITING)
        self._clock: tuple[float, dict[str, Any]] | None = None  # what the page was told, at s of time.monotonic
        self._said: str | None = None
        self._end = ""  # where the list of the last message ends, if it is too short
        self._rhythm = Rhythm()

    def read(self) -> dict[str, Any] | None:
        """Return {"points": [[s, value or None], ...], "says": why there are none, or "", "clock": ...} if it is new.

        The times are those of the plot's clock, which is told as `PlotClock.told` says. A gap, a time in which nothing
        was published, is None instead of a point.
        """
        published, says = self._kind != "", self._listen()
        waiting = [self._waiting.popleft() for _ in range(len(self._waiting))]
        step = math.ceil(len(waiting) / POINTS) or 1
        points: list[list[float | None] | None] = [None] if len(waiting) == WAITING else []  # older ones may be lost
        for number, (came, at, message) in enumerate(waiting):
            if self._rhythm.breaks(came):
                points.append(None)
            if number % step == 0:
                points.append([round(at, 3), self._read(message)])
        if published and not self._kind:
            points.append(None)
        if self._end and not says:
            says = f"In the last message, {self._end}."
        clock = CLOCK.told()
        if not points and says == self._said and self._knows(clock):
            return None
        self._said, self._clock = says, (time.monotonic(), clock)
        return {"points": points, "says": says, "clock": clock}

    def _knows(self, clock: dict[str, Any]) -> bool:
        """Return True if the page knows the time by what it was told last."""
        if self._clock is None:
            return False
        at, told = self._clock
        return abs(told["now"] + told["rate"] * (time.monotonic() - at) - clock["now"]) < NEAR

    def close(self) -> None:
        """End the subscription."""
        if self._live is not None and self._live.ok and self._subscription is not None:
            self._live.node.destroy_subscription(self._subscription)
        self._subscription = None

    def _listen(self) -> str:
        """Subscribe while somebody publishes; return why there can be no data, or "".

        Raises LiveError when the topic's type has no such number.
        """
        live = session()
        if live is not self._live:
            self._subscription, self._live = None, live
        publishers = self._publishers(live)
        kind = dict(live.node.get_topic_names_and_types()).get(self._topic, [""])[0] if publishers else ""
        qos = KEPT if all(map(_keeps, publishers)) else ANY
        heard = self._subscription is not None and self._subscription in live.node.subscriptions
        if kind != self._kind or (kind and (not heard or qos != self._qos)):
            self.close()
            self._kind, self._end = kind, ""
            if kind:
                self._type = forms.interface("topic", kind).message
                if not has_number(forms.fields_of(self._type), self._parts):
                    raise LiveError(f"{self._topic} has no number {self._field}: choose a field from the list.")
                self._qos = qos
                self._subscription = live.node.create_subscription(self._type, self._topic, self._hear, qos, raw=True)
        if kind:
            return ""
        if live.node.count_publishers(self._topic):
            return f"Only cells or the Inspector publish on {self._topic} now, and the plot draws what nodes publish."
        return f"No node publishes on {self._topic} now."

    def _publishers(self, live: Session) -> list[TopicEndpointInfo]:
        """Return the publishers of nodes.

        Publishers in cells do not count: a public check waits for a subscriber, and must not take the plot for one.
        Commands for driving by hand are published in the kernel, too, but count.
        """
        own = live.node.get_fully_qualified_name()
        publishers = live.node.get_publishers_info_by_topic(self._topic)
        return [
            each for each in publishers if self._topic == COMMANDS or full(each.node_name, each.node_namespace) != own
        ]

    def _hear(self, message: bytes) -> None:
        self._waiting.append((time.monotonic(), CLOCK.now(), message))

    def _read(self, message: bytes) -> float | None:
        if self._type is None or len(message) > LONGEST or (read := decoded(message, self._type)) is None:
            return None
        self._end = end_of_list(read, self._parts)
        return value_of(read, self._parts)
