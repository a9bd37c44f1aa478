"""Section 3.1.3: a service client, `python -m course.nodes.add_two_ints_client 5 3`."""

import sys
from typing import Any

import rclpy
from example_interfaces.srv import AddTwoInts
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.task import Future
from rclpy.utilities import remove_ros_args

TIMEOUT = 5.0  # s to wait for the service, and again for its answer


class AddTwoIntsClient(Node):
    """Calls the service `/add_two_ints`."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("add_two_ints_client", **kwargs)
        self.client = self.create_client(AddTwoInts, "add_two_ints")

    def wait_for_service(self, timeout_sec: float = TIMEOUT) -> bool:
        """Wait for the service; False when it is not available within `timeout_sec` s."""
        return self.client.wait_for_service(timeout_sec=timeout_sec)

    def send_request(self, a: int, b: int) -> Future:
        """Send `a` and `b`; return the future of the response.

        Each call makes a new request: a shared one could be changed while it is still being sent.
        """
        return self.client.call_async(AddTwoInts.Request(a=a, b=b))


def numbers(words: list[str]) -> tuple[int, int]:
    """The two 64-bit integers on the command line; raises ValueError for anything else."""
    a, b = (int(word) for word in words)
    if not all(-(2**63) <= number < 2**63 for number in (a, b)):
        raise ValueError("a and b must fit into 64 bits")
    return a, b


def main(args: list[str] | None = None) -> int:
    """Add the two numbers on the command line; return 0, or 1 without an answer and 2 for a wrong command line."""
    try:
        a, b = numbers(remove_ros_args(sys.argv[1:] if args is None else args))
    except ValueError:
        print("Usage: add_two_ints_client A B    (two integers of 64 bits)", file=sys.stderr)
        return 2
    rclpy.init(args=args)
    try:
        node = AddTwoIntsClient()
        if not node.wait_for_service():
            node.get_logger().error(f"No service add_two_ints within {TIMEOUT:g} s: is its server running?")
            return 1
        future = node.send_request(a, b)
        rclpy.spin_until_future_complete(node, future, timeout_sec=TIMEOUT)
        if not future.done():
            node.get_logger().error(f"No answer within {TIMEOUT:g} s")
            return 1
        node.get_logger().info(f"Result: {a} + {b} = {future.result().sum}")
        return 0
    except (KeyboardInterrupt, ExternalShutdownException):
        return 1
    except RuntimeError:  # rclpy's own, when a signal ends the context between two waits
        if rclpy.ok():
            raise
        return 1
    finally:
        rclpy.try_shutdown()


if __name__ == "__main__":
    sys.exit(main())
