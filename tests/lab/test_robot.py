"""The robot view, from the kernel's side: what it is shown of a drive, its controls, the parameters that it follows."""

import itertools
import json
import math
import statistics
from types import SimpleNamespace

import pytest
from geometry_msgs.msg import Point
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import FloatingPointRange, Parameter, ParameterDescriptor, ParameterEvent, ParameterValue
from rclpy.serialization import serialize_message
from sensor_msgs.msg import LaserScan
from visualization_msgs.msg import Marker

from course.lab import protocol
from course.lab.kernel import driving, knobs
from course.lab.kernel.robot_listener import FARTHEST, RobotListener
from course.world import ROOMS
from course.world.geometry import clearance
from course.world.simulation import Robot
from tests.lab.client import Client, page_of
from tests.lab.test_arrival import SIMULATION

DRIVER = """import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node


class Driver(Node):
    def __init__(self):
        super().__init__('my_driver')
        self.declare_parameter('turn', 0.5)
        self.declare_parameter('label', 'mine')
        self.pub = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_timer(0.05, self.go)

    def go(self):
        command = Twist()
        command.angular.z = self.get_parameter('turn').value
        self.pub.publish(command)


rclpy.init()
rclpy.spin(Driver())
"""


@pytest.fixture(scope="module")
def kernel(kernel):
    (kernel.folder / "driver.py").write_text(DRIVER)
    (kernel.folder / "simulation.py").write_text(SIMULATION)
    kernel.run("from course.world.node import World")
    return kernel


@pytest.fixture(autouse=True)
def nothing_runs(kernel):
    kernel.run("ros.stop()")


def shown_until(page: Client, condition) -> dict:
    """Return what a page knows when it has been told enough."""
    known: dict = {}
    while not condition(known):
        known |= page.event()["data"]
    return known


def knob(known: dict, node: str, name: str) -> dict | None:
    """A parameter, as the page knows it."""
    for each in known.get("nodes", []):
        for parameter in each["parameters"] or []:
            if (each["name"], parameter["name"]) == (node, name):
                return parameter
    return None


def test_a_world_that_the_view_starts_is_a_node_of_the_session_and_is_controlled(kernel, page):
    page.subscribe("robot")
    assert page.event()["data"] == {
        "nodes": {"sees": [], "drives": []},
        "room": {"name": "", "walls": [], "began": 0},
        "idle": "No robot takes commands: no node subscribes to /cmd_vel.",
    }
    assert list(page.ask("robot.rooms")["result"]) == list(ROOMS)
    assert page.ask("robot.start", room="office")["result"] is None
    assert kernel.run("print(ros.nodes())") == "['/world']"
    known = shown_until(page, lambda known: (known.get("scan") or {}).get("from") and known["room"]["name"])
    assert known["room"]["name"] == "office"
    assert len(known["room"]["walls"]) == 4 * len(ROOMS["office"].segments)
    assert known["nodes"] == {"sees": ["/world"], "drives": []}
    assert known["robot"]["pose"] == pytest.approx(ROOMS["office"].start, abs=0.01)
    scan = known["scan"]
    assert (len(scan["ranges"]), scan["beams"], set(scan["sectors"])) == (360, 360, {"front", "left", "right"})
    assert scan["from"] == known["robot"]["pose"]

    assert page.ask("robot.place", x=3.0, y=3.0, heading=math.pi / 2)["result"] is None
    shown_until(page, lambda known: known.get("robot", {}).get("pose") == [3.0, 3.0, 1.5708])
    assert page.ask("robot.drop", x=3.0, y=4.0)["result"] is None
    known = shown_until(page, lambda known: known.get("room"))
    assert len(known["room"]["walls"]) == 4 * (len(ROOMS["office"].segments) + 16)
    assert "would touch an obstacle" in page.ask("robot.place", x=3.0, y=4.0, heading=0.0)["error"]
    assert "outside the room" in page.ask("robot.place", x=30.0, y=4.0, heading=0.0)["error"]
    assert "the robot stands there" in page.ask("robot.drop", x=3.0, y=3.1)["error"]
    assert "it is inside an obstacle" in page.ask("robot.drop", x=3.0, y=4.0)["error"]
    assert "it would touch a wall or an obstacle" in page.ask("robot.drop", x=3.0, y=4.2)["error"]
    for what, put in (("The robot cannot stand there", "robot.place"), ("No obstacle fits there", "robot.drop")):
        answer = page.ask(put, x=1.3, y=1.6, **({"heading": 0.0} if put == "robot.place" else {}))
        assert answer["error"] == f"{what}: it is inside an obstacle."
    assert page.ask("robot.reset")["result"] is None
    known = shown_until(page, lambda known: known.get("room"))
    assert len(known["room"]["walls"]) == 4 * len(ROOMS["office"].segments)


