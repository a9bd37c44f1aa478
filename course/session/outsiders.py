"""Programs outside of a session that use its domain: who serves a name there, in which process, and how to end it.

The middleware tells of each endpoint by which participant it was made, and that leads to its process.
"""

import contextlib
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from rclpy.node import Node
from rclpy.topic_endpoint_info import TopicEndpointInfo

from course.foundation import processes
from course.foundation.untrusted import one_line
from course.ros.discovery import is_of_process, ports
from course.ros.names import base, full
from course.session.node_process import NodeProcess
from course.session.presence import EVENTS, UNKNOWN
from course.session.watch import Handle

COMMAND = 60  # characters of a program's command line
PROGRAM, HOST = slice(12), slice(2, 4)  # in an endpoint's identifier


@dataclass(frozen=True)
class Outsider:
    """A node that the session has not started."""

    node: str  # its full name
    pid: int = 0  # of its process; 0 when it runs on another host, or out of sight
    command: str = ""

    @property
    def where(self) -> str:
        """Return where it runs, as far as that is known."""
        command = f" ({self.command})" if self.command else ""
        return f"process {self.pid}{command}" if self.pid else "a process that cannot be seen from here"

    def __str__(self) -> str:
        return f"{self.node if base(self.node) != UNKNOWN else 'a node'}, {self.where}"

    @property
    def program(self) -> tuple[Path, tuple[str, ...]] | None:
        """Return the Python file that it runs (`python FILE.py ARGUMENTS`), and its arguments; None for another."""
        with contextlib.suppress(OSError):
            python, *words = _words(self.pid)
            if Path(python).name.startswith("python") and words and words[0].endswith(".py"):
                file = Path(f"/proc/{self.pid}/cwd").readlink() / words[0]
                return (file, tuple(words[1:])) if file.is_file() else None
        return None

    @property
    def ending(self) -> str:
        """Return how to end it."""
        return f"Ctrl-C in its terminal, or `!kill {self.pid}`" if self.pid else "Ctrl-C where it was started"


class Outsiders:
    """The nodes beside those of `handles` that `node`, the session's own, sees in the ROS domain `domain`."""

    def __init__(self, node: Node, domain: int, handles: Mapping[str, Handle]):
        self._node, self._domain, self._handles = node, domain, handles

    def nodes(self) -> list[Outsider]:
        """All of them, hidden ones left out."""
        return list(self._outside(self._node.get_publishers_info_by_topic(EVENTS)))

    def serving(self, name: str) -> list[Outsider]:
        """Those that serve the service or the action `name`, or publish on the topic of that name."""
        return list(dict.fromkeys(self._outside(self._ends(name))))

    def own(self, name: str) -> list[str]:
        """The nodes and files of the session that serve the service or action `name`, or publish on the topic."""
        found = []
        ends = self._ends(name)
        for key, handle in list(self._handles.items()):
            pid = handle.pid if isinstance(handle, NodeProcess) else os.getpid()
            nodes = handle.nodes if pid == os.getpid() else None  # a kernel has many nodes, a file's are all its own
            if handle.alive and any(
                is_of_process(end.endpoint_gid, pid) and (nodes is None or self._node_of(end) in nodes) for end in ends
            ):
                found.append(key)
        return found

    def _ends(self, name: str) -> list[TopicEndpointInfo]:
        """Return what serves the service or the action `name`, or publishes on the topic of that name."""
        services = (name, f"{name}/_action/send_goal")
        topics = [(f"rr{service}Reply", True) for service in services] + [(name, False)]
        look = self._node.get_publishers_info_by_topic
        return [end for topic, raw in topics for end in look(topic, no_mangle=raw)]

    def _outside(self, ends: Iterable[TopicEndpointInfo]) -> Iterator[Outsider]:
        """The nodes outside that these are of."""
        started = {handle.pid for handle in list(self._handles.values()) if isinstance(handle, NodeProcess)}
        for endpoint in ends:
            name, identifier = self._node_of(endpoint), bytes(endpoint.endpoint_gid)
            if any(is_of_process(identifier, pid) for pid in (os.getpid(), *started)):
                continue
            if base(name).startswith("_") and base(name) != UNKNOWN:
                continue
            found = self._processes(identifier)
            if found and _session(found[0]) not in started:  # a program of the session may have started others
                yield Outsider(name, found[0], _command(found[0]))
            elif not found and identifier[HOST] != self._host:  # else the graph remembers what has ended
                yield Outsider(name)

    def _node_of(self, endpoint: TopicEndpointInfo) -> str:
        """Return the full name of the node that an endpoint belongs to; its program's parameter events may know it."""
        if endpoint.node_name == UNKNOWN:
            program = bytes(endpoint.endpoint_gid)[PROGRAM]
            known = self._node.get_publishers_info_by_topic(EVENTS)
            endpoint = next((each for each in known if bytes(each.endpoint_gid)[PROGRAM] == program), endpoint)
        return full(endpoint.node_name, endpoint.node_namespace)

    @cached_property
    def _host(self) -> bytes:
        """Return what the identifiers of this host's endpoints have in common."""
        publishers = self._node.get_publishers_info_by_topic(EVENTS)
        return next(
            (bytes(each.endpoint_gid)[HOST] for each in publishers if each.node_name == self._node.get_name()), b""
        )

    def _processes(self, identifier: bytes) -> list[int]:
        """The running processes that this endpoint may be of, and that take part in the domain."""
        sockets = {f"socket:[{port.inode}]" for port in ports(self._domain)}
        listed = (int(name) for name in os.listdir("/proc") if name.isdecimal())
        fitting = (pid for pid in listed if is_of_process(identifier, pid) and processes.birth(pid))
        return [pid for pid in fitting if _has(pid, sockets)]


def _has(pid: int, sockets: set[str]) -> bool:
    """Return True if a process has one of the sockets, or if it is another user's and cannot be asked."""
    try:
        descriptors = list(Path(f"/proc/{pid}/fd").iterdir())
    except PermissionError:
        return True
    except OSError:
        return False
    for descriptor in descriptors:
        with contextlib.suppress(OSError):  # closed meanwhile
            if os.readlink(descriptor) in sockets:
                return True
    return False


def _session(pid: int) -> int:
    with contextlib.suppress(OSError):
        return os.getsid(pid)
    return 0


def _words(pid: int) -> list[str]:
    """Return the command line of a process; raises OSError when it has gone."""
    return Path(f"/proc/{pid}/cmdline").read_text(errors="replace").rstrip("\0").split("\0")


def _command(pid: int) -> str:
    """Return the command line of a process, its program and its file without their folders."""
    try:
        words = _words(pid)
    except OSError:
        return ""
    named = " ".join([*(Path(word).name for word in words[:2]), *words[2:]])
    return one_line(named if len(named) <= COMMAND else f"{named[:COMMAND]}...")
