"""`ros2 run demo_nodes_py talker`: says hello on `chatter`, once a second."""

from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import String

PERIOD = 1.0  # s


class Talker(Node):
    """Publishes messages with a number that increases."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("talker", **kwargs)
        self.count = 0
        self.publisher = self.create_publisher(String, "chatter", 10)
        self.timer = self.create_timer(PERIOD, self.say)

    def say(self) -> None:
        """Publish the next message."""
        message = String(data=f"Hello World: {self.count}")
        self.count += 1
        self.get_logger().info(f'Publishing: "{message.data}"')
        self.publisher.publish(message)


def main(args: list[str] | None = None) -> None:
    """Run until Ctrl-C, which shuts rclpy down by itself."""
    rclpy.init(args=args)
    try:
        rclpy.spin(Talker())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except RuntimeError:  # rclpy's own, when a signal ends the context between two waits
        if rclpy.ok():
            raise


if __name__ == "__main__":
    main()
