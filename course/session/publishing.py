"""Publishes a session's record in the registry for other processes, see `course.registry`."""

import os
import threading
import time
from collections.abc import Mapping

from course import registry
from course.foundation import processes
from course.session.domains import kernel_id
from course.session.offered import services_made
from course.session.watch import Handle


class Publishing:
    """Keeps the record of this process's session up to date, until `end`."""

    def __init__(self, domain: int, folder: str, handles: Mapping[str, Handle]):
        self._domain, self._folder, self._handles = domain, folder, handles
        self._since = time.time()
        self._lock = threading.Lock()
        self._ended = False

    def publish(self) -> None:
        """Write the record, which `course sessions` and `ros2` read; may be called in any thread."""
        with self._lock:
            if not self._ended:
                pid = os.getpid()
                registry.write(
                    registry.SessionRecord(
                        pid, self._domain, self._folder, self._since, processes.birth(pid), self._records(), kernel_id()
                    )
                )

    def end(self) -> None:
        """Stop writing the record, and remove it."""
        self._ended = True
        registry.remove(os.getpid())

    def _records(self) -> list[registry.NodeRecord]:
        return [
            registry.NodeRecord(
                name,
                handle.state,
                handle.alive,
                handle.started,
                handle.where,
                sorted(handle.services),
                [str(report) for report in handle.reports],
                [report.at for report in handle.reports],
                services_made(handle.source) if handle.reports else None,
            )
            for handle in list(self._handles.values())
            for name in handle.nodes or [handle.name]
        ]
