"""Send one goal: python3 fibonacci_client.py ORDER [--cancel-after N]."""
import argparse
import sys

import rclpy
from action_msgs.msg import GoalStatus
from course_interfaces.action import Fibonacci
from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.utilities import remove_ros_args

OUTCOMES = {
    GoalStatus.STATUS_SUCCEEDED: 'SUCCEEDED',
    GoalStatus.STATUS_CANCELED: 'CANCELED',
    GoalStatus.STATUS_ABORTED: 'ABORTED',
}


class FibonacciClient(Node):

    def __init__(self, cancel_after=None):
        super().__init__('fibonacci_client')
        self.client = ActionClient(self, Fibonacci, '/fibonacci')
        self.cancel_after = cancel_after
        self.heard = 0
        self.goal_handle = None

    def run(self, order):
        """Return how the goal ended, in a word."""
        if not self.client.wait_for_server(timeout_sec=5.0):
            return 'NO SERVER for /fibonacci'
        self.goal_handle = self.wait_for(self.client.send_goal_async(
            Fibonacci.Goal(order=order), feedback_callback=self.on_feedback))
        if not self.goal_handle.accepted:
            return 'REJECTED'
        self.cancel_when_heard()
        end = self.wait_for(self.goal_handle.get_result_async())
        print('Result:', list(end.result.sequence))
        return OUTCOMES.get(end.status, 'UNKNOWN')

    def wait_for(self, future):
        rclpy.spin_until_future_complete(self, future)
        return future.result()

    def on_feedback(self, message):
        print('Feedback:', list(message.feedback.partial_sequence))
        self.heard += 1
        self.cancel_when_heard()

    def cancel_when_heard(self):
        """Cancel after so many feedback messages; they may come before the handle."""
        if self.goal_handle and self.cancel_after and self.heard >= self.cancel_after:
            self.cancel_after = None
            self.goal_handle.cancel_goal_async()


def main(args=None):
    """Return the exit status: 0 when the goal succeeded."""
    parser = argparse.ArgumentParser()
    parser.add_argument('order', type=int)
    parser.add_argument('--cancel-after', type=int, metavar='N')
    options = parser.parse_args(remove_ros_args(args)[1:])
    rclpy.init(args=args)
    node = FibonacciClient(options.cancel_after)
    try:
        outcome = node.run(options.order)
    except KeyboardInterrupt:
        return 130
    finally:
        rclpy.try_shutdown()
    print('Outcome:', outcome)
    return 0 if outcome == 'SUCCEEDED' else 1


if __name__ == '__main__':
    sys.exit(main())
