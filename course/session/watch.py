"""Failures in a session's nodes, reported once: to whoever waits for them, or else to the next cell.

Nodes end and raise in other threads and processes.  The main thread asks here: while it waits (`look` raises), when a
call finds no server (`reason`), and before each cell (`pending`).
"""

import os
import threading
from collections import deque
from collections.abc import Iterable

from course.errors import NodeFailed
from course.registry import told_elsewhere
from course.session.failure_report import FailureReport
from course.session.live_node import LiveNode
from course.session.node_process import NodeProcess

Handle = LiveNode | NodeProcess


class Watch:
    """The untold ends and exceptions of the nodes in `handles`, which the session keeps up to date."""

    def __init__(self, handles: dict[str, Handle]):
        self._handles = handles
        self._told: set[tuple[Handle, int]] = set()  # a node, and which of its reports
        self._notices: deque[str] = deque(maxlen=20)
        self._lock = threading.Lock()

    def look(self) -> None:
        """Raise NodeFailed when a node has something to tell that nobody was told."""
        for handle, number, report in self._untold():
            self._tell(handle, number)
            raise NodeFailed(str(report))

    def reason(self, service: str, *, again: bool = False) -> FailureReport | None:
        """Return why nobody answers at `service`, and mark it as told; with `again`, also one told before.

        What is not known to have served anything may have been meant to serve this.
        """
        reports = self._all() if again else self._untold()
        for handle, number, report in reversed(list(reports)):
            if not handle.services or service in handle.services:
                self._tell(handle, number)
                return report
        return None

    def pending(self) -> list[str]:
        """Return what the next cell must print first."""
        said = []
        untold = list(self._untold())
        elsewhere = told_elsewhere(os.getpid()) if untold else set()
        for handle, number, report in untold:
            self._tell(handle, number)
            if str(report) not in elsewhere:
                said.append(f"Since the last cell: {report}")
        return said + self.notices()

    def notices(self) -> list[str]:
        """Return the callbacks' notices to the reader, each once."""
        with self._lock:
            said = list(self._notices)
            self._notices.clear()
        return said

    def notice(self, text: str) -> None:
        """Have the end of this cell, or the next one, say `text`; may be called in any thread."""
        with self._lock:
            if text not in self._notices:
                self._notices.append(text)

    def forget(self, words: str) -> None:
        """Drop the notices with these words in them: the reader is told the same another way."""
        with self._lock:
            kept = [text for text in self._notices if words not in text]
            self._notices.clear()
            self._notices.extend(kept)

    def mark_told(self, handle: Handle) -> None:
        """Note that the reader knows all that `handle` has to tell so far."""
        for number, _ in enumerate(handle.reports):
            self._tell(handle, number)

    def _tell(self, handle: Handle, number: int) -> None:
        self._told.add((handle, number))

    def _untold(self) -> Iterable[tuple[Handle, int, FailureReport]]:
        return (each for each in self._all() if each[:2] not in self._told)

    def _all(self) -> Iterable[tuple[Handle, int, FailureReport]]:
        for handle in list(self._handles.values()):
            for number, report in enumerate(handle.reports):
                yield handle, number, report
