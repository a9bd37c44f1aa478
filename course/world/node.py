"""The world as a ROS node: it takes `cmd_vel`, publishes `scan` and `odom`, and reports each hit on `collision`.

It runs in real time by itself, or (parameter `fast`) as fast as possible, in lockstep with the driver, the node that
publishes `cmd_vel`: each tick of simulated time publishes one scan and waits for one command.  A drive then ends the
same way on a busy machine as on an idle one.
"""

import contextlib
import math
import threading
import time
import weakref
from array import array
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import LaserScan
from std_msgs.msg import String

from course.errors import NoDriver, WorldError
from course.foundation.calls import fitting, is_number, takes
from course.foundation.waiting import tellers, time_limit, wait_until
from course.ros.rclpy_internals import InvalidHandle, RCLError
from course.world.controls import LATCHED, Controls
from course.world.drivers import SILENT_CAUSE, endpoints, half_a_driver, tell_of_no_driver, tell_of_silence
from course.world.geometry import Pose
from course.world.laser import Laser
from course.world.lockstep import Barrier, Drive, Pace
from course.world.rooms import Room
from course.world.simulation import Robot, Simulation

MOST_RATE = 1000.0  # Hz
IDLE = 0.5  # s without a move, after which a world does not simulate
COMMAND_TIMEOUT = 0.5  # s of the world's time without a command, after which the robot stops
CLOCK_REPEAT = 0.05  # s; subscribers to /clock are best effort, so an unanswered tick is published again
SILENT = 5.0  # s after which the reader learns that the driver does not answer
IDLE_ANSWERS = 1.0  # s within which a node answers a request for parameters, unless a callback of it keeps it busy
PATIENCE = 3.0  # s without a driver, after which the reader is told that a drive waits for one
FIND_SERVICES = 1.0  # s to wait for the driver's parameter services
SETTLE = 0.01  # s without a command after which a tick ends, for a driver without parameter services


# Called with a world of this process when it is made, and when one of its drives begins and ends, because polling could
# miss a drive.
watchers: list[Callable[["World"], None]] = []
_latest: list["weakref.ReferenceType[World]"] = []  # the last one made


def read_once(description: str) -> ParameterDescriptor:
    """Return the descriptor of a parameter that counts when the world starts, and cannot be set afterwards."""
    return ParameterDescriptor(read_only=True, description=description)


def _refused(parameters: list[Parameter]) -> SetParametersResult:
    """Refuse changes of a world in fast mode, which would have no effect."""
    if all(parameter.name == "use_sim_time" for parameter in parameters):
        return SetParametersResult(successful=True)
    why = "a world in fast mode runs as its cell says: start it with other parameters"
    return SetParametersResult(successful=False, reason=why)


