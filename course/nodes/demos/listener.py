"""`ros2 run demo_nodes_py listener`: logs the messages on `chatter`."""

from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import String


class Listener(Node):
    """Logs each message."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("listener", **kwargs)
        self.subscription = self.create_subscription(String, "chatter", self.hear, 10)

    def hear(self, message: String) -> None:
        """Log a message."""
        self.get_logger().info(f"I heard: [{message.data}]")


def main(args: list[str] | None = None) -> None:
    """Run until Ctrl-C, which shuts rclpy down by itself."""
    rclpy.init(args=args)
    try:
        rclpy.spin(Listener())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except RuntimeError:  # rclpy's own, when a signal ends the context between two waits
        if rclpy.ok():
            raise


if __name__ == "__main__":
    main()
