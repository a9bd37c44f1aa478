"""The grader's own side of the conversation: a node in a ROS domain, spun in the background."""

import secrets
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import ClassVar

import rclpy
from rcl_interfaces.msg import Log
from rclpy.context import Context
from rclpy.exceptions import NameValidationException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

from course.live.spinner import Spinner
from course.rclpy_internals import NodeNameNonExistentError, RCLError, patch

AGAIN = 3.0  # s without an answer until a request is sent again
ALIVE = 0.1  # s between two looks whether a silent program is alive
HEARD = 1000  # log messages that are kept
LONG = 100_000  # characters or elements of a field: nothing that is asked for comes near
ARGUMENTS = ["--ros-args", "--disable-stdout-logs", "--disable-rosout-logs", "--disable-external-lib-logs"]


class Ros:
    """A node of the grader's in `domain`.  Its name tells nothing: a program must behave the same for everybody."""

    names: ClassVar[set[str]] = set()  # of all of them

    def __init__(self, domain: int, threads: int = 1):
        patch()
        self.domain = domain
        self._context = Context()
        rclpy.init(args=ARGUMENTS, context=self._context, domain_id=domain)
        self.node = Node(f"node_{secrets.token_hex(4)}", context=self._context, use_global_arguments=False)
        self.names.add(self.node.get_name())
        self._heard: deque[str] = deque(maxlen=HEARD)
        self.node.create_subscription(
            Log,
            "/rosout",
            lambda log: self._heard.append(log.msg[:1000]),
            QoSProfile(depth=HEARD, durability=DurabilityPolicy.TRANSIENT_LOCAL),
        )
        self._spinner = Spinner(self.node, threads)

    def close(self) -> None:
        """Leave the domain."""
        self._spinner.stop()
        self._context.try_shutdown()

    def call(self, client, request, timeout: float, alive: Callable[[], bool], again: float = AGAIN):
        """Send `request` and return the response, or None after `timeout` s or when the program is no longer `alive`.

        A request can be lost when a program has only just been found, so it is sent again every `again` s.
        """
        start, futures = time.monotonic(), []

        def answered() -> bool:
            return any(future.done() for future in futures)

        while (waited := time.monotonic() - start) < timeout and alive() and not answered():
            if waited >= again * len(futures):
                futures.append(client.call_async(request))
                done = threading.Event()
                futures[-1].add_done_callback(lambda _, done=done: done.set())
            done.wait(ALIVE)
        for future in futures:
            client.remove_pending_request(future)
        return next((sensible(future.result()) for future in futures if future.done()), None)

    @property
    def rosout(self) -> str:
        """What the nodes of the domain have logged, a message a line."""
        return "\n".join(list(self._heard))

    def others(self) -> list[tuple[str, str]]:
        """The nodes in the domain that are not the grader's, by name and namespace."""
        return [node for node in graph(self.node.get_node_names_and_namespaces) if node[0] not in self.names]

    def offered(self) -> list[str]:
        """The services of these nodes with their types, without those that every node has."""
        return sorted(
            f"{service} ({types[0]})"
            for node in self.others()
            for service, types in graph(self.node.get_service_names_and_types_by_node, *node)
            if not types[0].startswith(("rcl_interfaces/", "type_description_interfaces/"))
        )


def graph(query: Callable, *names: str) -> list:
    """What `query` tells of the graph; nothing when a node has gone meanwhile, or has a name that there cannot be.

    A program has any name in the graph that it likes, by rmw.  Whoever asks, asks again.
    """
    try:
        return query(*names)
    except (NodeNameNonExistentError, RCLError, UnicodeDecodeError, NameValidationException):
        return []


def sensible(message):
    """A message as it came; an empty one in the place of one that is longer than any right answer."""
    fields = (getattr(message, name) for name in message.get_fields_and_field_types())
    return message if all(len(field) <= LONG for field in fields if hasattr(field, "__len__")) else type(message)()
