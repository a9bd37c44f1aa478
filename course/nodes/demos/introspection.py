"""`ros2 run demo_nodes_py introspection`: a service and a client for `ros2 service echo`.

demo_nodes_cpp has a program for each of the two nodes: `introspection_service`, `introspection_client`.
"""

import sys
from typing import Any

import rclpy
from example_interfaces.srv import AddTwoInts
from rcl_interfaces.msg import SetParametersResult
from rclpy.client import Client
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_system_default
from rclpy.service import Service
from rclpy.service_introspection import ServiceIntrospectionState
from rclpy.task import Future

PERIOD = 0.5  # s between two requests
STATES = {
    "disabled": ServiceIntrospectionState.OFF,
    "metadata": ServiceIntrospectionState.METADATA,
    "contents": ServiceIntrospectionState.CONTENTS,
}


class Introspected(Node):
    """A node with a string parameter that sets the introspection of its service or client."""

    def follow(self, parameter: str, end: Service | Client) -> None:
        """Declare the parameter, and apply its value to the service or client `end`."""

        def check(changed: list[Parameter]) -> SetParametersResult:
            wrong = any(each.name == parameter and each.value not in STATES for each in changed)
            reason = "must be one of 'disabled', 'metadata', or 'contents'" if wrong else ""
            return SetParametersResult(successful=not wrong, reason=reason)

        def configure(changed: list[Parameter]) -> None:
            for each in changed:
                if each.name == parameter:
                    end.configure_introspection(self.get_clock(), qos_profile_system_default, STATES[each.value])

        self.add_on_set_parameters_callback(check)
        self.add_post_set_parameters_callback(configure)
        self.declare_parameter(parameter, "disabled")


class IntrospectionService(Introspected):
    """Adds two numbers."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("introspection_service", **kwargs)
        self.follow("service_configure_introspection", self.create_service(AddTwoInts, "add_two_ints", self.add))

    def add(self, request: AddTwoInts.Request, response: AddTwoInts.Response) -> AddTwoInts.Response:
        """Answer a request."""
        response.sum = request.a + request.b
        self.get_logger().info(f"Incoming request\na: {request.a} b: {request.b}")
        return response


class IntrospectionClient(Introspected):
    """Asks for 2 + 3, one request after the other."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("introspection_client", **kwargs)
        self.client = self.create_client(AddTwoInts, "add_two_ints")
        self.asked: Future | None = None
        self.follow("client_configure_introspection", self.client)
        self.timer = self.create_timer(PERIOD, self.ask)

    def ask(self) -> None:
        """Send the next request, once the last one is answered."""
        if self.client.service_is_ready() and (self.asked is None or self.asked.done()):
            self.asked = self.client.call_async(AddTwoInts.Request(a=2, b=3))
            self.asked.add_done_callback(self.tell)

    def tell(self, answered: Future) -> None:
        """Log the answer."""
        response = answered.result()
        if response is not None:
            self.get_logger().info(f"Result of add_two_ints: {response.sum}")


def main(args: list[str] | None = None) -> None:
    """Run until Ctrl-C: the node that the first argument names, `service` or `client`, or else both."""
    words = sys.argv[1:] if args is None else args
    known: dict[str, type[IntrospectionService | IntrospectionClient]] = {
        "service": IntrospectionService,
        "client": IntrospectionClient,
    }
    wanted = [known[word] for word in words[:1] if word in known] or [*known.values()]
    rclpy.init(args=args)
    executor = SingleThreadedExecutor()
    for make in wanted:
        executor.add_node(make())
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except RuntimeError:  # rclpy's own, when a signal ends the context between two waits
        if rclpy.ok():
            raise


if __name__ == "__main__":
    main()
