"""`ros2 run lifecycle lifecycle_talker`: a managed node, `lc_talker`, that publishes only while it is active."""

from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.lifecycle import LifecycleState, Node, TransitionCallbackReturn
from rclpy.lifecycle.publisher import LifecyclePublisher
from rclpy.timer import Timer
from std_msgs.msg import String

PERIOD = 1.0  # s


class LifecycleTalker(Node):
    """Has a publisher once it is configured; it publishes only while the node is active."""

    def __init__(self, **kwargs: Any) -> None:
        self.count = 0
        self.said: LifecyclePublisher | None = None
        self.timer: Timer | None = None
        super().__init__("lc_talker", **kwargs)

    def say(self) -> None:
        """Publish the next message; an inactive publisher drops it."""
        if self.said is None:
            return
        message = String(data=f"Lifecycle HelloWorld #{self.count}")
        self.count += 1
        if self.said.is_activated:
            self.get_logger().info(f"Lifecycle publisher is active. Publishing: [{message.data}]")
        else:
            self.get_logger().info("Lifecycle publisher is inactive. Messages are not published.")
        self.said.publish(message)

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Make the publisher and the timer."""
        self.said = self.create_lifecycle_publisher(String, "lifecycle_chatter", 10)
        self.timer = self.create_timer(PERIOD, self.say)
        self.get_logger().info("on_configure() is called.")
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Let the node's own publishers be activated."""
        self.get_logger().info("on_activate() is called.")
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Let the node's own publishers be deactivated."""
        self.get_logger().info("on_deactivate() is called.")
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Destroy the publisher and the timer."""
        self._forget()
        self.get_logger().info("on_cleanup() is called.")
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Destroy the publisher and the timer, whatever the state was."""
        self._forget()
        self.get_logger().info("on_shutdown() is called.")
        return TransitionCallbackReturn.SUCCESS

    def _forget(self) -> None:
        if self.timer is not None:
            self.destroy_timer(self.timer)
        if self.said is not None:
            self.destroy_publisher(self.said)
        self.timer = self.said = None


def main(args: list[str] | None = None) -> None:
    """Run until Ctrl-C, which shuts rclpy down by itself."""
    rclpy.init(args=args)
    try:
        rclpy.spin(LifecycleTalker())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except RuntimeError:  # rclpy's own, when a signal ends the context between two waits
        if rclpy.ok():
            raise


if __name__ == "__main__":
    main()
