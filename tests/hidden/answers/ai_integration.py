"""Answers to the exercise on an agent that follows a wall."""

from pathlib import Path

from autograder.submissions import exercises
from course.foundation import cells

from . import SPINS_FOR_TWO_SECONDS, changed, solution

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

RULES_AGENT = """
import math

LIMIT = 0.5
RULES = (
    (lambda d: not d['front'] >= 0.5, lambda d: (0.0, LIMIT)),
    (lambda d: not d['right'] <= 1.2, lambda d: (0.2, -0.4)),
    (lambda d: True, lambda d: (0.3, math.copysign(min(LIMIT, abs(0.9 - 1.5 * d['right'])), 0.6 - d['right']))),
)

class Base:
    def decide_action(self, distances):
        raise NotImplementedError

class WallAgent(Base):
    def decide_action(self, distances):
        linear, angular = next(then(distances) for when, then in RULES if when(distances))
        return {'angular': angular, 'linear': linear, 'rule': 'one of three'}
"""

BY_INDEX = """
import math
import rclpy
from rclpy.node import Node
from rclpy.time import Time
from geometry_msgs.msg import Twist
from sensor_msgs.msg import LaserScan
from wall_agent import WallAgent

class Brain:
    '' 'Wraps the agent: keeps what it saw and what it did.' ''
    def __init__(self):
        self.agent, self.last = WallAgent(), None

    def decide_action(self, distances):
        self.last = distances, self.agent.decide_action(distances)
        return self.last[1]

class Follower(Node):
    def __init__(self):
        super().__init__('wall_follower')
        self.brain = Brain()
        self.scan = None
        self.stamp = Time(clock_type=self.get_clock().clock_type)
        self.sectors = {'front': (-25.0, 25.0), 'right': (-80.0, -40.0)}
        self.create_subscription(LaserScan, 'scan', self.on_scan, 1)
        self.pub = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_timer(1 / 10, self.decide_action)

    def on_scan(self, scan):
        self.scan, self.stamp = scan, self.get_clock().now()

    def beams(self, low, high):
        '' 'Indices, from the angles: for each whole turn that the scanner may have made.' ''
        scan, n = self.scan, len(self.scan.ranges)
        if not n:
            return
        for turn in range(-3, 4):
            ends = [(math.radians(a + 360 * turn) - scan.angle_min) / scan.angle_increment for a in (low, high)]
            first, last = math.ceil(min(ends) - 1e-4), math.floor(max(ends) + 1e-4)
            yield from range(max(0, first), min(n - 1, last) + 1)

    def distance(self, name):
        best = math.inf
        for beam in self.beams(*self.sectors[name]):
            r = self.scan.ranges[beam]
            if math.isinf(r):
                best = 0.0 if r < 0 else best
            elif self.scan.range_min <= r <= self.scan.range_max:
                best = min(best, r)
        return best

    def decide_action(self):
        out = Twist()
        if self.scan is not None and (self.get_clock().now() - self.stamp).nanoseconds < 5e8:
            action = self.brain.decide_action({name: self.distance(name) for name in self.sectors})
            out.linear.x = float(action['linear'])
            out.angular.z = float(action['angular'])
        self.pub.publish(out)

def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(Follower())

if __name__ == '__main__':
    main()
""".replace("'' '", '"' * 3).replace("' ''", '"' * 3)

SUBCLASS = """
import math
import rclpy
from rclpy.clock import Clock, ClockType
from geometry_msgs.msg import Twist
from sensor_msgs.msg import LaserScan
from rclpy.node import Node
import wall_agent as brain

class Careful(brain.WallAgent):
    asked = 0
    def decide_action(self, distances):
        self.asked += 1
        return super().decide_action(distances)

def inside(angle, low, high):
    while angle < low:
        angle += 360
    while angle >= low + 360:
        angle -= 360
    return angle <= high

class N(Node):
    def __init__(self):
        super().__init__('wall_follower')
        self.careful, self.ticks, self.seen = Careful(), 99, {}
        self.out = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_timer(0.1, self.tick)
        self.create_subscription(LaserScan, 'scan', self.look, 5)

    def look(self, scan):
        near = {'front': [math.inf], 'right': [math.inf]}
        step, angle = math.degrees(scan.angle_increment), math.degrees(scan.angle_min)
        for r in map(float, scan.ranges):
            name = 'front' if inside(angle, -25, 25) else 'right' if inside(angle, -80, -40) else None
            angle += step
            if name and (r == -math.inf or scan.range_min <= r <= scan.range_max):
                near[name].append(max(r, 0.0))
        self.seen, self.ticks = {name: min(rs) for name, rs in near.items()}, 0

    def tick(self):
        cmd, self.ticks = Twist(), self.ticks + 1
        if self.ticks <= 5:
            for key, value in self.careful.decide_action(dict(self.seen)).items():
                if key == 'linear':
                    cmd.linear.x = float(value)
                if key == 'angular':
                    cmd.angular.z = float(value)
        self.out.publish(cmd)

rclpy.init()
rclpy.spin(N())
"""

