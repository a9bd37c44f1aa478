"""What passes in one call, goal, message or change of a parameter: each event with its time.

A reader sends them with the inspector; the calls that cells make are kept, too, while their diagrams can be seen.
"""

import itertools
import os
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any

from rclpy.serialization import deserialize_message, serialize_message

from course.errors import LiveError
from course.lab.kernel.panels import Changes
from course.ros2 import messages
from course.session.calls import listeners

KEPT = 20  # exchanges
FIRST, LAST = 20, 180  # events of an exchange that are kept
LONGEST = 2000  # characters of a message that are shown
LENGTH = 100  # elements of an array that are shown

_numbers = itertools.count(1)


class Exchange:
    """What passes between the session, as a client, and the server, action server or subscriptions of `name`."""

    def __init__(self, kind: str, name: str, type_name: str):
        """`kind` is service, action, topic or parameter."""
        self.number = f"{os.getpid()}.{next(_numbers)}"  # of this kernel, and none that was restarted
        self.kind, self.name, self.type_name = kind, name, type_name
        self._first: list[list[Any]] = []
        self._last: deque[list[Any]] = deque(maxlen=LAST)
        self._count = 0
        self._began: float | None = None  # s
        self._over = False
        self._failed = ""
        self._note = ""
        self._goal: Any = None
        self._lock = threading.Lock()

    def add(self, event: str, message: Any = None) -> None:
        """An event has been seen, now; `message` is what came with it, or a text."""
        now = time.monotonic()
        # The sender may change its message later, and must not wait until it is written as text.
        kept = message or "" if message is None or isinstance(message, str) else _Serialized(message)
        with self._lock:
            if self._began is None:
                self._began = now
            row = [round((now - self._began) * 1e3, 2), event, kept]  # ms
            self._count += 1
            (self._first if len(self._first) < FIRST else self._last).append(row)

    def end(self, failed: str = "") -> None:
        """Nothing more will come; `failed` says why, when that is no answer."""
        with self._lock:
            self._over, self._failed, self._note = True, failed, ""

    def note(self, text: str) -> None:
        """Something for the reader to know while the exchange goes on."""
        with self._lock:
            self._note = text

    def may_be_canceled(self, goal: Any) -> None:
        """`goal` has `cancel`."""
        self._goal = goal

    def cancel(self) -> None:
        """Ask the server to cancel the goal; raises LiveError when there is none, and CourseError before its answer."""
        if self._goal is None or self.over:
            raise LiveError("there is no goal to cancel: it has ended")
        self._goal.cancel()

    @property
    def over(self) -> bool:
        """Whether nothing more will come."""
        with self._lock:
            return self._over

    def summary(self) -> dict[str, Any]:
        """What a list of exchanges shows of it."""
        with self._lock:
            state = "failed" if self._failed else "over" if self._over else "running"
            return {"number": self.number, "kind": self.kind, "name": self.name, "state": state}

    def state(self) -> dict[str, Any]:
        """All of it, as the page shows it; the events are [ms since the first, event, text]."""
        summary = self.summary()
        with self._lock:
            for row in (*self._first, *self._last):
                row[2] = str(row[2])[:LONGEST]
            return {
                **summary,
                "type": self.type_name,
                "events": [*self._first, *self._last],
                "left_out": self._count - len(self._first) - len(self._last),  # between the first and the last
                "first": len(self._first),
                "failed": self._failed,
                "note": self._note,
                "cancellable": self._goal is not None and not self._over,
            }


class _Serialized:
    """A message as it is now, which becomes YAML when somebody looks at it."""

    def __init__(self, message: Any):
        self._bytes, self._type = serialize_message(message), type(message)

    def __str__(self) -> str:
        message = deserialize_message(self._bytes, self._type)
        return messages.to_yaml(message, messages.Limits(LENGTH)).strip()


_kept: deque[Exchange] = deque(maxlen=KEPT)


def keep(exchange: Exchange) -> Exchange:
    """Have an exchange in the list; the oldest one may leave it."""
    _kept.append(exchange)
    return exchange


def summaries() -> list[dict[str, Any]]:
    """The exchanges that are kept, the newest first."""
    return [each.summary() for each in reversed(list(_kept))]


def find(number: str) -> Exchange:
    """The exchange with this number; raises LiveError when it is not kept any more."""
    for each in list(_kept):
        if each.number == number:
            return each
    raise LiveError("nothing is known of it any more, as after a restart of the kernel: send it again")


class Summaries(Changes):
    """A feed of what `summaries` says; while a page follows it, the calls that cells make are kept, too."""

    def __init__(self) -> None:
        super().__init__(summaries)
        _followed.add(self)
        if _listen not in listeners:
            listeners.append(_listen)

    def close(self) -> None:
        """The page has left."""
        _followed.discard(self)
        if not _followed and _listen in listeners:
            listeners.remove(_listen)


_followed: set[Summaries] = set()


def _listen(service: str, srv_type: type[Any], request: Any) -> Callable[[Any, str], None]:
    """Keep a call that a cell makes; those of panels come in other threads."""
    if threading.current_thread() is not threading.main_thread():
        return lambda response, failed: None
    package = srv_type.__module__.partition(".")[0]
    exchange = keep(Exchange("service", service, f"{package}/srv/{srv_type.__name__}"))
    exchange.add("request", request)

    def tell(response: Any, failed: str) -> None:
        if response is not None:
            exchange.add("response", response)
        exchange.end(failed)

    return tell
