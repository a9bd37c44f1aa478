"""Which nodes the ROS graph shows in the session's domain, without those that it has failed to forget.

A program that ends publishes the last changes of its node list, and then leaves.  The middleware learns the two in two
threads: on a busy machine it may remove the program first, and then enter the late list as if it were a new program's.
Such a ghost has a name and no endpoint, and stays for as long as this process does (rmw_fastrtps_shared_cpp,
listener_thread.cpp; rmw_dds_common, GraphCache::update_participant_entities).
"""

import time
from collections import Counter
from collections.abc import Iterable

from rclpy.node import Node

from course.rclpy_internals import NodeNameNonExistentError
from course.waiting import wait_until

FORGOTTEN = 15.0  # s; a node that was killed is in the graph for 5 (discovery.xml), on a busy machine for longer
GHOST = 1.0  # s for which the node of a program that has ended is listed with no endpoint, until it counts as a ghost


class Presence:
    """The nodes that `node`, the session's own, sees."""

    def __init__(self, node: Node):
        self._node = node
        self._ghosts: Counter[str] = Counter()

    def names(self) -> list[str]:
        """The full names of all nodes, hidden ones too; a name that two nodes have is there twice."""
        listed = Counter(
            f"{namespace.rstrip('/')}/{name}" for name, namespace in self._node.get_node_names_and_namespaces()
        )
        self._ghosts &= listed
        return sorted((listed - self._ghosts).elements())

    def wait_until_gone(self, ended: Iterable[str], others: Iterable[str]) -> None:
        """Wait until the graph has forgotten the nodes `ended`; `others`, perhaps of the same names, are still there.

        A call made next must not meet the old node.
        """
        seen = time.monotonic()  # when one of them had an endpoint

        def forgotten() -> bool:
            nonlocal seen
            left = set(ended) & set(difference(self.names(), others))
            if any(self._has_endpoints(name) for name in left):
                seen = time.monotonic()
            elif left and time.monotonic() - seen > GHOST:
                self._ghosts.update(left)
                return True
            return not left

        wait_until(forgotten, FORGOTTEN, alert=False)

    def services(self, name: str) -> set[str]:
        """The services that the node with the full name `name` offers."""
        try:
            return {service for service, _ in self._node.get_service_names_and_types_by_node(*_parts(name))}
        except NodeNameNonExistentError:
            return set()

    def served(self) -> set[str]:
        """The services that any node offers."""
        return {name for name, _ in self._node.get_service_names_and_types() if self._node.count_services(name)}

    def _has_endpoints(self, name: str) -> bool:
        # Every node of rclpy or rclcpp publishes parameter events, unless it was told not to.
        try:
            return bool(self._node.get_publisher_names_and_types_by_node(*_parts(name)) or self.services(name))
        except NodeNameNonExistentError:
            return False


def base(node: str) -> str:
    """The name of a node without its namespace."""
    return node.rpartition("/")[2]


def difference(after: Iterable[str], before: Iterable[str]) -> list[str]:
    """The names that are in `after` more often than in `before`, sorted."""
    return sorted((Counter(after) - Counter(before)).elements())


def _parts(name: str) -> tuple[str, str]:
    namespace, _, name = name.rpartition("/")
    return name, namespace or "/"