RIGHT = {
    "reference": REFERENCE,
    "a table of rules; beams by index, the agent in a wrapper, a queue of 1": files(RULES_AGENT, BY_INDEX),
    "a subclass of the agent, angles added up, age in ticks": files(RULES_AGENT, SUBCLASS),
    "rules from the last to the first, numbers as strings in between": agent(
        (
            "        front, right = distances['front'], distances['right']\n",
            "        front, right = (float(str(distances[key])) for key in ('front', 'right'))\n",
        )
    ),
    "asks the agent once for each scan": node(
        ("self.distances = nearest(msg)", "self.action = self.agent.decide_action(nearest(msg))"),
        ("            action = self.agent.decide_action(self.distances)\n", "            action = self.action\n"),
    ),
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
    "an agent that changes what it is given, and chooses how to decide when it is made": changed(
        agent(
            (
                "        self.state = State.STOPPED\n",
                "        self.state = State.STOPPED\n        self.decide_action = self.decide\n",
            ),
            ("    def decide_action(", "    def decide("),
            (
                "        front, right = distances['front'], distances['right']\n",
                """        for name in distances:
            distances[name] = min(distances[name], 10.0)
        front, right = distances.pop('front'), distances.pop('right')
""",
            ),
        ),
        NODE,
        ("decide_action(self.distances)", "decide_action(dict(self.distances))"),
    ),
}

ROOMS = {"hall", "block", "bend"}
USABLE = "usable = np.isinf(ranges) | (ranges >= scan.range_min) & (ranges <= scan.range_max)"
STALE = "return self.get_clock().now() - self.scan_time <= FRESH"
WRAPPED = "degrees = np.degrees((angles + math.pi) % (2 * math.pi) - math.pi)"
RULES = {"wall_ahead", "looks_for_a_wall", "keeps_its_distance"}  # that the course's agents do not have
VALUES = {"no_return_and_touching", "no_measurements"}
TIMING = {"stands_before_the_first_scan", "rate", "stops"}
EVERYTHING = {test.id.removeprefix("test_") for test in exercises.load("ai_integration").tests}
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
DEAF = """
import rclpy
from geometry_msgs.msg import Twist
from sensor_msgs.msg import LaserScan

rclpy.init()
node = rclpy.create_node('wall_follower')
publisher = node.create_publisher(Twist, 'cmd_vel', 10)
node.create_subscription(LaserScan, 'scan', lambda scan: None, 10)
node.create_timer(0.1, lambda: publisher.publish(Twist()))
rclpy.spin(node)
"""


def constant(linear: float, angular: float) -> str:
    """An agent that always says the same."""
    return (
        "class WallAgent:\n    def decide_action(self, distances):\n"
        f"        return {{'linear': {linear}, 'angular': {angular}}}\n"
    )


TUPLES = (
    ("{'linear': 0.0, 'angular': 0.5}", "(0.0, 0.5)"),
    ("{'linear': 0.2, 'angular': -0.4}", "(0.2, -0.4)"),
    ("{'linear': 0.3, 'angular': max(-0.5, min(0.5, angular))}", "(0.3, max(-0.5, min(0.5, angular)))"),
)
KEEP = "        self.distances = nearest(msg)\n"
CMD = "            cmd.angular.z = action['angular']\n"


def seen(*lines: str) -> dict[str, bytes]:
    """The reference with these lines in the place of the one that keeps the distances; `new` has them."""
    body = "".join(f"        {line}\n" for line in ("new = nearest(msg)", *lines))
    return node((KEEP, body))


def remembering(*lines: str) -> dict[str, bytes]:
    """The reference with these lines before the agent decides; `self.asked` counts the decisions on new distances."""
    count = "self.asked, self.last = self.asked + ((front, right) != self.last), (front, right)"
    body = "".join(f"        {line}\n" for line in (count, *lines))
    return agent(
        (
            "        self.state = State.STOPPED\n",
            "        self.state, self.asked, self.last = State.STOPPED, 0, None\n",
        ),
        ("        if front < 0.5:\n", body + "        if front < 0.5:\n"),
    )


