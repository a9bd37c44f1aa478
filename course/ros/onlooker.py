"""A node that looks at a graph in which other programs may have nodes with invalid names.

rclpy checks the names of its own nodes, but a program without it can announce any bytes.  The queries of `Node` then
raise for all that they would return: UnicodeDecodeError for a name that is not valid text, RCLError for one node that
they are asked about by an invalid name.
"""

from collections.abc import Callable
from typing import Any

from rclpy.node import Node

from course.ros.node_names import names_and_namespaces
from course.ros.rclpy_internals import NodeNameNonExistentError, RCLError

# The queries of all, and those of one node.
OF_ALL = (
    "get_publishers_info_by_topic",
    "get_subscriptions_info_by_topic",
    "get_topic_names_and_types",
    "get_service_names_and_types",
)
OF_NODE = (
    "get_publisher_names_and_types_by_node",
    "get_subscriber_names_and_types_by_node",
    "get_service_names_and_types_by_node",
    "get_client_names_and_types_by_node",
)


class Onlooker(Node):
    """A node whose queries of endpoints leave out what has an invalid name.

    `unreadable`: True if the last list of nodes has one whose name is not valid text, with its bytes escaped.
    """

    unreadable = False

    def get_node_names_and_namespaces(self) -> list[tuple[str, str]]:
        """Return names and namespaces of all nodes."""
        found, self.unreadable = names_and_namespaces(self.handle)
        return found


def _of_all(query: Callable[..., list[Any]]) -> Callable[..., list[Any]]:
    def ask(*args: Any, **kwargs: Any) -> list[Any]:
        try:
            return query(*args, **kwargs)
        except UnicodeDecodeError:
            return []

    return ask


def _of_node(query: Callable[..., list[Any]]) -> Callable[..., list[Any]]:
    def ask(*args: Any, **kwargs: Any) -> list[Any]:
        try:
            return query(*args, **kwargs)
        except NodeNameNonExistentError:
            raise
        except (RCLError, UnicodeDecodeError):
            raise NodeNameNonExistentError("its name, or one of its topics, is invalid") from None

    return ask


for _name in OF_ALL:
    setattr(Onlooker, _name, _of_all(getattr(Node, _name)))
for _name in OF_NODE:
    setattr(Onlooker, _name, _of_node(getattr(Node, _name)))
