"""The action /lift: one cabin, which stops where the goal says; the newest goal has it."""
import threading
import time

import rclpy
from course_interfaces.action import Lift
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from std_srvs.srv import SetBool


class LiftServer(Node):

    def __init__(self):
        super().__init__('lift_server')
        self.declare_parameter('top', 9)
        self.declare_parameter('step_period', 1.0)
        self.floor = 0
        self.blocked = False
        self.newest = None  # the goal that was accepted last
        self.cabin = threading.Lock()  # held by the one goal that moves the cabin
        self.service = self.create_service(SetBool, '/lift/block', self.block)
        self.server = ActionServer(
            self, Lift, '/lift', self.execute, goal_callback=self.check_goal,
            handle_accepted_callback=self.take_over, cancel_callback=self.allow_cancel)
        self.get_logger().info('Lift ready')

    def block(self, request, response):
        """Block the shaft, or free it; the goal that runs looks at this before each step."""
        self.blocked = request.data
        response.success = True
        response.message = 'blocked' if self.blocked else 'free'
        return response

    def check_goal(self, goal):
        """Accept at least one floor, and only floors that there are."""
        top = self.get_parameter('top').value
        if goal.floors and all(0 <= floor <= top for floor in goal.floors):
            return GoalResponse.ACCEPT
        self.get_logger().warning(f'Rejected: {list(goal.floors)}')
        return GoalResponse.REJECT

    def take_over(self, goal_handle):
        """Store the newest goal: the one that runs sees that it is no longer the newest, and ends."""
        self.newest = goal_handle
        goal_handle.execute()

    def allow_cancel(self, goal_handle):
        """Agree to every cancel; the goal must keep the promise."""
        return CancelResponse.ACCEPT

    def execute(self, goal_handle):
        """Wait until the goal before this one has released the cabin, then move the cabin."""
        with self.cabin:
            return self.move(goal_handle)

    def move(self, goal_handle):
        """Go on step by step until all stops are made, or until a step must not be made."""
        period = self.get_parameter('step_period').value
        stops, left = [], list(goal_handle.request.floors)
        self.stop(stops, left)
        while left:
            if goal_handle.is_cancel_requested:
                goal_handle.canceled()
                break
            if self.blocked or self.newest is not goal_handle:
                goal_handle.abort()
                break
            time.sleep(period)
            if not self.context.ok():  # Ctrl-C: nobody waits for this goal any more
                break
            self.floor += 1 if left[0] > self.floor else -1
            self.stop(stops, left)
            goal_handle.publish_feedback(
                Lift.Feedback(floor=self.floor, stops_left=len(left)))
        else:
            goal_handle.succeed()
        self.get_logger().info(f'Stopped at {stops}, {len(left)} left, now at {self.floor}')
        return Lift.Result(stops=stops, floor=self.floor)

    def stop(self, stops, left):
        """Make the stops that are due where the cabin stands."""
        while left and left[0] == self.floor:
            stops.append(left.pop(0))


def main(args=None):
    rclpy.init(args=args)
    node = LiftServer()
    # One thread for the goal that moves, one for the goal that waits, two for requests.
    executor = MultiThreadedExecutor(num_threads=4)
    executor.add_node(node)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


if __name__ == '__main__':
    main()
