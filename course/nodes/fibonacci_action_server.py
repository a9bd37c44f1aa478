"""Section 3.2.2: an action server, `/fibonacci`, that reports every step and can be cancelled at any of them."""

import signal
import time
from typing import Any

import rclpy
from course_interfaces.action import Fibonacci
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node

MAX_ORDER = 46  # element 47 does not fit into int32
POLL = 0.01  # s between two looks at "cancel requested", for which rclpy has no event
THREADS = 10  # one for each running goal, and one more to hear a cancel request


class FibonacciActionServer(Node):
    """Computes elements 0 to `order`, one every `step_period` s (a parameter).

    Spin it with a MultiThreadedExecutor of several threads: a running goal occupies one, and if there is no other, a
    cancel request is read only when the goal is over.
    """

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("fibonacci_action_server", **kwargs)
        self.declare_parameter("step_period", 1.0)
        self._action_server = ActionServer(
            self,
            Fibonacci,
            "fibonacci",
            self.execute_callback,
            goal_callback=self.goal_callback,
            cancel_callback=self.cancel_callback,
            callback_group=ReentrantCallbackGroup(),
        )
        self.get_logger().info("Fibonacci Action Server started")

    def goal_callback(self, goal: Fibonacci.Goal) -> GoalResponse:
        """Accept the orders that can be computed."""
        if 0 <= goal.order <= MAX_ORDER:
            return GoalResponse.ACCEPT
        self.get_logger().warning(f"Goal rejected: order {goal.order} is not from 0 to {MAX_ORDER}")
        return GoalResponse.REJECT

    def cancel_callback(self, _goal_handle: ServerGoalHandle) -> CancelResponse:
        """Accept every cancel request; without this callback an ActionServer rejects them all."""
        self.get_logger().info("Cancel requested")
        return CancelResponse.ACCEPT

    def execute_callback(self, goal_handle: ServerGoalHandle) -> Fibonacci.Result:
        """Compute the sequence; a cancelled goal returns what has been computed so far."""
        order = goal_handle.request.order
        self.get_logger().info(f"Executing goal: order={order}")
        sequence = [0, 1][: order + 1]
        goal_handle.publish_feedback(Fibonacci.Feedback(partial_sequence=sequence))
        while len(sequence) <= order and self.wait_step(goal_handle):
            sequence.append(sequence[-1] + sequence[-2])
            goal_handle.publish_feedback(Fibonacci.Feedback(partial_sequence=sequence))
            self.get_logger().info(f"Feedback: {sequence}")
        result = Fibonacci.Result(sequence=sequence)
        if len(sequence) > order:
            goal_handle.succeed()
            self.get_logger().info(f"Result: {sequence}")
        elif goal_handle.is_cancel_requested:
            goal_handle.canceled()
            self.get_logger().info(f"Goal canceled: {sequence}")
        return result

    def wait_step(self, goal_handle: ServerGoalHandle) -> bool:
        """Wait for one step's time; False as soon as the goal is to be cancelled or the program ends."""
        end = time.monotonic() + self.get_parameter("step_period").value
        while self.context.ok() and not goal_handle.is_cancel_requested:
            left = end - time.monotonic()
            if left <= 0.0:
                return True
            time.sleep(min(left, POLL))  # by hand: a robot to which this file is copied has no `course`
        return False


def main(args: list[str] | None = None) -> None:
    """Run until Ctrl-C, which shuts rclpy down by itself."""
    # A KeyboardInterrupt while the thread pool starts a thread would keep the program from ever ending.
    signal.signal(signal.SIGINT, lambda *_: None)
    rclpy.init(args=args)
    try:
        executor = MultiThreadedExecutor(num_threads=THREADS)
        executor.add_node(FibonacciActionServer())
        while rclpy.ok():
            executor.spin_once(timeout_sec=1.0)  # without a limit, it could miss the shutdown
    except RuntimeError:  # rclpy's own, when a signal ends the context between two waits
        if rclpy.ok():
            raise


if __name__ == "__main__":
    main()
