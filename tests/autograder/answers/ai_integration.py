"""Answers to the exercise on an agent that drives."""

from . import changed, solution

NODE = "obstacle_avoider.py"
REFERENCE = solution("ai_integration")


def node(*pairs: tuple[str, str]) -> dict[str, bytes]:
    """The reference with some texts replaced."""
    return changed(REFERENCE, NODE, *pairs)


FUNCTIONS = """
import math, time
import rclpy
from geometry_msgs.msg import Twist
from sensor_msgs.msg import LaserScan

def decide(front, left, right):
    if front < 0.5:
        return (0.0, 0.5) if left > right else (0.0, -0.5)
    return 0.3, 0.0

def closest(msg, low, high):
    best = math.inf
    for i, r in enumerate(msg.ranges):
        angle = msg.angle_min + i * msg.angle_increment
        angle = math.degrees(math.atan2(math.sin(angle), math.cos(angle)))
        if not low <= angle <= high or r != r:
            continue
        if r == -math.inf:
            return 0.0
        if msg.range_min <= r <= msg.range_max and r < best:
            best = r
    return best

last = None

def on_scan(msg):
    global last
    last = time.monotonic(), (closest(msg, -30, 30), closest(msg, 30, 90), closest(msg, -90, -30))

def tick():
    command = Twist()
    if last and time.monotonic() - last[0] < 0.4:
        command.linear.x, command.angular.z = decide(*last[1])
    publisher.publish(command)

rclpy.init()
node = rclpy.create_node('x')
publisher = node.create_publisher(Twist, '/cmd_vel', 1)
node.create_subscription(LaserScan, '/scan', on_scan, 1)
node.create_timer(0.1, tick)
rclpy.spin(node)
"""

OWN_TIME = """
import threading, time
import numpy as np
import rclpy
from geometry_msgs.msg import Twist
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from sensor_msgs.msg import LaserScan

class Agent:
    def decide(self, front, left, right):
        match int(front < 0.5), int(left > right):
            case 1, 1: return 0.0, 0.5
            case 1, 0: return 0.0, -0.5
            case _: return 0.3, 0.0

class Avoider(Node):
    def __init__(self):
        super().__init__('avoider')
        self.agent, self.lock, self.seen, self.when = Agent(), threading.Lock(), None, 0.0
        self.pub = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_subscription(LaserScan, 'scan', self.scan, 10)
        threading.Thread(target=self.loop, daemon=True).start()

    def scan(self, msg):
        r = np.asarray(msg.ranges, dtype=float)
        a = np.angle(np.exp(1j * (msg.angle_min + msg.angle_increment * np.arange(r.size))), deg=True)
        r = np.where(r == -np.inf, 0.0, np.where((r >= msg.range_min) & (r <= msg.range_max), r, np.inf))
        with self.lock:
            self.when = time.time()
            self.seen = [np.append(r[(a >= low) & (a < high)], np.inf).min()
                         for low, high in ((-30, 30), (30, 90), (-90, -30))]

    def loop(self):
        following = time.monotonic()
        while True:
            command = Twist()
            with self.lock:
                if self.seen and time.time() - self.when < 0.35:
                    command.linear.x, command.angular.z = self.agent.decide(*self.seen)
            self.pub.publish(command)
            following += 0.1
            time.sleep(max(0.0, following - time.monotonic()))

def main(args=None):
    rclpy.init(args=args)
    executor = MultiThreadedExecutor(2)
    executor.add_node(Avoider())
    executor.spin()

if __name__ == '__main__':
    main()
"""

WATCHDOG = """
import math, sys, time
from dataclasses import dataclass
import rclpy
from geometry_msgs.msg import Twist, Vector3
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.context import Context
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import LaserScan

@dataclass(frozen=True)
class Seen:
    front: float = math.inf
    left: float = math.inf
    right: float = math.inf

    @classmethod
    def of(cls, scan):
        found = {'front': [], 'left': [], 'right': []}
        for i, value in enumerate(scan.ranges):
            degrees = math.remainder(math.degrees(scan.angle_min + i * scan.angle_increment), 360)
            if abs(degrees) <= 30: side = 'front'
            elif 30 < degrees <= 90: side = 'left'
            elif -90 <= degrees < -30: side = 'right'
            else: continue
            if value == -math.inf: found[side].append(0.0)
            elif scan.range_min <= value <= scan.range_max: found[side].append(value)
        return cls(**{side: min(values, default=math.inf) for side, values in found.items()})

class Agent:
    def act(self, seen):
        if seen is None: return 0.0, 0.0
        if seen.front >= 0.5: return 0.3, 0.0
        return 0.0, math.copysign(0.5, seen.left - seen.right if seen.left != seen.right else -1)

class Driver(Node):
    def __init__(self, context):
        super().__init__('driver', context=context)
        group = ReentrantCallbackGroup()
        self.agent, self.seen = Agent(), None
        self.declare_parameter('speed', 0.3)
        self.watchdog = self.create_timer(0.3, self.lost, callback_group=group)
        self.create_subscription(LaserScan, 'scan', self.scan, qos_profile_sensor_data, callback_group=group)
        self.out = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_timer(0.1, self.step, callback_group=group)

    async def scan(self, message):
        self.seen = Seen.of(message)
        self.watchdog.reset()

    def lost(self):
        self.seen = None

    def step(self):
        linear, angular = self.agent.act(self.seen)
        self.get_logger().info(f'{self.seen}: {linear} {angular}')
        self.out.publish(Twist(linear=Vector3(x=linear), angular=Vector3(z=angular)))

def main(args=None):
    time.sleep(2)
    print('y' * 100_000, file=sys.stderr)
    context = Context()
    rclpy.init(args=args, context=context)
    executor = MultiThreadedExecutor(num_threads=4, context=context)
    executor.add_node(Driver(context))
    executor.spin()

if __name__ == '__main__':
    main()
"""

