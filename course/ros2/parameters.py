"""A node's parameter services: what `ros2 param` and the Tab key ask of them."""

import re

from course.ros2.graph import absolute

SERVICE_TIMEOUT = 5.0  # s until a node's parameter service is given up


def call(graph, node_name: str, kind: str, **fields):
    """Call a node's service `kind` (ListParameters, ...); raises RuntimeError if it is not there within 5 s."""
    from rcl_interfaces import srv

    service = getattr(srv, kind)
    word = re.sub(r"(?<!^)(?=[A-Z])", "_", kind).lower()
    client = graph.node.create_client(service, f"{absolute(node_name)}/{word}")
    if not graph.wait_until(client.service_is_ready, SERVICE_TIMEOUT):
        raise RuntimeError("Wait for service timed out")
    future = client.call_async(service.Request(**fields))
    graph.spin(future.done)
    if future.result() is None:
        raise RuntimeError(f"Exception while calling service of node '{node_name}': {future.exception()}")
    return future.result()


def list_parameters(graph, node_name: str, prefixes=()) -> list[str]:
    """Return the names of a node's parameters that begin with one of `prefixes`, sorted."""
    return sorted(call(graph, node_name, "ListParameters", prefixes=list(prefixes)).result.names)


def set_parameter(graph, node_name: str, name: str, value):
    """Set one parameter; return its rcl_interfaces/msg/SetParametersResult."""
    from rcl_interfaces.msg import Parameter

    return call(graph, node_name, "SetParameters", parameters=[Parameter(name=name, value=value)]).results[0]
