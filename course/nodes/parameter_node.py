"""Section 3.3.1: a node with parameters; the command line can override them, `ros2 param set` can change them."""

from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node


class ParameterNode(Node):
    """Logs its `max_speed` (m/s) every second; it reads it each time, so that a change shows at once."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("parameter_node", **kwargs)
        self.declare_parameter("robot_name", "atlas")
        self.declare_parameter("max_speed", 1.5)  # m/s
        self.declare_parameter("debug_mode", False)

        self.get_logger().info(f"Robot: {self.get_parameter('robot_name').value}")
        self.get_logger().info(f"Max Speed: {self.get_parameter('max_speed').value} m/s")
        self.get_logger().info(f"Debug Mode: {self.get_parameter('debug_mode').value}")
        self.timer = self.create_timer(1.0, self.timer_callback)

    def timer_callback(self) -> None:
        """Use the parameter's current value."""
        self.get_logger().info(f"Max speed: {self.get_parameter('max_speed').value}")


def main(args: list[str] | None = None) -> None:
    """Run until Ctrl-C, which shuts rclpy down by itself."""
    rclpy.init(args=args)
    try:
        rclpy.spin(ParameterNode())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except RuntimeError:  # rclpy's own, when a signal ends the context between two waits
        if rclpy.ok():
            raise


if __name__ == "__main__":
    main()