RIGHT = {
    "reference": REFERENCE,
    "functions, loops, age by the wall clock": {NODE: FUNCTIONS.encode()},
    "a thread that keeps its own time": {NODE: OWN_TIME.encode()},
    "watchdog, threads, async, own context, slow start, scans by best effort": {NODE: WATCHDOG.encode()},
    "age in periods of the timer": node(
        ("        self.scan_time = self.get_clock().now()\n", "        self.scan_time = 0\n"),
        (
            "        return self.get_clock().now() - self.scan_time < Duration(seconds=0.35)\n",
            "        self.scan_time += 1\n        return self.scan_time <= 4\n",
        ),
    ),
    "age by the stamp of the scan, no parameter services": node(
        (
            "        self.scan_time = self.get_clock().now()\n",
            "        self.scan_time = rclpy.time.Time.from_msg(msg.header.stamp)\n",
        ),
        (
            "super().__init__('obstacle_avoider')",
            "super().__init__('obstacle_avoider', start_parameter_services=False)",
        ),
    ),
    "half a second to the letter, edges to the other sector": node(
        ("seconds=0.35", "seconds=0.5"), ("(low <= degrees) & (degrees < high)", "(low < degrees) & (degrees <= high)")
    ),
    "the scan is kept, and looked at when it is needed": node(
        ("self.laser_data = nearest(msg)", "self.laser_data = msg"),
        ("decide_action(self.laser_data)", "decide_action(nearest(self.laser_data))"),
    ),
}

ROOMS = {"hall", "pillars", "corridor"}
USABLE = "usable = np.isinf(ranges) | (ranges >= scan.range_min) & (ranges <= scan.range_max)"
STALE = "return self.get_clock().now() - self.scan_time < Duration(seconds=0.35)"
WRAPPED = "degrees = np.degrees((angles + math.pi) % (2 * math.pi) - math.pi)"
SECTORS = {"edges_of_the_sectors", "resolutions", "first_beam_anywhere", "clockwise"}
SCANS = SECTORS | {"decisions", "no_return", "touching", "no_measurements_among_others", "nothing_usable"}
SEED = 1  # of the gradings of wrong answers: a wrong decision makes a robot fail in one room and not in another

