"""The state of the node that should answer, as the notebook's live session in this ROS domain knows it."""

import os
import sys
import time
from collections.abc import Callable

from course import registry
from course.ros.elsewhere import tell_if_alone
from course.ros.graph import Graph
from course.ros.names import OF_EVERY_NODE, SEND, can_be

COMMANDS = {"service": "service call", "action": "action send_goal"}
LOOK = 0.2  # s between two checks of a server
TELL = 5.0  # s after which the services that exist instead are printed
MISFIT = 1.0  # s after which the type is printed with which the name is served
LATE = 1.0  # s by which the report of a failed goal may come after its end
STALE = 0.2  # s for which read data is used


class ServerStatus:
    """The failure reports of nodes that serve `service`, or that may serve it by their text, and serve nothing yet."""

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
        return [node for node in reversed(nodes) if self.name in node.services or self._may_serve(node)]

    def _may_serve(self, node: registry.NodeRecord) -> bool:
        return not node.services and (node.makes is None or any(can_be(self.name, each) for each in node.makes))


def wait_for_answer(graph: Graph, ended: Callable[[], object]) -> None:
    """Spin until `ended()`; after `TELL` s, print once on stderr that the answer is still missing."""
    if not graph.spin(ended, TELL):
        print("still waiting for the answer. Ctrl-C ends this.", file=sys.stderr, flush=True)
        graph.spin(ended)


def _served(graph: Graph, name: str) -> bool:
    """Return True if the service or action has a server: the graph also lists names with only clients."""
    return any(graph.service_counts(each)[1] for each in (name, f"{name}{SEND}"))


def _types(graph: Graph, name: str, what: str) -> list[str]:
    """Return the types with which nodes serve the service or action (`what`) `name`."""
    kind = "action_server" if what == "action" else "service"
    of_nodes = (graph.of_node(kind, node.full_name, hidden=True) for node in graph.nodes(hidden=True))
    return sorted({each for found in of_nodes for known, types in found if known == name for each in types})


def wait_for_server(
    graph: Graph,
    status: ServerStatus,
    ready: Callable[[], bool],
    look: Callable[..., list[tuple[str, list[str]]]],
    what: str,
    kind: str,
) -> str:
    """Wait for a server of the type `kind`; return '' when there is one, or why there will be none if its node died.

    After `TELL` s it prints once on stderr which services exist instead, or before that which type the name has, and
    goes on waiting.
    """
    began, told = time.monotonic(), False
    name = status.name.removesuffix(SEND)
    if not graph.settle(ready, names_only=True):
        tell_if_alone(graph)
    while not graph.wait_until(ready, LOOK):
        if _served(graph, name):
            if not told and time.monotonic() > began + MISFIT and (types := _types(graph, name, what)):
                told = kind not in types
                if told:
                    print(
                        f"still waiting; {name} is served with the type {types[0]}, and you ask for {kind}. Ctrl-C "
                        f"ends this; then write: ros2 {COMMANDS[what]} {name} {types[0]} ...",
                        file=sys.stderr,
                    )
        elif report := status.ending():
            return f"There is no such {what}. {report}"
        if not told and time.monotonic() > began + TELL:
            told = True
            own = sorted(
                each for each, types in look() if not types[0].startswith(OF_EVERY_NODE) and _served(graph, each)
            )
            served = f"served here: {', '.join(own)}" if own else f"there is no {what} here"
            print(f"still waiting; {served}. Ctrl-C ends this.", file=sys.stderr)
    return ""
