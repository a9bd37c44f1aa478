"""The nodes of the ROS graph in the session's domain, without those that the middleware failed to remove.

A program that ends publishes the last changes of its node list, and then leaves.  The middleware handles these in two
threads: on a busy machine it may remove the program first, and then enter the late list as if from a new program. Such
a ghost has a name but no endpoint, and stays until this process ends (rmw_fastrtps_shared_cpp, listener_thread.cpp;
rmw_dds_common, GraphCache::update_participant_entities).
"""

import time
from collections import Counter
from collections.abc import Iterable

from rcl_interfaces.srv import ListParameters
from rclpy.node import Node

from course.foundation.waiting import wait_until
from course.ros.discovery import is_of_process
from course.ros.names import full, split
from course.ros.onlooker import Onlooker
from course.ros.rclpy_internals import NodeNameNonExistentError, unwatched
from course.session.node_process import NodeProcess

REMOVAL = 15.0  # s; a killed node stays in the graph for 5 s (discovery.xml), longer on a busy machine
SETTLED = 2.0  # s that a program may take from making its node to spinning it
UNKNOWN = "_NODE_NAME_UNKNOWN_"  # the name of a node that is not discovered yet
EVENTS = "/parameter_events"  # every rclpy node has a publisher there, and every rclcpp node unless disabled


class Presence:
    """The nodes that `node`, the session's own, sees."""

    def __init__(self, node: Node):
        self._node = node

    @property
    def unreadable(self) -> bool:
        """Return True if a node of the last list has a name that is not valid text: `names` leaves it out."""
        return isinstance(self._node, Onlooker) and self._node.unreadable

    def names(self) -> list[str]:
        """Return the full names of all nodes, hidden ones too; a name of two nodes is listed twice."""
        listed = Counter(full(name, space) for name, space in self._node.get_node_names_and_namespaces())
        publishers = self._node.get_publishers_info_by_topic(EVENTS)
        alive = Counter(full(each.node_name, each.node_namespace) for each in publishers)
        for name in listed - alive:
            listed[name] = alive[name] or int(self._has_endpoints(name))
        return sorted(listed.elements())

    def of_process(self, pid: int) -> list[str]:
        """Return the full names of the nodes of a process on this host, if they publish parameter events."""
        publishers = self._node.get_publishers_info_by_topic(EVENTS)
        own = (each for each in publishers if is_of_process(each.endpoint_gid, pid))
        return sorted(full(each.node_name, each.node_namespace) for each in own if each.node_name != UNKNOWN)

    def new_of_nobody(self, before: Iterable[str]) -> list[str]:
        """Return the nodes that are not in `before` and belong to no known process."""
        owned = {full(each.node_name, each.node_namespace) for each in self._node.get_publishers_info_by_topic(EVENTS)}
        return [name for name in difference(self.names(), before) if name not in owned]

    def wait_until_gone(self, ended: Iterable[str], others: Iterable[str]) -> None:
        """Wait until the graph has removed the nodes `ended`; `others`, perhaps with the same names, remain.

        So the next call cannot reach the old node.
        """
        wait_until(lambda: not set(ended) & set(difference(self.names(), others)), REMOVAL, alert=False)

    def settle(self, process: NodeProcess, served: set[str]) -> None:
        """Wait until the program answers from its executor, so that its start is complete.

        `served` are the services that existed before it.  A program without parameter services, or busy for longer than
        `SETTLED`, is not waited for.
        """
        end = time.monotonic() + SETTLED
        client = self._node.create_client(ListParameters, f"{process.nodes[0]}/list_parameters")
        wait_until(lambda: client.service_is_ready() or not process.alive, SETTLED, alert=False)
        if process.alive and client.service_is_ready():
            with unwatched():
                future = client.call_async(ListParameters.Request())
            wait_until(lambda: future.done() or not process.alive, end - time.monotonic(), alert=False)
        for name in process.nodes:  # a ghost of the same name has no services
            process.services |= self.services(name) or self.served() - served
        self._node.destroy_client(client)

    def services(self, name: str) -> set[str]:
        """Return the services of the node with the full name `name`."""
        try:
            return {service for service, _ in self._node.get_service_names_and_types_by_node(*split(name))}
        except NodeNameNonExistentError:
            return set()

    def served(self) -> set[str]:
        """Return the services of all nodes."""
        return {name for name, _ in self._node.get_service_names_and_types() if self._node.count_services(name)}

    def _has_endpoints(self, name: str) -> bool:
        try:
            found = self._node.get_publisher_names_and_types_by_node(*split(name))
        except NodeNameNonExistentError:
            return False
        return bool(found or self.services(name))


def difference(after: Iterable[str], before: Iterable[str]) -> list[str]:
    """Return the names that are in `after` more often than in `before`, sorted."""
    return sorted((Counter(after) - Counter(before)).elements())
