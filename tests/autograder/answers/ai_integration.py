"""Answers to the exercise on an agent that follows a wall."""

from pathlib import Path

from course.notebook import cells

from . import changed, solution

AGENT, NODE = "wall_agent.py", "wall_follower.py"
REFERENCE = solution("ai_integration")


def agent(*pairs: tuple[str, str]) -> dict[str, bytes]:
    """The reference with some texts of the agent replaced."""
    return changed(REFERENCE, AGENT, *pairs)


def node(*pairs: tuple[str, str]) -> dict[str, bytes]:
    """The reference with some texts of the node replaced."""
    return changed(REFERENCE, NODE, *pairs)


def files(agent_text: str, node_text: str = "") -> dict[str, bytes]:
    """Both files; the node of the reference, if there is no other."""
    return {AGENT: agent_text.encode(), NODE: node_text.encode() or REFERENCE[NODE]}


SHORT_AGENT = """
class WallAgent:
    wall, near, lost, gain = 0.6, 0.5, 1.2, 1.5

    def decide_action(self, seen):
        if seen.get('front', 9) < self.near:
            return dict(linear=0.0, angular=0.5)
        if not seen.get('right', 9) <= self.lost:
            return dict(linear=0.2, angular=-0.4)
        return dict(linear=0.3, angular=min(0.5, max(-0.5, self.gain * (self.wall - seen['right']))))
"""

NUMPY_AGENT = """
from dataclasses import dataclass
import numpy as np

@dataclass
class WallAgent:
    distance: float = 0.6
    state: str = ''

    def decide_action(self, distances):
        match distances:
            case {'front': front} if front < 0.5:
                self.state, speeds = 'corner', (0, 0.5)
            case {'right': right} if right > 1.2:
                self.state, speeds = 'search', (0.2, -0.4)
            case {'right': right}:
                self.state, speeds = 'follow', (0.3, np.clip(1.5 * (self.distance - right), -0.5, 0.5))
        return {'linear': float(speeds[0]), 'angular': float(speeds[1])}

if __name__ == '__main__':
    assert WallAgent().decide_action({'front': 1, 'right': 0.6}) == {'linear': 0.3, 'angular': 0.0}
"""

FUNCTIONS = """
import math, time
import rclpy
import wall_agent
from geometry_msgs.msg import Twist
from sensor_msgs.msg import LaserScan

brain = wall_agent.WallAgent()

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
    last = time.monotonic(), {'front': closest(msg, -25, 25), 'right': closest(msg, -80, -40)}

def tick():
    command = Twist()
    if last and time.monotonic() - last[0] < 0.5:
        speeds = brain.decide_action(last[1])
        command.linear.x, command.angular.z = speeds['linear'], speeds['angular']
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
from wall_agent import WallAgent

class Follower(Node):
    def __init__(self):
        super().__init__('follower')
        self.agent, self.lock, self.seen, self.when = WallAgent(), threading.Lock(), None, 0.0
        self.pub = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_subscription(LaserScan, 'scan', self.scan, 10)
        threading.Thread(target=self.loop, daemon=True).start()

    def scan(self, msg):
        r = np.asarray(msg.ranges, dtype=float)
        a = np.angle(np.exp(1j * (msg.angle_min + msg.angle_increment * np.arange(r.size))), deg=True)
        r = np.where(r == -np.inf, 0.0, np.where((r >= msg.range_min) & (r <= msg.range_max), r, np.inf))
        with self.lock:
            self.when = time.time()
            self.seen = {name: np.append(r[(a >= low) & (a < high)], np.inf).min()
                         for name, low, high in (('front', -25, 25), ('right', -80, -40))}

    def loop(self):
        following = time.monotonic()
        while True:
            command = Twist()
            with self.lock:
                if self.seen and time.time() - self.when < 0.5:
                    action = self.agent.decide_action(self.seen)
                    command.linear.x, command.angular.z = float(action['linear']), float(action['angular'])
            self.pub.publish(command)
            following += 0.1
            time.sleep(max(0.0, following - time.monotonic()))

def main(args=None):
    rclpy.init(args=args)
    executor = MultiThreadedExecutor(2)
    executor.add_node(Follower())
    executor.spin()

if __name__ == '__main__':
    main()
"""

