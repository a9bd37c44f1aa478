"""An obstacle avoider: an agent that decides, and a node that is its eyes and wheels."""
import math
from enum import Enum

import numpy as np
import rclpy
from geometry_msgs.msg import Twist
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import LaserScan

SECTORS = {'front': (-30, 30), 'left': (30, 90), 'right': (-90, -30)}  # degrees


class RobotState(Enum):
    FORWARD = 1
    TURNING_LEFT = 2
    TURNING_RIGHT = 3
    STOPPED = 4


class ObstacleAvoidanceAI:
    """Decides where to drive by three distances. There is no ROS in it."""

    def __init__(self, obstacle_distance_threshold=0.5):
        self.state = RobotState.STOPPED
        self.obstacle_threshold = obstacle_distance_threshold

    def decide_action(self, laser_data):
        """Return the speeds, 'linear' (m/s) and 'angular' (rad/s)."""
        if laser_data['front'] >= self.obstacle_threshold:
            self.state = RobotState.FORWARD
            return {'linear': 0.3, 'angular': 0.0}
        if laser_data['left'] > laser_data['right']:
            self.state = RobotState.TURNING_LEFT
            return {'linear': 0.0, 'angular': 0.5}
        self.state = RobotState.TURNING_RIGHT
        return {'linear': 0.0, 'angular': -0.5}

    def stop(self):
        """Stand still, because there is nothing to decide by."""
        self.state = RobotState.STOPPED
        return {'linear': 0.0, 'angular': 0.0}


def nearest(scan):
    """Return the nearest distance (m) of each sector, inf where nothing is."""
    ranges = np.array(scan.ranges, dtype=float)
    angles = scan.angle_min + scan.angle_increment * np.arange(len(ranges))
    degrees = np.degrees((angles + math.pi) % (2 * math.pi) - math.pi)
    usable = np.isinf(ranges) | (ranges >= scan.range_min) & (ranges <= scan.range_max)
    ranges[np.isneginf(ranges)] = 0.0  # too near to be measured
    laser_data = {}
    for name, (low, high) in SECTORS.items():
        seen = ranges[usable & (low <= degrees) & (degrees < high)]
        laser_data[name] = seen.min(initial=math.inf)
    return laser_data


class ObstacleAvoider(Node):

    def __init__(self):
        super().__init__('obstacle_avoider')
        self.ai_agent = ObstacleAvoidanceAI(obstacle_distance_threshold=0.5)
        self.laser_data = None
        self.scan_time = None
        self.cmd_vel_pub = self.create_publisher(Twist, 'cmd_vel', 10)
        self.laser_sub = self.create_subscription(
            LaserScan, 'scan', self.laser_callback, 10)
        self.timer = self.create_timer(0.1, self.control_loop)
        self.get_logger().info('Obstacle avoider started')

    def laser_callback(self, msg):
        """Keep what the agent needs of the scan, and when it came."""
        self.laser_data = nearest(msg)
        self.scan_time = self.get_clock().now()

    def scan_is_fresh(self):
        """Too old is what leaves no time to stop within half a second."""
        if self.scan_time is None:
            return False
        return self.get_clock().now() - self.scan_time < Duration(seconds=0.35)

    def control_loop(self):
        """Decide, ten times a second."""
        if self.scan_is_fresh():
            action = self.ai_agent.decide_action(self.laser_data)
        else:
            action = self.ai_agent.stop()
        cmd = Twist()
        cmd.linear.x = action['linear']
        cmd.angular.z = action['angular']
        self.cmd_vel_pub.publish(cmd)


def main(args=None):
    rclpy.init(args=args)
    node = ObstacleAvoider()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == '__main__':
    main()