def test_parameters_are_set_and_followed_whoever_sets_them(kernel, page):
    page.subscribe("robot.knobs")
    kernel.run("ros.start(World)\nros.start('driver.py')")
    known = shown_until(page, lambda known: knob(known, "/my_driver", "turn") and knob(known, "/world", "paused"))
    assert knob(known, "/world", "speed")["to"] == 4.0
    assert knob(known, "/my_driver", "turn")["value"] == 0.5
    assert knob(known, "/my_driver", "label")["kind"] == "string"
    assert page.ask("robot.set", node="/my_driver", values={"turn": 1})["result"] is None  # an integer, in JavaScript
    shown_until(page, lambda known: (knob(known, "/my_driver", "turn") or {}).get("value") == 1.0)
    kernel.run("!ros2 param set /my_driver turn 0.25")
    shown_until(page, lambda known: (knob(known, "/my_driver", "turn") or {}).get("value") == 0.25)
    assert page.ask("robot.set", node="/world", values={"paused": True, "beams": 90})["result"] is None
    known = shown_until(page, lambda known: (knob(known, "/world", "paused") or {}).get("value") is True)
    assert knob(known, "/world", "beams")["value"] == 90
    refused = page.ask("robot.set", node="/world", values={"room": "nowhere"})["error"]
    assert refused.startswith("/world rejected the change: there is no room 'nowhere'")
    kernel.run("ros.restart('driver.py')")
    shown_until(page, lambda known: (knob(known, "/my_driver", "turn") or {}).get("value") == 0.5)


def test_a_drive_in_a_cell_is_seen_and_cannot_be_changed(kernel, page):
    """Also when it is over: the room is not that of a world before it."""
    page.subscribe("robot")
    kernel.run("ros.start(World, parameters={'room': 'hall'})")
    shown_until(page, lambda known: (known.get("room") or {}).get("name") == "hall")
    kernel.run(
        "from course.nodes.ai_robot_controller import AIRobotController\n"
        "world = ros.start(World, parameters={'room': 'pillars', 'fast': True})\n"
        "ros.start(AIRobotController, parameters={'use_sim_time': True})"
    )
    nodes = {"sees": ["/world"], "drives": ["/ai_robot_controller"]}
    known = shown_until(page, lambda known: known.get("nodes") == nodes and known.get("room"))
    assert known["room"]["name"] == "pillars"
    kernel.run("driven = world.node.drive(15.0, answer_within=30.0)")
    shown_until(page, lambda known: known.get("robot"))
    assert "fast mode" in page.ask("robot.place", x=3.0, y=3.0, heading=0.0)["error"]
    assert kernel.run("print(driven.missed, len(driven.collisions))") == "0 0"
    kernel.run("ros.stop('world')")
    known = shown_until(page, lambda known: known.get("nodes", nodes)["sees"] == [])
    assert "room" not in known
    kernel.run("ros.start(World, parameters={'room': 'hall'})")
    shown_until(page, lambda known: (known.get("room") or {}).get("name") == "hall")


def test_a_new_world_is_told_apart_from_the_one_before_and_a_reset_is_none(kernel, page):
    """The page no longer shows anything of a world that has ended."""
    page.subscribe("robot")
    kernel.run("ros.start(World)")
    first = shown_until(page, lambda known: known.get("world") and known["room"]["name"])["world"]
    assert page.ask("robot.reset")["result"] is None
    known = shown_until(page, lambda known: known.get("room"))
    assert "world" not in known
    kernel.run("ros.start(World)")
    assert shown_until(page, lambda known: known.get("world"))["world"] != first
    kernel.run("ros.stop('world')")
    shown_until(page, lambda known: known.get("world") == "")


def test_a_drive_that_is_over_at_once_is_shown_with_its_path(kernel, page):
    """All of it passes in one cell, between two looks of the view: the world tells it."""
    page.subscribe("robot")
    page.event()
    kernel.run(
        "from course.nodes.ai_robot_controller import AIRobotController\n"
        "world = ros.start(World, parameters={'room': 'pillars', 'fast': True})\n"
        "ros.start(AIRobotController, parameters={'use_sim_time': True})\n"
        "driven = world.node.drive(3.0, answer_within=30.0)\n"
        "heard = world.node._scan_pub.get_subscription_count()"
    )
    assert kernel.run("print(heard)") == "2"  # the driver's, and the view's, in time
    places: list = []
    last = eval(kernel.run("print([round(float(x), 2) for x in driven.path[-1, 1:3]])"))
    while not places or math.dist(places[-1][:2], last) > 0.06:
        data = page.event()["data"]
        if path := data.get("path"):
            places = (places if not path["anew"] else []) + path["places"]
    assert places[0][:2] == pytest.approx(ROOMS["pillars"].start[:2], abs=0.01)
    assert all(0.04 < math.dist(one[:2], other[:2]) < 0.2 for one, other in itertools.pairwise(places))
    assert [at for *_, at in places] == sorted({at for *_, at in places})  # s of the world's time
    page.close()  # it is loaded again, when the world publishes nothing any more
    kernel.run(
        "from course.lab.kernel import robot_listener\n"
        "ros.until(lambda: not robot_listener._listener and not world.node.simulates, 30)"
    )
    again = page_of(kernel)
    again.subscribe("robot")
    known = shown_until(again, lambda known: (known.get("path") or {}).get("places"))
    assert known["robot"]["pose"][:2] == pytest.approx(last, abs=0.01)
    again.close()