WATCHDOG = """
import math, sys, time
from dataclasses import asdict, dataclass
import rclpy
from geometry_msgs.msg import Twist, Vector3
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.context import Context
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import LaserScan
from wall_agent import WallAgent as Agent

@dataclass(frozen=True)
class Seen:
    front: float = math.inf
    right: float = math.inf

    @classmethod
    def of(cls, scan):
        found = {'front': [], 'right': []}
        for i, value in enumerate(scan.ranges):
            degrees = math.remainder(math.degrees(scan.angle_min + i * scan.angle_increment), 360)
            if abs(degrees) <= 25: side = 'front'
            elif -80 <= degrees <= -40: side = 'right'
            else: continue
            if value == -math.inf: found[side].append(0.0)
            elif scan.range_min <= value <= scan.range_max: found[side].append(value)
        return cls(**{side: min(values, default=math.inf) for side, values in found.items()})

class Driver(Node):
    def __init__(self, context):
        super().__init__('driver', context=context)
        group = ReentrantCallbackGroup()
        self.agent, self.seen = Agent(), None
        self.declare_parameter('speed', 0.3)
        self.watchdog = self.create_timer(0.5, self.lost, callback_group=group)
        self.create_subscription(LaserScan, 'scan', self.scan, qos_profile_sensor_data, callback_group=group)
        self.out = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_timer(0.1, self.step, callback_group=group)

    async def scan(self, message):
        self.seen = Seen.of(message)
        self.watchdog.reset()

    def lost(self):
        self.seen = None

    def step(self):
        seen = self.seen
        action = self.agent.decide_action(asdict(seen)) if seen else {'linear': 0.0, 'angular': 0.0}
        self.get_logger().info(f'{seen}: {action}')
        self.out.publish(Twist(linear=Vector3(x=action['linear']), angular=Vector3(z=action['angular'])))

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
    "short agent; functions, loops, age by the wall clock": files(SHORT_AGENT, FUNCTIONS),
    "dataclass and NumPy; a thread that keeps its own time": files(NUMPY_AGENT, OWN_TIME),
    "watchdog, threads, async, own context, slow start, scans by best effort": files(SHORT_AGENT, WATCHDOG),
    "age in periods of the timer": node(
        ("        self.scan_time = self.get_clock().now()\n", "        self.scan_time = 0\n"),
        (
            "        return self.get_clock().now() - self.scan_time <= FRESH\n",
            "        self.scan_time += 1\n        return self.scan_time <= 5\n",
        ),
    ),
    "age by the stamp of the scan, no parameter services": node(
        (
            "        self.scan_time = self.get_clock().now()\n",
            "        self.scan_time = rclpy.time.Time.from_msg(msg.header.stamp)\n",
        ),
        ("super().__init__('wall_follower')", "super().__init__('wall_follower', start_parameter_services=False)"),
    ),
    "half a second without its last moment, edges to the other sector": node(
        ("<= FRESH", "< FRESH"), ("(low <= degrees) & (degrees < high)", "(low < degrees) & (degrees <= high)")
    ),
    "the scan is kept, and looked at when it is needed": node(
        ("self.distances = nearest(msg)", "self.distances = msg"),
        ("decide_action(self.distances)", "decide_action(nearest(self.distances))"),
    ),
    "an agent with a distance to set, and a method for standing still": changed(
        agent(
            ("    def __init__(self):", "    def __init__(self, distance=0.6):\n        self.distance = distance"),
            ("1.5 * (0.6 - right)", "1.5 * (self.distance - right)"),
        ),
        NODE,
        ("WallAgent()", "WallAgent(distance=0.6)"),
    ),
}

ROOMS = {"hall", "block", "bend"}
USABLE = "usable = np.isinf(ranges) | (ranges >= scan.range_min) & (ranges <= scan.range_max)"
STALE = "return self.get_clock().now() - self.scan_time <= FRESH"
WRAPPED = "degrees = np.degrees((angles + math.pi) % (2 * math.pi) - math.pi)"
POLICY = {"wall_ahead", "looks_for_a_wall", "keeps_its_distance", "thresholds"}
SECTORS = {"sectors", "first_beam_anywhere", "clockwise"}
SCANS = SECTORS | {"no_return_and_touching", "no_measurements"}
TIMING = {"stands_before_the_first_scan", "rate", "stops"}
SEED = 1  # of the gradings of wrong answers: a wrong decision makes a robot fail in one room and not in another

ONE_FILE = REFERENCE[NODE].replace(
    b"from wall_agent import WallAgent\n", REFERENCE[AGENT].split(b'"""\n', 1)[1].rstrip() + b"\n"
)

COURSE = Path(__file__).parents[3] / "course"


def shipped(path: str) -> str:
    """A file of the course, as students have it."""
    return (COURSE / path).read_text()


CHAPTERS_AGENT = shipped("robot/agent.py") + "\n\nWallAgent = ObstacleAvoidanceAI\n"
# Each line that imports from the course is replaced by the agent's, or by what it imports from.
CHAPTERS_NODE = shipped("robot/sectors.py") + shipped("nodes/ai_robot_controller.py").replace(
    "from course.robot.agent import", "from wall_agent import"
).replace("from course.robot.sectors import from_scan\n", "").replace("ObstacleAvoidanceAI(", "WallAgent(").replace(
    "import ObstacleAvoidanceAI", "import WallAgent"
)

