"""Section 3.2.3: an action client, `python -m course.nodes.fibonacci_action_client 10`."""

import sys
from typing import Any

import rclpy
from action_msgs.msg import GoalStatus
from course_interfaces.action import Fibonacci
from rclpy.action import ActionClient
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.task import Future
from rclpy.utilities import remove_ros_args

TIMEOUT = 5.0  # s to wait for the server


class FibonacciActionClient(Node):
    """Sends a goal to `/fibonacci`; the future `done` receives the outcome.

    The outcome is the response of get_result_async (`.status`, `.result.sequence`), or None when the goal was rejected
    or no server is available.
    """

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("fibonacci_action_client", **kwargs)
        self._action_client = ActionClient(self, Fibonacci, "fibonacci")
        self.goal_handle = None
        self.done = Future()

    def send_goal(self, order: int) -> Future:
        """Send the goal and register the callbacks; return the future `done`."""
        self.goal_handle, self.done = None, Future()
        self.get_logger().info("Waiting for action server...")
        if not self._action_client.wait_for_server(timeout_sec=TIMEOUT):
            self.get_logger().error(f"No action server fibonacci within {TIMEOUT:g} s: is it running?")
            self.done.set_result(None)
            return self.done
        self.get_logger().info(f"Sending goal: order={order}")
        future = self._action_client.send_goal_async(
            Fibonacci.Goal(order=order), feedback_callback=self.feedback_callback
        )
        future.add_done_callback(self.goal_response_callback)
        return self.done

    def goal_response_callback(self, future: Future) -> None:
        """The server has accepted or rejected the goal."""
        goal_handle = future.result()
        if not goal_handle.accepted:
            self.get_logger().warning("Goal rejected")
            self.done.set_result(None)
            return
        self.get_logger().info("Goal accepted")
        self.goal_handle = goal_handle
        goal_handle.get_result_async().add_done_callback(self.get_result_callback)

    def feedback_callback(self, feedback_msg: Any) -> None:
        """The server has done a step."""
        self.get_logger().info(f"Received feedback: {list(feedback_msg.feedback.partial_sequence)}")

    def get_result_callback(self, future: Future) -> None:
        """The goal is over: succeeded, cancelled or aborted."""
        outcome = future.result()
        self.get_logger().info(f"Result: {list(outcome.result.sequence)}")
        self.done.set_result(outcome)


def main(args: list[str] | None = None) -> int:
    """Send the order on the command line (default 10); return 0 if the goal succeeded, 2 for a wrong command line."""
    words = remove_ros_args(sys.argv[1:] if args is None else args)
    try:
        (order,) = (int(word) for word in words or ["10"])
        goal = Fibonacci.Goal(order=order)
    except (ValueError, AssertionError):
        print("Usage: fibonacci_action_client [ORDER]    (an integer of 32 bits)", file=sys.stderr)
        return 2
    rclpy.init(args=args)
    try:
        node = FibonacciActionClient()
        done = node.send_goal(goal.order)
        rclpy.spin_until_future_complete(node, done)
        outcome = done.result()
        return 0 if outcome is not None and outcome.status == GoalStatus.STATUS_SUCCEEDED else 1
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
