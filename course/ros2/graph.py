"""What a verb sees of the ROS graph: a node of its own that waits until discovery is complete, then answers.

ros2cli asks a daemon that has watched the graph for long, or else waits half a second, whatever has arrived by then.
Here there is no daemon.  What must be there is known: every participant on this host holds a UDP port of its domain
(RTPS 2.5, 9.6.2.3), so the look is complete when as many participants are known, with their nodes, as there are ports.
"""

import contextlib
import math
import os
import signal
import threading
import time
from pathlib import Path
from typing import NamedTuple

from course.environment import DISCOVERY_PROFILE
from course.waiting import wait_until

PROFILES = Path(__file__).parent
RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
HIDDEN_PREFIX = "_"
COMMAND_PREFIX = "_ros2cli"

POLL = 0.01  # s between two looks: rclpy exposes no event for a change of the graph
QUIET = 0.1  # s without a change, before topics and services count as complete
REMOTE = 0.3  # s given to other hosts, whose participants cannot be counted beforehand
COUNTABLE = range(101)  # domains; from 101 on their ports are also Linux's ephemeral ones, and mean nothing
UNCOUNTED = 0.5  # s given to all hosts in other domains, as ros2cli does
PATIENCE = 3.5  # s after which an incomplete look is taken as it is; Fast DDS announces a participant every three
SPIN = 0.1  # s between two looks at a pending Ctrl-C


class NodeName(NamedTuple):
    """A node as the graph knows it; sorts as in ros2cli, by the name first."""

    name: str
    namespace: str
    full_name: str


def is_hidden(name: str) -> bool:
    """Whether a part of a topic's, service's or node's name begins with an underscore."""
    return any(part.startswith(HIDDEN_PREFIX) for part in name.split("/"))


def absolute(node_name: str) -> str:
    """Return a node's name with its leading slash."""
    return node_name if node_name.startswith("/") else "/" + node_name


def split(node_name: str) -> tuple[str, str]:
    """Return name and namespace of a full node name."""
    namespace, name = absolute(node_name).rsplit("/", 1)
    return name, namespace or "/"


def participants_here(domain: int) -> int:
    """Return how many DDS participants of `domain` this host (or network namespace) has, as told by their UDP ports."""
    first = 7400 + 250 * domain
    if domain not in COUNTABLE:
        return 0
    ports = set()
    for table in ("/proc/net/udp", "/proc/net/udp6"):
        with contextlib.suppress(OSError), open(table) as file:
            ports.update(int(line.split()[1].rpartition(":")[2], 16) for line in file.readlines()[1:])
    return sum(1 for port in range(first + 10, first + 250, 2) if port in ports)


def reaches_other_hosts() -> bool:
    """Whether ROS may be heard beyond this host: by its settings, and by a route other than loopback."""
    if os.environ.get(RANGE, "SUBNET") in ("LOCALHOST", "OFF"):
        return False
    try:
        with open("/proc/net/route") as file:
            return any(line.split()[0] != "lo" for line in file.readlines()[1:])
    except OSError:
        return True


def choose_transport(talks: bool) -> None:
    """Have Fast DDS speak UDP alone in this process, unless the user has chosen otherwise.

    UDP finds twenty nodes in 0.1 to 0.3 s; beside shared memory, a node's name comes up to four seconds late.
    A process that only looks also takes its readers' timing from the profile; one that talks keeps rmw_fastrtps's.
    """
    if os.environ.get("FASTRTPS_DEFAULT_PROFILES_FILE") == str(DISCOVERY_PROFILE):
        profile = "discovery.xml"
        if os.environ.get(RANGE) == "LOCALHOST" and not os.environ.get("ROS_STATIC_PEERS"):
            # rmw_fastrtps adds shared memory for LOCALHOST itself; SYSTEM_DEFAULT leaves all to the profile.
            os.environ[RANGE] = "SYSTEM_DEFAULT"
            profile = "localhost.xml"
        os.environ["FASTRTPS_DEFAULT_PROFILES_FILE"] = str(PROFILES / profile)
        if not talks:
            os.environ.setdefault("RMW_FASTRTPS_USE_QOS_FROM_XML", "1")
    os.environ.setdefault("FASTDDS_BUILTIN_TRANSPORTS", "UDPv4")


