"""A wall follower: the node that is the agent's eyes and wheels."""
import math

import numpy as np
import rclpy
from geometry_msgs.msg import Twist
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import LaserScan

from wall_agent import WallAgent

FRESH = Duration(seconds=0.5)  # for so long after it came, a scan may be used
SECTORS = {'front': (-25, 25), 'right': (-80, -40)}  # degrees


def nearest(scan):
    """Return the nearest distance (m) of each sector, inf where nothing is."""
    ranges = np.array(scan.ranges, dtype=float)
    angles = scan.angle_min + scan.angle_increment * np.arange(len(ranges))
    degrees = np.degrees((angles + math.pi) % (2 * math.pi) - math.pi)
    usable = np.isinf(ranges) | (ranges >= scan.range_min) & (ranges <= scan.range_max)
    ranges[np.isneginf(ranges)] = 0.0  # too near to be measured
    distances = {}
    for name, (low, high) in SECTORS.items():
        seen = ranges[usable & (low <= degrees) & (degrees < high)]
        distances[name] = float(seen.min(initial=math.inf))
    return distances


class WallFollower(Node):

    def __init__(self):
        super().__init__('wall_follower')
        self.agent = WallAgent()
        self.distances = None
        self.scan_time = None
        self.cmd_vel_pub = self.create_publisher(Twist, 'cmd_vel', 10)
        self.laser_sub = self.create_subscription(
            LaserScan, 'scan', self.laser_callback, 10)
        self.timer = self.create_timer(0.1, self.control_loop)
        self.get_logger().info('Wall follower started')

    def laser_callback(self, msg):
        """Keep what the agent needs of the scan, and when it came."""
        self.distances = nearest(msg)
        self.scan_time = self.get_clock().now()

    def scan_is_fresh(self):
        """Return whether there is a scan that may still be used."""
        if self.scan_time is None:
            return False
        return self.get_clock().now() - self.scan_time <= FRESH

    def control_loop(self):
        """Publish a command, ten times a second."""
        cmd = Twist()
        if self.scan_is_fresh():
            action = self.agent.decide_action(self.distances)
            cmd.linear.x = action['linear']
            cmd.angular.z = action['angular']
        self.cmd_vel_pub.publish(cmd)


def main(args=None):
    rclpy.init(args=args)
    node = WallFollower()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == '__main__':
    main()
