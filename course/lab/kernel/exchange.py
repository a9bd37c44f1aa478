"""Exchanges: records of the messages of one call, goal, publication or parameter change, each event with its time.

They come from the reader's inspector, or are recorded from cells, nodes and other programs (see `traffic.py`).
"""

import itertools
import os
import threading
import time
from collections import deque
from typing import Any

from rclpy.serialization import deserialize_message, serialize_message

from course.errors import LiveError
from course.lab.kernel.panels import Changes
from course.ros import messages

KEPT = 20  # exchanges that are kept
ALIKE = 5  # exchanges of one name and sender that are kept: a timer must not push out all others
INSPECTOR = "the Inspector"
FIRST, LAST = 20, 180  # events of an exchange that are kept
BEGINS = 10.0  # s until a page, perhaps of a busy machine, has begun to show an exchange that it has asked for
UNUSUAL = ("rejected", "canceled", "aborted")  # ends of a goal that the list tells
LONGEST = 2000  # characters of a message that are shown
LENGTH = 100  # elements of an array that are shown
LARGEST = 1 << 16  # bytes of a message that is kept as sent; of a larger one only the shown text is kept

_numbers = itertools.count(1)


class Exchange:
    """The messages between a client or publisher and the server, action server or subscriptions of `name`."""

    def __init__(
        self, kind: str, name: str, type_name: str, by: str = INSPECTOR, about: str = "", line: str = ""
    ) -> None:
        """Begin; `kind` is service, action, topic or parameter, `by` the sender, `about` a remark for the reader.

        `line` is the shell command that sends the same, if known.
        """
        self.number = f"{os.getpid()}.{next(_numbers)}"  # unique across restarts of the kernel
        self.kind, self.name, self.type_name, self.by, self.about = kind, name, type_name, by, about
        self._line = line
        self._first: list[list[Any]] = []
        self._last: deque[list[Any]] = deque(maxlen=LAST)
        self._count = 0
        self._began: float | None = None  # s
        self._over = False
        self._failed = ""
        self._note = ""
        self._goal: Any = None
        self._followers = 0
        # Time when the last page stopped showing it: none has begun yet.
        self._left = time.monotonic() + BEGINS
        self._lock = threading.Lock()

    def add(self, event: str, message: Any = None, at: float | None = None) -> None:
        """Add an event; `message` is its message, or a text.

        `at` is its time (s, on the same clock for all events of an exchange), by default `time.monotonic()`.
        """
        now = time.monotonic() if at is None else at
        # Serialized now, because the sender may change its message; made into text later, so that the sender need not
        # wait.
        kept = message or "" if message is None or isinstance(message, str) else _Serialized(message)
        with self._lock:
            if self._began is None:
                self._began = now
            row = [round((now - self._began) * 1e3, 2), event, kept]  # ms
            self._count += 1
            events = [each[1] for each in self._first] if event == "accepted" else []
            if "feedback" in events:
                # Both have come at once.  Feedback is sent after acceptance, but rclpy may report it first.
                place = events.index("feedback")
                self._first.insert(place, [self._first[place][0], event, kept])
            else:
                (self._first if len(self._first) < FIRST else self._last).append(row)

    def end(self, failed: str = "", note: str = "") -> None:
        """End the exchange; `failed` says why there was no answer, `note` why it ended without the reader's doing."""
        with self._lock:
            self._over, self._failed, self._note = True, failed, note

    def note(self, text: str) -> None:
        """Show a note to the reader while the exchange goes on."""
        with self._lock:
            self._note = text

    def follow(self, by: int) -> None:
        """Change the number of Inspectors that show it by `by`."""
        with self._lock:
            self._followers += by
            if by:
                self._left = time.monotonic()

    def is_shown(self, within: float) -> bool:
        """Return True if an Inspector shows it, or has shown it within the last `within` s."""
        with self._lock:
            return self._followers > 0 or time.monotonic() - self._left < within

    def may_be_canceled(self, goal: Any) -> None:
        """Set `goal`, whose `cancel` ends the exchange: an action's goal, or a repeated publication."""
        self._goal = goal

    def cancel(self) -> None:
        """Cancel the goal; raises LiveError if there is none, and RecorderError before the goal has an answer.

        A repeated publication is stopped.
        """
        if self._goal is None or self.over:
            raise LiveError(
                f"there is {'nothing to stop' if self.kind == 'topic' else 'no goal to cancel'}: it has ended"
            )
        self._goal.cancel()

    @property
    def over(self) -> bool:
        """Return True once the exchange has ended."""
        with self._lock:
            return self._over

    def summary(self) -> dict[str, Any]:
        """Return its row for the list of exchanges."""
        with self._lock:
            state = "failed" if self._failed else "over" if self._over else "running"
            row = {
                "number": self.number,
                "kind": self.kind,
                "name": self.name,
                "by": self.by,
                "state": state,
                "end": "",
            }
            if state == "over":  # the end may be followed by the answer to a cancel
                events = (event for _, event, _ in reversed((*self._first, *self._last)))
                row["end"] = next((event for event in events if event in UNUSUAL), "")
            return row

    def state(self) -> dict[str, Any]:
        """Return everything that the page shows; the events are [ms since the first, event, text]."""
        summary = self.summary()
        with self._lock:
            for row in (*self._first, *self._last):
                row[2] = str(row[2])[:LONGEST]
            return {
                **summary,
                "type": self.type_name,
                "about": self.about,
                "line": self._line,
                "events": [*self._first, *self._last],
                "left_out": self._count - len(self._first) - len(self._last),  # between the first and the last events
                "first": len(self._first),
                "failed": self._failed,
                "note": self._note,
                "cancellable": self._goal is not None and not self._over,
            }