def test_all_that_is_shown_of_a_drive_in_fast_mode_is_of_one_moment(kernel, page):
    """In a twentieth of a second the robot drives farther than one sees: robot, laser, and the end of the way."""
    page.subscribe("robot")
    kernel.run(
        "from course.nodes.ai_robot_controller import AIRobotController\n"
        "world = ros.start(World, parameters={'room': 'pillars', 'fast': True})\n"
        "ros.start(AIRobotController, parameters={'use_sim_time': True})"
    )
    shown_until(page, lambda known: (known.get("room") or {}).get("name") == "pillars")
    kernel.client.execute("world.node.drive(40.0, answer_within=30.0)")
    driven, last, ahead = 0.0, [], []
    while driven < 5.0:  # m
        data = page.event()["data"]
        if pose := (data.get("robot") or {}).get("pose"):
            assert (data["robot"]["fast"], data["scan"]["from"]) == (True, pose)
            driven += math.dist(pose[:2], last[:2]) if last else 0.0
            last = pose
            if places := (data.get("path") or {}).get("places"):
                ahead.append(math.dist(places[-1][:2], pose[:2]))
    assert ahead
    assert statistics.median(ahead) < 0.1


def path_until(page: Client, condition) -> list:
    """Follow the view until the path that it draws is so."""
    places: list = []
    while not condition(places):
        if path := page.event()["data"].get("path"):
            places = ([] if path["anew"] else places) + (path["places"] or [])
    return places


def test_the_path_in_real_time_is_shown_to_a_page_that_comes_later_and_begins_where_the_robot_is_put(kernel, page):
    kernel.run(
        "import math\nfrom course.world import ROOMS\nfrom geometry_msgs.msg import Twist, Vector3\n"
        "world = ros.start(World, parameters={'room': 'hall', 'speed': 4.0}).node\n"
        "forward = ros.node.create_publisher(Twist, 'cmd_vel', 10)\n"
        "ahead = Twist(linear=Vector3(x=0.3))\n"
        "start = ROOMS['hall'].start[:2]\n"
        "assert ros.until(lambda: forward.publish(ahead) or math.dist(world.simulation.pose[:2], start) > 0.5, 30.0)"
    )
    page.subscribe("robot")
    first, *_ = path_until(page, lambda places: len(places) > 8)
    assert first[:2] == pytest.approx(ROOMS["hall"].start[:2], abs=0.01)
    page.ask("robot.place", x=6.0, y=4.0, heading=0.0)
    first, *_ = path_until(page, lambda places: places and places[-1][0] > 5.5)
    assert math.dist(first[:2], (6.0, 4.0)) < 0.7  # no line leads there
    kernel.run("ros.stop('world')\nros.start(World, parameters={'room': 'pillars'})")
    first, *_ = path_until(page, lambda places: places and places[-1][0] < 2.0)
    assert first[:2] == pytest.approx(ROOMS["pillars"].start[:2], abs=0.01)
    kernel.run("ros.node.destroy_publisher(forward)")


def test_commands_that_a_cell_publishes_with_the_sessions_own_node_are_shown(kernel, page):
    page.subscribe("robot")
    kernel.run("ros.start(World)")
    kernel.run(
        "from geometry_msgs.msg import Twist, Vector3\n"
        "forward = ros.node.create_publisher(Twist, 'cmd_vel', 10)\n"
        "timer = ros.node.create_timer(0.1, lambda: forward.publish(Twist(linear=Vector3(x=0.2))))"
    )
    shown_until(page, lambda known: known.get("command") == [0.2, 0.0])
    kernel.run("timer.cancel()")
    shown_until(page, lambda known: "command" in known and known["command"] is None)
    kernel.run("ros.node.destroy_publisher(forward)")


HIT = """import math
from geometry_msgs.msg import Twist, Vector3
from course.world.node import latest
forward = ros.node.create_publisher(Twist, 'cmd_vel', 10)
def hit():
    'Drive the robot of the world that is there into an obstacle, dropped right before it.'
    world = latest()
    x, y, heading = world.simulation.pose
    world.drop(x + 0.36 * math.cos(heading), y + 0.36 * math.sin(heading))
    ahead = Twist(linear=Vector3(x=0.3))
    return bool(ros.until(lambda: forward.publish(ahead) or world.simulation.collisions, 20))"""
