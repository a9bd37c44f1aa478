"""Failures in a session's nodes, reported once: to a wait in progress, or else at the next cell.

Nodes end and raise in other threads and processes.  The main thread checks: while it waits (`look` raises), when a call
finds no server (`reason`), and before each cell (`pending`).
"""

import contextlib
import os
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator

from course.errors import NodeFailed
from course.explaining.failure_report import FailureReport, cell_of
from course.registry import told_elsewhere
from course.ros.names import is_of_every_node
from course.session.live_node import LiveNode
from course.session.node_process import NodeProcess

Handle = LiveNode | NodeProcess


class Watch:
    """The unreported ends and exceptions of the nodes in `handles`, which the session keeps up to date."""

    def __init__(self, handles: dict[str, Handle]):
        self._handles = handles
        self._told: set[tuple[Handle, int]] = set()  # a node, and the index of its report
        self._notices: deque[tuple[str, Callable[[], bool]]] = deque(maxlen=20)  # each, and whether it is true
        self._lock = threading.Lock()

    def look(self) -> None:
        """Raise NodeFailed if a node has an unreported failure."""
        for handle, number, report in self._untold():
            self._tell(handle, number)
            failure = NodeFailed(str(report))
            failure.source = handle.source or (cell_of(handle.cls) if isinstance(handle, LiveNode) else "")
            raise failure

    @contextlib.contextmanager
    def postponing(self) -> Iterator[None]:
        """Leave a failure that is raised here untold, so that the next wait or cell tells it."""
        before = self._told.copy()
        try:
            yield
        except NodeFailed:
            self._told &= before
            raise

    def reason(self, service: str, meant: Callable[[Handle], bool], *, again: bool = False) -> FailureReport | None:
        """Return the failure that left `service` without a server, and mark it as told; with `again`, also a told one.

        A node that is not known to have served anything counts, too, if it may have been `meant` to serve this.  The
        services of a program become known one by one, those that every node has first.
        """
        reports = self._all() if again else self._untold()
        for handle, number, report in reversed(list(reports)):
            known = {*handle.services}
            if isinstance(handle, NodeProcess):
                known = {name for name in known if not is_of_every_node(name)}
            if service in handle.services or (not known and meant(handle)):
                self._tell(handle, number)
                return report
        return None

    def pending(self) -> list[str]:
        """Return the reports for the next cell to print first."""
        said = []
        untold = list(self._untold())
        elsewhere = told_elsewhere(os.getpid()) if untold else set()
        for handle, number, report in untold:
            self._tell(handle, number)
            if str(report) not in elsewhere:
                said.append(f"Since the last cell: {report}")
        return said + self.notices()

    def notices(self) -> list[str]:
        """Return the notices from callbacks to the reader, each once."""
        with self._lock:
            said = list(self._notices)
            self._notices.clear()
        return [text for text, is_true in said if is_true()]

    def notice(self, text: str, is_true: Callable[[], bool] = lambda: True) -> None:
        """Have `text` printed at the end of this cell, or of the next one, if it is still true then.

        May be called in any thread.
        """
        with self._lock:
            if all(text != known for known, _ in self._notices):
                self._notices.append((text, is_true))

    def forget(self, words: str) -> None:
        """Drop the notices that contain these words, because the reader learns the same in another way."""
        with self._lock:
            kept = [each for each in self._notices if words not in each[0]]
            self._notices.clear()
            self._notices.extend(kept)

    def mark_told(self, handle: Handle) -> None:
        """Mark all reports of `handle` so far as told."""
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