class Followed(Changes):
    """A feed of an exchange, which marks the exchange as shown; with `onlooker`, as a graph is, it does not."""

    def __init__(self, number: str, onlooker: bool = False):
        self._exchange = find(number)
        super().__init__(self._exchange.state)
        self._counts = not onlooker
        self._exchange.follow(self._counts)

    def close(self) -> None:
        """Note that the page no longer shows it."""
        self._exchange.follow(-self._counts)


class _Serialized:
    """A message serialized now, and made into YAML when it is shown."""

    def __init__(self, message: Any):
        self._bytes, self._type = serialize_message(message), type(message)
        self._text = ""
        if len(self._bytes) > LARGEST:
            self._text, self._bytes = str(self)[:LONGEST], b""

    def __str__(self) -> str:
        if self._text:
            return self._text
        message = deserialize_message(self._bytes, self._type)
        return messages.to_yaml(message, messages.Limits(LENGTH)).strip()


_kept: deque[Exchange] = deque(maxlen=KEPT)
_keeping = threading.Lock()


def keep(exchange: Exchange) -> Exchange:
    """Add an exchange to the list, from which the oldest one may be dropped."""
    with _keeping:
        mark = (exchange.kind, exchange.name, exchange.by)
        alike = [each for each in _kept if (each.kind, each.name, each.by) == mark]
        if len(alike) >= ALIKE:
            _kept.remove(alike[0])
        _kept.append(exchange)
    return exchange


def summaries() -> list[dict[str, Any]]:
    """Return the rows of the kept exchanges, the newest first."""
    with _keeping:
        return [each.summary() for each in reversed(_kept)]


def latest(kind: str = "", name: str = "") -> dict[str, str] | None:
    """Return number, kind, name and type of the inspector's last exchange with `name`; without it, of a running one.

    By it, a page that is loaded again finds what it has sent.
    """
    with _keeping:
        for each in reversed(_kept):
            if each.by == INSPECTOR and ((each.kind, each.name) == (kind, name) if name else not each.over):
                return {"number": each.number, "kind": each.kind, "name": each.name, "type": each.type_name}
    return None


def find(number: str) -> Exchange:
    """The exchange with this number; raises LiveError when it is not kept any more."""
    with _keeping:
        for each in _kept:
            if each.number == number:
                return each
    raise LiveError("The kernel was restarted, or this exchange is too old to be kept. Send it again.")
