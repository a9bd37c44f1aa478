"""The panels' interface to their pages: methods that answer a request, and topics that a page subscribes to."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from threading import Lock
from typing import Any, Protocol


class Feed(Protocol):
    """The source of the data of one subscription of one page."""

    def read(self) -> Any:
        """Return what is new since the last call, as JSON takes it, or None.

        It is called in a thread of its own, and only when the page has taken in what came before.  What it raises ends
        the subscription, and is shown to the reader.
        """

    def close(self) -> None:
        """The page has left."""


@dataclass(frozen=True)
class Topic:
    """Something that pages can follow."""

    open: Callable[..., Feed]  # called with a subscription's options
    period: float  # s between two calls of `read`


@dataclass
class Panels:
    """The methods and topics of all panels, by their names: PANEL.NAME."""

    methods: dict[str, Callable[..., Any]] = field(default_factory=dict)
    topics: dict[str, Topic] = field(default_factory=dict)


class Changes:
    """A feed of a state: all of it, whenever it is another than before."""

    def __init__(self, state: Callable[[], Any]):
        self._state = state
        self._last: Any = None

    def read(self) -> Any:
        """The state, when it has changed."""
        state = self._state()
        if state == self._last:
            return None
        self._last = state
        return state

    def close(self) -> None:
        """Nothing is held."""


class Backlog:
    """A feed of events that other threads put in: the newest of them, and how many a slow page has lost."""

    def __init__(self, limit: int, leave: Callable[[], None] = lambda: None):
        """Keep at most `limit` events; `leave` is called when the page has left."""
        self._events: deque[Any] = deque(maxlen=limit)
        self._lost = 0
        self._lock = Lock()
        self.close = leave

    def put(self, event: Any) -> None:
        """Add an event, for which the oldest may have to go; may be called in any thread."""
        with self._lock:
            self._lost += len(self._events) == self._events.maxlen
            self._events.append(event)

    def read(self) -> dict[str, Any] | None:
        """{"events": the new ones, "lost": how many older ones are lost}; None when nothing is new."""
        with self._lock:
            if not self._events:
                return None
            news = {"events": list(self._events), "lost": self._lost}
            self._events.clear()
            self._lost = 0
        return news
