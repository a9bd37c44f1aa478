"""The log in the nodes panel, filtered here, so that a flood of lines does not hide the wanted ones."""

from collections import deque
from typing import Any

from course.foundation.untrusted import all_visible
from course.lab import protocol
from course.lab.kernel.nodes import session
from course.lab.kernel.panels import Panels, Topic
from course.ros.discovery import mark
from course.session.following import LogFollower
from course.session.live import Session
from course.session.logs import LEVELS, NAME, Entry

LINES = 200  # from each source in one event
FIRST = 1000  # in the first one, which has what was logged before
LONGEST = 2000  # characters of a line that are shown
EVENT = protocol.LINE // 8  # bytes of the lines in one event: the others come with the next one
SEVERITY = {"PRINT": 20, "ENDED": 50} | {name: number for number, name in LEVELS.items()}


def add(panels: Panels) -> None:
    """Add the log."""
    panels.topics |= {"log": Topic(LogFeed, 0.2)}


class LogFeed:
    """A feed of the log's new lines."""

    def __init__(self, nodes: list[str] | None = None, level: str = "DEBUG", text: str = "", pid: int = 0):
        """Follow lines of `nodes` (as in the log, or files; None for all), of at least `level`, with `text`.

        The search for `text` ignores case.  With the id of a process, only lines of that one.
        """
        self._nodes = None if nodes is None else set(nodes)
        self._process = mark(int(pid))
        self._level, self._text = SEVERITY.get(level, 0), text.casefold()
        self._all = nodes is None and self._level <= SEVERITY["DEBUG"] and not text and not pid
        self._hidden = 0  # lines that were not wanted
        self._told: int | None = 0  # of these, those that the page knows of; None once it has a wanted one
        self._session: Session | None = None
        self._follower: LogFollower | None = None
        self._left: deque[list[Any]] = deque()  # lines that did not fit in the events so far

    def read(self) -> dict[str, Any] | None:
        """Return {"lines": [[level, node, text, stamp, process], ...], "lost": ..., "older": ..., "hidden": ...}.

        A stamp is "seconds.nanoseconds" since 1970, as a terminal shows it, or "" if it is not known, and a process the
        low 16 bits of its id, or 0.  "lost" is the number of lines that came too fast, "older" that of lines left out
        that were there before the page listened, "hidden" that of lines that were not wanted, up to the first wanted
        one.
        """
        live, limit = session(), LINES
        if live is not self._session or self._follower is None:
            self._session, limit = live, FIRST
            self._hidden = self._told = 0
            self._left.clear()
            self._follower = live.follow_logs(None if self._all else self._wanted)
        if self._left:
            return {"lines": self._next(), "lost": 0, "older": 0, "hidden": self._hidden}
        entries, lost = self._follower.read(limit)
        if not entries and not lost and self._told in (None, self._hidden):
            return None
        self._told = None if entries or self._told is None else self._hidden
        lines = ([each.level, each.node[:NAME], _cut(each.text), _stamp(each.at), each.process] for each in entries)
        self._left.extend(lines)
        older = self._follower.older if limit == FIRST else 0
        return {"lines": self._next(), "lost": lost, "older": older, "hidden": self._hidden}

    def _next(self) -> list[list[Any]]:
        """Remove and return the next lines, as many as fit in an event."""
        lines: list[list[Any]] = []
        size = 0
        while self._left:
            size += len(protocol.encoded(all_visible(self._left[0])))
            if lines and size > EVENT:
                break
            lines.append(self._left.popleft())
        return lines

    def close(self) -> None:
        """Do nothing: the feed holds no resources."""

    def _wanted(self, entry: Entry) -> bool:
        wanted = (
            (self._nodes is None or entry.node in self._nodes)
            and self._process in (0, entry.process)
            and SEVERITY.get(entry.level, 0) >= self._level
            and self._text in entry.text.casefold()
        )
        self._hidden += not wanted
        return wanted


def _stamp(at: int) -> str:
    return f"{at // 10**9}.{at % 10**9:09}" if at else ""


def _cut(text: str) -> str:
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}… ({len(text):,} characters; `ros.logs()` has more)"
