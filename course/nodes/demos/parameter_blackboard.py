"""`ros2 run demo_nodes_cpp parameter_blackboard`: keeps whatever parameters it is given."""

from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node


class ParameterBlackboard(Node):
    """Accepts undeclared parameters, from the command line and by `ros2 param set`."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(
            "parameter_blackboard",
            allow_undeclared_parameters=True,
            automatically_declare_parameters_from_overrides=True,
            **kwargs,
        )
        self.get_logger().info(f"Parameter blackboard node named '{self.get_fully_qualified_name()}' ready")


def main(args: list[str] | None = None) -> None:
    """Run until Ctrl-C, which shuts rclpy down by itself."""
    rclpy.init(args=args)
    try:
        rclpy.spin(ParameterBlackboard())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except RuntimeError:  # rclpy's own, when a signal ends the context between two waits
        if rclpy.ok():
            raise


if __name__ == "__main__":
    main()
