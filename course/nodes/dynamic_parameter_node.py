"""Section 3.3.2: a node that checks a new parameter value before it is stored, and uses it afterwards."""

from typing import Any

import rclpy
from rcl_interfaces.msg import SetParametersResult
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.parameter import Parameter


class DynamicParameterNode(Node):
    """Has a `threshold` from 0 to 100; `self.threshold` follows it."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("dynamic_parameter_node", **kwargs)
        # This comes before the declaration, so that a value from the command line is checked as well.
        self.add_on_set_parameters_callback(self.parameter_callback)
        self.threshold = self.declare_parameter("threshold", 50.0).value
        self.add_post_set_parameters_callback(self.parameters_changed)
        self.get_logger().info("Dynamic Parameter Node started")

    def parameter_callback(self, params: list[Parameter]) -> SetParametersResult:
        """Accept or refuse all of `params`, and change nothing: another callback may still refuse them."""
        for param in params:
            if param.name == "threshold":
                reason = self.fault(param.value)
                if reason:
                    self.get_logger().warning(f"Invalid threshold: {reason}")
                    return SetParametersResult(successful=False, reason=reason)
        return SetParametersResult(successful=True)

    def fault(self, value: Any) -> str | None:
        """Return why `value` cannot be the threshold, or None if it can."""
        if not isinstance(value, float):  # None means delete it; a bool would compare as 0 or 1
            return f"threshold must be a float such as 50.0, not {value!r}"
        if not 0.0 <= value <= 100.0:
            return f"threshold must be from 0 to 100, not {value}"
        return None

    def parameters_changed(self, params: list[Parameter]) -> None:
        """Use the new values: they have already been accepted and stored."""
        for param in params:
            if param.name == "threshold":
                self.threshold = param.value
                self.get_logger().info(f"Threshold updated: {param.value}")


def main(args: list[str] | None = None) -> None:
    """Run until Ctrl-C, which shuts rclpy down by itself."""
    rclpy.init(args=args)
    try:
        rclpy.spin(DynamicParameterNode())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except RuntimeError:  # rclpy's own, when a signal ends the context between two waits
        if rclpy.ok():
            raise


if __name__ == "__main__":
    main()