@contextlib.contextmanager
def uninterrupted():
    """Put a Ctrl-C off to the end; gives a list that is not empty when it has been pressed.

    Raised amid a call into rclpy, KeyboardInterrupt can come out as an error of another kind.
    """
    pressed = []
    if threading.current_thread() is not threading.main_thread():
        yield pressed  # signals are for the main thread
        return
    before = signal.signal(signal.SIGINT, lambda *_: pressed.append(True))
    try:
        yield pressed
    finally:
        signal.signal(signal.SIGINT, before)
    if pressed:
        raise KeyboardInterrupt


class Graph:
    """A node that looks at the graph, and with `talks=True` a whole rclpy node, which also calls and subscribes.

    A context manager; raises what rclpy raises when the middleware cannot be started.
    """

    def __init__(self, args=None, *, talks: bool = False, node_name: str | None = None) -> None:
        self.spin_time = getattr(args, "spin_time", None)
        self.least = REMOTE if reaches_other_hosts() else 0.0
        choose_transport(talks)
        import rclpy
        from rclpy.signals import SignalHandlerOptions

        from course.rclpy_internals import rclpy_implementation

        self.rclpy = rclpy_implementation
        self.context = rclpy.Context()
        # Python's own SIGINT handler raises KeyboardInterrupt, and every wait here is short enough for it to be heard.
        rclpy.init(args=[], context=self.context, signal_handler_options=SignalHandlerOptions.NO)
        if self.context.get_domain_id() not in COUNTABLE:
            self.least = UNCOUNTED
        name = node_name or f"{COMMAND_PREFIX}_{os.getpid()}"
        self.node = self._executor = None
        if talks:
            overrides = []
            if getattr(args, "use_sim_time", False):
                overrides.append(rclpy.Parameter("use_sim_time", value=True))
            self.node = rclpy.create_node(
                name, context=self.context, start_parameter_services=False, parameter_overrides=overrides
            )
            self.handle = self.node.handle
        else:
            with self.context.handle:
                self.handle = self.rclpy.Node(name, "", self.context.handle, None, False, True)
        self.created = time.monotonic()

    def __enter__(self):
        return self

    def __exit__(self, *exception) -> None:
        if self._executor is not None:
            self._executor.shutdown()
        if self.node is not None:
            self.node.destroy_node()
        else:
            self.handle.destroy_when_not_in_use()
        self.context.try_shutdown()

    # --- waiting ---

    def settle(self, ready=None, *, names_only: bool = False) -> bool:
        """Wait until discovery is complete, or until `ready()`; return whether `ready()` holds then.

        `--spin-time` waits just that long.  `names_only` does without the nodes' topics and services.
        """
        seen, changed = None, self.created
        while True:
            if ready is not None and ready():
                return True
            now = time.monotonic()
            elapsed = now - self.created
            if self.spin_time is not None:
                if elapsed >= self.spin_time:
                    break
            else:
                state = None if names_only else self._size()
                if state != seen:
                    seen, changed = state, now
                quiet = names_only or now - changed >= QUIET
                if elapsed >= PATIENCE or (quiet and elapsed >= self.least and self._complete(names_only)):
                    break
            time.sleep(POLL)
        return ready is not None and ready()

    def _size(self) -> tuple[int, ...]:
        with self.handle:
            endpoints = self.rclpy.rclpy_get_topic_names_and_types(self.handle, True)
            return len(self.handle.get_node_names_and_namespaces()), len(endpoints)

    def _complete(self, names_only: bool) -> bool:
        """Whether all of this host's participants are known, each with its nodes, and each node with its endpoints."""
        # Every participant writes the names of its nodes to this topic, and every rclpy or rclcpp node has its
        # parameter events: the middleware knows an endpoint's node only once both have arrived.
        found = {participant for participant, _ in self._endpoints("publishers", "ros_discovery_info")}
        if len(found) < participants_here(self.context.get_domain_id()):
            return False
        events = self._endpoints("publishers", "/parameter_events")
        resolved = {participant for participant, node in events + self._endpoints("publishers", "/rosout") if node}
        if found - resolved:
            return False
        if names_only:
            return True
        # Subscriptions are announced apart from publishers, and a service has one of each.
        if found - {participant for participant, _ in self._endpoints("subscriptions", "ros_discovery_info")}:
            return False
        nodes = [node for node in self.nodes(hidden=True) if not node.name.startswith(COMMAND_PREFIX)]
        return len(nodes) <= sum(1 for _, node in events if node)

    def _endpoints(self, side: str, topic: str) -> list[tuple[bytes, str]]:
        """Return participant and node (or '') of each of a topic's publishers or subscriptions."""
        look = getattr(self.rclpy, f"rclpy_get_{side}_info_by_topic")
        with self.handle:
            infos = look(self.handle, topic, not topic.startswith("/"))
        return [
            (bytes(info["endpoint_gid"][:12]), "" if "UNKNOWN" in info["node_name"] else info["node_name"])
            for info in infos
        ]

    def wait_until(self, ready, timeout: float | None = None) -> bool:
        """Wait for `ready()`, which no event announces; return whether it came true within `timeout` (s)."""
        return bool(wait_until(ready, math.inf if timeout is None else timeout))

    def spin(self, until=None, timeout: float | None = None) -> bool:
        """Run callbacks until `until()` (or for ever); return False if `timeout` (s) ends first."""
        from rclpy.executors import SingleThreadedExecutor

        if self._executor is None:
            self._executor = SingleThreadedExecutor(context=self.context)
            self._executor.add_node(self.node)
        end = None if timeout is None else time.monotonic() + timeout
        with uninterrupted() as pressed:
            while not pressed and (until is None or not until()):
                left = SPIN if end is None else min(SPIN, end - time.monotonic())
                if left <= 0:
                    return False
                self._executor.spin_once(timeout_sec=left)
        return True

    # --- looking ---

    def nodes(self, *, hidden: bool = False) -> list[NodeName]:
        """Return the nodes; two of the same name are both there."""
        with self.handle:
            found = self.handle.get_node_names_and_namespaces()
        return [
            NodeName(name, namespace, f"{namespace.rstrip('/')}/{name}")
            for name, namespace in found
            if name and (hidden or not name.startswith(HIDDEN_PREFIX))
        ]

    def find_node(self, node_name: str, *, hidden: bool = False, timeout: float = 0.0) -> bool:
        """Wait for the node `node_name`, `timeout` (s) or longer; return whether it is there."""
        full_name = absolute(node_name)

        def there() -> bool:
            return any(node.full_name == full_name for node in self.nodes(hidden=hidden))

        return self.settle(there, names_only=True) or self.wait_until(there, self.created + timeout - time.monotonic())

    def topics(self, *, hidden: bool = False) -> list[tuple[str, list[str]]]:
        """Return topics with their types, sorted by name."""
        with self.handle:
            found = self.rclpy.rclpy_get_topic_names_and_types(self.handle, False)
        return sorted((name, types) for name, types in found if hidden or not is_hidden(name))

    def services(self, *, hidden: bool = False) -> list[tuple[str, list[str]]]:
        """Return services with their types, sorted by name."""
        with self.handle:
            found = self.rclpy.rclpy_get_service_names_and_types(self.handle)
        return sorted((name, types) for name, types in found if hidden or not is_hidden(name))

    def actions(self) -> list[tuple[str, list[str]]]:
        """Return actions with their types, sorted by name."""
        with self.handle:
            return sorted(self.handle.get_action_names_and_types())

    def types_of(self, name: str, look) -> list[str]:
        """Return the types of `name` among what `look()` returns, as soon as they are known, else []."""

        def found() -> list[str]:
            return next((types for known, types in look() if known == name), [])

        self.settle(found)
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
        """Return names and types of what a node has: `kind` is publisher, subscriber, service, client or action_*."""
        name, namespace = split(node_name)
        with self.handle:
            if kind.startswith("action_"):
                found = getattr(self.handle, f"get_{kind}_names_and_types_by_node")(name, namespace)
            else:
                look = getattr(self.rclpy, f"rclpy_get_{kind}_names_and_types_by_node")
                demangled = (False,) if kind in ("publisher", "subscriber") else ()
                found = look(self.handle, *demangled, name, namespace)
        return sorted((name, types) for name, types in found if hidden or not is_hidden(name))
