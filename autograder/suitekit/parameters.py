"""The parameters of a student's node, read and set over the services that every node has."""

import time
from collections.abc import Mapping
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor, ParameterValue, SetParametersResult
from rcl_interfaces.srv import DescribeParameters, GetParameters, SetParameters, SetParametersAtomically
from rclpy.parameter import Parameter, parameter_value_to_python

from autograder.errors import Wrong
from autograder.suitekit.lifecycle import Alive
from autograder.suitekit.live import LiveProgram, Offers
from autograder.suitekit.ros import graph

OFFER = "its parameters"
ALONE = 1.0  # s to wait for the right node of a program before using any of its nodes
KINDS = {
    "get_parameters": GetParameters,
    "describe_parameters": DescribeParameters,
    "set_parameters": SetParameters,
    "set_parameters_atomically": SetParametersAtomically,
}


class Parameters:
    """The parameters of the program's node that subscribes to `topic` or serves `service`, or else of any node."""

    def __init__(self, live: LiveProgram, topic: str = "", service: str = ""):
        self._live, self._topic, self._service = live, topic, service
        self._clients: dict[str, Any] = {}  # by service, once the node is found
        self._first_seen = 0.0  # when a node of the program could first be asked (s of time.monotonic)

    def connect(self) -> Offers:
        """Return what the program must offer, for `LiveProgram.connect` at each start."""
        self._clients, self._first_seen = {}, 0.0
        return {OFFER: self._ready}

    def get(self, *names: str) -> dict[str, Any]:
        """Return the values of these parameters, without those that are not declared."""
        values = self._call("get_parameters", GetParameters.Request(names=names)).values
        if len(values) == len(names):
            return {name: _value(name, value) for name, value in zip(names, values, strict=True)}
        if len(names) == 1:
            return {}
        return {
            name: value for one in names for name, value in self.get(one).items()
        }  # a single undeclared name makes the whole answer empty

    def describe(self, name: str) -> ParameterDescriptor:
        """Return a parameter's descriptor; an empty one if the parameter is not declared."""
        found = self._call("describe_parameters", DescribeParameters.Request(names=[name])).descriptors
        return found[0] if found else ParameterDescriptor()

    def set(self, values: Mapping[str, Any]) -> list[SetParametersResult]:
        """Set parameters one after the other, as `ros2 param set` does; return a result for each."""
        return self._call("set_parameters", SetParameters.Request(parameters=_messages(values))).results

    def set_together(self, values: Mapping[str, Any]) -> SetParametersResult:
        """Set parameters together: all of them, or none."""
        return self._call(
            "set_parameters_atomically", SetParametersAtomically.Request(parameters=_messages(values))
        ).result

    def _call(self, service: str, request: Any) -> Any:
        def question(limit: float, alive: Alive) -> Any:
            return self._live.ros.call(self._clients[service], request, limit, alive)

        return self._live.converse(question, f"a request to its service {service}", OFFER)

    def _ready(self) -> bool:
        if not self._clients:
            self._find()
        return bool(self._clients) and all(client.service_is_ready() for client in self._clients.values())

    def _find(self) -> None:
        node = self._live.ros.node
        for name, namespace in sorted(self._live.ros.others(), key=lambda other: not self._wanted(*other)):
            prefix = f"{namespace.rstrip('/')}/{name}"
            services = dict(graph(node.get_service_names_and_types_by_node, name, namespace))
            if any(f"{prefix}/{service}" not in services for service in KINDS):
                continue
            self._first_seen = self._first_seen or time.monotonic()
            if self._wanted(name, namespace) or time.monotonic() > self._first_seen + ALONE:
                self._clients = {
                    service: node.create_client(kind, f"{prefix}/{service}") for service, kind in KINDS.items()
                }
                return

    def _wanted(self, name: str, namespace: str) -> bool:
        node = self._live.ros.node
        if self._service:
            return self._service in dict(graph(node.get_service_names_and_types_by_node, name, namespace))
        topics = graph(node.get_subscriber_names_and_types_by_node, name, namespace)
        return not self._topic or any(topic.rpartition("/")[2] == self._topic for topic, _ in topics)


def _value(name: str, value: ParameterValue) -> Any:
    try:
        return parameter_value_to_python(value)
    except RuntimeError:
        raise Wrong(
            f"The parameter {name} has a type that rcl_interfaces/msg/ParameterType does not define.",
            value,
            certain=True,
        ) from None


def _messages(values: Mapping[str, Any]) -> list[Any]:
    return [Parameter(name, value=value).to_parameter_msg() for name, value in values.items()]
