"""Programs outside of a session that use its domain: finding the process that serves a name, and how to end it.

The middleware knows the participant of each endpoint, and that identifies the process.
"""

import contextlib
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from rclpy.node import Node
from rclpy.topic_endpoint_info import TopicEndpointInfo

from course import registry
from course.foundation import processes
from course.foundation.untrusted import one_line
from course.ros.discovery import is_of_process, ports
from course.ros.names import base, full
from course.session.node_process import NodeProcess
from course.session.presence import EVENTS, UNKNOWN
from course.session.watch import Handle

COMMAND = 60  # characters of a program's command line
PROGRAM_WORDS = 3  # of a command line, which name the program: python -m NAME
JUPYTER = ("ipykernel", "jupyter")  # how the names of kernels and of a JupyterLab begin
SHELLS = ("bash", "dash", "fish", "ksh", "sh", "zsh")
PROGRAM, HOST = slice(12), slice(2, 4)  # in an endpoint's id


@dataclass(frozen=True)
class Outsider:
    """A node that the session did not start."""

    node: str  # the node's full name
    pid: int = 0  # process id; 0 if it runs on another host or cannot be seen
    command: str = ""

    @property
    def where(self) -> str:
        """Return where it runs, as far as known."""
        command = f" ({self.command})" if self.command else ""
        return f"process {self.pid}{command}" if self.pid else "a process that is not visible from here"

    def __str__(self) -> str:
        name = base(self.node)
        return f"{'a node' if name == UNKNOWN else 'a command' if name.startswith('_') else self.node}, {self.where}"

    @property
    def program(self) -> tuple[Path, tuple[str, ...]] | None:
        """Return the Python file that it runs (`python FILE.py ARGUMENTS`), and its arguments; None for another."""
        with contextlib.suppress(OSError):
            python, *words = processes.command_line(self.pid)
            if Path(python).name.startswith("python") and words and words[0].endswith(".py"):
                file = Path(f"/proc/{self.pid}/cwd").readlink() / words[0]
                return (file, tuple(words[1:])) if file.is_file() else None
        return None

    @property
    def process(self) -> tuple[int, int] | None:
        """Return the id and the `birth` of its process if a student may stop it here; None otherwise.

        Another user's process may not be stopped, and neither may a notebook's kernel, a JupyterLab, a shell, or a
        process without a command line: one that is just being started.
        """
        born = processes.birth(self.pid) if self.pid else 0
        if not born or processes.user(self.pid) != os.getuid() or self.pid in processes.ancestors(os.getpid()):
            return None
        if registry.of_kernel(self.pid):
            return None
        with contextlib.suppress(OSError):
            names = [Path(word).name.lstrip("-") for word in processes.command_line(self.pid)[:PROGRAM_WORDS]]
            if not any(name.startswith(JUPYTER) for name in names) and names[0] not in {*SHELLS, ""}:
                return self.pid, born
        return None

    @property
    def ending(self) -> str:
        """Return instructions for ending it."""
        if not self.pid:
            return "Ctrl-C where it was started"
        if processes.stopped(self.pid):  # by Ctrl-Z: another signal would wait until it goes on
            return f"`fg` and Ctrl-C in its terminal, or `!kill -9 {self.pid}`"
        parent = next(iter(processes.ancestors(self.pid)), 0)  # the session's kernel itself, if that has started a file
        kernel = registry.of_kernel(parent)
        if kernel and parent != os.getpid() and self.program:
            return f"`ros.stop()` in the notebook in {Path(kernel.folder).name}, or `!kill {self.pid}`"
        return f"Ctrl-C in its terminal, or `!kill {self.pid}`"


