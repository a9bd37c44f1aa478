"""Send one goal: python3 lift_client.py FLOOR [FLOOR ...] [--cancel-after N]."""
import argparse
import sys

import rclpy
from action_msgs.msg import GoalStatus
from course_interfaces.action import Lift
from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.utilities import remove_ros_args

OUTCOMES = {
    GoalStatus.STATUS_SUCCEEDED: 'SUCCEEDED',
    GoalStatus.STATUS_CANCELED: 'CANCELED',
    GoalStatus.STATUS_ABORTED: 'ABORTED',
}


class LiftClient(Node):

    def __init__(self, cancel_after=None):
        super().__init__('lift_client')
        self.client = ActionClient(self, Lift, '/lift')
        self.cancel_after = cancel_after
        self.heard = 0
        self.goal_handle = None

    def run(self, floors):
        """Return how the goal ended, in a word."""
        if not self.client.wait_for_server(timeout_sec=5.0):
            return 'NO SERVER for /lift'
        self.goal_handle = self.wait_for(self.client.send_goal_async(
            Lift.Goal(floors=floors), feedback_callback=self.on_feedback))
        if not self.goal_handle.accepted:
            return 'REJECTED'
        self.cancel_when_heard()
        end = self.wait_for(self.goal_handle.get_result_async())
        print(f'Result: stops {list(end.result.stops)}, now at {end.result.floor}')
        return OUTCOMES.get(end.status, 'UNKNOWN')

    def wait_for(self, future):
        rclpy.spin_until_future_complete(self, future)
        return future.result()

    def on_feedback(self, message):
        now = message.feedback
        print(f'Feedback: floor {now.floor}, {now.stops_left} stops left')
        self.heard += 1
        self.cancel_when_heard()

    def cancel_when_heard(self):
        """Cancel after N feedback messages; they may come before the handle."""
        due = self.cancel_after is not None and self.heard >= self.cancel_after
        if self.goal_handle and due:
            self.cancel_after = None
            self.goal_handle.cancel_goal_async()


def main(args=None):
    """Return the exit status: 0 when the goal succeeded."""
    parser = argparse.ArgumentParser()
    parser.add_argument('floors', type=int, nargs='+', metavar='FLOOR')
    parser.add_argument('--cancel-after', type=int, metavar='N')
    options = parser.parse_args(remove_ros_args(args)[1:])
    rclpy.init(args=args)
    node = LiftClient(options.cancel_after)
    try:
        outcome = node.run(options.floors)
    except KeyboardInterrupt:
        return 130
    finally:
        rclpy.try_shutdown()
    print('Outcome:', outcome)
    return 0 if outcome == 'SUCCEEDED' else 1


if __name__ == '__main__':
    sys.exit(main())
