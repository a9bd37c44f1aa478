"""Section 3.1.2: a service server, `/add_two_ints`."""

from typing import Any

import rclpy
from example_interfaces.srv import AddTwoInts
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node


class AddTwoIntsServer(Node):
    """Adds two 64-bit integers; a sum that does not fit wraps around, as it would in C."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("add_two_ints_server", **kwargs)
        self.srv = self.create_service(AddTwoInts, "add_two_ints", self.add_two_ints_callback)
        self.get_logger().info("Add Two Ints Server started")

    def add_two_ints_callback(self, request: AddTwoInts.Request, response: AddTwoInts.Response) -> AddTwoInts.Response:
        """Fill in the response and return it: if a callback returns nothing, its client waits forever."""
        response.sum = (request.a + request.b + 2**63) % 2**64 - 2**63
        self.get_logger().info(f"Incoming request: a={request.a}, b={request.b}")
        self.get_logger().info(f"Sending response: sum={response.sum}")
        return response


def main(args: list[str] | None = None) -> None:
    """Run until Ctrl-C, which shuts rclpy down by itself."""
    rclpy.init(args=args)
    try:
        rclpy.spin(AddTwoIntsServer())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except RuntimeError:  # rclpy's own, when a signal ends the context between two waits
        if rclpy.ok():
            raise


if __name__ == "__main__":
    main()