# Each way in which a drive can begin: what the view asks for, or a cell.
BEGINS = {
    "reset in the view": ("robot.reset", {}),
    "another room in the view": ("robot.set", {"node": "/world", "values": {"room": "pillars"}}),
    "another world by the view": ("robot.start", {"room": "hall"}),
    "reset in a cell": "latest().reset()",
    "another room in a cell": "latest().reset('pillars')",
    "another world in a cell": "ros.start(World)",
    "restarted": "ros.restart('world')",
    "stopped and started": "ros.stop('world')\nros.start(World)",
    "in fast mode": "ros.start(World, parameters={'fast': True})",
    "reset by ros2": "!ros2 service call /world/reset std_srvs/srv/Empty",
    "another room by ros2": "!ros2 param set /world room pillars",
    "in a program of its own": "ros.stop('world')\nros.start('simulation.py')",
}
ELSEWHERE = ("in fast mode", "in a program of its own")  # where `hit` cannot drive the robot


@pytest.mark.parametrize("way", BEGINS)
def test_a_drive_begins_without_the_collisions_of_the_one_before(kernel, page, way):
    page.subscribe("robot")
    kernel.run("ros.start(World)")
    assert kernel.run(f"{HIT}\nprint(hit())") == "True"
    known = shown_until(page, lambda known: (known.get("collisions") or {}).get("count") == 1)
    assert len(known["collisions"]["places"]) == 1
    if isinstance(begin := BEGINS[way], str):
        kernel.run(begin)
    else:
        assert page.ask(begin[0], **begin[1])["result"] is None
    known = shown_until(page, lambda known: (known.get("collisions") or {}).get("count") == 0)
    assert known["collisions"] == {"count": 0, "last": "", "places": []}
    if way not in ELSEWHERE:
        assert kernel.run("print(hit())") == "True"
        shown_until(page, lambda known: (known.get("collisions") or {}).get("count") == 1)
    kernel.run("ros.node.destroy_publisher(forward)")


def test_a_new_session_begins_without_the_collisions_of_the_one_before(kernel, page):
    page.subscribe("robot")
    kernel.run("ros.start(World)")
    assert kernel.run(f"{HIT}\nprint(hit())") == "True"
    shown_until(page, lambda known: (known.get("collisions") or {}).get("count") == 1)
    kernel.run("ros.close()")
    while "error" not in page.event():
        pass
    kernel.run("ros = course.live()\nros.start(World)")
    page.subscribe("robot")
    known = shown_until(page, lambda known: known.get("scan") and (known.get("room") or {}).get("name"))
    assert "collisions" not in known  # a page begins with none


def test_a_drive_in_fast_mode_shows_its_own_collisions(kernel, page):
    page.subscribe("robot")
    kernel.run(
        "from geometry_msgs.msg import Twist, Vector3\nfrom rclpy.node import Node\n"
        "from sensor_msgs.msg import LaserScan\n"
        "class Blind(Node):\n"
        "    def __init__(self):\n"
        "        super().__init__('blind')\n"
        "        self.pub = self.create_publisher(Twist, 'cmd_vel', 10)\n"
        "        self.create_subscription(LaserScan, 'scan', self.go, 10)\n"
        "    def go(self, msg):\n"
        "        self.pub.publish(Twist(linear=Vector3(x=0.5)))\n"
        "world = ros.start(World, parameters={'fast': True})\nros.start(Blind)"
    )
    for _ in range(2):
        assert kernel.run("print(len(world.node.drive(16.0, answer_within=30.0).collisions))") == "1"
        shown_until(page, lambda known: (known.get("collisions") or {}).get("count") == 1)
        kernel.run("world.node.reset()")
        shown_until(page, lambda known: (known.get("collisions") or {}).get("count") == 0)


def test_a_scan_is_drawn_where_it_was_seen_from_while_the_robot_turns(kernel, page):
    """Its points lie on the walls, whatever the robot does: a wrong heading shows at once."""
    page.subscribe("robot")
    kernel.run("ros.start(World)\nros.start('driver.py', parameters={'turn': 9.0})")
    walls = ROOMS["hall"].segments
    known = shown_until(page, lambda known: abs(((known.get("robot") or {}).get("moves") or [0, 0])[1]) > 1.0)
    assert known["robot"]["moves"][1] == pytest.approx(Robot().max_angular)
    seen = []
    while len(seen) < 25:
        data = page.event()["data"]
        if scan := data.get("scan"):
            x, y, heading = scan["from"]  # known of each: the page leaves out a scan without it
            assert data["robot"]["pose"] == scan["from"], "robot and laser are of one moment"
            beams = [
                (heading + scan["first"] + scan["step"] * n, r / 100) for n, r in enumerate(scan["ranges"]) if r > 0
            ]
            off = [clearance((x + r * math.cos(a), y + r * math.sin(a)), walls) for a, r in beams]
            seen.append(statistics.quantiles(off, n=20)[-1])  # 19 of 20 are nearer to a wall
    assert max(seen) < 0.05, seen


