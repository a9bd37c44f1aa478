"""Exchanges, the record of what passes in one call, goal, message or change of a parameter: each event with its time.

A reader sends them with the inspector.  What cells, nodes and other programs send is recorded, too: see `passing.py`.
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

KEPT = 20  # exchanges
ALIKE = 5  # of these with one name and from one sender: a timer must not push out all others
INSPECTOR = "the Inspector"
FIRST, LAST = 20, 180  # events of an exchange that are kept
LONGEST = 2000  # characters of a message that are shown
LENGTH = 100  # elements of an array that are shown
LARGEST = 1 << 16  # bytes of a message that is kept as it was sent; of a larger one, what is shown

_numbers = itertools.count(1)


class Exchange:
    """The messages that pass between a client and the server, the action server or the subscriptions of `name`."""

    def __init__(self, kind: str, name: str, type_name: str, by: str = INSPECTOR, about: str = ""):
        """`kind` is service, action, topic or parameter; `by` is who sends, `about` what a reader must know of it."""
        self.number = f"{os.getpid()}.{next(_numbers)}"  # of this kernel, and none that was restarted
        self.kind, self.name, self.type_name, self.by, self.about = kind, name, type_name, by, about
        self._first: list[list[Any]] = []
        self._last: deque[list[Any]] = deque(maxlen=LAST)
        self._count = 0
        self._began: float | None = None  # s
        self._over = False
        self._failed = ""
        self._note = ""
        self._goal: Any = None
        self._followers = 0
        self._left = time.monotonic()  # when the last page stopped showing it
        self._lock = threading.Lock()

    def add(self, event: str, message: Any = None, at: float | None = None) -> None:
        """An event has been seen; `message` is what came with it, or a text.

        `at` is when (s, on the same clock for all events of an exchange); by default now, as `time.monotonic` says.
        """
        now = time.monotonic() if at is None else at
        # The sender may change its message later, and must not wait until it is written as text.
        kept = message or "" if message is None or isinstance(message, str) else _Serialized(message)
        with self._lock:
            if self._began is None:
                self._began = now
            row = [round((now - self._began) * 1e3, 2), event, kept]  # ms
            self._count += 1
            events = [each[1] for each in self._first] if event == "accepted" else []
            if "feedback" in events:
                # The two came together.  Feedback is sent later, but rclpy tells of it first.
                place = events.index("feedback")
                self._first.insert(place, [self._first[place][0], event, kept])
            else:
                (self._first if len(self._first) < FIRST else self._last).append(row)

    def end(self, failed: str = "") -> None:
        """Nothing more will come; `failed` says why, when there was no answer."""
        with self._lock:
            self._over, self._failed, self._note = True, failed, ""

    def note(self, text: str) -> None:
        """Something for the reader to know while the exchange goes on."""
        with self._lock:
            self._note = text

    def follow(self, by: int) -> None:
        """So many pages more show it, or with a negative number fewer."""
        with self._lock:
            self._followers += by
            self._left = time.monotonic()

    def is_shown(self, within: float) -> bool:
        """Return True if a page shows it, or did within the last `within` s."""
        with self._lock:
            return self._followers > 0 or time.monotonic() - self._left < within

    def may_be_canceled(self, goal: Any) -> None:
        """`goal` has `cancel`: an action's goal, or what publishes again and again."""
        self._goal = goal

    def cancel(self) -> None:
        """Ask the server to cancel the goal; raises LiveError when there is none, and CourseError before its answer.

        What publishes again and again is stopped.
        """
        if self._goal is None or self.over:
            raise LiveError(
                f"there is {'nothing to stop' if self.kind == 'topic' else 'no goal to cancel'}: it has ended"
            )
        self._goal.cancel()

    @property
    def over(self) -> bool:
        """Return True once nothing more will come."""
        with self._lock:
            return self._over

    def summary(self) -> dict[str, Any]:
        """Return the row that stands for it in a list of exchanges."""
        with self._lock:
            state = "failed" if self._failed else "over" if self._over else "running"
            return {"number": self.number, "kind": self.kind, "name": self.name, "by": self.by, "state": state}

    def state(self) -> dict[str, Any]:
        """All of it, as the page shows it; the events are [ms since the first, event, text]."""
        summary = self.summary()
        with self._lock:
            for row in (*self._first, *self._last):
                row[2] = str(row[2])[:LONGEST]
            return {
                **summary,
                "type": self.type_name,
                "about": self.about,
                "events": [*self._first, *self._last],
                "left_out": self._count - len(self._first) - len(self._last),  # between the first and the last
                "first": len(self._first),
                "failed": self._failed,
                "note": self._note,
                "cancellable": self._goal is not None and not self._over,
            }


class Followed(Changes):
    """A feed of an exchange, which knows that it is shown."""

    def __init__(self, number: str):
        self._exchange = find(number)
        super().__init__(self._exchange.state)
        self._exchange.follow(1)

    def close(self) -> None:
        """The page shows it no more."""
        self._exchange.follow(-1)


class _Serialized:
    """A message as it is now, which becomes YAML when somebody looks at it."""

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
    """Have an exchange in the list; the oldest one may leave it."""
    with _keeping:
        mark = (exchange.kind, exchange.name, exchange.by)
        alike = [each for each in _kept if (each.kind, each.name, each.by) == mark]
        if len(alike) >= ALIKE:
            _kept.remove(alike[0])
        _kept.append(exchange)
    return exchange


def summaries() -> list[dict[str, Any]]:
    """The exchanges that are kept, the newest first."""
    with _keeping:
        return [each.summary() for each in reversed(_kept)]


def find(number: str) -> Exchange:
    """The exchange with this number; raises LiveError when it is not kept any more."""
    with _keeping:
        for each in _kept:
            if each.number == number:
                return each
    raise LiveError("The kernel was restarted, or too much has happened since. Send it again.")
