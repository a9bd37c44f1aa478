"""The grader's side of the conversation: it is the robot's laser, its clock, and whoever listens to its wheels."""

import contextlib
import itertools
import math
import statistics
import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

from geometry_msgs.msg import Twist
from rclpy.parameter import Parameter
from sensor_msgs.msg import LaserScan

from autograder.hidden.ai_integration.simulated_time import SimulatedTime
from autograder.suitekit import Alive, Bench, Heard, Listener, LiveProgram, Offers, Wrong, speaker
from autograder.suitekit.lifecycle import Answer, Question
from course.waiting import wait_until
from course.world import Laser, Room, Simulation
from course.world.node import World

SCAN = "a subscription to the topic scan (sensor_msgs/LaserScan)"
CMD_VEL = "a publisher of the topic cmd_vel (geometry_msgs/Twist)"
SIMULATED = ("--ros-args", "-p", "use_sim_time:=true")
PERIOD = 0.1  # s of simulated time between two commands

TRIES = 6  # ticks until a node must have done what a scan asks for
STAYS = 4  # commands that must then be the same
MORE_TRIES, MORE_STAYS = 30, 11  # the same for a node that cannot be asked, and may have old ticks to work off

SETTLING = 0.5  # s of real time before a rate is measured: discovery, and the commands of before, are over
MEASURED = 2.5  # s of real time in which it is measured: 25 commands, of which a busy machine delays a few
FEWEST = 3  # commands that have a rate

DRIVING = 1.0  # s of real time with scans, until a node certainly drives
DRIVING_HERTZ = 20.0  # scans a second then
WATCHED = 1.5  # s of real time without scans: three times as long as a node may drive on

DECISION = 0.2  # s of real time for a command of a drive, until the robot moves on by the one before
DRIVE = 60.0  # s of real time for a drive
IDLE = 20  # ticks of a drive without a command after which it ends


class Command(NamedTuple):
    """What a Twist tells the robot to do."""

    linear: float  # m/s
    angular: float  # rad/s


FORWARD, LEFT, RIGHT, STOP = Command(0.3, 0.0), Command(0.0, 0.5), Command(0.0, -0.5), Command(0.0, 0.0)
WORDS = {
    FORWARD: "drive forward (linear.x 0.3, angular.z 0)",
    LEFT: "turn left (linear.x 0, angular.z 0.5)",
    RIGHT: "turn right (linear.x 0, angular.z -0.5)",
    STOP: "stand still (linear.x 0, angular.z 0)",
}


class StandstillError(Exception):
    """The node sends no commands any more."""