def test_a_command_that_is_not_repeated_is_no_command_any_more(kernel, page):
    page.subscribe("robot")
    kernel.run("ros.start(World)\nros.start('driver.py')")
    known = shown_until(page, lambda known: known.get("command"))
    assert known["command"] == [0.0, 0.5]
    kernel.run("ros.stop('driver.py')")
    assert shown_until(page, lambda known: known.get("command", 0) is None)["command"] is None


SAYS = """import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node

rclpy.init()
node = Node('NAME')
pub = node.create_publisher(Twist, 'cmd_vel', 10)
node.create_timer(0.1, lambda: (pub.publish(Twist()), node.get_logger().info('SAID')))
rclpy.spin(node)
"""


def test_the_state_is_what_the_one_driver_logs_and_none_rather_than_a_wrong_one(kernel, page):
    for name, said in {"says": "State: WALL_AHEAD, Cmd: linear=0.00", "mute": "nothing of the kind"}.items():
        (kernel.folder / f"{name}.py").write_text(SAYS.replace("NAME", name).replace("SAID", said))
    page.subscribe("robot")
    kernel.run("ros.start(World)\nros.start('says.py')")
    shown_until(page, lambda known: known.get("state") == "WALL_AHEAD")
    kernel.run("ros.start('mute.py')")  # now two drive
    shown_until(page, lambda known: known.get("state") == "")
    kernel.run("ros.stop('says.py')")
    shown_until(page, lambda known: (known.get("nodes") or {}).get("drives") == ["/mute"])
    kernel.run("ros.stop('mute.py')")
    kernel.run("from course.nodes.ai_robot_controller import AIRobotController\nros.start(AIRobotController)")
    shown_until(page, lambda known: known.get("state") == "FORWARD")
    kernel.run("ros.stop('ai_robot_controller')")
    shown_until(page, lambda known: known.get("state") == "")


def test_only_what_a_node_publishes_is_listened_to(kernel, page):
    """A public check waits for a subscriber of its own publisher: the view must not be taken for one."""
    kernel.run("from sensor_msgs.msg import LaserScan\nbench = ros.node.create_publisher(LaserScan, 'scan', 10)")
    page.subscribe("robot")
    page.event()
    kernel.run("ros.start(World)")
    shown_until(page, lambda known: known.get("scan"))
    assert kernel.run("print(bench.get_subscription_count())") == "1"
    kernel.run("ros.stop('world')")
    shown_until(page, lambda known: known.get("nodes") == {"sees": [], "drives": []})
    assert kernel.run("print(ros.until(lambda: bench.get_subscription_count() == 0))") == "True"
    kernel.run("ros.node.destroy_publisher(bench)")


def test_a_second_page_shares_what_is_heard_and_the_last_one_ends_it(kernel, page):
    kernel.run("world = ros.start(World)")
    second = page_of(kernel)
    for each in (page, second):
        each.subscribe("robot")
        shown_until(each, lambda known: known.get("scan"))
    count = "print(world.node._scan_pub.get_subscription_count())"
    assert kernel.run(count) == "1"
    second.close()
    shown_until(page, lambda known: known.get("scan"))
    page.close()
    assert kernel.run(f"ros.until(lambda: not world.node._scan_pub.get_subscription_count(), 30)\n{count}") == "0"


def test_a_session_that_ends_is_told_and_a_new_one_is_seen(kernel, page):
    kernel.run("ros.start(World)")
    number = page.subscribe("robot")
    shown_until(page, lambda known: known.get("scan"))
    kernel.run("ros.close()")
    while "error" not in (event := page.event()):
        pass
    assert event["id"] == number and "ros = course.live()" in event["error"]
    kernel.run("ros = course.live()\nros.start(World)")
    page.subscribe("robot")
    shown_until(page, lambda known: known.get("scan"))


COMMANDS = """from geometry_msgs.msg import Twist
commands = []
ears = ros.node.create_subscription(Twist, 'cmd_vel', commands.append, 10)"""


def odometry_until(page: Client, condition) -> None:
    """Follow the view until the robot's speeds (m/s, rad/s) are so."""
    shown_until(page, lambda known: (moves := (known.get("robot") or {}).get("moves")) and condition(*moves))


