"""Section 3.4: the ROS wrapper around the agent, LaserScan `scan` in, Twist `cmd_vel` out, ten times a second."""

import time
from collections import deque
from typing import Any

import rclpy
from geometry_msgs.msg import Twist
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import LaserScan

from course.robot.agent import ObstacleAvoidanceAI
from course.robot.sectors import from_scan

PERIOD = 0.1  # s between two decisions


class AIRobotController(Node):
    """Asks the agent what to do about the latest scan.

    Publishes nothing before the first scan, as in the chapter.  When the scan is older than the parameter
    `scan_timeout` (s), the robot stops.  Both it and `obstacle_threshold` (m) can be changed while the robot drives.
    """

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("ai_robot_controller", **kwargs)
        self.ai_agent = ObstacleAvoidanceAI(self._declare("obstacle_threshold", 0.5))
        self._scan_timeout = Duration(seconds=self._declare("scan_timeout", 0.5))
        self.add_post_set_parameters_callback(self.parameters_changed)

        self.latest_laser_data: dict[str, float] | None = None  # the nearest obstacle (m) in each sector
        self.latencies: deque[float] = deque(maxlen=10_000)  # s, from the start of a decision to its published command
        self.observers: list[Any] = []  # functions that are called with each decision, see control_loop
        self._scan_stamp, self._scan_received = 0.0, self.get_clock().now()

        self.cmd_vel_pub = self.create_publisher(Twist, "cmd_vel", 10)
        self.laser_sub = self.create_subscription(LaserScan, "scan", self.laser_callback, 10)
        self.timer = self.create_timer(PERIOD, self.control_loop)
        self.get_logger().info("AI Robot Controller started")

    def _declare(self, name: str, default: float) -> float:
        limits = [FloatingPointRange(from_value=0.01, to_value=100.0)]
        return self.declare_parameter(name, default, ParameterDescriptor(floating_point_range=limits)).value

    def parameters_changed(self, parameters: list[Parameter]) -> None:
        """Use the new values: they have already been accepted and stored."""
        for parameter in parameters:
            if parameter.name == "obstacle_threshold":
                self.ai_agent.obstacle_threshold = parameter.value
            elif parameter.name == "scan_timeout":
                self._scan_timeout = Duration(seconds=parameter.value)

    def laser_callback(self, msg: LaserScan) -> None:
        """Keep what the agent needs from the latest scan."""
        self.latest_laser_data = from_scan(msg)
        self._scan_received = self.get_clock().now()
        self._scan_stamp = msg.header.stamp.sec + msg.header.stamp.nanosec * 1e-9

    def control_loop(self) -> None:
        """Decide, ten times a second."""
        if self.latest_laser_data is None:
            return  # no sensor data yet
        start = time.perf_counter()
        if self.get_clock().now() - self._scan_received > self._scan_timeout:
            action = self.ai_agent.stop()
        else:
            action = self.ai_agent.decide_action(self.latest_laser_data)
        command = Twist()
        command.linear.x, command.angular.z = action["linear"], action["angular"]
        self.cmd_vel_pub.publish(command)
        self.latencies.append(time.perf_counter() - start)
        state = self.ai_agent.state.name
        self.get_logger().info(
            f"State: {state}, Cmd: linear={action['linear']:.2f}, angular={action['angular']:.2f}",
            throttle_duration_sec=1.0,
        )
        decision = {"stamp": self._scan_stamp, "state": state, **action, **self.latest_laser_data}
        for observer in self.observers:
            observer({**decision, "latency": self.latencies[-1]})


def main(args: list[str] | None = None) -> None:
    """Run until Ctrl-C, which shuts rclpy down by itself."""
    rclpy.init(args=args)
    try:
        rclpy.spin(AIRobotController())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except RuntimeError:  # rclpy's own, when a signal ends the context between two waits
        if rclpy.ok():
            raise


if __name__ == "__main__":
    main()
