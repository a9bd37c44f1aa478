"""A node's parameter services, as `ros2 param` and the Tab key call them."""

import re
import sys
import time
from collections.abc import Iterable
from typing import Any

from course.errors import RosError
from course.ros.graph import Graph
from course.ros.names import absolute
from course.ros.server_status import TELL, ServerStatus

SERVICE_TIMEOUT = 5.0  # s to wait for a node's parameter service
AGAIN = 2.0  # s until a node is asked again


def call(graph: Graph, node_name: str, kind: str, **fields: Any) -> Any:
    """Call a node's service `kind` (ListParameters, ...) and return the response.

    A node drops a response whose reader it has not discovered yet.  So it is asked again, unless that would set the
    parameters twice: then it is asked for something else before, because it discovers readers in the order in which
    they are made.  After `TELL` s without an answer it says so once, on stderr, and goes on waiting.

    Raises RosError when the service is not available within 5 s, or the call fails.
    """
    from rcl_interfaces import srv

    service = getattr(srv, kind)
    word = re.sub(r"(?<!^)(?=[A-Z])", "_", kind).lower()
    name = f"{absolute(node_name)}/{word}"
    client, status = graph.node.create_client(service, name), ServerStatus(name)
    if not graph.wait_until(client.service_is_ready, SERVICE_TIMEOUT):
        raise RosError(f"Wait for service timed out waiting for parameter services for node {node_name}")
    if sets := kind.startswith("Set"):
        call(graph, node_name, "GetParameters")
    futures: list[Any] = []
    began, told = time.monotonic(), False
    while not (done := [future for future in futures if future.done()]):
        if report := status.report():
            raise RosError(f"The node does not answer.\n{report}")
        if not told and time.monotonic() - began > TELL:
            told = True
            print(
                f"still waiting: {absolute(node_name)} does not answer. Is it in a callback that does not return? "
                "Ctrl-C ends this.",
                file=sys.stderr,
                flush=True,
            )
        if not sets or not futures:
            futures.append(client.call_async(service.Request(**fields)))
        graph.spin(lambda: any(future.done() for future in futures) or status.report(), AGAIN)
    if done[0].result() is None:
        raise RosError(f"Exception while calling service of node '{node_name}': {done[0].exception()}")
    return done[0].result()


def list_parameters(graph: Graph, node_name: str, prefixes: Iterable[str] = ()) -> list[str]:
    """Return the names of a node's parameters, sorted; with `prefixes`, only those that begin with one of them."""
    return sorted(call(graph, node_name, "ListParameters", prefixes=list(prefixes)).result.names)


def set_parameter(graph: Graph, node_name: str, name: str, value: Any) -> Any:
    """Set a parameter to an rcl_interfaces/msg/ParameterValue; return its SetParametersResult."""
    from rcl_interfaces.msg import Parameter

    return call(graph, node_name, "SetParameters", parameters=[Parameter(name=name, value=value)]).results[0]