class Avoider(LiveProgram):
    """The student's node."""

    advice = "a timer of 10 Hz must publish on cmd_vel, and no callback may wait"

    def __init__(self, bench: Bench, *args: str):
        super().__init__(bench, "obstacle_avoider.py", *args)

    def connect(self) -> Offers:
        """The laser, a subscription of the commands, and the clock."""
        self.commands = Listener(self.ros, "cmd_vel", Twist)
        self.laser = speaker(self.ros, "scan", LaserScan)
        self._time = SimulatedTime(self.ros, self.laser, self.commands, self.allow)
        return {SCAN: lambda: self.laser.get_subscription_count() > 0, CMD_VEL: lambda: self.commands.ready}

    def ask(self, question: Question[Answer], what: str = "a scan") -> Answer:
        """The answer to a question (see `converse`), asked as soon as both topics are there."""
        return self.converse(question, what, SCAN, CMD_VEL)

    def start_fresh(self) -> None:
        """Have the program running, and no scan shown to it yet."""
        self.ensure_fresh(SCAN, CMD_VEL)

    def tick(self, scan: LaserScan | None = None, period: float = PERIOD, wait: bool = True) -> list[Command]:
        """Move simulated time on by `period` s, with a scan just before; the commands that came of it.

        A node that does not publish by simulated time is waited for, unless told not to `wait`.
        """
        self.fresh = self.fresh and scan is None
        return commands_of(self._time.tick(period, lambda: self.program.alive, scan, wait))

    def simulate(self, seconds: float, step: float, scans: Callable[[int], LaserScan | None]) -> list[Command]:
        """The commands of some simulated time, in which `scans(tick)` is shown at each tick of `step` s."""

        def play(limit: float, alive: Alive) -> list[Command] | None:
            before = len(self.commands.heard)
            for tick in range(round(seconds / step)):
                if not alive() or self.bench.clock.left <= 0:
                    return None
                self.tick(scans(tick), step, wait=False)
            return commands_of(self.commands.heard[before:]) if alive() else None

        return self.ask(play)

    def expect(self, scan: LaserScan, right: Command, about: str) -> None:
        """Shown this scan again and again, it must come to the right command and stay with it."""

        def show(limit: float, alive: Alive) -> list[Command] | None:
            got: list[Command] = []
            end = time.monotonic() + limit
            for tries in range(MORE_TRIES):
                if tries >= TRIES and self._time.can_be_asked:
                    break
                got += self.tick(scan)[-1:]
                stays = [right] * (STAYS if self._time.can_be_asked else MORE_STAYS)
                if got[-len(stays) :] == stays or not alive() or time.monotonic() > end:
                    break
            return got if got and alive() else None

        got = self.ask(show)
        if got[-2:] != [right, right]:
            raise Wrong(
                f"{about}, the robot must {WORDS[right]}; it was told to {describe(got[-1])}.",
                f"commands {got}, scan {scan}",
            )
        if other := {*got[-STAYS:]} - {right}:
            raise Wrong(
                f"{about}, the robot must {WORDS[right]}, for as long as the scan stays the same; it was also told to "
                f"{describe(other.pop())}.",
                f"commands {got}, scan {scan}",
            )

    def rate(self, scan: LaserScan, hertz: float) -> tuple[float, list[Command]]:
        """Commands a second in real time while scans come at `hertz`, and the commands.

        The rate is by the median of the times between two, which a busy machine hardly moves; or by their mean when
        that makes it higher, as with a node that answers scans and publishes by a timer as well.
        """

        def measure(limit: float, alive: Alive) -> tuple[float, list[Command]] | None:
            self._show(scan, hertz, SETTLING)
            before = len(self.commands.heard)
            self._show(scan, hertz, MEASURED)
            heard = self.commands.heard[before:]
            if len(heard) < FEWEST:
                return None
            gaps = [later.time - earlier.time for earlier, later in itertools.pairwise(heard)]
            return 1 / min(statistics.median(gaps), statistics.mean(gaps)), commands_of(heard)

        return self.ask(measure)

    def time_to_stop(self, scan: LaserScan) -> float:
        """How long after the last scan it stands still for good (s, in real time); infinite when it does not."""

        def measure(limit: float, alive: Alive) -> float | None:
            self._show(scan, DRIVING_HERTZ, DRIVING)
            last = time.monotonic()
            wait_until(lambda: not alive(), WATCHED)
            after = [heard for heard in self.commands.heard if heard.time > last]
            standing = [*itertools.takewhile(lambda heard: command_of(heard) == STOP, reversed(after))]
            return (standing[-1].time - last if standing else math.inf) if alive() else None

        return self.ask(measure)

    def drive(self, room: Room, laser: Laser, seed: int, seconds: float) -> Simulation:
        """A drive through a room in simulated time, from a fresh start; `seed` is of the laser's noise."""
        self.start_fresh()

        def go(limit: float, alive: Alive) -> Simulation | None:
            self.fresh = False
            world = World(
                room,
                laser,
                context=self.ros.node.context,
                use_global_arguments=False,
                parameter_overrides=[Parameter("fast", value=True), Parameter("seed", value=seed)],
            )
            watch = StandstillWatch(self.commands, alive)
            try:
                with contextlib.suppress(TimeoutError, StandstillError):
                    world.drive(seconds, on_step=watch.look, answer_within=DECISION, wall_limit=self.allow(DRIVE))
            finally:
                world.destroy_node()
            return world.simulation if alive() and watch.heard else None

        return self.ask(go, "a drive")

    def _show(self, scan: LaserScan, hertz: float, seconds: float) -> None:
        """Send the scan again and again, in real time."""
        self.fresh = False
        start = time.monotonic()
        for number in range(round(seconds * hertz)):
            time.sleep(max(0.0, start + number / hertz - time.monotonic()))
            scan.header.stamp = self.ros.node.get_clock().now().to_msg()
            self.laser.publish(scan)


class StandstillWatch:
    """Ends a drive when the node is dead, or has sent no command for IDLE ticks."""

    def __init__(self, commands: Listener, alive: Alive):
        self.heard = 0  # commands
        self._commands, self._alive, self._idle = commands, alive, 0

    def look(self) -> None:
        """After a tick; raises StandstillError."""
        heard = len(self._commands.heard)
        self._idle = self._idle + 1 if heard == self.heard else 0
        self.heard = heard
        if self._idle > IDLE or not self._alive():
            raise StandstillError


def command_of(heard: Heard) -> Command:
    """What a message on cmd_vel says."""
    return Command(round(heard.message.linear.x, 6), round(heard.message.angular.z, 6))


def commands_of(heard: Sequence[Heard]) -> list[Command]:
    """What messages on cmd_vel say."""
    return [command_of(message) for message in heard]


def describe(command: Command) -> str:
    """A command in words for the student."""
    return WORDS.get(command, f"do something else (linear.x {command.linear:g}, angular.z {command.angular:g})")
