"""The grader's side of the conversation: it is the robot's laser, its clock, and whoever listens to its wheels.

Most is played in simulated time: /clock moves on only when the student's node has worked off what came before, so that
a busy machine changes nothing.  A node that keeps time by itself is given the time that it takes.
"""

import contextlib
import itertools
import math
import statistics
import threading
import time
from collections.abc import Callable

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Twist
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan

from autograder.errors import Wrong
from autograder.suitekit.live import Live
from autograder.suitekit.topics import Heard, Listener, speaker
from course.world import Laser, Room, Simulation
from course.world.lockstep import Barrier
from course.world.node import World

SCAN = "a subscription to the topic scan (sensor_msgs/LaserScan)"
CMD_VEL = "a publisher of the topic cmd_vel (geometry_msgs/Twist)"
SIMULATED = ("--ros-args", "-p", "use_sim_time:=true")
PERIOD = 0.1  # s between two commands
OWN_TIME = 0.5  # s that a node which keeps its own time may take for a command
LATE = 0.02  # s, the same for one that does not
CROSSED = 1.0  # s for an answer about its parameters
FIND = 2.0  # s until a node's services are found
DECISION = 0.2  # s of real time for a command of a drive, until the robot moves on by the one before
DRIVE = 60.0  # s of real time for a drive
IDLE = 20  # ticks of a drive without a command after which it ends
TRIES = 6  # ticks until a node must have done what a scan asks for
STAYS = 4  # commands that must then be the same
MORE_TRIES, MORE_STAYS = 30, 11  # the same for one that cannot be asked, and may have ticks of before to work off

FORWARD, LEFT, RIGHT, STOP = (0.3, 0.0), (0.0, 0.5), (0.0, -0.5), (0.0, 0.0)
WORDS = {
    FORWARD: "drive forward (linear.x 0.3, angular.z 0)",
    LEFT: "turn left (linear.x 0, angular.z 0.5)",
    RIGHT: "turn right (linear.x 0, angular.z -0.5)",
    STOP: "stand still (linear.x 0, angular.z 0)",
}


class StandstillError(Exception):
    """The node sends no commands any more."""


def speeds(heard: Heard) -> tuple[float, float]:
    """What a command says: linear and angular speed (m/s, rad/s)."""
    return round(heard.message.linear.x, 6), round(heard.message.angular.z, 6)