class World(Node):
    """The node `world`: a robot with a laser in a room.

    Subscribes to `cmd_vel` (geometry_msgs/Twist).  Publishes `scan` (sensor_msgs/LaserScan, frame `laser`), `odom`
    (nav_msgs/Odometry, `odom` to `base_link`) and, for each collision as it begins, `collision` (std_msgs/String, kept
    for late subscribers); in fast mode also `/clock`, for nodes started with `use_sim_time:=true`.

    Parameters: `room` (a name in course.world.ROOMS or the path of a .json file), `noise` (m), `beams` (over one turn)
    and `angle_min` (rad) of the laser; read-only are `seed` of its noise, `rate` (scans a second) and `fast`.  The
    arguments `room` and `laser` override the parameters.  In real time the world can be controlled while it runs
    (course.world.controls); in fast mode only `cmd_vel` has an effect, so that a drive is repeatable.  `simulation`
    holds the robot's pose, path and collisions since the last reset, which was at `began`; `received` counts the
    commands.  Raises WorldError if there is no such room, or the robot touches an obstacle at its start.
    """

    def __init__(
        self,
        room: str | Path | Room | None = None,
        laser: Laser | None = None,
        robot: Robot | None = None,
        **kwargs: Any,
    ) -> None:
        super().__init__("world", **kwargs)
        self._lock = threading.Condition(threading.RLock())
        self._room = room or self.declare_parameter("room", "hall").value
        self._seed = self.declare_parameter("seed", 0, read_once("seed of the laser's noise")).value
        self._laser = laser or Laser.turn(
            self.declare_parameter("beams", 360).value,
            self.declare_parameter("angle_min", 0.0).value,
            noise=self.declare_parameter("noise", 0.01).value,
        )
        self._robot = robot or Robot()
        rate = self.declare_parameter("rate", 10.0, read_once("scans a second")).value
        if not 0.0 < rate <= MOST_RATE:
            raise WorldError(f"rate must be above 0 Hz, at most {MOST_RATE:g} Hz, not {rate}")
        self._period = round(1e9 / rate)  # ns, so that ticks add up exactly
        self.fast = self.declare_parameter("fast", False, read_once("in step with the driver")).value

        self._now = 0  # ns of simulated time
        self.received = 0  # commands since the start
        self._moved = 0.0, -math.inf  # the last move: s of simulated time, s of time.monotonic
        self._shown = -math.inf  # s of time.monotonic, when the timer showed the world last
        self._own_executor: SingleThreadedExecutor | None = None
        self._controls: Controls | None = None
        self._barrier = Barrier(self, "cmd_vel", self._wait, self._wake)
        self.reset()

        # The clock's publisher comes last: a node that has discovered it has discovered the scan as well.
        self._scan_pub = self.create_publisher(LaserScan, "scan", 10)
        self._odom_pub = self.create_publisher(Odometry, "odom", 10)
        self._collision_pub = self.create_publisher(String, "collision", LATCHED)
        self.create_subscription(Twist, "cmd_vel", self._on_command, 10)
        if self.fast:
            self._clock_pub = self.create_publisher(ClockMessage, "/clock", 10)
            self.add_on_set_parameters_callback(_refused)
        else:
            self._controls = Controls(self, self)
            self.create_timer(1.0 / rate, self._on_timer, clock=Clock(clock_type=ClockType.STEADY_TIME))
        _latest[:] = [weakref.ref(self)]
        self._tell_watchers()
        self.get_logger().info(f"World started in room '{self.simulation.room.name}'")

    @fitting
    def reset(self, room: str | Path | Room | None = None, seed: int | None = None) -> None:
        """Put the robot at the start of `room`, at rest and without history; by default room and seed are kept.

        Simulated time goes on, because it must not jump backwards for nodes that use it.
        """
        self._expect_running()
        with self._lock:
            self._room = room or self._room
            self._seed = self._seed if seed is None else seed
            self.simulation = Simulation(self._room, self._laser, self._robot, self._seed)
            self.began = self.get_clock().now().to_msg()
            self._command, self._command_age = (0.0, 0.0), 0.0
        if self._controls:
            self._controls.show_walls()

    @fitting
    def place(self, pose: Pose) -> None:
        """Put the robot at `pose` (x m, y m, heading rad); raises WorldError if it cannot stand there."""
        with self._lock:
            self.simulation.place(pose)

    @fitting
    def drop(self, x: float, y: float) -> None:
        """Put a round obstacle at x, y (m), until the next `reset`; raises WorldError if the robot stands there."""
        self._expect_running()
        with self._lock:
            self.simulation.drop(x, y)
        if self._controls:
            self._controls.show_walls()

    def _expect_running(self) -> None:
        """Raise WorldError once the node has been destroyed."""
        try:
            self.get_name()
        except InvalidHandle:
            raise WorldError("this world has been ended: start one again, such as `world = ros.start(World)`") from None

    @property
    def laser(self) -> Laser:
        """Return the robot's scanner; a new one is used from the next scan on."""
        return self._laser

    @laser.setter
    def laser(self, laser: Laser) -> None:
        self._expect_running()
        Simulation(self._room, laser, self._robot)  # raises
        with self._lock:
            self._laser = self.simulation.laser = laser

    def check_room(self, room: str | Path | Room) -> None:
        """Raise the errors of `reset` for this room, without changing anything."""
        Simulation(room, self._laser, self._robot)

    @property
    def simulates(self) -> bool:
        """Return True while simulated time passes: not while the world is paused, or waits for a drive."""
        return time.monotonic() - self._moved[1] < IDLE

    @property
    def paused(self) -> bool:
        """Return True while the world runs, but its simulated time stands still because its parameter says so."""
        return self._controls is not None and self._controls.paused and time.monotonic() - self._shown < IDLE

    @property
    def speed(self) -> float:
        """Return how fast simulated time passes, 1 in real time; unknown, and 1, in fast mode."""
        return self._controls.speed if self._controls else 1.0

    @property
    def elapsed(self) -> float:
        """Return the simulated time (s) since the world was made; a reset does not change it."""
        elapsed, moved = self._moved
        if self._controls is None:
            return elapsed
        return elapsed + self.speed * min(time.monotonic() - moved, self._period / 1e9)

    def _on_command(self, message: Twist) -> None:
        with self._lock:
            self._command, self._command_age = (message.linear.x, message.angular.z), 0.0
            self.received += 1
            self._lock.notify_all()

    def _on_timer(self) -> None:
        with self._lock:
            if self._controls and not self._controls.paused:
                self._move(self._controls.speed)
            self._show(self.get_clock().now().to_msg())
        self._shown = time.monotonic()

    def _move(self, speed: float = 1.0) -> None:
        """Drive for one period by the last command; with another `speed`, the world's time passes so much faster."""
        period = self._period / 1e9
        if self._command_age >= COMMAND_TIMEOUT - 1e-9:
            self._command = (0.0, 0.0)
        self._command_age += period
        self._moved = self._moved[0] + speed * period, time.monotonic()
        collision = self.simulation.step(*self._command, speed * period)
        if collision:
            self.get_logger().warning(f"Collision: {collision}")
            self._collision_pub.publish(String(data=str(collision)))

    def _show(self, stamp: Time) -> None:
        """Publish the odometry, if anybody has subscribed to it, and then the scan, with this `stamp`."""
        if self._odom_pub.get_subscription_count():
            self._show_odometry(stamp)
        laser, scan = self.simulation.laser, LaserScan()
        scan.header.stamp, scan.header.frame_id = stamp, "laser"
        scan.angle_min, scan.angle_increment = laser.angle_min, laser.angle_increment
        scan.angle_max = laser.angle_min + laser.angle_increment * (laser.beams - 1)
        scan.scan_time = self._period / 1e9
        scan.range_min, scan.range_max = laser.range_min, laser.range_max
        # An array is assigned directly; for a list, the message class checks each number twice.
        scan.ranges = array("f", self.simulation.scan().astype(np.float32).tobytes())
        self._scan_pub.publish(scan)

    def _show_odometry(self, stamp: Time) -> None:
        (x, y, heading), (linear, angular) = self.simulation.pose, self.simulation.velocity
        odometry = Odometry(child_frame_id="base_link")
        odometry.header.stamp, odometry.header.frame_id = stamp, "odom"
        odometry.pose.pose.position.x, odometry.pose.pose.position.y = x, y
        odometry.pose.pose.orientation.z = math.sin(heading / 2.0)
        odometry.pose.pose.orientation.w = math.cos(heading / 2.0)
        odometry.twist.twist.linear.x, odometry.twist.twist.angular.z = linear, angular
        self._odom_pub.publish(odometry)

    # Lockstep

    @fitting
    def drive(
        self,
        seconds: float,
        *,
        on_step: Callable[[], object] | None = None,
        find_within: float = 10.0,
        answer_within: float = 1.0,
        wall_limit: float | None = None,
        alive: Callable[[], bool] = lambda: True,
    ) -> Drive:
        """Drive for `seconds` s of simulated time in lockstep with the driver; return the outcome.

        Each tick publishes the scan, then the clock, waits for a command at most `answer_within` s (not at all if
        nobody publishes commands), and moves the robot by the newest one; after 0.5 s without one, the robot stops. The
        drive begins with the first tick that the driver answers, with the robot and the noise at their start. `on_step`
        is called after each tick, in the caller's thread.  After `wall_limit` s of real time the drive ends early.
        When `drive` returns, the driver has finished the callbacks that the drive triggered.  A driver that is not
        `alive()` any more is not waited for before the drive.

        Blocks; spins the node itself unless it already has an executor.  Raises WorldError if the node is not in fast
        mode, and NoDriver if no driver (a publisher of `cmd_vel` and a subscriber of `scan`) is found within
        `find_within` s; with 0, no driver is needed.
        """
        self._expect_running()
        if not self.fast:
            raise WorldError(
                "the world runs in real time: to drive it, start it with parameters={'fast': True} (in a terminal: "
                "-p fast:=true)"
            )
        if not is_number(seconds, 0.0):
            raise WorldError(f"a drive lasts a number of seconds, such as 60.0, not {seconds!r:.40}")
        if not (on_step is None or takes(on_step)):
            raise WorldError(f"`on_step` is a function without arguments, such as `lambda: ...`, not {on_step!r:.40}")
        for limit in (find_within, answer_within, math.inf if wall_limit is None else wall_limit):
            time_limit(limit)
        end = time.monotonic() + (math.inf if wall_limit is None else wall_limit)
        if find_within > 0.0:
            self._find_driver(min(find_within, end - time.monotonic()), alive)
            self._meet(min(find_within, end - time.monotonic()), answer_within, alive)
        self._tell_watchers()
        result = Drive(self.simulation.room.name)
        pace = Pace(self._barrier, answer_within, self._period / 1e9)
        ticks, pending = round(seconds * 1e9 / self._period), find_within > 0.0
        for _ in range(ticks):
            if time.monotonic() > end or not self.context.ok():
                break
            # The first tick that the driver answered is the first one of the drive.
            answered = self._met if pending else self._tick(min(answer_within, max(0.0, end - time.monotonic())))
            pending = False
            result.answered += answered
            result.missed += not answered
            pace.look(result)
            with self._lock:
                self._move()
            if on_step is not None:
                on_step()
        # After its last command a driver may still have work to do, such as logging it or calling its observers.
        self._barrier.cross(min(answer_within, end - time.monotonic()))
        self._tell_watchers()
        simulation = self.simulation
        result.seconds, result.distance, result.path = simulation.time, simulation.distance, simulation.path
        result.ground_covered, result.collisions = simulation.ground_covered(), list(simulation.collisions)
        return result

    def _tell_watchers(self) -> None:
        for tell in list(watchers):
            with contextlib.suppress(Exception):  # an error of a watcher must not end a drive
                tell(self)

    def _find_driver(self, timeout: float, alive: Callable[[], bool]) -> None:
        def found() -> bool:
            return self._scan_pub.get_subscription_count() > 0 and self._is_driven()

        found_one = self._wait(lambda: found() or not alive(), min(timeout, PATIENCE)) and alive()
        if not found_one and alive() and timeout > PATIENCE:
            tell_of_no_driver(self, timeout - PATIENCE)
            found_one = self._wait(lambda: found() or not alive(), timeout - PATIENCE) and alive()
        self._barrier.find(min(timeout, FIND_SERVICES))
        if not found_one:
            known = half_a_driver(self)
            raise NoDriver(
                f"within {timeout:g} s, no node appeared that publishes cmd_vel and subscribes to scan"
                f"{known and f': {known}'}"
            )

    def _is_driven(self) -> bool:
        """Return True if there is a publisher of commands, and a possible driver subscribes to the scan.

        A hidden node, such as that of the robot view or of `ros2 topic echo`, only counts if it publishes commands
        itself.
        """
        try:
            drivers, seers = endpoints(self)
        except (RCLError, UnicodeDecodeError):  # a node has an invalid name: assume that it may drive
            return self.count_publishers("cmd_vel") > 0
        unknown = {each for each in seers if "_UNKNOWN_" in each[0]}
        return bool(drivers) and any(
            each in drivers or each in unknown or not each[0].startswith("_") for each in seers
        )

    def _meet(self, timeout: float, answer_within: float, alive: Callable[[], bool]) -> None:
        """Tick without moving the robot until the driver answers, and so is fully connected.

        Where a reader waits, raises NoDriver for a driver that answers other requests, and sends no command.
        """
        began, told = time.monotonic(), False
        end = began + timeout
        self._met = False
        while not self._met and time.monotonic() < end and self.context.ok() and alive():
            if self.simulation.time == 0.0:
                self.simulation.reset()
            self._met = self._tick(min(answer_within, 5 * CLOCK_REPEAT))
            if not self._met and not told and time.monotonic() - began >= SILENT:
                told = True
                answers = self._barrier.cross(min(answer_within, IDLE_ANSWERS))
                tell_of_silence(self._barrier.names, time.monotonic() - began, answers=answers)
        if tellers and not self._met and alive() and self._barrier.cross(min(answer_within, IDLE_ANSWERS)):
            raise NoDriver(
                f"{' and '.join(self._barrier.names)} sent no command within {timeout:.0f} s, though scans came. "
                f"{SILENT_CAUSE}"
            )

    def _tick(self, timeout: float) -> bool:
        """Publish the next moment of simulated time; return True if the driver sent a command within `timeout` s.

        The driver has handled the scan before the clock advances, so that a control loop in simulated time uses a fresh
        scan; and it has handled the clock before the tick ends, so that no command is left over for the next tick.
        """
        end = time.monotonic() + timeout
        self._now += self._period
        stamp = Time(sec=self._now // 10**9, nanosec=self._now % 10**9)
        before = self.received
        with self._lock:
            self._show(stamp)
        asked = self._barrier.cross(timeout)
        middle = self.received
        self._clock_pub.publish(ClockMessage(clock=stamp))
        rounds = 2 if asked else 0
        while self.received == middle and time.monotonic() < end and self.count_publishers("cmd_vel"):
            if rounds:
                rounds -= 1
                self._barrier.cross(end - time.monotonic())
            elif asked and middle > before:
                break  # the driver answers in its scan callback
            elif not self._wait(lambda: self.received > middle, min(CLOCK_REPEAT, end - time.monotonic())):
                self._clock_pub.publish(ClockMessage(clock=stamp))
        while not asked and self.received > before and time.monotonic() < end:
            seen = self.received
            if not self._wait(lambda: self.received > seen, SETTLE):  # noqa: B023
                break
        return self.received > before

    def _wake(self) -> None:
        with self._lock:
            self._lock.notify_all()

    def _wait(self, condition: Callable[[], bool], timeout: float) -> bool:
        """Wait until `condition()`, at most `timeout` s, while receiving messages; return its last value."""
        if self.executor is not None and self.executor is not self._own_executor:
            return wait_until(condition, timeout, news=self._lock, unless=lambda: not self.context.ok())
        if self._own_executor is None:
            self._own_executor = SingleThreadedExecutor(context=self.context)
            self._own_executor.add_node(self)
        end = time.monotonic() + timeout
        # Not `wait_until`: messages are received only while this thread itself spins the node.
        while not condition() and (left := end - time.monotonic()) > 0.0 and self.context.ok():
            self._own_executor.spin_once(timeout_sec=min(left, CLOCK_REPEAT))
        return condition()


def latest() -> World | None:
    """Return the world that was made last in this process, if it still exists."""
    return _latest[0]() if _latest else None


def main(args: list[str] | None = None) -> int:
    """Run the world until Ctrl-C; with `fast`, for `duration` s of simulated time (0: until Ctrl-C).

    Returns the exit status: 1 if the robot hit something in a drive that ran to its end, else 0.
    """
    status = 0
    rclpy.init(args=args)
    try:
        node = World()
        if node.fast:
            duration = node.declare_parameter("duration", 0.0).value
            result = node.drive(duration or 1e9)
            node.get_logger().info(str(result))
            status = 1 if result.collisions else 0
            rclpy.try_shutdown()
        else:
            rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except RuntimeError:  # rclpy's own, when a signal ends the context between two waits
        if rclpy.ok():
            raise
    return status
