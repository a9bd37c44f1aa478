"""Find the parts of a node that use a package's interfaces: they must end before the package is rebuilt."""

import functools
from collections.abc import Callable, Iterator

from rclpy.node import Node

from course.ros.rclpy_internals import action_type, destroy


def is_of(interface: object, package: str) -> bool:
    """Return True if an interface's class belongs to `package`."""
    return str(getattr(interface, "__module__", "")).split(".")[0] == package


def destructors(node: Node, package: str) -> Iterator[Callable[[], object]]:
    """Yield a function that destroys it for each client, server, publisher, ... of `node` with a type of `package`."""
    for client in node.clients:
        if is_of(client.srv_type, package):
            yield functools.partial(node.destroy_client, client)
    for service in node.services:
        if is_of(service.srv_type, package):
            yield functools.partial(node.destroy_service, service)
    for publisher in node.publishers:
        if is_of(publisher.msg_type, package):
            yield functools.partial(node.destroy_publisher, publisher)
    for subscription in node.subscriptions:
        if is_of(subscription.msg_type, package):
            yield functools.partial(node.destroy_subscription, subscription)
    for waitable in node.waitables:
        if is_of(action_type(waitable) or object, package):
            yield functools.partial(destroy, waitable)
