"""The grader's own node in a ROS domain, spun in the background, and its view of other nodes."""

import secrets
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, ClassVar

import rclpy
from rcl_interfaces.msg import Log
from rclpy.context import Context
from rclpy.exceptions import NameValidationException
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile

from course.ros.fast_dds import ignore_discovery
from course.ros.names import OF_EVERY_NODE
from course.ros.rclpy_internals import NodeNameNonExistentError, RCLError
from course.ros.rclpy_patches import patch
from course.session.spinner import Spinner

AGAIN = 3.0  # s without an answer until a request is sent again
ALIVE = 0.1  # s between two looks at whether a silent program is still alive
LATEST = 1.0  # s that a message may have been under way, on a busy machine
HEARD = 1000  # log messages that are kept
LOG_LENGTH = 1000  # characters of a log message that are kept
LONGEST = 100_000  # characters or elements of a field, far more than in any right answer
EMPTIED: deque[str] = deque(maxlen=1)  # the last message that was too long, in words; cleared after each test
ARGUMENTS = ["--ros-args", "--disable-stdout-logs", "--disable-rosout-logs", "--disable-external-lib-logs"]

# Options of a grader's node: no parameter services, by which a program could set its clock (`use_sim_time`).
CLOSED: dict[str, Any] = {
    "use_global_arguments": False,
    "start_parameter_services": False,
    "parameter_overrides": [Parameter("start_type_description_service", value=False)],
}


class Ros:
    """A grader's node in `domain`, with a random name, so that no program can recognise it."""

    names: ClassVar[set[str]] = set()  # the names of all grader's nodes

    def __init__(self, domain: int, threads: int = 1):
        """Start the node; `threads` threads run its callbacks."""
        patch()
        self.domain = domain
        self._context = Context()
        rclpy.init(args=ARGUMENTS, context=self._context, domain_id=domain)
        self.node = Node(f"node_{secrets.token_hex(4)}", context=self._context, **CLOSED)
        self.names.add(self.node.get_name())
        self._heard: deque[str] = deque(maxlen=HEARD)
        self._sent: list[str] = []  # the service of each request
        self.node.create_subscription(
            Log, "/rosout", self._on_log, QoSProfile(depth=HEARD, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        )
        self._spinner = Spinner(self.node, threads)
        self._spinner.start()

    def _on_log(self, log: Any) -> None:
        self._heard.append(log.msg[:LOG_LENGTH])

    def close(self) -> None:
        """Leave the domain."""
        ignore_discovery(self.domain)
        self._spinner.stop()
        self._context.try_shutdown()

    def call(
        self, client: Any, request: Any, timeout: float, alive: Callable[[], bool], again: float = AGAIN
    ) -> Any | None:
        """Send `request` and return the response; None after `timeout` s, or when the program is no longer `alive`.

        A request can be lost when a program has only just been discovered, so it is sent again every `again` s.
        """
        start = time.monotonic()
        futures: list[Any] = []

        def answered() -> bool:
            return any(future.done() for future in futures)

        while (waited := time.monotonic() - start) < timeout and alive() and not answered():
            if waited >= again * len(futures):
                futures.append(self.send(client, request))
                done = threading.Event()
                futures[-1].add_done_callback(lambda _, done=done: done.set())
            done.wait(ALIVE)
        for future in futures:
            client.remove_pending_request(future)
        return next((sensible(future.result()) for future in futures if future.done()), None)

    def send(self, client: Any, request: Any) -> Any:
        """Send `request` once; return the future of its response."""
        self._sent.append(client.srv_name)
        return client.call_async(request)

    def sent(self, service: str) -> int:
        """Return how many requests `call` and `send` have sent to a service."""
        return self._sent.count(service)

    @property
    def rosout(self) -> str:
        """Return the log messages of the domain's nodes, one per line."""
        return "\n".join(list(self._heard))

    def others(self) -> list[tuple[str, str]]:
        """Return name and namespace of each node in the domain that is not the grader's."""
        return [node for node in graph(self.node.get_node_names_and_namespaces) if node[0] not in self.names]

    def offered(self) -> list[str]:
        """Return the services of these nodes with their types, except those that every node has."""
        return sorted(
            f"{service} ({types[0]})"
            for node in self.others()
            for service, types in graph(self.node.get_service_names_and_types_by_node, *node)
            if not types[0].startswith(OF_EVERY_NODE)
        )


def graph(query: Callable[..., list[Any]], *names: str) -> list[Any]:
    """Return the result of a graph `query`; empty when a node has disappeared meanwhile or has an invalid name.

    Without rclpy, a program can give its node any name.  Callers poll, so a node missed once is found later.
    """
    try:
        return query(*names)
    except (NodeNameNonExistentError, RCLError, UnicodeDecodeError, NameValidationException):
        return []


def published(info: Mapping[str, int]) -> float:
    """Return when a message was published, by its program's clock (s), of what rclpy tells a callback of its times.

    A program can shift its clock: a time after the message came, or more than `LATEST` before, is not believed.
    """
    came, said = 1e-9 * info["received_timestamp"], 1e-9 * info["source_timestamp"]
    return min(max(said, came - LATEST), came)


def sensible(message: Any) -> Any:
    """Return the message, or an empty one, noted in EMPTIED, if it is longer than any right answer."""
    for name in message.get_fields_and_field_types():
        if hasattr(field := getattr(message, name), "__len__") and len(field) > LONGEST:
            EMPTIED.append(f"{name} of a {type(message).__name__} had the length {len(field):,}")
            return type(message)()
    return message