class Outsiders:
    """The nodes other than those of `handles` that `node`, the session's own, sees in the ROS domain `domain`."""

    def __init__(self, node: Node, domain: int, handles: Mapping[str, Handle]):
        self._node, self._domain, self._handles = node, domain, handles

    def nodes(self) -> list[Outsider]:
        """Return all of them, without hidden ones."""
        return list(self._outside(self._node.get_publishers_info_by_topic(EVENTS)))

    def serving(self, name: str) -> list[Outsider]:
        """Return those that serve the service or the action `name`, or publish on that topic, as `ros2 topic pub`."""
        return list(dict.fromkeys(self._outside(self._ends(name), hidden=True)))

    def calling(self, name: str) -> list[Outsider]:
        """Return those that have a client of the service or the action `name`, as `ros2 service call`."""
        return list(dict.fromkeys(self._outside(self._clients(name), hidden=True)))

    def own(self, name: str, *, calling: bool = False) -> list[str]:
        """Return the session's nodes and files that serve the service or action `name`, or publish on that topic.

        With `calling`, those that have a client of it.
        """
        found = []
        ends = self._clients(name) if calling else self._ends(name)
        for key, handle in list(self._handles.items()):
            pid = handle.pid if isinstance(handle, NodeProcess) else os.getpid()
            nodes = handle.nodes if pid == os.getpid() else None  # a file's nodes are all its own
            if handle.alive and any(
                is_of_process(end.endpoint_gid, pid) and (nodes is None or self._node_of(end) in nodes) for end in ends
            ):
                found.append(key)
        return found

    def is_command(self, endpoint_gid: Iterable[int], name: str) -> bool:
        """Return True if an endpoint belongs to a running command of this name, as `ros2`; for a node without a name.

        The middleware may know an endpoint before its node, and a command may end before that is known.
        """
        found = [_command(pid).split()[:PROGRAM_WORDS] for pid in self._processes(bytes(endpoint_gid))]
        return bool(found) and all(name in words for words in found)

    def are_gone(self, name: str) -> bool:
        """Return True if the graph has servers of `name`, and the programs of all of them have ended on this host."""
        known = [bytes(end.endpoint_gid) for end in self._ends(name)]
        return bool(known) and all(each[HOST] == self._host and not self._processes(each) for each in known)

    def _ends(self, name: str) -> list[TopicEndpointInfo]:
        """Return the endpoints that serve the service or the action `name`, or publish on that topic."""
        services = (name, f"{name}/_action/send_goal")
        topics = [(f"rr{service}Reply", True) for service in services] + [(name, False)]
        look = self._node.get_publishers_info_by_topic
        return [end for topic, raw in topics for end in look(topic, no_mangle=raw)]

    def _clients(self, name: str) -> list[TopicEndpointInfo]:
        """Return the endpoints that send requests to the service or the action `name`."""
        look = self._node.get_publishers_info_by_topic
        services = (name, f"{name}/_action/send_goal")
        return [end for service in services for end in look(f"rq{service}Request", no_mangle=True)]

    def _outside(self, ends: Iterable[TopicEndpointInfo], *, hidden: bool = False) -> Iterator[Outsider]:
        """Yield the outside nodes of these endpoints, with `hidden` those of a hidden name, too."""
        started = {handle.pid for handle in list(self._handles.values()) if isinstance(handle, NodeProcess)}
        for endpoint in ends:
            name, identifier = self._node_of(endpoint), bytes(endpoint.endpoint_gid)
            if any(is_of_process(identifier, pid) for pid in (os.getpid(), *started)):
                continue
            if base(name).startswith("_") and base(name) != UNKNOWN and not hidden:
                continue
            found = self._processes(identifier)
            if found and processes.session(found[0]) not in started:  # not started by a program of the session
                yield Outsider(name, found[0], _command(found[0]))
            elif not found and identifier[HOST] != self._host:  # otherwise the graph remembers an ended node
                yield Outsider(name)

    def _node_of(self, endpoint: TopicEndpointInfo) -> str:
        """Return the full name of an endpoint's node, if needed from its program's parameter events."""
        if endpoint.node_name == UNKNOWN:
            program = bytes(endpoint.endpoint_gid)[PROGRAM]
            known = self._node.get_publishers_info_by_topic(EVENTS)
            endpoint = next((each for each in known if bytes(each.endpoint_gid)[PROGRAM] == program), endpoint)
        return full(endpoint.node_name, endpoint.node_namespace)

    @cached_property
    def _host(self) -> bytes:
        """Return the common part of the ids of this host's endpoints."""
        publishers = self._node.get_publishers_info_by_topic(EVENTS)
        return next(
            (bytes(each.endpoint_gid)[HOST] for each in publishers if each.node_name == self._node.get_name()), b""
        )

    def _processes(self, identifier: bytes) -> list[int]:
        """Return the running processes in the domain that this endpoint may belong to."""
        sockets = {f"socket:[{port.inode}]" for port in ports(self._domain)}
        listed = (int(name) for name in os.listdir("/proc") if name.isdecimal())
        fitting = (pid for pid in listed if is_of_process(identifier, pid) and processes.birth(pid))
        return [pid for pid in fitting if _has(pid, sockets)]


def _has(pid: int, sockets: set[str]) -> bool:
    """Return True if a process has one of the sockets, or belongs to another user and cannot be checked."""
    try:
        descriptors = list(Path(f"/proc/{pid}/fd").iterdir())
    except PermissionError:
        return True
    except OSError:
        return False
    for descriptor in descriptors:
        with contextlib.suppress(OSError):  # the descriptor was closed meanwhile
            if os.readlink(descriptor) in sockets:
                return True
    return False


def _command(pid: int) -> str:
    """Return the command line of a process, with program and file without folders."""
    try:
        words = processes.command_line(pid)
    except OSError:
        return ""
    named = " ".join([*(Path(word).name for word in words[:2]), *words[2:]])
    return one_line(named if len(named) <= COMMAND else f"{named[:COMMAND]}...")
