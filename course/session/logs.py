"""The nodes' logs, collected from /rosout and shown in a notebook as a foldable table."""

import html
import math
import re
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, SupportsIndex, TypeVar, cast, overload

from rcl_interfaces.msg import Log
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import deserialize_message, serialize_message

from course.foundation.untrusted import visible
from course.foundation.waiting import wait_until
from course.ros.discovery import mark_in
from course.ros.rclpy_internals import create_telling_subscription

LEVELS = {10: "DEBUG", 20: "INFO", 30: "WARN", 40: "ERROR", 50: "FATAL"}
Message = TypeVar("Message")

KEPT = 5000
LONGEST = 10_000  # characters of a line that are kept
SHORT = 16_384  # bytes of a message that is kept whole
NAME = 256  # bytes of a node's name: more than ROS 2 allows
SHOWN = 1_000_000  # characters shown in a notebook: more would make JupyterLab slow and the file large
SAMPLE = 2000  # messages after which their rate is checked
FLOOD = 1000.0  # lines a second: more than anybody reads, or a node's timer logs


@dataclass(frozen=True, repr=False)
class Entry:
    """One line of a log (rcl_interfaces/msg/Log)."""

    level: str
    node: str
    text: str
    at: int = field(default=0, compare=False)  # when it was logged or printed, ns since 1970; 0 where nobody knows
    process: int = field(default=0, compare=False)  # the `mark` of its process; 0 where nobody knows

    def __str__(self) -> str:
        return f"[{self.level}] [{self.node}]: {self.text}"

    __repr__ = __str__  # so that a list of entries shows what was logged, without escapes


class Logged(bytes):
    """A /rosout message, the `mark` of the process that published it, and its entry once somebody has asked for it."""

    process = 0
    entry: Entry | None = None

    @classmethod
    def of(cls, message: bytes, info: Mapping[str, Any]) -> "Logged":
        """Return a message with rclpy's info on it, see `create_telling_subscription`."""
        logged = cls(message)
        logged.process = mark_in(info.get("publisher", b""))
        return logged


class Logs(list[Entry]):
    """Entries in order of arrival; a notebook shows them folded, and only the newest of very many."""

    def __str__(self) -> str:
        """Return the newest lines, up to `SHOWN` characters."""
        lines: list[str] = []
        left = SHOWN
        for entry in reversed(self):
            lines.append(str(entry))
            left -= len(lines[-1])
            if left < 0 and len(lines) < len(self):
                lines.append(
                    f"({len(self) - len(lines):,} earlier lines are not shown; `ros.logs()` returns all of them as a "
                    "list)"
                )
                break
        return "\n".join(reversed(lines))

    __repr__ = __str__

    @overload
    def __getitem__(self, place: SupportsIndex) -> Entry: ...

    @overload
    def __getitem__(self, place: slice) -> "Logs": ...

    def __getitem__(self, place: SupportsIndex | slice) -> "Entry | Logs":
        """Return an entry, or, for a slice such as `[-5:]`, the logs with these entries."""
        return Logs(super().__getitem__(place)) if isinstance(place, slice) else super().__getitem__(place)

    def _repr_html_(self) -> str:
        shown = html.escape(visible(str(self), 2 * SHOWN))
        lines = "1 log line" if len(self) == 1 else f"{len(self)} log lines"
        return f"<details><summary>{lines}</summary><pre>{shown}</pre></details>"


LINE = re.compile(r"(?:\x1b\[\d*m)?\[(DEBUG|INFO|WARN|ERROR|FATAL)\] \[([\w./]+)\]: (.*?)(?:\x1b\[\d*m)?$")

INSIDE = re.compile(r"(?:\x1b\[\d*m)?\[(?:DEBUG|INFO|WARN|ERROR|FATAL)\] \[[\w./]+\]: ")  # anywhere in a line


def program_logs(name: str, output: str, ends: list[str]) -> list[Entry]:
    """Return the entries of a program's terminal output (ROS log lines and printed lines), and how it ended."""
    entries = [entry_of_line(name, part) for line in output.splitlines() for part in _unglued(line)]
    return [*entries, *(Entry("ENDED", name, end) for end in ends)]


def _unglued(line: str) -> list[str]:
    """Split a line if a log line follows output without a newline."""
    found = INSIDE.search(line)
    return [line[: found.start()], line[found.start() :]] if found and found.start() else [line]


def entry_of_line(name: str, line: str, at: int = 0, process: int = 0) -> Entry:
    """Return the entry for a line of the program called `name`: a ROS log line, or printed output.

    The line itself contains no time: `at` is when it was read, in ns since 1970.  `process` is the program's mark.
    """
    found = LINE.match(line)
    level, node, text = (found[1], found[2], found[3]) if found else ("PRINT", name, line)
    return Entry(level, node, text, at, process)


def node_of_line(line: str) -> str | None:
    """Return the node that logged this line of a terminal; None if it is not a log line."""
    found = LINE.match(line.rstrip("\n"))
    return found[2] if found else None


