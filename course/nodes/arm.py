"""For section 3.3: an arm that a PID controller holds up, `effort` in and `error` out.  It has no controller itself."""

import time
from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Float64

from course.recorders import Recorder

PERIOD = 0.02  # s
LONGEST = 0.05  # s: on a busy machine the arm's time stops instead of jumping
INERTIA = 0.5  # kg m²
DAMPING = 4.0  # N m s/rad
LOAD = 6.0  # N m by which its weight pulls the arm down


class Arm(Node):
    """The node `arm`: one joint with a weight, simulated in real time; it begins at 0 rad.

    Subscribes to `effort` (std_msgs/Float64, N m).  Publishes `error` (std_msgs/Float64, rad: the parameter `target`
    minus the angle), 50 times a second.  `track` records `angle`, `target` (rad) and `effort` (N m), and the texts
    given to `note` in separate rows.
    """

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("arm", **kwargs)
        self.declare_parameter("target", 1.0)  # rad
        self.track = Recorder("angle", "target", "effort", "note")
        self._angle, self._speed, self._effort = 0.0, 0.0, 0.0  # rad, rad/s, N m
        self._last = time.monotonic()
        self._errors = self.create_publisher(Float64, "error", 10)
        self.create_subscription(Float64, "effort", self._on_effort, 10)
        self.create_timer(PERIOD, self._step)
        self.get_logger().info("Arm started: it falls until an effort holds it")

    @property
    def error(self) -> float:
        """Return the target minus the angle (rad)."""
        return float(self.get_parameter("target").value - self._angle)

    def note(self, text: str) -> None:
        """Record in `track` a change of the controller, such as 'ki = 20'."""
        self.track.add(note=text)

    def _on_effort(self, msg: Float64) -> None:
        self._effort = msg.data

    def _step(self) -> None:
        now = time.monotonic()
        step, self._last = min(now - self._last, LONGEST), now
        self._speed += (self._effort - LOAD - DAMPING * self._speed) / INERTIA * step
        self._angle += self._speed * step
        self.track.add(angle=self._angle, target=self._angle + self.error, effort=self._effort)
        self._errors.publish(Float64(data=self.error))


def main(args: list[str] | None = None) -> None:
    """Run until Ctrl-C, which shuts rclpy down by itself."""
    rclpy.init(args=args)
    try:
        rclpy.spin(Arm())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except RuntimeError:  # rclpy's own, when a signal ends the context between two waits
        if rclpy.ok():
            raise


if __name__ == "__main__":
    main()