def test_the_pad_drives_until_it_is_no_longer_renewed_and_leaves_no_publisher(kernel, page):
    page.subscribe("robot")
    assert "no node subscribes to /cmd_vel" in page.ask("robot.drive", linear=0.3, angular=0.0)["error"]
    kernel.run(f"world = ros.start(World)\n{COMMANDS}")
    shown_until(page, lambda known: known.get("idle") == "" and known.get("robot"))
    while (moves := (page.event()["data"].get("robot") or {}).get("moves")) != [0.3, 0.5]:
        assert page.ask("robot.drive", linear=0.3, angular=0.5)["result"] is None, moves
    # Nobody renews it any more: a command to stop comes, before the world would stop by itself.
    odometry_until(page, lambda linear, angular: (linear, angular) == (0.0, 0.0))
    assert kernel.run("print(commands[0].linear.x, commands[-1].linear.x, commands[-1].angular.z)") == "0.3 0.0 0.0"
    assert kernel.run("print(ros.until(lambda: not ros.node.count_publishers('/cmd_vel')))") == "True"

    assert page.ask("robot.drive", linear=9.0, angular=0.0)["result"] is None  # no faster than the robot can
    odometry_until(page, lambda linear, angular: linear == Robot().max_linear)
    assert page.ask("robot.drive", linear=0.0, angular=0.0)["result"] is None
    odometry_until(page, lambda linear, angular: linear == 0.0)
    kernel.run("ros.node.destroy_subscription(ears)")


def test_a_page_that_is_half_a_second_late_drives_without_a_stop(kernel, page):
    kernel.run(f"world = ros.start(World)\n{COMMANDS}")
    page.subscribe("robot")
    shown_until(page, lambda known: known.get("nodes") and known.get("idle", "") == "")
    kernel.run(
        "import time\ntimes = []\n"
        "watch = ros.node.create_subscription(Twist, 'cmd_vel', lambda message: times.append(time.monotonic()), 10)"
    )
    page.ask("robot.drive", linear=0.3, angular=0.0)
    assert kernel.run("print(ros.until(lambda: commands and commands[-1].linear.x == 0.0))") == "True"
    assert float(kernel.run("print(times[-1] - times[0])")) > 0.5
    kernel.run("removed = [ros.node.destroy_subscription(each) for each in (watch, ears)]")


def test_a_page_that_is_lost_while_it_drives_stops_the_robot(kernel, page):
    kernel.run(f"world = ros.start(World)\n{COMMANDS}")
    other = page_of(kernel)
    page.subscribe("robot", page="one")
    other.subscribe("robot", page="other")
    shown_until(page, lambda known: known.get("nodes") and known.get("idle", "") == "")

    def drive_until(told: str, to: Client, **pages: Client) -> None:
        """Drive from these pages until one page is told so who drives."""
        hand = None
        while hand != told:
            for name, each in pages.items():
                each.ask("robot.drive", linear=0.3, angular=0.9, page=name)  # again where it is refused at first
            hand = to.event()["data"].get("hand", hand)

    drive_until("another page", page, other=other)
    odometry_until(page, lambda linear, angular: linear == 0.3)
    drive_until("you", other, other=other)
    for each in (page, other):
        drive_until("you and another page", each, one=page, other=other)
    assert other.ask("robot.drive", linear=0.0, angular=0.0, page="other")["result"] is None
    drive_until("you", page, one=page)
    drive_until("another page", page, other=other)
    other.close()
    odometry_until(page, lambda linear, angular: linear == 0.0)
    assert kernel.run("print(commands[-1].linear.x)\nremoved = ros.node.destroy_subscription(ears)") == "0.0"


COMMANDS_OF_A_CELL = """from geometry_msgs.msg import Twist
mine = ros.node.create_publisher(Twist, 'cmd_vel', 10)
often = ros.node.create_timer(0.05, lambda: mine.publish(Twist()))"""
DRIVEN_BY = {
    "a node": ("ros.start('driver.py')", "/my_driver drives now", "ros.stop('driver.py')"),
    "a cell": (
        COMMANDS_OF_A_CELL,
        "A cell of the notebook drives now",
        "ros.node.destroy_timer(often)\nros.node.destroy_publisher(mine)",
    ),
}


@pytest.mark.parametrize("who", DRIVEN_BY)
def test_the_pad_says_who_drives_and_keeps_out_of_it(kernel, page, who):
    begin, told, end = DRIVEN_BY[who]
    page.subscribe("robot")
    kernel.run(f"ros.start(World)\n{begin}")
    known = shown_until(page, lambda known: told in known.get("idle", "") and (known.get("nodes") or {}).get("drives"))
    assert known["nodes"]["drives"] == [told.removesuffix(" drives now").replace("A ", "a ")]
    assert told in page.ask("robot.drive", linear=0.3, angular=0.0)["error"]
    kernel.run(end)
    shown_until(page, lambda known: known.get("idle") == "")


