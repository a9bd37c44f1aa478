"""The ROS graph for the verbs of `ros2`: a node that waits until discovery is complete.

ros2cli asks a daemon that has long watched the graph, or else waits half a second and uses what has arrived by then.
Here there is no daemon, but the number of participants is known: every participant on this host has a UDP port of its
domain (RTPS 2.5, 9.6.2.3).  So discovery is complete when as many participants are known, with their nodes, as there
are ports; each of them is also asked to announce itself.
"""

from __future__ import annotations

import contextlib
import math
import os
import signal
import threading
import time
from argparse import Namespace
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, Self

from course.environment import DISCOVERY_PROFILE, RANGE
from course.foundation.waiting import wait_until
from course.ros.discovery import COUNTABLE, ask_participants, participants_here
from course.ros.fast_dds import ignore_discovery
from course.ros.names import HIDDEN_PREFIX, absolute, is_hidden, split
from course.ros.node_names import names_and_namespaces
from course.ros.rclpy_patches import load_generator_later, load_numpy_later

if TYPE_CHECKING:  # rclpy is loaded by the first Graph: `-h` and the Tab key need none
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.node import Node

PROFILES = Path(__file__).parent
COMMAND_PREFIX = "_ros2cli"

QUIET = 0.1  # s without a change after which topics and services count as complete
CERTAIN = 0.5  # s without one after which a name that is looked for is not there, or has no publisher
LEAVING = 1.0  # s for which a node that ends may be listed without what it had
REMOTE = 0.3  # s to wait for other hosts, whose participants cannot be counted beforehand
UNCOUNTED = 0.5  # s to wait for all hosts in the other domains, as ros2cli does
PATIENCE = 3.5  # s to wait for discovery at most; Fast DDS announces a participant every 3 s
ASK_AGAIN = 0.2  # s until participants that have not answered are asked again
SPIN = 0.1  # s between two looks whether Ctrl-C was pressed


class NodeName(NamedTuple):
    """A node in the graph; sorted as in ros2cli, by its name first."""

    name: str
    namespace: str
    full_name: str


def reaches_other_hosts() -> bool:
    """Return True if ROS can reach other hosts: its settings allow it, and there is a route other than loopback."""
    if os.environ.get(RANGE, "SUBNET") in ("LOCALHOST", "OFF"):
        return False
    try:
        with open("/proc/net/route") as file:
            return any(line.split()[0] != "lo" for line in file.readlines()[1:])
    except OSError:
        return True


def choose_transport(talks: bool) -> None:
    """Have Fast DDS use only UDP in this process, unless the user has chosen otherwise.

    UDP finds twenty nodes in 0.1 to 0.3 s; together with shared memory, a node's name can come four seconds late.
    A process that only looks also takes the timing of its readers from the profile; one that talks keeps
    rmw_fastrtps's own.
    """
    if os.environ.get("FASTRTPS_DEFAULT_PROFILES_FILE") == str(DISCOVERY_PROFILE):
        profile = "discovery.xml"
        if os.environ.get(RANGE) == "LOCALHOST" and not os.environ.get("ROS_STATIC_PEERS"):
            # For LOCALHOST, rmw_fastrtps itself adds shared memory; SYSTEM_DEFAULT leaves everything to the profile.
            os.environ[RANGE] = "SYSTEM_DEFAULT"
            profile = "localhost.xml"
        os.environ["FASTRTPS_DEFAULT_PROFILES_FILE"] = str(PROFILES / profile)
        if not talks:
            os.environ.setdefault("RMW_FASTRTPS_USE_QOS_FROM_XML", "1")
    os.environ.setdefault("FASTDDS_BUILTIN_TRANSPORTS", "UDPv4")


@contextlib.contextmanager
def uninterrupted() -> Iterator[list[bool]]:
    """Delay the KeyboardInterrupt of Ctrl-C to the end of the block; the list is not empty once it was pressed.

    Raised in the middle of a call into rclpy, it could turn into another error.
    """
    pressed: list[bool] = []
    if threading.current_thread() is not threading.main_thread():
        yield pressed  # only the main thread receives signals
        return
    before = signal.signal(signal.SIGINT, lambda *_: pressed.append(True))
    try:
        yield pressed
    finally:
        signal.signal(signal.SIGINT, before)
    if pressed:
        raise KeyboardInterrupt


