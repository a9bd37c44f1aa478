"""What nodes log, collected from /rosout and shown in a notebook as a table that folds away."""

import html
import math
import re
import threading
from collections import deque
from dataclasses import dataclass

from rcl_interfaces.msg import Log
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import deserialize_message

from course.waiting import wait_until

LEVELS = {10: "DEBUG", 20: "INFO", 30: "WARN", 40: "ERROR", 50: "FATAL"}
KEPT = 5000


@dataclass(frozen=True)
class Entry:
    """One line of a log (rcl_interfaces/msg/Log)."""

    level: str
    node: str
    text: str

    def __str__(self) -> str:
        return f"[{self.level}] [{self.node}]: {self.text}"


class Logs(list[Entry]):
    """Entries in the order in which they came; a notebook shows them folded."""

    def __str__(self) -> str:
        return "\n".join(map(str, self))

    __repr__ = __str__

    def _repr_html_(self) -> str:
        rows = "\n".join(html.escape(str(entry)) for entry in self)
        return f"<details><summary>{len(self)} log lines</summary><pre>{rows}</pre></details>"


LINE = re.compile(r"(?:\x1b\[\d*m)?\[(DEBUG|INFO|WARN|ERROR|FATAL)\] \[([\w./]+)\]: (.*?)(?:\x1b\[\d*m)?$")


def program_logs(name: str, output: str, ends: list[str]) -> list[Entry]:
    """What a program wrote on its terminal, line by line, and how it ended: log lines of ROS and what it printed."""
    entries = [entry_of_line(name, line) for line in output.splitlines()]
    return [*entries, *(Entry("ENDED", name, end) for end in ends)]


def entry_of_line(name: str, line: str) -> Entry:
    """What the program called `name` wrote in a line: a log line of ROS, or something that it printed."""
    found = LINE.match(line)
    return Entry(found[1], found[2], found[3]) if found else Entry("PRINT", name, line)


def node_of_line(line: str) -> str | None:
    """The node that has logged this line of a terminal; None for what no node has logged."""
    found = LINE.match(line.rstrip("\n"))
    return found[2] if found else None


def entry_of(message: bytes) -> Entry:
    """The entry in a message of /rosout."""
    log = deserialize_message(message, Log)
    return Entry(LEVELS.get(log.level, str(log.level)), log.name, log.msg)


def node_of(message: bytes) -> str:
    """The node in a message of /rosout, a hundred times faster than `entry_of`.

    In the message's CDR encoding, four bytes of header, a stamp and the level come before the length of its name.
    """
    end = 20 + int.from_bytes(message[16:20], "little" if message[1] else "big")
    return message[20 : end - 1].decode(errors="replace")


class LogBook:
    """Collects /rosout on the given node: as bytes, because reading each line at once would slow every call down."""

    def __init__(self, node: Node):
        self._messages: deque[bytes] = deque(maxlen=KEPT)
        self.count = 0  # of all that have come
        self._changed = threading.Condition(threading.RLock())
        node.create_subscription(
            Log, "/rosout", self._on_log, QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL), raw=True
        )

    def _on_log(self, message: bytes) -> None:
        with self._changed:
            self._messages.append(message)
            self.count += 1
            self._changed.notify_all()

    def read(self, node: str | None = None) -> Logs:
        """The entries of `node`, or all."""
        with self._changed:
            messages = list(self._messages)
        return Logs(entry for entry in map(entry_of, messages) if node is None or entry.node == node.lstrip("/"))

    def since(self, count: int) -> tuple[int, list[bytes]]:
        """How many have come by now, and the newest of those after the first `count`, as `entry_of` takes them."""
        with self._changed:
            new = min(self.count - count, len(self._messages))
            return self.count, list(self._messages)[len(self._messages) - new :]

    def forget(self, node: str, before: float = math.inf) -> None:
        """Drop the entries of `node`: those stamped before a time (s, as `time.time()` gives it), or all."""

        def stays(log: Log) -> bool:
            return log.name != node or log.stamp.sec + 1e-9 * log.stamp.nanosec >= before

        with self._changed:
            kept = [m for m in self._messages if stays(deserialize_message(m, Log))]
            self._messages.clear()
            self._messages.extend(kept)

    def wait_for(self, text: str, node: str | None = None, timeout: float = 5.0) -> bool:
        """Wait until a line (of `node`) that contains `text` is there; False after `timeout` s."""
        return wait_until(lambda: any(text in entry.text for entry in self.read(node)), timeout, news=self._changed)