def test_what_the_inspector_publishes_drives_until_it_has_ended(kernel, page):
    kernel.run("ros.start(World)")
    sent = {"kind": "topic", "name": "/cmd_vel", "type_name": "geometry_msgs/msg/Twist", "given": {}, "rate": "20"}
    number = page.ask("inspector.send", **sent)["result"]
    sending, robot = page.subscribe("inspector.exchange", number=number), page.subscribe("robot")
    known: dict = {}

    def follow(condition):
        while not condition():
            if (event := page.event())["id"] == robot:
                known.update(event["data"])

    follow(lambda: known.get("idle") and (known.get("nodes") or {}).get("drives"))
    assert known["idle"] == "The Inspector drives now. Stop it to drive yourself."
    assert known["nodes"]["drives"] == ["the Inspector"]
    assert page.ask("inspector.cancel", number=number)["result"] is None
    follow(lambda: known["idle"] == "" and known["nodes"]["drives"] == [] and not known.get("silent"))
    assert kernel.run("print(ros.until(lambda: not ros.node.count_publishers('/cmd_vel')))") == "True"
    page.ask("unsubscribe", id=sending)


def test_one_who_sends_no_commands_any_more_does_not_drive_and_is_told(kernel, page):
    quiet = kernel.folder / "quiet"
    look = f"if os.path.exists({str(quiet)!r}):\n            return\n        command = Twist()"
    (kernel.folder / "moody.py").write_text("import os\n" + DRIVER.replace("command = Twist()", look))
    page.subscribe("robot")
    kernel.run("ros.start(World)\nros.start('moody.py')")
    known = shown_until(page, lambda known: "/my_driver drives now" in known.get("idle", ""))
    known |= shown_until(page, lambda new: "/my_driver" in (known | new).get("nodes", {}).get("drives", []))
    assert "silent" not in known
    quiet.touch()
    known = shown_until(page, lambda known: known.get("silent") == ["/my_driver"] and known.get("idle") == "")
    assert known["nodes"] == {"sees": ["/world"], "drives": []}
    while (moves := (page.event()["data"].get("robot") or {}).get("moves")) != [0.3, 0.5]:  # and so one may drive
        assert page.ask("robot.drive", linear=0.3, angular=0.5)["result"] is None, moves
    known = shown_until(page, lambda known: known.get("hand") == "")
    assert known.get("idle", "") == "" and "silent" not in known
    quiet.unlink()
    known = shown_until(page, lambda known: "/my_driver drives now" in known.get("idle", ""))
    assert known["silent"] == [] and known["nodes"]["drives"] == ["/my_driver"]


def test_a_node_that_drives_in_fast_mode_is_not_what_keeps_one_from_driving():
    listener = SimpleNamespace(takes={driving.TYPE}, commanders=["/my_driver"], silent=False, fast_world=lambda: True)
    assert "To drive yourself, start a world in real time." in driving.reason(listener)
    listener.fast_world = lambda: None
    assert driving.reason(listener) == "/my_driver drives now. Stop it to drive yourself."


def test_the_pad_keeps_out_of_fast_mode_and_of_another_type(kernel, page):
    page.subscribe("robot")
    kernel.run("ros.start(World, parameters={'fast': True})")
    # While somebody drives, the view listens to the commands, and the kernel can subscribe to no other type of them.
    shown_until(page, lambda known: "fast mode" in known.get("idle", "") and not known["nodes"]["drives"])
    kernel.run(
        "ros.stop()\nfrom geometry_msgs.msg import TwistStamped\nfrom rclpy.node import Node\n"
        "class Stamped(Node):\n"
        "    def __init__(self):\n"
        "        super().__init__('stamped')\n"
        "        self.create_subscription(TwistStamped, 'cmd_vel', print, 10)\n"
        "ros.start(Stamped)"
    )
    shown_until(page, lambda known: "takes geometry_msgs/msg/TwistStamped" in known.get("idle", ""))


@pytest.mark.parametrize("number", [1e308, -1e308, math.inf, -math.inf, math.nan])
def test_numbers_without_measure_that_somebody_publishes_are_drawn_or_left_out(number):
    """Any node in the domain can publish them; they must not take the view away."""
    turned, moving, scan = Odometry(), Odometry(), LaserScan(angle_max=1.0, angle_increment=0.1, range_max=math.inf)
    turned.pose.pose.position.x = turned.pose.pose.orientation.y = turned.pose.pose.orientation.z = number
    moving.pose.pose.orientation.w = 1.0
    moving.twist.twist.linear.x = moving.twist.twist.angular.z = number
    scan.header.stamp.sec = 1
    in_scans = max(-3e38, min(number, 3e38)) if math.isfinite(number) else number  # which have 32 bits
    scan.ranges = [in_scans, 1.0]
    for odometry in (turned, moving):
        heard = object.__new__(RobotListener)
        heard._last = {"/odom": serialize_message(odometry), "/scan": serialize_message(scan)}
        heard._poses = [heard._last["/odom"]]
        drawn = json.loads(json.dumps([heard.scan(), heard.robot()], allow_nan=False))
        assert drawn[0]["ranges"][1] == 100
    for wide in ("angle_min", "angle_increment", "range_min", "range_max"):
        setattr(scan, wide, in_scans)
        heard._last["/scan"] = serialize_message(scan)
        json.dumps(heard.scan(), allow_nan=False)