class Graph:
    """A context manager: a bare node for looking at the graph, or with `talks=True` a full rclpy node as `node`.

    Raises rclpy's errors when the middleware cannot be started.
    """

    def __init__(self, args: Namespace | None = None, *, talks: bool = False, node_name: str | None = None) -> None:
        self.spin_time: float | None = getattr(args, "spin_time", None)
        self.least = REMOTE if reaches_other_hosts() else 0.0
        choose_transport(talks)
        load_generator_later()
        if talks:
            load_numpy_later()
        import rclpy
        from rclpy.signals import SignalHandlerOptions

        from course.ros.rclpy_internals import rclpy_implementation

        self.rclpy = rclpy_implementation
        self.context = rclpy.Context()
        # Python's own SIGINT handler raises KeyboardInterrupt, and every wait here is short enough to notice it.
        rclpy.init(args=[], context=self.context, signal_handler_options=SignalHandlerOptions.NO)
        if self.context.get_domain_id() not in COUNTABLE:
            self.least = UNCOUNTED
        name = node_name or f"{COMMAND_PREFIX}_{os.getpid()}"
        self._node: Node | None = None
        self._executor: SingleThreadedExecutor | None = None
        if talks:
            overrides = []
            if getattr(args, "use_sim_time", False):
                overrides.append(rclpy.Parameter("use_sim_time", value=True))
            self._node = rclpy.create_node(
                name, context=self.context, start_parameter_services=False, parameter_overrides=overrides
            )
            self.handle = self._node.handle
        else:
            context = self.context.handle
            assert context is not None  # since `init`
            with context:
                self.handle = self.rclpy.Node(name, "", context, None, False, True)
        self.created = self.asked = time.monotonic()
        ask_participants(self.context.get_domain_id())

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        if self._executor is not None:
            self._executor.shutdown()
        ignore_discovery(self.context.get_domain_id())
        if self._node is not None:
            self._node.destroy_node()
        else:
            self.handle.destroy_when_not_in_use()
        self.context.try_shutdown()

    @property
    def node(self) -> Node:
        """The rclpy node of a graph that talks."""
        assert self._node is not None, "only Graph(talks=True) has a full node"
        return self._node

    # --- waiting ---

    def settle(
        self, ready: Callable[[], object] = lambda: False, *, names_only: bool = False, quiet: float = QUIET
    ) -> bool:
        """Wait until discovery is complete, or until `ready()`; return whether `ready()` holds then.

        With `--spin-time` this waits exactly that long.  With `names_only`, nodes count without their topics and
        services; without it, they are complete when none has come for `quiet` s.
        """
        seen: tuple[int, ...] = ()
        changed = self.created

        def complete() -> bool:
            nonlocal seen, changed
            now = time.monotonic()
            if not names_only and (size := self._size()) != seen:
                seen, changed = size, now
            settled = names_only or now - changed >= quiet
            return settled and now - self.created >= self.least and self.complete(names_only=names_only)

        if self.spin_time is None:
            wait_until(lambda: ready() or complete(), self.created + PATIENCE - time.monotonic())
        else:
            wait_until(ready, self.created + self.spin_time - time.monotonic())
        return bool(ready())

    def _size(self) -> tuple[int, ...]:
        with self.handle, contextlib.suppress(UnicodeDecodeError):
            endpoints = self.rclpy.rclpy_get_topic_names_and_types(self.handle, True)
            return len(names_and_namespaces(self.handle)[0]), len(endpoints)
        return ()

    def complete(self, *, names_only: bool = True) -> bool:
        """Return True if all participants of this host are known, with their nodes.

        Without `names_only`, the nodes' topics and services must be known, too.
        """
        # Every participant publishes the names of its nodes on this topic, and every rclpy or rclcpp node publishes
        # parameter events: the middleware knows to which node an endpoint belongs once both have arrived.
        found = {participant for participant, _ in self._endpoints("publishers", "ros_discovery_info")}
        domain = self.context.get_domain_id()
        if len(found) < participants_here(domain):
            if time.monotonic() - self.asked >= ASK_AGAIN:
                self.asked = time.monotonic()
                ask_participants(domain)
            return False
        events = self._endpoints("publishers", "/parameter_events")
        resolved = {participant for participant, node in events + self._endpoints("publishers", "/rosout") if node}
        if found - resolved:
            return False
        if names_only:
            return True
        # Subscriptions are announced separately from publishers, and a service has one of each.
        if found - {participant for participant, _ in self._endpoints("subscriptions", "ros_discovery_info")}:
            return False
        nodes = [node for node in self.nodes(hidden=True) if not node.name.startswith(COMMAND_PREFIX)]
        return len(nodes) <= sum(1 for _, node in events if node)

    def _endpoints(self, side: str, topic: str) -> list[tuple[bytes, str]]:
        """Return the participant and the node (or '') of each publisher or subscription (`side`) of a topic."""
        look = getattr(self.rclpy, f"rclpy_get_{side}_info_by_topic")
        try:
            with self.handle:
                infos = look(self.handle, topic, not topic.startswith("/"))
        except UnicodeDecodeError:  # a node's name is no text
            return []
        return [
            (bytes(info["endpoint_gid"][:12]), "" if "UNKNOWN" in info["node_name"] else info["node_name"])
            for info in infos
        ]

    def wait_until(self, ready: Callable[[], object], timeout: float | None = None) -> bool:
        """Wait until `ready()`, without running callbacks; return whether it became true within `timeout` s."""
        return bool(wait_until(ready, math.inf if timeout is None else timeout))

    def spin(self, until: Callable[[], object] = lambda: False, timeout: float | None = None) -> bool:
        """Run callbacks until `until()`, by default forever; return False after `timeout` s.

        Not `wait_until`: callbacks run only while this thread spins, and Ctrl-C is handled between two of them.
        """
        from rclpy.executors import SingleThreadedExecutor

        if self._executor is None:
            self._executor = SingleThreadedExecutor(context=self.context)
            self._executor.add_node(self.node)
        end = None if timeout is None else time.monotonic() + timeout
        with uninterrupted() as pressed:
            while not pressed and not until():
                left = SPIN if end is None else min(SPIN, end - time.monotonic())
                if left <= 0:
                    return False
                self._executor.spin_once(timeout_sec=left)
        return True

    # --- looking ---

    def nodes(self, *, hidden: bool = False) -> list[NodeName]:
        """Return the nodes; two nodes of the same name are listed twice, and a name that is not valid text is
        escaped.
        """
        found, _ = names_and_namespaces(self.handle)
        return [
            NodeName(name, namespace, f"{namespace.rstrip('/')}/{name}")
            for name, namespace in found
            if name and (hidden or not name.startswith(HIDDEN_PREFIX))
        ]

    def find_node(self, node_name: str, *, hidden: bool = False, timeout: float = 0.0) -> bool:
        """Wait until discovery is complete, and at least `timeout` s, for a node; return whether it is there."""
        full_name = absolute(node_name)

        def there() -> bool:
            return any(node.full_name == full_name for node in self.nodes(hidden=hidden))

        return self.settle(there, names_only=True) or self.wait_until(there, self.created + timeout - time.monotonic())

    def topics(self, *, hidden: bool = False) -> list[tuple[str, list[str]]]:
        """Return the topics with their types, sorted by name."""
        with self.handle:
            found = self.rclpy.rclpy_get_topic_names_and_types(self.handle, False)
        return sorted((name, types) for name, types in found if hidden or not is_hidden(name))

    def services(self, *, hidden: bool = False) -> list[tuple[str, list[str]]]:
        """Return the services with their types, sorted by name."""
        with self.handle:
            found = self.rclpy.rclpy_get_service_names_and_types(self.handle)
        return sorted((name, types) for name, types in found if hidden or not is_hidden(name))

    def actions(self) -> list[tuple[str, list[str]]]:
        """Return the actions with their types, sorted by name."""
        with self.handle:
            return sorted(self.handle.get_action_names_and_types())

    def types_of(self, name: str, look: Callable[[], list[tuple[str, list[str]]]]) -> list[str]:
        """Return all the types that `look()` lists for `name` once discovery is complete."""

        def found() -> list[str]:
            return next((types for known, types in look() if known == name), [])

        self.settle()
        if not found():  # on a busy machine some of a node's topics and services may come late
            self.settle(found, quiet=CERTAIN)
        return found()

    def counts(self, name: str) -> tuple[int, int]:
        """Return how many publishers and subscriptions a topic has."""
        with self.handle:
            return self.handle.get_count_publishers(name), self.handle.get_count_subscribers(name)

    def service_counts(self, name: str) -> tuple[int, int]:
        """Return how many clients and servers a service has."""
        with self.handle:
            return self.handle.get_count_clients(name), self.handle.get_count_services(name)

    def of_node(self, kind: str, node_name: str, *, hidden: bool = False) -> list[tuple[str, list[str]]]:
        """Return the names and types of a node's publishers, or of another `kind`.

        The kinds are publisher, subscriber, service, client, action_server and action_client.
        """
        found: list[tuple[str, list[str]]] = []

        def looked() -> bool:
            nonlocal found
            try:
                found = self._look_at_node(kind, *split(node_name))
            except RuntimeError:  # the middleware knows its name, and not yet, or no more, what it has
                return all(node.full_name != absolute(node_name) for node in self.nodes(hidden=True))
            return True

        wait_until(looked, LEAVING)  # one that is still listed then has left nothing but its name
        return sorted((name, types) for name, types in found if hidden or not is_hidden(name))

    def _look_at_node(self, kind: str, name: str, namespace: str) -> list[tuple[str, list[str]]]:
        with self.handle:
            if kind.startswith("action_"):
                return getattr(self.handle, f"get_{kind}_names_and_types_by_node")(name, namespace)
            look = getattr(self.rclpy, f"rclpy_get_{kind}_names_and_types_by_node")
            demangled = (False,) if kind in ("publisher", "subscriber") else ()
            return look(self.handle, *demangled, name, namespace)
