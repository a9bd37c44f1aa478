"""The panels' interface to pages: methods that answer requests, and topics that a page subscribes to."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from threading import Lock
from typing import Any, Protocol


class Feed(Protocol):
    """The source of the data of one subscription of one page."""

    def read(self) -> Any:
        """Return new data since the last call, in a form for JSON, or None.

        It is called in a separate thread, and only when the page has acknowledged earlier events.  An exception ends
        the subscription, and is shown to the reader until the page, which soon tries again, gets data.
        """

    def close(self) -> None:
        """End the subscription, because the page has left it."""


@dataclass(frozen=True)
class Topic:
    """A topic that pages can follow."""

    open: Callable[..., Feed]  # called with a subscription's options
    period: float  # s between two calls of `read`


@dataclass
class Panels:
    """The methods and topics of all panels, by their names: PANEL.NAME."""

    methods: dict[str, Callable[..., Any]] = field(default_factory=dict)
    topics: dict[str, Topic] = field(default_factory=dict)


class Changes:
    """A feed of a state: returns all of it whenever it has changed."""

    def __init__(self, state: Callable[[], Any]):
        self._state = state
        self._last: Any = None

    def read(self) -> Any:
        """Return the state if it has changed."""
        state = self._state()
        if state == self._last:
            return None
        self._last = state
        return state

    def close(self) -> None:
        """Do nothing: the feed holds no resources."""


class Backlog:
    """A feed of events that other threads put in: the newest, and the number that a slow page has lost."""

    def __init__(self, limit: int, leave: Callable[[], None] = lambda: None):
        """Keep at most `limit` events; `leave` is called when the page has left."""
        self._events: deque[Any] = deque(maxlen=limit)
        self._lost = 0
        self._lock = Lock()
        self.close = leave

    def put(self, event: Any) -> None:
        """Add an event, and drop the oldest if there are too many; may be called in any thread."""
        with self._lock:
            self._lost += len(self._events) == self._events.maxlen
            self._events.append(event)

    def read(self) -> dict[str, Any] | None:
        """Return {"events": the new ones, "lost": the number of dropped older ones}; None if nothing is new."""
        with self._lock:
            if not self._events:
                return None
            news = {"events": list(self._events), "lost": self._lost}
            self._events.clear()
            self._lost = 0
        return news