@pytest.mark.parametrize("far", [1e7, -1e17, 1e308])
def test_a_place_where_no_room_can_be_is_left_out_and_a_distance_is_bounded(far):
    """The picture could not show it, and a page counts its lines."""
    heard = object.__new__(RobotListener)
    scan = LaserScan(angle_increment=0.1, range_max=abs(min(far, 3e38)))
    odometry, marker = Odometry(), Marker(text="far")
    odometry.pose.pose.orientation.w = scan.range_min = 1.0
    odometry.pose.pose.position.y = far
    scan.ranges = [scan.range_max]
    marker.points = [Point(x=x, y=y) for x, y in ((0.0, 0.0), (1.0, 0.0), (0.0, far), (1.0, 0.0))]
    read = {"/odom": odometry, "/walls": marker, "/scan": scan}
    heard._last = {topic: serialize_message(message) for topic, message in read.items()}
    heard._poses, heard._fast, heard.fast_world = [heard._last["/odom"]], None, lambda: None
    assert heard.robot()["pose"] is None
    assert heard.walls()[1:] == ("far", [0.0, 0.0, 1.0, 0.0])
    seen = heard.scan()
    assert (seen["from"], seen["reach"], seen["sectors"]["front"]) == (None, FARTHEST, FARTHEST)
    odometry.pose.pose.position.y, odometry.twist.twist.linear.x = FARTHEST, 1e300  # and moves on until the scan
    scan.header.stamp.sec = 1
    heard._last |= {"/odom": serialize_message(odometry), "/scan": serialize_message(scan)}
    heard._poses = [heard._last["/odom"]]
    assert heard.robot()["pose"] == [0.0, FARTHEST, 0.0]
    assert heard.scan()["from"] is None


@pytest.mark.parametrize("number", [math.inf, -math.inf, math.nan])
def test_a_range_that_is_no_number_is_none_for_a_slider(number):
    wide = FloatingPointRange(from_value=number, to_value=number, step=number)
    descriptor = ParameterDescriptor(name="gain", floating_point_range=[wide])
    shown = knobs._shown(descriptor, ParameterValue(type=3, double_value=number))
    assert [shown[name] for name in ("value", "from", "to", "step")] == 4 * [None]


def test_a_parameter_that_changes_its_type_is_read_again():
    """Its node may declare it so; a program may also only say so."""
    feed, source = knobs.KnobsFeed(), ("/node", (1,))
    gain = knobs._shown(ParameterDescriptor(name="gain"), ParameterValue(type=3, double_value=0.5))
    feed._known[source] = {"gain": gain}

    def hear(**value):
        changed = [Parameter(name="gain", value=ParameterValue(**value))]
        feed._hear(serialize_message(ParameterEvent(node="/node", changed_parameters=changed)))

    hear(type=3, double_value=0.75)
    assert feed._known[source]["gain"]["value"] == 0.75
    hear(type=4, string_value="a text")
    assert feed._known == {} and gain["value"] == 0.75


GAIN = knobs._shown(ParameterDescriptor(name="gain"), ParameterValue(type=3, double_value=0.5))


@pytest.fixture
def listener(monkeypatch):
    """A listener of a session that hears nothing, and whom the knobs take."""

    class Node:
        def create_subscription(self, *_, **__):
            return None

    listener = object.__new__(RobotListener)
    listener.look, listener.live = lambda: None, SimpleNamespace(ok=True, node=Node())
    monkeypatch.setattr(knobs, "open_listener", lambda user: listener)
    return listener


def test_an_answer_that_cannot_be_read_hides_no_other_node(listener, monkeypatch):
    listener.publishers = {"/scan": (("/bad", (1,)), ("/good", (2,))), "/cmd_vel": ()}
    monkeypatch.setattr(knobs, "_read", lambda listener, name: {"/good": {"gain": GAIN}}[name])
    told = [{"name": "/bad", "parameters": None}, {"name": "/good", "parameters": [GAIN]}]
    assert knobs.KnobsFeed().read() == {"nodes": told}
    listener.live.ok = False
    with pytest.raises(KeyError):
        knobs.KnobsFeed().read()


def test_the_parameters_of_all_nodes_together_are_bounded(listener, monkeypatch):
    listener.publishers = {"/scan": tuple((f"/{number}", (number,)) for number in range(30)), "/cmd_vel": ()}
    many = {str(number): GAIN | {"name": str(number), "about": 1000 * "é"} for number in range(knobs.SHOWN)}
    monkeypatch.setattr(knobs, "_read", lambda listener, name: many)
    sent = knobs.KnobsFeed().read()
    assert len(protocol.encoded(sent)) < 1.1 * knobs.MOST
    assert [len(node["parameters"]) for node in sent["nodes"][:3]] == 3 * [knobs.SHOWN]