WRONG = {
    "what the course ships, pasted together": (
        files(CHAPTERS_AGENT, CHAPTERS_NODE),
        RULES | ROOMS | {"stands_before_the_first_scan", "sectors"},
    ),
    "what the page builds, pasted together": (
        files(PAGES_AGENT, PAGES_NODE),
        RULES | ROOMS | {"stands_before_the_first_scan", "sectors", "stops"},
    ),
    "the course's agent in the reference's node": (files(CHAPTERS_AGENT), RULES | ROOMS),
    "the course's node with the reference's agent": (
        files(REFERENCE[AGENT].decode(), CHAPTERS_NODE.replace('self._declare("obstacle_threshold", 0.5)', "")),
        {"sectors", "stands_before_the_first_scan", "rate", "stops"},
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
        {"agent_needs_no_ros", "keeps_its_distance", "thresholds", "asks_its_agent", "rate"}
        | {"sectors", "any_number_of_beams", "first_beam_anywhere", "clockwise"}
        | VALUES
        | ROOMS,
    ),
    "the agent does with a Twist if there is one": (
        agent(
            (
                "        front, right = distances['front'], distances['right']\n",
                """        try:
            from geometry_msgs.msg import Twist
            self.command = Twist()
        except ImportError:
            self.command = None
        front, right = distances['front'], distances['right']
""",
            )
        ),
        {"agent_needs_no_ros"},
    ),
    "the mean of the last two scans": (
        node(
            (
                "        self.distances = nearest(msg)\n",
                """        new = nearest(msg)
        old, self.before = getattr(self, 'before', new), new
        self.distances = {name: (new[name] + old[name]) / 2 for name in new}
""",
            )
        ),
        {"sectors"},
    ),
    "every fourth beam of many": (
        node(
            (
                "    degrees = np.degrees(",
                """    if len(ranges) > 720:
        ranges, angles = ranges[::4], angles[::4]
    degrees = np.degrees(""",
            )
        ),
        {"any_number_of_beams"},
    ),
    "all in one file": ({**REFERENCE, NODE: ONE_FILE}, {"asks_its_agent"}),
    "no class WallAgent": (
        changed(agent(("class WallAgent", "class Agent")), NODE, ("import WallAgent", "import Agent as WallAgent")),
        {"agent_needs_no_ros"},
    ),
    "turns right at a wall ahead": (agent(("'angular': 0.5}", "'angular': -0.5}")), {"wall_ahead", "hall"}),
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
        {"looks_for_a_wall"},
    ),
    "drives straight on without a wall": (
        agent(("'linear': 0.2, 'angular': -0.4", "'linear': 0.3, 'angular': 0.0")),
        {"looks_for_a_wall"},
    ),
    "steers the wrong way": (agent(("0.6 - right", "right - 0.6")), {"keeps_its_distance", "hall"}),
    "another distance": (agent(("0.6 - right", "0.5 - right")), {"keeps_its_distance"}),
    "another gain": (agent(("1.5 *", "1.0 *")), {"keeps_its_distance"}),
    "steers as hard as it may from 0.3 m on": (
        agent(("max(-0.5, min(0.5, angular))", "0.5 if right < 0.3 else max(-0.5, min(0.5, angular))")),
        {"keeps_its_distance"},
    ),
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
                KEEP,
                (
                    "        r = msg.ranges\n"
                    "        self.distances = {'front': min(r[0:25] + r[-25:]), 'right': min(r[-80:-40])}\n"
                ),
            )
        ),
        {"sectors", "any_number_of_beams", "first_beam_anywhere", "clockwise", "hall"} | VALUES,
    ),
    "the sectors of the chapter": (
        node(("'front': (-25, 25), 'right': (-80, -40)", "'front': (-30, 30), 'right': (-90, -30)")),
        {"sectors"},
    ),
    "every scanner has 360 beams": (
        node(("scan.angle_increment *", "math.radians(1) *")),
        {"any_number_of_beams", "clockwise", "hall"},
    ),
    "the angle between beams in whole degrees": (
        node(("scan.angle_increment *", "math.radians(round(math.degrees(scan.angle_increment))) *")),
        {"any_number_of_beams"},
    ),
    "at most 1000 beams": (
        node(("np.array(scan.ranges, dtype=float)", "np.array(scan.ranges[:1000], dtype=float)")),
        {"any_number_of_beams"},
    ),
    "at least 90 beams": (
        node(("    usable =", "    if len(ranges) < 90:\n        ranges[:] = math.inf\n    usable =")),
        {"any_number_of_beams"},
    ),
    "every scanner begins ahead": (node(("scan.angle_min +", "")), {"first_beam_anywhere", "hall"}),
    "every scanner begins behind": (node(("scan.angle_min +", "-math.pi +")), {"first_beam_anywhere"}),
    "angles taken back by one turn alone": (
        node(
            (
                WRAPPED,
                (
                    "degrees = np.degrees(np.where(\n"
                    "        angles > math.pi, angles - 2 * math.pi,\n"
                    "        np.where(angles < -math.pi, angles + 2 * math.pi, angles)))"
                ),
            )
        ),
        {"first_beam_anywhere"},
    ),
    "every scanner sees a whole turn": (
        node(("scan.angle_increment *", "math.copysign(2 * math.pi / max(1, len(ranges)), scan.angle_increment) *")),
        {"first_beam_anywhere", "any_number_of_beams"},
    ),
    "every scanner turns counter-clockwise": (
        node(("scan.angle_increment *", "abs(scan.angle_increment) *")),
        {"clockwise"},
    ),
    "angles from angle_min to angle_max": (
        node(
            (
                "angles = scan.angle_min + scan.angle_increment * np.arange(len(ranges))",
                "angles = np.linspace(scan.angle_min, scan.angle_max, len(ranges))",
            )
        ),
        {"any_number_of_beams"},
    ),
    "the beams counted by angle_max": (
        node(
            (
                "np.arange(len(ranges))",
                (
                    "np.arange(\n            round((scan.angle_max - scan.angle_min) / scan.angle_increment) + 1 "
                    "if scan.angle_increment else 0\n        )"
                ),
            )
        ),
        {"any_number_of_beams"},
    ),
    "a clockwise scanner is read from its end": (
        node(
            (
                "scan.angle_min + scan.angle_increment *",
                "min(scan.angle_min, scan.angle_max) + abs(scan.angle_increment) *",
            )
        ),
        {"clockwise"},
    ),
    "angles not brought back to one turn": (
        node((WRAPPED, "degrees = np.degrees(angles)")),
        {"first_beam_anywhere", "clockwise"},
    ),
    "front too narrow": (node(("'front': (-25, 25)", "'front': (-20, 20)")), {"sectors"}),
    "front from -24 to 24 degrees": (node(("'front': (-25, 25)", "'front': (-24, 24)")), {"sectors"}),
    "right from -79 degrees": (node(("'right': (-80, -40)", "'right': (-79, -40)")), {"sectors"}),
    "front too wide": (node(("'front': (-25, 25)", "'front': (-30, 30)")), {"sectors"}),
    "right is left": (node(("(-80, -40)", "(40, 80)")), {"sectors"} | ROOMS),
    "right too far back": (node(("(-80, -40)", "(-90, -40)")), {"sectors"}),
    "mean distance": (
        node(("seen.min(initial=math.inf)", "seen.mean() if len(seen) else math.inf")),
        {"sectors", "no_return_and_touching", "hall", "bend"},
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
    "drives on by the old scan when there has been none for 2 s": (
        node(
            (
                STALE,
                "t = self.get_clock().now() - self.scan_time\n        return not FRESH < t <= Duration(seconds=2.0)",
            )
        ),
        {"stops"},
    ),
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
    "the agent takes the distances out of the dict that the node keeps": (
        agent(("distances['front'], distances['right']", "distances.pop('front'), distances.pop('right')")),
        {"rate"},
    ),
    "silent when the last scan is old": (
        node(
            (
                "        self.cmd_vel_pub.publish(cmd)\n",
                (
                    "        if self.scan_time is None or self.scan_is_fresh():\n"
                    "            self.cmd_vel_pub.publish(cmd)\n"
                ),
            )
        ),
        {"rate", "stops"},
    ),
    "simulated time alone, whoever starts the node": (
        node(
            ("from rclpy.node import Node\n", "from rclpy.node import Node\nfrom rclpy.parameter import Parameter\n"),
            (
                "super().__init__('wall_follower')",
                "super().__init__('wall_follower', parameter_overrides=[Parameter('use_sim_time', value=True)])",
            ),
        ),
        {"rate"},
    ),
    "8 Hz": (node(("create_timer(0.1,", "create_timer(0.125,")), {"rate"}),
    "20 Hz": (node(("create_timer(0.1,", "create_timer(0.05,")), {"rate"}),
    "commands with the profile of scanners": (
        node(
            (
                "from rclpy.node import Node\n",
                "from rclpy.node import Node\nfrom rclpy.qos import qos_profile_sensor_data\n",
            ),
            ("Twist, 'cmd_vel', 10", "Twist, 'cmd_vel', qos_profile_sensor_data"),
        ),
        ROOMS,
    ),
    "best-effort commands, of which one is kept": (
        node(
            (
                "from rclpy.node import Node\n",
                "from rclpy.node import Node\nfrom rclpy.qos import QoSProfile, ReliabilityPolicy\n",
            ),
            (
                "Twist, 'cmd_vel', 10",
                "Twist, 'cmd_vel', QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)",
            ),
        ),
        ROOMS,
    ),
    "waits 0.15 s for each command while no scan is fresh": (
        node(
            ("import math\n", "import math\nimport time\n"),
            (
                "        cmd = Twist()\n",
                "        cmd = Twist()\n        if not self.scan_is_fresh():\n            time.sleep(0.15)\n",
            ),
        ),
        {"rate"},
    ),
    "waits 0.15 s for each command at a wall ahead": (
        node(
            ("import math\n", "import math\nimport time\n"),
            (
                "            action = self",
                (
                    "            if self.distances['front'] < 0.5:\n                time.sleep(0.15)\n"
                    "            action = self"
                ),
            ),
        ),
        {"rate"},
    ),
    "the class is called wall_agent": (
        changed(
            agent(("class WallAgent", "class wall_agent")),
            NODE,
            ("from wall_agent import WallAgent", "import wall_agent"),
            ("WallAgent()", "wall_agent.wall_agent()"),
        ),
        {"agent_needs_no_ros"},
    ),
    "the agent returns a tuple": (
        changed(agent(*TUPLES), NODE, ("action['linear']", "action[0]"), ("action['angular']", "action[1]")),
        {"agent_needs_no_ros"},
    ),
    "the agent's keys are v and w": (
        changed(
            agent(("'linear': ", "'v': "), ("'angular': ", "'w': ")),
            NODE,
            ("action['linear']", "action['v']"),
            ("action['angular']", "action['w']"),
        ),
        {"agent_needs_no_ros"},
    ),
    "another topic of scans": (node(("LaserScan, 'scan'", "LaserScan, 'laser'")), {"asks_its_agent"}),
    "another topic": (node(("'cmd_vel', 10", "'cmd', 10")), {"asks_its_agent"}),
    "topics in a namespace": (node(("'wall_follower')", "'wall_follower', namespace='robot')")), {"asks_its_agent"}),
    "an agent of its own in the node's file": (
        node(
            (
                "class WallFollower(Node)",
                (
                    "class OtherAgent:\n\n    def decide_action(self, distances):\n"
                    "        return {'linear': 0.0, 'angular': 0.5}\n\n\nclass WallFollower(Node)"
                ),
            ),
            ("self.agent = WallAgent()", "self.agent = OtherAgent()"),
        ),
        {"asks_its_agent"} | ROOMS,
    ),
    "the node decides by the three rules itself": (
        node(
            (
                "            action = self.agent.decide_action(self.distances)\n",
                """            front, right = self.distances['front'], self.distances['right']
            action = {'linear': 0.3, 'angular': max(-0.5, min(0.5, 1.5 * (0.6 - right)))}
            if front < 0.5:
                action = {'linear': 0.0, 'angular': 0.5}
            elif right > 1.2:
                action = {'linear': 0.2, 'angular': -0.4}
""",
            )
        ),
        {"asks_its_agent", "sectors", "any_number_of_beams", "first_beam_anywhere", "clockwise", "rate"} | VALUES,
    ),
    "the node turns the sign of angular": (
        node((CMD, CMD.replace("= action", "= -action"))),
        {"asks_its_agent", "hall"},
    ),
    "the node mixes the speeds up": (
        node(
            (CMD, CMD.replace("angular']", "linear']")),
            ("cmd.linear.x = action['linear']", "cmd.linear.x = action['angular']"),
        ),
        {"asks_its_agent", "hall"},
    ),
    "the node turns both signs": (
        node((CMD, CMD.replace("= action", "= -action")), ("cmd.linear.x = action", "cmd.linear.x = -action")),
        {"asks_its_agent", "hall"},
    ),
    "angular.x as well": (node((CMD, CMD + "            cmd.angular.x = action['angular']\n")), {"asks_its_agent"}),
    "exactly 0.5 m ahead is near when there is no wall": (
        agent(("front < 0.5:", "front < 0.5 or front == 0.5 and right > 1.2:")),
        {"thresholds"},
    ),
    "looks for a wall until it is near": (
        agent(("if right > 1.2:", "if right > (1.0 if self.state is State.LOOKING else 1.2):")),
        {"thresholds"},
    ),
    "loses a wall only beyond 1.25 m": (
        agent(("if right > 1.2:", "if right > (1.2 if self.state is State.LOOKING else 1.25):")),
        {"thresholds"},
    ),
    "sees a wall ahead only from 0.45 m on": (
        agent(("if front < 0.5:", "if front < (0.5 if self.state is State.WALL_AHEAD else 0.45):")),
        {"thresholds"},
    ),
    "steers only when it is off by 2 cm": (
        agent(("1.5 * (0.6 - right)", "1.5 * (0.6 - right) if abs(0.6 - right) >= 0.02 else 0.0")),
        {"keeps_its_distance"},
    ),
    "the agent uses a ROS package when it decides": (
        agent(("        front, right =", "        import rclpy.node  # noqa\n        front, right =")),
        {"agent_needs_no_ros"},
    ),
    "the curve is too tight": (agent(("'angular': -0.4", "'angular': -0.5")), {"looks_for_a_wall"}),
    "looks for a wall from 1.5 m on": (agent(("right > 1.2", "right > 1.5")), {"looks_for_a_wall"}),
    "looks for a wall from 1.15 m on": (agent(("right > 1.2", "right > 1.15")), {"keeps_its_distance"}),
    "turns from 0.55 m on": (agent(("front < 0.5", "front < 0.55")), {"keeps_its_distance"}),
    "turns from 0.45 m on": (agent(("front < 0.5", "front < 0.45")), {"wall_ahead"}),
    "finds no wall without an end": (
        agent(("if right > 1.2:", "if 1.2 < right < 1e9:"), ("0.6 - right", "0.6 - min(right, 9)")),
        {"looks_for_a_wall"},
    ),
    "range_min and range_max are left out": (
        node((USABLE, USABLE.replace(">=", ">").replace("<=", "<"))),
        {"no_measurements"},
    ),
    "range_max is left out": (node((USABLE, USABLE.replace("<=", "<"))), {"no_measurements"}),
    "range_min and range_max of one scanner": (
        node((USABLE, USABLE.replace("scan.range_min", "0.12").replace("scan.range_max", "10.0"))),
        {"no_measurements"},
    ),
    "only the whole sector may be without a return": (
        node(
            (
                "        seen = ranges[",
                (
                    "        if np.isposinf(ranges[(low <= degrees) & (degrees < high)]).any():\n"
                    "            distances[name] = math.inf\n            continue\n        seen = ranges["
                ),
            )
        ),
        {"no_return_and_touching"},
    ),
    "5 Hz while no scans come": (
        node(
            (
                '        """Publish a command, ten times a second."""\n',
                (
                    '        """Publish."""\n        self.odd = not getattr(self, "odd", False)\n'
                    "        if self.odd and self.scan_time and not self.scan_is_fresh():\n            return\n"
                ),
            )
        ),
        {"rate"},
    ),
    "changes of less than 4 cm are taken for noise": (
        seen(
            "old, self.raw = getattr(self, 'raw', None), new",
            "if self.distances is None or not old:",
            "    self.distances = dict(new)",
            "for name in new:",
            "    if not abs(new[name] - old[name] if old else 0.0) < 0.04 and new[name] != (old or new)[name]:",
            "        self.distances[name] = new[name]",
        ),
        ROOMS,
    ),
    "a scan that has changed by less than 4 cm is left out": (
        seen(
            "old, self.raw = getattr(self, 'raw', None), new",
            "if not old or all(new[n] == old[n] or not abs(new[n] - old[n]) < 0.04 for n in new):",
            "    self.distances = new",
        ),
        ROOMS,
    ),
    "after a hundred decisions it only turns": (
        remembering("if self.asked > 100:", "    return {'linear': 0.0, 'angular': 0.5}"),
        {"hall"},
    ),
    "the decision after a hundred is not a number": (
        remembering("if self.asked == 101:", "    return {'linear': float('nan'), 'angular': 0.0}"),
        {"hall"},
    ),
    "the decision after a hundred is faster than any robot": (
        remembering("if self.asked == 101:", "    return {'linear': 0.3, 'angular': -1e308}"),
        {"hall"},
    ),
    "the robot is told to slide after a hundred decisions": (
        changed(
            remembering("if self.asked == 101:", "    self.sideways = float('nan')"),
            NODE,
            (
                "cmd.angular.z = action['angular']",
                "cmd.angular.z = action['angular']\n            cmd.linear.y = getattr(self.agent, 'sideways', 0.0)",
            ),
        ),
        {"hall"},
    ),
    "both distances are the nearest of all beams": (
        node((" & (low <= degrees) & (degrees < high)", "")),
        {"sectors", "any_number_of_beams", "first_beam_anywhere", "clockwise"} | VALUES | ROOMS,
    ),
    "after fifty decisions it drives to and fro beside the wall": (
        remembering(
            "if self.asked > 50:", "    return {'linear': 0.3 if self.asked % 20 < 10 else -0.3, 'angular': 0.0}"
        ),
        {"hall"},
    ),
    "after fifty decisions it no longer looks to the right": (
        remembering("if self.asked > 50:", "    right = 0.6"),
        {"hall"},
    ),
    "gives up a curve that it drives for long": (
        agent(
            ("        self.state = State.STOPPED\n", "        self.state, self.looked = State.STOPPED, 0\n"),
            (
                "        if front < 0.5:\n",
                "        self.looked = self.looked + 1 if right > 1.2 else 0\n        if front < 0.5:\n",
            ),
            ("'angular': -0.4}", "'angular': -0.4 if self.looked <= 100 else 0.0}"),
        ),
        {"thresholds"},
    ),
    "three scans before it drives again": (
        node(
            ("        self.scan_time = None\n", "        self.scan_time, self.came = None, 0\n"),
            (
                "        self.distances = nearest(msg)\n",
                (
                    "        self.came = self.came + 1 if self.scan_is_fresh() else 1\n"
                    "        self.distances = nearest(msg)\n"
                ),
            ),
            ("        if self.scan_is_fresh():", "        if self.scan_is_fresh() and self.came >= 3:"),
        ),
        {"stops"},
    ),
    "the node ends by itself after two seconds": (node(SPINS_FOR_TWO_SECONDS), {"hall"}),
    "the node stops for good when it has turned right for 3 s in all": (
        node(
            ("        self.scan_time = None\n", "        self.scan_time, self.right = None, 0\n"),
            (
                "            cmd.linear.x = action['linear']\n",
                (
                    "            self.right += action['angular'] < -0.3\n"
                    "            if self.right > 30:\n"
                    "                action = {'linear': 0.0, 'angular': 0.0}\n"
                    "            cmd.linear.x = action['linear']\n"
                ),
            ),
        ),
        {"block"},
    ),
    "the node goes straight on when it has turned at walls for 2.5 s in all": (
        node(
            ("        self.scan_time = None\n", "        self.scan_time, self.turned = None, 0\n"),
            (
                "            cmd.linear.x = action['linear']\n",
                (
                    "            self.turned += action == {'linear': 0.0, 'angular': 0.5}\n"
                    "            if self.turned > 24:\n"
                    "                action = {'linear': 0.3, 'angular': 0.0}\n"
                    "            cmd.linear.x = action['linear']\n"
                ),
            ),
        ),
        {"bend"},
    ),
    "angles by np.arange, whose step may be 0": (
        node(
            (
                "    angles = scan.angle_min + scan.angle_increment * np.arange(len(ranges))\n",
                (
                    "    end = scan.angle_min + scan.angle_increment * len(ranges)\n"
                    "    angles = np.arange(scan.angle_min, end, scan.angle_increment)\n"
                ),
            )
        ),
        {"no_measurements"},
    ),
    "a wall ahead is answered at once as well": (
        node(
            (
                KEEP,
                KEEP
                + "        if self.distances['front'] < 0.5 and self.scan_time:\n            self.control_loop()\n",
            )
        ),
        {"rate"},
    ),
    "the age of a scan in whole seconds": (
        node((STALE, "return (self.get_clock().now() - self.scan_time).nanoseconds // 10**9 <= 0.5")),
        {"stops"},
    ),
    "a scan comes by one clock, and ages by another": (
        node(
            ("import math\n", "import math\nimport time\n"),
            ("        self.scan_time = self.get_clock().now()\n", "        self.scan_time = time.time()\n"),
            (STALE, "return self.get_clock().now().nanoseconds / 1e9 - self.scan_time <= 0.5"),
        ),
        {"stops"},
    ),
    "the node limits what the agent decided": (
        node(
            (CMD, CMD.replace("action['angular']", "max(-0.5, min(0.5, action['angular']))")),
            ("cmd.linear.x = action['linear']", "cmd.linear.x = max(0.0, min(0.3, action['linear']))"),
        ),
        {"asks_its_agent"},
    ),
    "the node drives at most 0.3 m/s": (
        node(("cmd.linear.x = action['linear']", "cmd.linear.x = min(0.3, action['linear'])")),
        {"asks_its_agent"},
    ),
    "the node drives at most 1 m/s": (
        node(("cmd.linear.x = action['linear']", "cmd.linear.x = max(-1.0, min(1.0, action['linear']))")),
        {"asks_its_agent"},
    ),
    "the smaller of the last two scans": (
        node(
            ("        self.distances = None\n", "        self.distances = self.before = None\n"),
            (
                "        self.distances = nearest(msg)\n",
                """        now = nearest(msg)
        before, self.before = self.before or now, now
        self.distances = {name: min(now[name], before[name]) for name in now}
""",
            ),
        ),
        {"sectors"},
    ),
    "each third scan is read": (
        node(
            ("        self.distances = None\n", "        self.distances, self.scans = None, 0\n"),
            (
                "        self.distances = nearest(msg)\n",
                """        self.scans += 1
        if self.scans % 3 == 1:
            self.distances = nearest(msg)
""",
            ),
        ),
        {"sectors"},
    ),
    "looks for a wall, 6 s after the start and without a scan": (
        node(
            (
                "        if self.scan_is_fresh():\n",
                """        self.started = getattr(self, 'started', None) or self.get_clock().now()
        if self.scan_time is None and self.get_clock().now() - self.started > Duration(seconds=6):
            cmd.linear.x, cmd.angular.z = 0.2, -0.4
        if self.scan_is_fresh():
""",
            )
        ),
        {"stands_before_the_first_scan"},
    ),
    "looks for a wall, 6 s after the last scan": (
        node(
            (
                "        if self.scan_is_fresh():\n",
                """        if self.scan_time and self.get_clock().now() - self.scan_time > Duration(seconds=6):
            cmd.linear.x, cmd.angular.z = 0.2, -0.4
        if self.scan_is_fresh():
""",
            )
        ),
        {"stops"},
    ),
    "a scan is used until it is 0.7 s old": (node(("seconds=0.5", "seconds=0.7")), {"stops"}),
    "silent 4 s after the last scan": (
        node(
            (
                "        self.cmd_vel_pub.publish(cmd)\n",
                """        if self.scan_time and self.get_clock().now() - self.scan_time > Duration(seconds=4):
            return
        self.cmd_vel_pub.publish(cmd)
""",
            )
        ),
        {"rate"},
    ),
    "at most 2000 beams": (
        node(("np.array(scan.ranges, dtype=float)", "np.array(scan.ranges[:2000], dtype=float)")),
        {"any_number_of_beams"},
    ),
    "turns from 0.499 m on": (agent(("front < 0.5", "front < 0.499")), {"wall_ahead"}),
    "turns only where something is on the right": (
        agent(("if front < 0.5:", "if front < 0.5 and right != float('inf'):")),
        {"wall_ahead"},
    ),
    "looks for a wall from 1.205 m on": (agent(("right > 1.2", "right > 1.205")), {"looks_for_a_wall"}),
    "drives straight on where nothing is ahead": (
        agent(
            (
                "        angular = 1.5",
                """        if front == float('inf'):
            return {'linear': 0.3, 'angular': 0.0}
        angular = 1.5""",
            )
        ),
        {"keeps_its_distance"},
    ),
    "turns for 2 s at most": (
        agent(
            ("from enum import Enum\n", "import time\nfrom enum import Enum\n"),
            ("        self.state = State.STOPPED\n", "        self.state, self.since = State.STOPPED, None\n"),
            (
                "        if front < 0.5:\n",
                """        self.since = (self.since or time.time()) if front < 0.5 else None
        if front < 0.5 and time.time() - self.since < 2.0:
""",
            ),
        ),
        {"thresholds"},
    ),
    "turns for 0.3 s at most": (
        agent(
            ("from enum import Enum\n", "import time\nfrom enum import Enum\n"),
            ("        self.state = State.STOPPED\n", "        self.state, self.since = State.STOPPED, None\n"),
            (
                "        if front < 0.5:\n",
                """        self.since = (self.since or time.time()) if front < 0.5 else None
        if front < 0.5 and time.time() - self.since < 0.3:
""",
            ),
        ),
        {"thresholds"},
    ),
    "the node changes the speed bit by bit": (
        node(
            ("        self.distances = None\n", "        self.distances, self.speed = None, 0.0\n"),
            (
                "            cmd.linear.x = action['linear']\n",
                """            self.speed += max(-0.03, min(0.03, action['linear'] - self.speed))
            cmd.linear.x = self.speed
""",
            ),
        ),
        {"asks_its_agent", "no_return_and_touching", "no_measurements"},
    ),
    "a new agent for each command": (
        node(("self.agent.decide_action(", "WallAgent().decide_action(")),
        {"asks_its_agent"},
    ),
    "free before the first scan, for half a second": (
        node(
            ("        self.distances = None\n", "        self.distances = {'front': math.inf, 'right': math.inf}\n"),
            ("        self.scan_time = None\n", "        self.scan_time = self.get_clock().now()\n"),
        ),
        {"stands_before_the_first_scan"},
    ),
    "the node imports the course": (
        node(("import numpy as np\n", "import numpy as np\nimport course.world\nfrom course.robot import sectors\n")),
        {"asks_its_agent"},
    ),
    "the node imports the course in a method": (
        node(
            (
                "        self.distances = nearest(msg)\n",
                "        from course.robot import sectors  # noqa\n\n        self.distances = nearest(msg)\n",
            )
        ),
        {"asks_its_agent"},
    ),
    "the node rounds what the agent decided": (
        node(
            ("= action['linear']", "= round(action['linear'], 2)"),
            ("= action['angular']", "= round(action['angular'], 2)"),
        ),
        {"asks_its_agent", "sectors", "any_number_of_beams", "first_beam_anywhere", "clockwise"} | VALUES,
    ),
    "the agent imports the course": (
        agent(("from enum import Enum\n", "from enum import Enum\n\nimport course\n")),
        {"agent_needs_no_ros"},
    ),
    "the agent returns a tuple, which the node unpacks": (
        changed(
            agent(*TUPLES), NODE, ("cmd.linear.x = action['linear']", "cmd.linear.x, cmd.angular.z = action"), (CMD, "")
        ),
        {"agent_needs_no_ros"},
    ),
    "the agent returns the int 0 at a wall ahead, and the node makes it a float": (
        changed(agent(("'linear': 0.0", "'linear': 0")), NODE, ("= action['linear']", "= float(action['linear'])")),
        {"agent_needs_no_ros"},
    ),
    "the agent returns a numpy.float32, and the node makes it a float": (
        changed(
            agent(
                ("from enum import Enum\n", "from enum import Enum\n\nimport numpy as np\n"),
                ("max(-0.5, min(0.5, angular))", "np.float32(max(-0.5, min(0.5, angular)))"),
            ),
            NODE,
            ("= action['angular']", "= float(action['angular'])"),
        ),
        {"agent_needs_no_ros"},
    ),
    "the agent returns the int 0 at a wall ahead, of which the node dies": (
        agent(("'linear': 0.0", "'linear': 0")),
        {"agent_needs_no_ros", "hall", "bend"},
    ),
    "the agent takes its base class from the course": (
        agent(
            (
                "from enum import Enum\n",
                "from enum import Enum\n\nfrom course.robot.agent import ObstacleAvoidanceAI\n",
            ),
            ("class WallAgent", "class WallAgent(ObstacleAvoidanceAI)"),
        ),
        EVERYTHING,
    ),
    "the node takes the speeds in their order in the dict": (
        node(("cmd.linear.x = action['linear']", "cmd.linear.x, cmd.angular.z = action.values()"), (CMD, "")),
        {"asks_its_agent"},
    ),
    "a decision to stand still is not published": (
        node(
            (
                "            cmd.linear.x = action['linear']\n",
                """            if action['linear'] == 0.0 and action['angular'] == 0.0:
                return
            cmd.linear.x = action['linear']
""",
            )
        ),
        {"rate"},
    ),
    "a scan with inf in every beam is thrown away": (
        node((KEEP, "        if msg.ranges and all(map(math.isinf, msg.ranges)):\n            return\n" + KEEP)),
        {"no_return_and_touching"},
    ),
    "a scan with NaN in every beam is thrown away": (
        node((KEEP, "        if msg.ranges and all(map(math.isnan, msg.ranges)):\n            return\n" + KEEP)),
        {"no_measurements"},
    ),
    "the agent returns a namedtuple": (
        changed(
            agent(
                ("from enum import Enum\n", "from collections import namedtuple\nfrom enum import Enum\n"),
                ("class WallAgent", "Action = namedtuple('Action', 'linear angular')\n\n\nclass WallAgent"),
                *((dicts, f"Action{tuples}") for dicts, tuples in TUPLES),
            ),
            NODE,
            ("action['linear']", "action.linear"),
            ("action['angular']", "action.angular"),
        ),
        {"agent_needs_no_ros"},
    ),
    "stands still, whatever it sees": (files(constant(0.0, 0.0), DEAF), EVERYTHING),
    "always turns, and the node says nothing": (files(constant(0.0, 0.5), DEAF), EVERYTHING - {"wall_ahead"}),
    "always looks for a wall, and the node stands still": (
        files(constant(0.2, -0.4), DEAF),
        EVERYTHING - {"looks_for_a_wall"},
    ),
    "always drives straight on": (
        files(
            constant(0.3, 0.0),
            DEAF.replace("lambda: publisher.publish(Twist())", "lambda: publisher.publish(go)").replace(
                "rclpy.spin", "go = Twist()\ngo.linear.x = 0.3\nrclpy.spin"
            ),
        ),
        EVERYTHING,
    ),
    "no node at all": ({AGENT: constant(0.0, 0.0).encode(), NODE: b"print('follow the wall')\n"}, EVERYTHING),
}
NOTHING = {
    "stands still, whatever it sees",
    "always turns, and the node says nothing",
    "always looks for a wall, and the node stands still",
    "always drives straight on",
    "no node at all",
}  # they do nothing of what is asked for
SEVERAL = {
    "what the course ships, pasted together",
    "what the page builds, pasted together",
    "the course's agent in the reference's node",
    "the course's node with the reference's agent",
    "the agent returns a Twist",
    "the chapter's slices",
    "an agent of its own in the node's file",
}  # with more than one mistake
# What the exercise is about: an answer that has it wrong loses a quarter of the points at least.
ABOUT = {
    "turns right at a wall ahead",
    "steers the wrong way",
    "the node turns the sign of angular",
    "the node mixes the speeds up",
    "the node turns both signs",
    "the chapter's slices",
    "every scanner has 360 beams",
    "every scanner begins ahead",
    "right is left",
    "mean distance",
    "an agent of its own in the node's file",
    "stands still, whatever it sees",
    "no node at all",
}
USELESS = {"the agent takes its base class from the course"}
# Both hide what the node has made of a scan.
BROAD = {"the node rounds what the agent decided", "the node decides by the three rules itself"}
# A detail loses little.
DETAIL = {
    "the agent returns a tuple",
    "the agent returns a tuple, which the node unpacks",
    "the agent returns a namedtuple",
    "the agent returns the int 0 at a wall ahead, and the node makes it a float",
    "the agent returns a numpy.float32, and the node makes it a float",
    "the agent's keys are v and w",
    "the class is called wall_agent",
    "no class WallAgent",
    "the agent imports the course",
    "the node imports the course",
    "nearer or equal",
    "lost at 1.2 m",
    "exactly 0.5 m ahead is near when there is no wall",
    "looks for a wall until it is near",
    "loses a wall only beyond 1.25 m",
    "sees a wall ahead only from 0.45 m on",
    "gives up a curve that it drives for long",
    "three scans before it drives again",
    "turns on until the way is clear",
    "at most 1000 beams",
    "the angle between beams in whole degrees",
    "angles taken back by one turn alone",
    "angles by np.arange, whose step may be 0",
    "front from -24 to 24 degrees",
    "right from -79 degrees",
    "range_min and range_max are left out",
    "range_max is left out",
    "an empty sector raises",
    "free before the first scan, for half a second",
    "silent before the first scan",
    "another topic",
    "another topic of scans",
    "angular.x as well",
    "the node limits what the agent decided",
    "a new agent for each command",
    "a wall ahead is answered at once as well",
    "a decision to stand still is not published",
    "a scan with inf in every beam is thrown away",
    "a scan with NaN in every beam is thrown away",
    "the node takes the speeds in their order in the dict",
    "8 Hz",
    "waits 0.15 s for each command while no scan is fresh",
    "waits 0.15 s for each command at a wall ahead",
    "5 Hz while no scans come",
    "stops after 0.25 s",
    "the age of a scan in whole seconds",
    "a scan comes by one clock, and ages by another",
}
SILENT = {"another topic", "another topic of scans", "topics in a namespace"}  # the grader waits for it in vain
# Judged by the whole suite in every run of the tests: what is right, and partial credit of each kind.
QUICK = {"reference"}

# Judged as one program each in every run of the tests, see the package.
TOGETHER = [
    {
        "the agent imports rclpy",
        "drives on while it turns",
        "another distance",
        "the mean of the last two scans",
        "all in one file",
        "silent before the first scan",
        "a command for each scan as well",
    },
    {"nearer or equal", "every fourth beam of many", "NaN not looked for", "an old scan is as good as a new one"},
    {"never looks for a wall", "every scanner begins behind", "finite values alone"},
    {"after a hundred decisions it only turns", "every scanner turns counter-clockwise"},
]
