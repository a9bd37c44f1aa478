"""The world as a ROS node: takes `cmd_vel`, gives `scan` and `odom`, and reports on `collision` when the robot hits.

It runs at real time by itself, or (parameter `fast`) as fast as it computes, in lockstep with the node that drives: each
tick of simulated time shows the driver one scan and waits for one command.  A drive then comes out the same on a busy
machine as on an idle one.
"""

import math
import threading
import time

import rclpy
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rclpy.clock import Clock, ClockType
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import LaserScan
from std_msgs.msg import String

from course.world.laser import Laser
from course.world.lockstep import Barrier, Drive
from course.world.simulation import Robot, Simulation

COMMAND_TIMEOUT = 0.5  # s of the world's time without a command, after which the robot's base stops by itself
CLOCK_REPEAT = 0.05  # s; subscribers to /clock are best effort, so a tick that no one answers is told again
FIND_SERVICES = 1.0  # s, how long a driver's parameter services are looked for
SETTLE = 0.01  # s of silence that end a tick, for a driver without parameter services
LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class World(Node):
    """The node `world`: a robot with a laser in a room.

    Subscribes `cmd_vel` (geometry_msgs/Twist).  Publishes `scan` (sensor_msgs/LaserScan, frame `laser`), `odom`
    (nav_msgs/Odometry, `odom` to `base_link`) and, for each collision as it begins, `collision` (std_msgs/String,
    kept for subscribers that come later); in fast mode also `/clock`, so that nodes started with
    `use_sim_time:=true` live in its time.

    Parameters, read once: `room` (a name in course.world.ROOMS or the path of a .json file), `seed` of the laser's
    noise, `noise` (m), `beams` (over one turn), `angle_min` (rad), `rate` (scans a second), `fast`.
    `room`, `laser` and `robot` given as objects win over the parameters.  `simulation` holds the robot's pose,
    path and collisions.  Raises ValueError for a room that is not there or not free at its start.
    """

    def __init__(self, room=None, laser=None, robot=None, **kwargs):
        super().__init__("world", **kwargs)
        self._lock = threading.Condition(threading.RLock())
        self._room = room or self.declare_parameter("room", "hall").value
        self._seed = self.declare_parameter("seed", 0).value
        self._laser = laser or Laser.turn(
            self.declare_parameter("beams", 360).value,
            self.declare_parameter("angle_min", 0.0).value,
            noise=self.declare_parameter("noise", 0.01).value,
        )
        self._robot = robot or Robot()
        rate = self.declare_parameter("rate", 10.0).value
        if not rate > 0.0:
            raise ValueError(f"rate must be above 0 Hz, not {rate}")
        self._period = round(1e9 / rate)  # ns, so that ticks add up exactly
        self.fast = self.declare_parameter("fast", False).value

        self._now = 0  # ns of simulated time
        self._received = 0
        self._own_executor = None
        self._barrier = Barrier(self, "cmd_vel", self._wait, self._wake)
        self.reset()

        # The clock comes last: who has found it has found the scan as well.
        self._scan_pub = self.create_publisher(LaserScan, "scan", 10)
        self._odom_pub = self.create_publisher(Odometry, "odom", 10)
        self._collision_pub = self.create_publisher(String, "collision", LATCHED)
        self.create_subscription(Twist, "cmd_vel", self._on_command, 10)
        if self.fast:
            self._clock_pub = self.create_publisher(ClockMessage, "/clock", 10)
        else:
            self.create_timer(1.0 / rate, self._on_timer, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self.get_logger().info(f"World started in room '{self.simulation.room.name}'")

    def reset(self, room=None, seed=None):
        """Put the robot at the start of `room` (by default the same one) at rest, nothing driven and nothing hit.

        Simulated time goes on, because nodes that follow it must not see it run backwards.
        """
        with self._lock:
            self._room = room or self._room
            self._seed = self._seed if seed is None else seed
            self.simulation = Simulation(self._room, self._laser, self._robot, self._seed)
            self._command, self._command_age = (0.0, 0.0), 0.0

    def _on_command(self, message):
        with self._lock:
            self._command, self._command_age = (message.linear.x, message.angular.z), 0.0
            self._received += 1
            self._lock.notify_all()

    def _on_timer(self):
        with self._lock:
            self._move()
            self._show(self.get_clock().now().to_msg())

    def _move(self):
        """Drive for one period by the last command."""
        period = self._period / 1e9
        if self._command_age >= COMMAND_TIMEOUT - 1e-9:
            self._command = (0.0, 0.0)
        self._command_age += period
        collision = self.simulation.step(*self._command, period)
        if collision:
            self.get_logger().warning(f"Collision: {collision}")
            self._collision_pub.publish(String(data=str(collision)))

    def _show(self, stamp):
        """Publish where the robot is and what its laser sees, as of `stamp`; the scan last, odometry is then there."""
        (x, y, heading), (linear, angular) = self.simulation.pose, self.simulation.velocity
        odometry = Odometry(child_frame_id="base_link")
        odometry.header.stamp, odometry.header.frame_id = stamp, "odom"
        odometry.pose.pose.position.x, odometry.pose.pose.position.y = x, y
        odometry.pose.pose.orientation.z = math.sin(heading / 2.0)
        odometry.pose.pose.orientation.w = math.cos(heading / 2.0)
        odometry.twist.twist.linear.x, odometry.twist.twist.angular.z = linear, angular
        self._odom_pub.publish(odometry)

        laser, scan = self.simulation.laser, LaserScan()
        scan.header.stamp, scan.header.frame_id = stamp, "laser"
        scan.angle_min, scan.angle_increment = laser.angle_min, laser.angle_increment
        scan.angle_max = laser.angle_min + laser.angle_increment * (laser.beams - 1)
        scan.scan_time = self._period / 1e9
        scan.range_min, scan.range_max = laser.range_min, laser.range_max
        scan.ranges = self.simulation.scan().tolist()
        self._scan_pub.publish(scan)

    # Lockstep

    def drive(self, seconds, *, on_step=None, find_within=10.0, answer_within=1.0, wall_limit=None):
        """Drive for `seconds` of simulated time in lockstep with whoever publishes `cmd_vel`; return the `Drive`.

        Each tick publishes the scan, then the clock, waits for a command at most `answer_within` s (not at all when
        nobody publishes commands), and moves the robot by the newest one; without any for 0.5 s it stands.  The drive
        begins with the first tick that is answered, the robot and the noise as at the start.  `on_step` is called
        after each tick, in the caller's thread.  After `wall_limit` s of real time the drive ends where it is.  When it
        returns, the driver is done with the callbacks that the drive set off.

        Blocks; spins the node itself unless an executor has it already.  Raises RuntimeError when the node is not in
        fast mode, and TimeoutError when no driver (a publisher of `cmd_vel` and a subscriber of `scan`) is found
        within `find_within` s; 0 drives without one.
        """
        if not self.fast:
            raise RuntimeError("the world runs at real time: start it with the parameter fast:=true to drive it")
        end = time.monotonic() + (math.inf if wall_limit is None else wall_limit)
        if find_within > 0.0:
            self._find_driver(min(find_within, end - time.monotonic()))
            self._meet(min(find_within, end - time.monotonic()), answer_within)
        result = Drive(self.simulation.room.name)
        ticks, pending = round(seconds * 1e9 / self._period), find_within > 0.0
        for _ in range(ticks):
            if time.monotonic() > end or not self.context.ok():
                break
            # The tick that met the driver is the first one of the drive.
            answered = self._met if pending else self._tick(min(answer_within, max(0.0, end - time.monotonic())))
            pending = False
            result.answered += answered
            result.missed += not answered
            with self._lock:
                self._move()
            if on_step is not None:
                on_step()
        # A driver goes on after it has sent its last command: to log it, to tell who watches it.
        self._barrier.cross(min(answer_within, end - time.monotonic()))
        simulation = self.simulation
        result.seconds, result.distance, result.path = simulation.time, simulation.distance, simulation.path
        result.ground_covered, result.collisions = simulation.ground_covered(), list(simulation.collisions)
        return result

    def _find_driver(self, timeout):
        def found():
            return self.count_publishers("cmd_vel") > 0 and self._scan_pub.get_subscription_count() > 0

        found_one = self._wait(found, timeout)
        self._barrier.find(min(timeout, FIND_SERVICES))
        if not found_one:
            raise TimeoutError(f"within {timeout:g} s no node came that publishes cmd_vel and subscribes scan")

    def _meet(self, timeout, answer_within):
        """Tick with the robot held until the driver answers, so that a drive does not begin with it half connected."""
        end = time.monotonic() + timeout
        self._met = False
        while not self._met and time.monotonic() < end and self.context.ok():
            if self.simulation.time == 0.0:
                self.simulation.reset()
            self._met = self._tick(min(answer_within, 5 * CLOCK_REPEAT))

    def _tick(self, timeout):
        """Show the driver the next moment of simulated time; whether it sent a command within `timeout` s.

        The driver has met the scan before the clock moves, so that a control loop on simulated time decides on a fresh
        scan; and it has met the clock before the tick ends, so that no command of it is left over for the next one.
        """
        end = time.monotonic() + timeout
        self._now += self._period
        stamp = Time(sec=self._now // 10**9, nanosec=self._now % 10**9)
        before = self._received
        with self._lock:
            self._show(stamp)
        asked = self._barrier.cross(timeout)
        middle = self._received
        self._clock_pub.publish(ClockMessage(clock=stamp))
        rounds = 2 if asked else 0
        while self._received == middle and time.monotonic() < end and self.count_publishers("cmd_vel"):
            if rounds:
                rounds -= 1
                self._barrier.cross(end - time.monotonic())
            elif asked and middle > before:
                break  # a driver that answers from its scan callback
            elif not self._wait(lambda: self._received > middle, min(CLOCK_REPEAT, end - time.monotonic())):
                self._clock_pub.publish(ClockMessage(clock=stamp))
        while not asked and self._received > before:
            seen = self._received
            if not self._wait(lambda: self._received > seen, SETTLE):  # noqa: B023
                break
        return self._received > before

    def _wake(self):
        with self._lock:
            self._lock.notify_all()

    def _wait(self, condition, timeout):
        """Let messages in until `condition()` or for `timeout` s; the condition's last value."""
        end = time.monotonic() + timeout
        if self.executor is None or self.executor is self._own_executor:
            if self._own_executor is None:
                self._own_executor = SingleThreadedExecutor(context=self.context)
                self._own_executor.add_node(self)
            while not condition() and (left := end - time.monotonic()) > 0.0 and self.context.ok():
                self._own_executor.spin_once(timeout_sec=min(left, CLOCK_REPEAT))
        else:
            with self._lock:
                while not condition() and (left := end - time.monotonic()) > 0.0 and self.context.ok():
                    self._lock.wait(min(left, CLOCK_REPEAT))
        return condition()


def main(args=None):
    """Run the world until Ctrl-C; with `fast`, drive for `duration` s (0: until Ctrl-C), 1 if the robot hit."""
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
