"""The action /fibonacci: one element a step, reported, and cancelled within a step."""
import time

import rclpy
from course_interfaces.action import Fibonacci
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node

LAST = 46  # element 47 does not fit int32


class FibonacciServer(Node):

    def __init__(self):
        super().__init__('fibonacci_server')
        self.declare_parameter('step_period', 1.0)
        self.server = ActionServer(
            self, Fibonacci, '/fibonacci', self.execute,
            goal_callback=self.check_goal, cancel_callback=self.allow_cancel,
            callback_group=ReentrantCallbackGroup())
        self.get_logger().info('Fibonacci server ready')

    def check_goal(self, goal):
        """Accept what can be computed."""
        if 0 <= goal.order <= LAST:
            return GoalResponse.ACCEPT
        self.get_logger().warning(f'Rejected: order {goal.order}')
        return GoalResponse.REJECT

    def allow_cancel(self, goal_handle):
        """Agree to every cancel; execute must keep the promise."""
        return CancelResponse.ACCEPT

    def execute(self, goal_handle):
        """Compute the elements 0 to order; run in a thread of its own for each goal."""
        order = goal_handle.request.order
        period = self.get_parameter('step_period').value
        sequence = [0, 1][:order + 1]
        while len(sequence) <= order:
            time.sleep(period)
            if not self.context.ok():  # Ctrl-C: nobody waits for this goal any more
                return Fibonacci.Result()
            if goal_handle.is_cancel_requested:
                goal_handle.canceled()
                self.get_logger().info(f'Canceled: {sequence}')
                return Fibonacci.Result(sequence=sequence)
            sequence.append(sequence[-1] + sequence[-2])
            goal_handle.publish_feedback(Fibonacci.Feedback(partial_sequence=sequence))
        goal_handle.succeed()
        self.get_logger().info(f'Succeeded: {sequence}')
        return Fibonacci.Result(sequence=sequence)


def main(args=None):
    rclpy.init(args=args)
    node = FibonacciServer()
    # Each goal that runs has a thread; one more must be free to take in a cancel.
    executor = MultiThreadedExecutor(num_threads=8)
    executor.add_node(node)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


if __name__ == '__main__':
    main()