class Avoider(Live):
    """The student's node."""

    advice = "a timer of 10 Hz must publish on cmd_vel, and no callback may wait"

    def __init__(self, bench, *args: str):
        super().__init__(bench, "obstacle_avoider.py", *args)

    def connect(self):
        """The laser, the clock, and a subscription of the commands."""
        self.commands = Listener(self.ros, "cmd_vel", Twist)
        self.laser = speaker(self.ros, "scan", LaserScan)
        self._clock = self.ros.node.create_publisher(Clock, "/clock", 10)
        self._news = threading.Condition()
        self._barrier = Barrier(self.ros.node, "cmd_vel", self._wait, self._wake)
        self._found = False
        self._asked = True  # the node answers to the barrier
        self._in_step = self._out_of_step = 0  # ticks after which a command was there at once, or came later
        self.now = 0  # ns of simulated time
        self.fresh = True  # no scan has been shown to this start of the program
        return {SCAN: lambda: self.laser.get_subscription_count() > 0, CMD_VEL: lambda: self.commands.ready}

    def converse(self, question: Callable, what: str = "a scan"):
        """Ask with the topics there, whatever else is not."""
        return super().converse(question, what, SCAN, CMD_VEL)

    def ensure_fresh(self) -> None:
        """Have the program running, and no scan shown to it yet."""
        if not self.fresh:
            self.program.kill()
            self.begin()
        self.up(SCAN, CMD_VEL)

    def tick(self, scan: LaserScan | None = None, period: float = PERIOD, wait: bool = True) -> list[Heard]:
        """Move simulated time on by `period` s, with a scan just before; the commands that came of it.

        A node that publishes by simulated time has done so when it has answered twice after the clock.  One that keeps
        time by itself, or cannot be asked, is waited for, unless told not to `wait`.
        """
        if not self._found:
            self._barrier.find(FIND)
            self._found = True
        before = len(self.commands.heard)
        self.now += round(period * 1e9)
        stamp = Time(sec=self.now // 10**9, nanosec=self.now % 10**9)
        if scan is not None:
            scan.header.stamp = stamp
            self.fresh = False
            self.laser.publish(scan)
            self._barrier.cross(self.bench.clock.allow(CROSSED))
        self._clock.publish(Clock(clock=stamp))
        crossed = [self._barrier.cross(self.bench.clock.allow(CROSSED)) for _ in range(2)]
        self._asked = all(crossed)
        if len(self.commands.heard) > before:
            self._in_step += 1
        elif wait:
            done = self._asked and self._in_step > 2 * self._out_of_step + 2
            self._out_of_step += bool(
                self.commands.wait(lambda heard: heard[before:], LATE if done else OWN_TIME, lambda: self.program.alive)
            )
        return self.commands.heard[before:]

    def expect(self, scan: LaserScan, right: tuple[float, float], about: str) -> None:
        """Shown this scan again and again, it comes to the right command and stays with it."""

        def show(limit, alive):
            got, end = [], time.monotonic() + limit
            for tries in range(MORE_TRIES):
                if tries >= TRIES and self._asked:
                    break
                got += [speeds(command) for command in self.tick(scan)][-1:]
                stays = [right] * (STAYS if self._asked else MORE_STAYS)
                if got[-len(stays) :] == stays or not alive() or time.monotonic() > end:
                    break
            return got if got and alive() else None

        got = self.converse(show)
        if got[-2:] != [right, right]:
            raise Wrong(
                f"{about}, it must {WORDS[right]}; it was told to {describe(got[-1])}.", f"commands {got}, scan {scan}"
            )
        if other := {*got[-STAYS:]} - {right}:
            raise Wrong(
                f"{about}, it must {WORDS[right]}, and stay with it while the scan stays the same; it was also told "
                f"to {describe(other.pop())}.",
                f"commands {got}, scan {scan}",
            )

    def rate(self, scan: LaserScan, hertz: float) -> tuple[float, list[tuple[float, float]]]:
        """Commands a second in real time while scans come at `hertz`, and the commands.

        The rate is by the median of the times between two, which a busy machine hardly moves; or by their mean when
        that makes it higher, as with a node that answers scans and publishes by a timer as well.
        """

        def measure(limit, alive):
            self._show(scan, hertz, 0.5)
            before = len(self.commands.heard)
            self._show(scan, hertz, 2.5)
            heard = self.commands.heard[before:]
            if len(heard) < 3:
                return None
            gaps = [later.time - earlier.time for earlier, later in itertools.pairwise(heard)]
            return 1 / min(statistics.median(gaps), statistics.mean(gaps)), [*map(speeds, heard)]

        return self.converse(measure)

    def time_to_stop(self, scan: LaserScan) -> float:
        """How long after the last scan it stands still for good (s, in real time); infinite when it does not."""

        def measure(limit, alive):
            self._show(scan, 20.0, 1.0)
            last = time.monotonic()
            time.sleep(1.5)
            after = [heard for heard in self.commands.heard if heard.time > last]
            standing = [*itertools.takewhile(lambda heard: speeds(heard) == STOP, reversed(after))]
            return (standing[-1].time - last if standing else math.inf) if alive() else None

        return self.converse(measure)

    def drive(self, room: Room, laser: Laser, seed: int, seconds: float) -> Simulation:
        """A drive through a room in simulated time, from a fresh start."""
        self.ensure_fresh()

        def go(limit, alive):
            self.fresh = False
            world = World(
                room,
                laser,
                context=self.ros.node.context,
                use_global_arguments=False,
                parameter_overrides=[Parameter("fast", value=True), Parameter("seed", value=seed)],
            )
            idle, heard = 0, 0

            def look():
                nonlocal idle, heard
                idle = idle + 1 if len(self.commands.heard) == heard else 0
                heard = len(self.commands.heard)
                if idle > IDLE or not alive():
                    raise StandstillError

            try:
                with contextlib.suppress(TimeoutError, StandstillError):
                    world.drive(seconds, on_step=look, answer_within=DECISION, wall_limit=self.bench.clock.allow(DRIVE))
            finally:
                world.destroy_node()
            return world.simulation if alive() and heard else None

        return self.converse(go, "a drive")

    def _show(self, scan: LaserScan, hertz: float, seconds: float) -> None:
        """Send the scan again and again, in real time."""
        self.fresh = False
        start = time.monotonic()
        for number in range(round(seconds * hertz)):
            time.sleep(max(0.0, start + number / hertz - time.monotonic()))
            scan.header.stamp = self.ros.node.get_clock().now().to_msg()
            self.laser.publish(scan)

    def _wait(self, condition: Callable[[], bool], timeout: float) -> bool:
        end = time.monotonic() + timeout
        with self._news:
            while not condition() and (left := end - time.monotonic()) > 0.0:
                self._news.wait(min(left, 0.02))  # nobody tells of who has come to the graph
            return condition()

    def _wake(self) -> None:
        with self._news:
            self._news.notify_all()


def describe(command: tuple[float, float]) -> str:
    """A command in words for the student."""
    return WORDS.get(command, f"something else (linear.x {command[0]:g}, angular.z {command[1]:g})")