def entry_of(message: bytes) -> Entry:
    """Return the entry of a /rosout message, which may be invalid, because anybody can publish there.

    It is made once for each message: whoever waits for a line looks at all of them again and again.
    """
    if not isinstance(message, Logged):
        return _made_of(message)
    if message.entry is None:
        message.entry = _made_of(message)
    return message.entry


def _made_of(message: bytes) -> Entry:
    process = process_of(message)
    if (log := decoded(message, Log)) is None:
        text = f"(published {len(message):,} bytes on /rosout that are not a log message)"
        return Entry("WARN", node_of(message), text, process=process)
    at = log.stamp.sec * 10**9 + log.stamp.nanosec
    return Entry(LEVELS.get(log.level, str(log.level)), log.name, log.msg, at, process)


def process_of(message: bytes) -> int:
    """Return the mark of the process that published a /rosout message; 0 where nobody knows."""
    return message.process if isinstance(message, Logged) else 0


def node_of(message: bytes) -> str:
    """Return the node of a /rosout message, a hundred times faster than `entry_of`.

    In the CDR encoding, a header of four bytes, a stamp and the level come before the name's length.
    """
    return _text_at(message, 16, NAME)[0]


def short(message: bytes) -> bytes:
    """Return a /rosout message, with only the beginning of a long text."""
    if len(message) <= SHORT:
        return message
    name, end = _text_at(message, 16, NAME)
    text, _ = _text_at(message, end + -end % 4, LONGEST)
    log = Log(name=name, msg=f"{text}… (a message of {len(message):,} bytes)", level=message[12])
    log.stamp.sec = int.from_bytes(message[4:8], _order(message), signed=True)
    return serialize_message(log)


def decoded(message: bytes, kind: type[Message]) -> Message | None:
    """Deserialize a message; None if that fails, because anybody may publish any bytes on any topic."""
    try:
        return cast(Message, deserialize_message(message, kind))
    except (RuntimeError, MemoryError):  # the middleware's RMWError is a RuntimeError
        return None


def _text_at(message: bytes, start: int, most: int) -> tuple[str, int]:
    """Return the text in a CDR encoding whose length is at `start`, at most `most` bytes of it, and its end."""
    end = start + 4 + int.from_bytes(message[start : start + 4], _order(message))
    return message[start + 4 : min(end - 1, start + 4 + most)].decode(errors="replace"), end


def _order(message: bytes) -> Literal["little", "big"]:
    return "little" if message[1:2] != b"\0" else "big"


class LogBook:
    """Collects /rosout on the given node, as bytes, because decoding each line at once would slow every call down."""

    def __init__(self, node: Node, flooded: Callable[[str], None] = lambda node: None):
        """Subscribe; `flooded` is called, in the thread that spins `node`, with a node that logs too much."""
        self._messages: deque[Logged] = deque(maxlen=KEPT)
        self._begun: dict[str, float] = {}  # by node: what it has logged before is forgotten; s of time.time()
        self.count = 0  # the number of all messages received
        self._flooded, self._sampled = flooded, time.monotonic()
        self._changed = threading.Condition(threading.RLock())
        qos = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        create_telling_subscription(node, Log, "/rosout", self._on_log, qos)

    def _on_log(self, message: bytes, info: dict[str, Any]) -> None:
        with self._changed:
            self._messages.append(Logged.of(short(message), info))
            self.count += 1
            self._changed.notify_all()
        if self.count % SAMPLE == 0:
            self._look_for_floods()

    def _look_for_floods(self) -> None:
        """Report the node with most of the last messages, if they came too fast to be read."""
        now = time.monotonic()
        passed, self._sampled = now - self._sampled, now
        if FLOOD * passed < SAMPLE:
            _, messages = self.since(self.count - SAMPLE)
            [(node, lines)] = Counter(map(node_of, messages)).most_common(1)
            if FLOOD * passed < lines:
                self._flooded(node)

    def read(self, node: str | None = None) -> Logs:
        """Return the entries of `node`, or all, without those that are forgotten."""
        with self._changed:
            messages, begun = list(self._messages), dict(self._begun)
        wanted = node and node.lstrip("/")
        entries = (entry for entry in map(entry_of, messages) if wanted in (None, entry.node))
        return Logs(entry for entry in entries if entry.at >= 1e9 * begun.get(entry.node, 0.0))

    def since(self, count: int) -> tuple[int, list[Logged]]:
        """Return the number of messages received so far, and the newest after the first `count`, for `entry_of`.

        Those that are forgotten are among them.
        """
        with self._changed:
            new = min(self.count - count, len(self._messages))
            return self.count, list(self._messages)[len(self._messages) - new :]

    def forget(self, node: str, before: float = math.inf) -> None:
        """Leave out of `read` what `node` has logged before a time (s of `time.time()`), or all of it so far."""
        with self._changed:
            self._begun[node] = min(before, time.time())

    def wait_for(self, text: str, node: str | None = None, timeout: float = 5.0) -> bool:
        """Wait until a line (of `node`) that contains `text` is there; False after `timeout` s."""
        return wait_until(lambda: any(text in entry.text for entry in self.read(node)), timeout, news=self._changed)
