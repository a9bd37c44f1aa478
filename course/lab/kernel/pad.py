"""Publishes commands for driving by hand for as long as they are renewed: a dead man's switch."""

import threading
import time

from geometry_msgs.msg import Twist
from rclpy.exceptions import InvalidHandle
from rclpy.publisher import Publisher

from course.ros.rclpy_internals import RCLError
from course.session.live import Session

LIMIT = 0.8  # s after the page's last command, when the robot is stopped; a browser on a busy machine may be late
PERIOD = 0.05  # s between two commands
KEPT = 1.0  # s that the publisher outlives the last command: later it would look like a driver


class Pad:
    """The session's publisher of commands, which exists only while somebody drives."""

    def __init__(self, live: Session):
        self._live = live
        self._lock = threading.Condition()
        # Of each page the last command (m/s, rad/s), and its end (s of time.monotonic); the newest is the last.
        self._commands: dict[str, tuple[tuple[float, float], float]] = {}
        self._until = 0.0  # end of the last one (s of time.monotonic)
        self._publisher: Publisher | None = None
        self._said: set[tuple[float, float]] = set()  # commands (m/s, rad/s) of the present publisher

    @property
    def publishes(self) -> bool:
        """Return True if the session has a publisher for it now."""
        return self._publisher is not None

    def command(self) -> tuple[float, float] | None:
        """Return the newest command (m/s, rad/s) of a page that drives, 0, 0 if none does any more, or None."""
        drives = self._drives()
        return drives[-1][1] if drives else (0.0, 0.0) if time.monotonic() < self._until else None

    def drivers(self) -> list[str]:
        """Return the pages that drive now: one that stands holds no button."""
        return [page for page, _ in self._drives()]

    def _drives(self) -> list[tuple[str, tuple[float, float]]]:
        now = time.monotonic()
        with self._lock:
            known = self._commands.items()
            return [(page, command) for page, (command, until) in known if now < until and any(command)]

    def has_said(self, linear: float, angular: float) -> bool:
        """Return True if the present publisher has sent this command (m/s, rad/s)."""
        return (linear, angular) in self._said

    def steer(self, linear: float, angular: float, page: str = "") -> None:
        """Publish this command of a page from now on, for `LIMIT` s at most."""
        with self._lock:
            self._until = time.monotonic() + LIMIT
            self._commands.pop(page, None)
            self._commands[page] = (linear, angular), self._until
            if self._publisher is None:
                self._publisher = self._live.node.create_publisher(Twist, "/cmd_vel", 10)
                threading.Thread(target=self._go_on, name="driving by hand", daemon=True).start()
            self._lock.notify_all()

    def stop(self) -> None:
        """Stop the robot at once, if it is driven by hand."""
        with self._lock:
            self._until = 0.0
            self._commands.clear()
            self._lock.notify_all()

    def _go_on(self) -> None:
        """Publish the command until it ends, then a stop; remove the publisher after `KEPT` s."""
        moving, stopped = False, time.monotonic()
        with self._lock:
            while self._live.ok and (moving or time.monotonic() < max(self._until, stopped + KEPT)):
                command = self.command() or (0.0, 0.0)
                try:
                    if moving or any(command):
                        self._publish(*command)
                except (RCLError, InvalidHandle):  # the session has ended
                    break
                moving = any(command)
                stopped = time.monotonic() if moving else stopped
                self._lock.wait(PERIOD)
            if self._live.ok and self._publisher is not None:
                self._live.node.destroy_publisher(self._publisher)
            self._publisher = None
            self._said.clear()
            self._commands.clear()

    def _publish(self, linear: float, angular: float) -> None:
        message = Twist()
        message.linear.x, message.angular.z = linear, angular
        assert self._publisher is not None
        self._said.add((linear, angular))
        self._publisher.publish(message)