# What is wrong, and the tests that it loses (without "test_").
WRONG = {
    "the chapter's slices": (
        node(
            (
                "        self.laser_data = nearest(msg)\n",
                (
                    "        r = msg.ranges\n"
                    "        self.laser_data = {'front': min(r[0:30] + r[-30:]), 'left': min(r[30:90]),\n"
                    "                           'right': min(r[-90:-30])}\n"
                ),
            )
        ),
        {"resolutions", "first_beam_anywhere", "clockwise", "no_measurements_among_others", "nothing_usable"} | ROOMS,
    ),
    "every scanner has 360 beams": (
        node(("scan.angle_increment *", "math.radians(1) *")),
        {"resolutions", "first_beam_anywhere", "clockwise", "pillars", "corridor"},
    ),
    "every scanner begins ahead": (
        node(("scan.angle_min +", "")),
        {"first_beam_anywhere", "clockwise", "nothing_usable"} | ROOMS,
    ),
    "every scanner begins behind": (node(("scan.angle_min +", "-math.pi +")), SCANS | {"pillars"}),
    "every scanner turns counter-clockwise": (
        node(("scan.angle_increment *", "abs(scan.angle_increment) *")),
        {"clockwise", "corridor"},
    ),
    "angles not brought back to one turn": (
        node((WRAPPED, "degrees = np.degrees(angles)")),
        {
            "decisions",
            "edges_of_the_sectors",
            "resolutions",
            "first_beam_anywhere",
            "clockwise",
            "touching",
            "no_return",
            "no_measurements_among_others",
            "nothing_usable",
        },
    ),
    "front too narrow": (node(("'front': (-30, 30)", "'front': (-25, 25)")), SECTORS),
    "front too wide": (node(("'front': (-30, 30)", "'front': (-35, 35)")), SECTORS),
    "sides reach too far back": (node(("(30, 90)", "(30, 120)"), ("(-90, -30)", "(-120, -30)")), SECTORS),
    "sides end too early": (node(("(30, 90)", "(30, 80)"), ("(-90, -30)", "(-80, -30)")), SECTORS),
    "left is right": (
        node(("'left': (30, 90), 'right': (-90, -30)", "'right': (30, 90), 'left': (-90, -30)")),
        SCANS | {"pillars", "corridor"},
    ),
    "threshold of 1 m": (
        node(("obstacle_distance_threshold=0.5)\n        self.laser", "1.0)\n        self.laser")),
        {"decisions"},
    ),
    "turns left when both sides are equal": (
        node(("laser_data['left'] > laser", "laser_data['left'] >= laser")),
        {"decisions"},
    ),
    "turns to the nearer side": (
        node(("laser_data['left'] > laser", "laser_data['left'] < laser")),
        SCANS | {"pillars", "corridor"},
    ),
    "turns at another speed": (
        node(("'angular': 0.5", "'angular': 0.8"), ("'angular': -0.5", "'angular': -0.8")),
        SCANS,
    ),
    "drives on while it turns": (
        node(
            ("{'linear': 0.0, 'angular': 0.5}", "{'linear': 0.3, 'angular': 0.5}"),
            ("{'linear': 0.0, 'angular': -0.5}", "{'linear': 0.3, 'angular': -0.5}"),
        ),
        SCANS | {"hall", "pillars"},
    ),
    "mean distance": (node(("seen.min(initial=math.inf)", "seen.mean() if len(seen) else math.inf")), SCANS | ROOMS),
    "NaN not looked for": (
        node((USABLE, "usable = ~((ranges < scan.range_min) | (ranges > scan.range_max)) | np.isinf(ranges)")),
        {"no_measurements_among_others", "nothing_usable"},
    ),
    "NaN is near": (
        node(
            ("    usable = ", "    ranges = np.nan_to_num(ranges, posinf=math.inf, neginf=-math.inf)\n    usable = "),
            ("(ranges >= scan.range_min) & ", ""),
        ),
        {"no_measurements_among_others", "nothing_usable"},
    ),
    "0.0 is a distance": (
        node((USABLE, "usable = ~np.isnan(ranges)")),
        {"no_measurements_among_others", "nothing_usable"},
    ),
    "finite values alone": (
        node((USABLE, "usable = (ranges >= scan.range_min) & (ranges <= scan.range_max)")),
        {"touching"},
    ),
    "-inf is far": (
        node(("ranges[np.isneginf(ranges)] = 0.0", "ranges[np.isneginf(ranges)] = math.inf")),
        {"touching"},
    ),
    "inf is near": (node(("ranges[np.isneginf(ranges)] = 0.0", "ranges[np.isinf(ranges)] = 0.0")), {"no_return"}),
    "nothing usable is near": (
        node(("initial=math.inf)", "initial=math.inf) if len(seen) else 0.0")),
        {"nothing_usable"},
    ),
    "an empty sector raises": (node(("initial=math.inf)", ")")), {"nothing_usable"}),
    "silent before the first scan": (
        node(
            ('        """Decide, ten times a second."""\n', "        if self.scan_time is None:\n            return\n")
        ),
        {"stands_before_the_first_scan"},
    ),
    "drives before the first scan": (
        node(
            (
                "            action = self.ai_agent.stop()\n",
                (
                    "            action = self.ai_agent.decide_action({'front': 9 if self.scan_time is None else -1,\n"
                    "                'left': 0, 'right': 0}) if self.scan_time is None else self.ai_agent.stop()\n"
                ),
            )
        ),
        {"stands_before_the_first_scan"},
    ),
    "an old scan is as good as a new one": (node((STALE, "return True")), {"stops"}),
    "stops after a second": (node(("seconds=0.35", "seconds=1.0")), {"stops"}),
    "a scan is old after 0.1 s": (node(("seconds=0.35", "seconds=0.12")), {"rate"}),
    "never drives again": (
        node(
            (
                STALE,
                (
                    "self.lost = getattr(self, 'lost', False) or self.get_clock().now() - self.scan_time > Duration(\n"
                    "            seconds=0.35)\n        return not self.lost"
                ),
            )
        ),
        {"stops"},
    ),
    "a command for each scan": (
        node(
            ("        self.timer = self.create_timer(0.1, self.control_loop)\n", ""),
            (
                "        self.scan_time = self.get_clock().now()\n",
                "        self.scan_time = self.get_clock().now()\n        self.control_loop()\n",
            ),
        ),
        {"stands_before_the_first_scan", "rate", "stops"},
    ),
    "a command for each scan as well": (
        node(
            (
                "        self.scan_time = self.get_clock().now()\n",
                "        self.scan_time = self.get_clock().now()\n        self.control_loop()\n",
            )
        ),
        {"rate"},
    ),
    "8 Hz": (node(("create_timer(0.1,", "create_timer(0.125,")), {"rate"}),
    "20 Hz": (node(("create_timer(0.1,", "create_timer(0.05,")), {"rate"}),
    "another topic": (
        node(("'cmd_vel', 10", "'cmd', 10")),
        SCANS | {"stands_before_the_first_scan", "rate", "stops"} | ROOMS,
    ),
}
SILENT = {"another topic"}  # the grader waits for it in vain
