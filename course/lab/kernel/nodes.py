"""The nodes panel: running and dead nodes, their topics, services, actions and parameters; restart and stop."""

import os
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

from rcl_interfaces.msg import ParameterValue
from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.action import get_action_client_names_and_types_by_node, get_action_server_names_and_types_by_node
from rclpy.client import Client
from rclpy.parameter import parameter_value_to_python

from course.errors import LiveError
from course.lab.kernel.panels import Changes, Panels, Topic
from course.ros.names import OF_EVERY_NODE, is_hidden, is_valid, own_first, split
from course.ros.rclpy_internals import NodeNameNonExistentError, RCLError
from course.session.live import Session, current
from course.session.table import Row

SHOWN = 500  # parameters of a node
LONGEST = 1000  # characters of a name or a value that are shown
NAME = 1000  # bytes of a parameter's name; a parameter with a longer one cannot be set from a page
ANSWER = 1.0  # s that a node may take to return its parameters
OF_NO_INTEREST = ("/rosout", "/parameter_events")  # topics that every node has

_stopped: list[Row] = []  # nodes stopped by this panel, which can start them again


def add(panels: Panels) -> None:
    """Add the panel's methods and topics."""
    panels.methods |= {"nodes.restart": restart, "nodes.stop": stop, "nodes.end": end}
    panels.topics |= {"nodes": Topic(lambda: Changes(state), 0.25), "nodes.node": Topic(Details, 1.0)}


def session() -> Session:
    """Return the kernel's live session; raises LiveError when it has ended."""
    if (found := current()) is None:
        raise LiveError("the session has ended: run the notebook's first cell, `ros = course.live()`")
    return found


def state() -> dict[str, Any]:
    """Return the domain, and each node as the page shows it; no nodes when the session has ended."""
    if (live := current()) is None:
        _stopped.clear()
        return {"domain": None, "nodes": []}
    rows = live.rows()
    known = {row.started_as for row in rows}
    _stopped[:] = [row for row in _stopped if row.started_as not in known]
    shown = [_shown(row, "running" if row.alive else "dead") for row in rows]
    shown += [_shown(row, "stopped") for row in _stopped]
    return {"domain": live.domain_id, "nodes": sorted(shown, key=lambda node: str(node["name"]))}


def restart(name: str) -> None:
    """Restart the node or the file `name`; raises LiveError, which says how it ended, when it does not start."""
    session().restart(name)


def stop(name: str) -> None:
    """Stop the node or the file `name`; the panel still shows it."""
    live = session()
    rows = [row for row in live.rows() if row.started_as == name]
    live.stop(name)
    _stopped.extend(row if row.over else replace(row, over=time.time()) for row in rows)


def end(process: int, born: int) -> None:
    """Stop a program started elsewhere, by process id and birth; raises LiveError if that fails."""
    session().stop_outsider(process, born)


def _shown(row: Row, state: str) -> dict[str, Any]:
    return {
        "name": row.name,
        "key": row.started_as,
        "process": row.process,
        "state": state,
        "line": row.state if state != "stopped" else "stopped",
        "since": row.since,
        "over": row.over,
        "where": row.where,
        "pid": row.pid,
        "at": "this kernel" if row.pid == os.getpid() else f"process {row.pid}" if row.pid else "",
        "stories": list(row.reports),
    }


class Details:
    """A feed of a node's topics, services and actions, and of its parameters' values."""

    def __init__(self, name: str):
        """Follow the node with the full name `name`."""
        self._name = name
        self._last: Any = None
        self._session: Session | None = None
        self._clients: list[Client] = []

    def read(self) -> dict[str, Any] | None:
        """Return all details if any has changed."""
        live = session()
        if live is not self._session:
            self._session = live
            kinds = {"list_parameters": ListParameters, "get_parameters": GetParameters}
            self._clients = [
                live.node.create_client(kind, f"{self._name}/{service}")
                for service, kind in kinds.items()
                if is_valid(self._name)
            ]
        parameters = self._parameters()  # first, because a node that has ended is waited for
        found = {**endpoints(live, self._name), **parameters}
        if found == self._last:
            return None
        self._last = found
        return found

    def close(self) -> None:
        """Stop asking the node."""
        if self._session is not None and self._session.ok:
            for client in self._clients:
                self._session.node.destroy_client(client)

    def _parameters(self) -> dict[str, Any]:
        """Return {"parameters": names with values}, and {"silent": True} if the node does not answer.

        The parameters that every node has come last.
        """
        if not self._clients:
            return {"parameters": [], "silent": True}
        listing, getting = self._clients
        listed = answer(listing, ListParameters.Request())
        names = sorted(set(listed.result.names), key=own_first)[:SHOWN] if listed else []
        got = answer(getting, GetParameters.Request(names=names)) if listed else None
        if got is None:
            return {"parameters": [], "silent": True}
        values = [_value(value) for value in got.values]
        shown = zip(map(_cut, names), values, strict=False)
        return {"parameters": [list(each) for each in shown], "silent": False}


def _value(value: ParameterValue) -> str:
    try:
        text = repr(parameter_value_to_python(value))
    except RuntimeError:  # a program that does not use rclpy may answer with an unknown type
        return f"(of type {value.type}, which rcl_interfaces/msg/ParameterType does not define)"
    return _cut(text)


def _cut(text: str) -> str:
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}… ({len(text):,} characters)"


def of_usual_length(names: Iterable[str]) -> list[str]:
    """Return the names of parameters that have at most `NAME` bytes: a page needs the whole name to set one."""
    return [name for name in names if len(name.encode(errors="replace")) <= NAME]


def endpoints(live: Session, full_name: str, *, everything: bool = False) -> dict[str, list[list[str]]]:
    """Return names with types, by the node's role; with `everything` also those that every node has."""
    node, (name, namespace) = live.node, split(full_name)
    asked: dict[str, Callable[[], Iterable[tuple[str, list[str]]]]] = {
        "publishes": lambda: node.get_publisher_names_and_types_by_node(name, namespace),
        "subscribes to": lambda: node.get_subscriber_names_and_types_by_node(name, namespace),
        "serves": lambda: node.get_service_names_and_types_by_node(name, namespace),
        "calls": lambda: node.get_client_names_and_types_by_node(name, namespace),
        "offers the actions": lambda: get_action_server_names_and_types_by_node(node, name, namespace),
        "sends goals to": lambda: get_action_client_names_and_types_by_node(node, name, namespace),
    }
    return {what: _listed(ask, everything=everything) for what, ask in asked.items()}


def _listed(ask: Callable[[], Iterable[tuple[str, list[str]]]], *, everything: bool) -> list[list[str]]:
    try:
        found = list(ask())
    except (NodeNameNonExistentError, RCLError, UnicodeDecodeError):  # it has left the graph, or an invalid name
        return []
    return sorted([name, ", ".join(types)] for name, types in found if everything or of_interest(name, types[0]))


def of_interest(name: str, kind: str) -> bool:
    """Return True if a topic, service or action is neither hidden nor one that every node has; `kind` is its type."""
    return name not in OF_NO_INTEREST and not is_hidden(name) and not kind.startswith(OF_EVERY_NODE)


def answer(client: Client, request: object) -> Any:
    """Return the response, or None if none came in time; the session's own thread receives it."""
    if not client.service_is_ready():
        return None
    future = client.call_async(request)
    done = threading.Event()
    future.add_done_callback(lambda _: done.set())
    if not done.wait(ANSWER):
        client.remove_pending_request(future)
        return None
    return future.result()
