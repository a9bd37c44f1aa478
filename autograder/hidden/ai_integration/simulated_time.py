"""Simulated time for a node: /clock moves on only when the node has worked off what came before.

So a busy machine changes nothing.  A node that keeps time by itself, or cannot be asked whether it is done, is given
the time that it takes.
"""

import threading
from collections.abc import Callable
from typing import Any

from builtin_interfaces.msg import Time
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan

from autograder.suitekit import Alive, Heard, Listener, Ros
from course.foundation.waiting import wait_until
from course.world.lockstep import Barrier

SECOND = 10**9  # ns
FIND = 2.0  # s until a node's parameter services are found, by which it is asked
CROSSED = 1.0  # s until it has answered
OWN_TIME = 0.5  # s that a node which keeps its own time may take for a command
LATE = 0.02  # s, the same for a node that usually has its command ready when it has answered
CLEARLY, AT_LEAST = 2, 2  # it usually has when it had so many times as often as not, and so many times more
ANSWERS = 2  # after the clock: by the first its timers are ready to run, and by the second they have run


class SimulatedTime:
    """The simulated time of one start of a node that answers scans with commands."""

    def __init__(self, ros: Ros, laser: Any, commands: Listener, allow: Callable[[float], float]):
        """`laser` publishes the scans; `allow` is that of the submission's clock."""
        self.can_be_asked = True  # whether the node answered when it was last asked
        self._laser, self._commands, self._allow = laser, commands, allow
        self._clock = ros.node.create_publisher(Clock, "/clock", 10)
        self._news = threading.Condition()
        self._barrier = Barrier(ros.node, "cmd_vel", self._wait, self._wake)
        self._found = False
        self._now = 0  # ns
        self._prompt = self._late = 0  # ticks after which a command was there at once, or came later

    def tick(self, period: float, alive: Alive, scan: LaserScan | None = None, wait: bool = True) -> list[Heard]:
        """Move time on by `period` s, with a scan just before; the commands that came of it.

        A node that publishes by simulated time has done so when it has answered after the clock.  Any other is waited
        for, unless told not to `wait`.
        """
        if not self._found:
            self._barrier.find(FIND)
            self._found = True
        before = len(self._commands.heard)
        self._now += round(period * SECOND)
        stamp = Time(sec=self._now // SECOND, nanosec=self._now % SECOND)
        if scan is not None:
            scan.header.stamp = stamp
            self._laser.publish(scan)
            self._is_done()
        self._clock.publish(Clock(clock=stamp))
        answers = [self._is_done() for _ in range(ANSWERS)]
        self.can_be_asked = all(answers)
        if len(self._commands.heard) > before:
            self._prompt += 1
        elif wait:
            patience = LATE if self.can_be_asked and self._is_prompt() else OWN_TIME
            self._late += bool(self._commands.wait(lambda heard: heard[before:], patience, alive))
        return self._commands.heard[before:]

    def _is_done(self) -> bool:
        """Wait until the node has answered, and so has worked off what was sent before; False when it has not."""
        return self._barrier.cross(self._allow(CROSSED))

    def _is_prompt(self) -> bool:
        return self._prompt > CLEARLY * self._late + AT_LEAST

    def _wait(self, condition: Callable[[], bool], timeout: float) -> bool:
        return wait_until(condition, timeout, news=self._news)

    def _wake(self) -> None:
        with self._news:
            self._news.notify_all()
