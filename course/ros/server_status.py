"""The state of the node that should answer, as the notebook's live session in this ROS domain knows it."""

import os
import sys
import time
from collections.abc import Callable

from course import registry
from course.ros.elsewhere import tell_if_alone
from course.ros.graph import Graph
from course.ros.names import OF_EVERY_NODE

LOOK = 0.2  # s between two checks of a server
TELL = 5.0  # s after which the services that exist instead are printed
LATE = 1.0  # s by which the report of a failed goal may come after its end
STALE = 0.2  # s for which read data is used


class ServerStatus:
    """The failure reports of nodes that serve `service`, or whose services are not known."""

    def __init__(self, service: str):
        self.name = service if service.startswith("/") else f"/{service}"
        self._began = time.time()
        self._read = 0.0
        self._record: registry.SessionRecord | None = None
        self._told: set[str] = set()

    def ending(self) -> str:
        """Return how a node ended that served it, or should have; '' if unknown."""
        return self._telling(next((node.stories[-1] for node in self._nodes() if node.stories and not node.alive), ""))

    def report(self) -> str:
        """Return the report of such a node since this object was made."""
        for node in self._nodes():
            for report, told in zip(node.stories, node.told, strict=True):
                if told >= self._began:
                    return self._telling(report)
        return ""

    def _telling(self, report: str) -> str:
        if report and self._record and report not in self._told:
            self._told.add(report)
            registry.tell(self._record, report)
        return report

    def _nodes(self) -> list[registry.NodeRecord]:
        if time.monotonic() > self._read + STALE:
            domain = os.environ.get("ROS_DOMAIN_ID", "0")
            self._record = registry.of_domain(int(domain)) if domain.isdigit() else None
            self._read = time.monotonic()
        nodes = self._record.nodes if self._record else []
        return [node for node in reversed(nodes) if not node.services or self.name in node.services]


def wait_for_answer(graph: Graph, ended: Callable[[], object]) -> None:
    """Spin until `ended()`; after `TELL` s, print once on stderr that the answer is still missing."""
    if not graph.spin(ended, TELL):
        print("still waiting for the answer. Ctrl-C ends this.", file=sys.stderr, flush=True)
        graph.spin(ended)


def _served(graph: Graph, name: str) -> bool:
    """Return True if the service or action has a server: the graph also lists names with only clients."""
    return any(graph.service_counts(each)[1] for each in (name, f"{name}/_action/send_goal"))


def wait_for_server(
    graph: Graph,
    status: ServerStatus,
    ready: Callable[[], bool],
    look: Callable[..., list[tuple[str, list[str]]]],
    what: str,
) -> str:
    """Wait for a server; return '' when there is one, or why there will be none if its node has died.

    After `TELL` s it prints once on stderr which services exist instead, and goes on waiting.
    """
    began, told = time.monotonic(), False
    if not graph.settle(ready, names_only=True):
        tell_if_alone(graph)
    while not graph.wait_until(ready, LOOK):
        if report := status.ending():
            return f"There is no such {what}. {report}"
        if not told and time.monotonic() > began + TELL:
            told = True
            own = sorted(
                name for name, types in look() if not types[0].startswith(OF_EVERY_NODE) and _served(graph, name)
            )
            served = f"served here: {', '.join(own)}" if own else f"there is no {what} here"
            print(f"still waiting; {served}. Ctrl-C ends this.", file=sys.stderr)
    return ""