SHOWN = {
    name: cell.source
    for cell in cells.read(COURSE.parent / "notebooks/ai_integration/ai_integration.ipynb")
    for name in ("class ObstacleAvoidanceAI:", "def nearest(", "class Controller(")
    if cell.kind == "code" and not cell.solution and name in cell.source
}
PAGES_AGENT = (
    f"import math\nfrom enum import Enum\n{SHOWN['class ObstacleAvoidanceAI:']}\nWallAgent = ObstacleAvoidanceAI\n"
)
PAGES_NODE = f"""
import numpy as np
import rclpy
from sensor_msgs.msg import LaserScan
from wall_agent import WallAgent
{SHOWN["def nearest("]}
{SHOWN["class Controller("]}
rclpy.init()
rclpy.spin(Controller(WallAgent()))
"""

# What is wrong, and the tests that it loses (without "test_").
WRONG = {
    "what the course ships, pasted together": (
        files(CHAPTERS_AGENT, CHAPTERS_NODE),
        POLICY | SECTORS | ROOMS | {"stands_before_the_first_scan"},
    ),
    "what the page builds, pasted together": (
        files(PAGES_AGENT, PAGES_NODE),
        POLICY | SECTORS | ROOMS | {"stands_before_the_first_scan", "stops"},
    ),
    "the course's agent in the reference's node": (files(CHAPTERS_AGENT), POLICY | ROOMS),
    "the course's node with the reference's agent": (
        files(REFERENCE[AGENT].decode(), CHAPTERS_NODE.replace('self._declare("obstacle_threshold", 0.5)', "")),
        SECTORS | {"stands_before_the_first_scan", "stops"},
    ),
    "the agent imports rclpy": (
        agent(("from enum import Enum\n", "from enum import Enum\n\nfrom rclpy.node import Node\n")),
        {"agent_needs_no_ros"},
    ),
    "the agent returns a Twist": (
        agent(
            ("from enum import Enum\n", "from enum import Enum\n\nfrom geometry_msgs.msg import Twist\n"),
            ("        angular = 1.5 * (0.6 - right)\n", "        return Twist()\n"),
        ),
        {"agent_needs_no_ros", "keeps_its_distance", "thresholds"} | ROOMS,
    ),
    "all in one file": ({**REFERENCE, NODE: ONE_FILE}, SCANS | TIMING),
    "no class WallAgent": (
        changed(agent(("class WallAgent", "class Agent")), NODE, ("import WallAgent", "import Agent as WallAgent")),
        {"agent_needs_no_ros"} | POLICY | SCANS | TIMING,
    ),
    "turns right at a wall ahead": (agent(("'angular': 0.5}", "'angular': -0.5}")), {"wall_ahead"} | {"hall", "bend"}),
    "drives on while it turns": (agent(("{'linear': 0.0,", "{'linear': 0.1,")), {"wall_ahead"}),
    "looks for a wall before it looks ahead": (
        agent(
            ("if front < 0.5:", "if right > 1.2:"),
            ("self.state = State.WALL_AHEAD\n            return {'linear': 0.0, 'angular': 0.5}", "HERE"),
            (
                (
                    "if right > 1.2:\n            self.state = State.LOOKING\n"
                    "            return {'linear': 0.2, 'angular': -0.4}"
                ),
                "if front < 0.5:\n            return {'linear': 0.0, 'angular': 0.5}",
            ),
            ("HERE", "self.state = State.LOOKING\n            return {'linear': 0.2, 'angular': -0.4}"),
        ),
        {"wall_ahead"},
    ),
    "stops for walls at 0.3 m": (agent(("front < 0.5", "front < 0.3")), {"wall_ahead"}),
    "nearer or equal": (agent(("front < 0.5", "front <= 0.5")), {"thresholds"}),
    "lost at 1.2 m": (agent(("right > 1.2", "right >= 1.2")), {"thresholds"}),
    "never looks for a wall": (
        agent(("if right > 1.2:", "if False:"), ("0.6 - right)", "0.6 - min(right, 9))")),
        {"looks_for_a_wall", "thresholds"},
    ),
    "drives straight on without a wall": (
        agent(("'linear': 0.2, 'angular': -0.4", "'linear': 0.3, 'angular': 0.0")),
        {"looks_for_a_wall"},
    ),
    "steers the wrong way": (agent(("0.6 - right", "right - 0.6")), {"keeps_its_distance"} | ROOMS),
    "another distance": (agent(("0.6 - right", "0.5 - right")), {"keeps_its_distance"}),
    "another gain": (agent(("1.5 *", "1.0 *")), {"keeps_its_distance"}),
    "no limit": (agent(("max(-0.5, min(0.5, angular))", "angular")), {"keeps_its_distance"}),
    "limits one side alone": (agent(("max(-0.5, min(0.5, angular))", "min(0.5, angular)")), {"keeps_its_distance"}),
    "left or right instead of in proportion": (
        agent(("angular = 1.5 * (0.6 - right)", "angular = 0.5 if right < 0.6 else -0.5")),
        {"keeps_its_distance"},
    ),
    "turns on until the way is clear": (
        agent(("if front < 0.5:", "if front < (0.7 if self.state is State.WALL_AHEAD else 0.5):")),
        {"thresholds"},
    ),
    "the chapter's slices": (
        node(
            (
                "        self.distances = nearest(msg)\n",
                (
                    "        r = msg.ranges\n"
                    "        self.distances = {'front': min(r[0:25] + r[-25:]), 'right': min(r[-80:-40])}\n"
                ),
            )
        ),
        SCANS | ROOMS,
    ),
    "the sectors of the chapter": (
        node(("'front': (-25, 25), 'right': (-80, -40)", "'front': (-30, 30), 'right': (-90, -30)")),
        SECTORS,
    ),
    "every scanner has 360 beams": (node(("scan.angle_increment *", "math.radians(1) *")), SECTORS | ROOMS),
    "every scanner begins ahead": (node(("scan.angle_min +", "")), {"first_beam_anywhere", "clockwise"} | ROOMS),
    "every scanner begins behind": (node(("scan.angle_min +", "-math.pi +")), SCANS | {"block"}),
    "every scanner turns counter-clockwise": (
        node(("scan.angle_increment *", "abs(scan.angle_increment) *")),
        {"clockwise", "bend"},
    ),
    "angles not brought back to one turn": (node((WRAPPED, "degrees = np.degrees(angles)")), SCANS),
    "front too narrow": (node(("'front': (-25, 25)", "'front': (-20, 20)")), SECTORS),
    "front too wide": (node(("'front': (-25, 25)", "'front': (-30, 30)")), SECTORS),
    "right is left": (node(("(-80, -40)", "(40, 80)")), SCANS | ROOMS),
    "right too far back": (node(("(-80, -40)", "(-90, -40)")), SECTORS),
    "mean distance": (
        node(("seen.min(initial=math.inf)", "seen.mean() if len(seen) else math.inf")),
        SCANS | {"hall", "bend"},
    ),
    "NaN not looked for": (
        node((USABLE, "usable = ~((ranges < scan.range_min) | (ranges > scan.range_max)) | np.isinf(ranges)")),
        {"no_measurements"},
    ),
    "0.0 is a distance": (node((USABLE, "usable = ~np.isnan(ranges)")), {"no_measurements"}),
    "finite values alone": (
        node((USABLE, "usable = (ranges >= scan.range_min) & (ranges <= scan.range_max)")),
        {"no_return_and_touching"},
    ),
    "-inf is far": (
        node(("ranges[np.isneginf(ranges)] = 0.0", "ranges[np.isneginf(ranges)] = math.inf")),
        {"no_return_and_touching"},
    ),
    "inf is near": (
        node(("ranges[np.isneginf(ranges)] = 0.0", "ranges[np.isinf(ranges)] = 0.0")),
        {"no_return_and_touching"},
    ),
    "nothing usable is near": (
        node(("initial=math.inf)", "initial=math.inf) if len(seen) else 0.0")),
        {"no_measurements"},
    ),
    "an empty sector raises": (node(("initial=math.inf)", ")")), {"no_measurements"}),
    "silent before the first scan": (
        node(
            (
                '        """Publish a command, ten times a second."""\n',
                '        """Publish."""\n        if self.scan_time is None:\n            return\n',
            )
        ),
        {"stands_before_the_first_scan"},
    ),
    "drives before the first scan": (
        node(
            ("        self.distances = None\n", "        self.distances = {'front': 9.0, 'right': 0.6}\n"),
            ("            return False\n", "            return True\n"),
        ),
        {"stands_before_the_first_scan"},
    ),
    "an old scan is as good as a new one": (node((STALE, "return True")), {"stops"}),
    "stops after a second": (node(("seconds=0.5", "seconds=1.0")), {"stops"}),
    "stops after 0.25 s": (node(("seconds=0.5", "seconds=0.25")), {"stops"}),
    "a scan is old after 0.1 s": (node(("seconds=0.5", "seconds=0.12")), {"rate", "stops"}),
    "never drives again": (
        node(
            (
                STALE,
                (
                    "self.lost = getattr(self, 'lost', False) or self.get_clock().now() - self.scan_time > FRESH\n"
                    "        return not self.lost"
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
    "another topic": (node(("'cmd_vel', 10", "'cmd', 10")), SCANS | TIMING | ROOMS),
}
SILENT = {"another topic"}  # the grader waits for it in vain
