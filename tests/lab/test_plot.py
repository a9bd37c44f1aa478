"""The plot, from the kernel's side: which fields there are, and what comes of one."""

import pytest
from sensor_msgs.msg import LaserScan
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from course.errors import LiveError
from course.lab.kernel import plot

NODE = """from geometry_msgs.msg import Twist, Vector3
from rclpy.node import Node
from sensor_msgs.msg import JointState
class Wheels(Node):
    def __init__(self):
        super().__init__('wheels')
        self.effort = self.create_publisher(JointState, 'joint_states', 10)
        self.create_timer(0.02, self.tell)
    def tell(self):
        self.effort.publish(JointState(name=['left', 'right'], effort=[1.5, float('nan')]))"""


def points_of(page, wanted: int) -> list:
    """The points that a plot is told, so many of them at least, without the gaps between them."""
    points: list = []
    while len(points) < wanted:
        points += filter(None, page.event()["data"]["points"])
    return points


def test_every_number_of_a_type_is_a_field():
    assert plot.fields("geometry_msgs/msg/Twist") == [
        f"{kind}.{axis}" for kind in ("linear", "angular") for axis in "xyz"
    ]
    scan = plot.fields("sensor_msgs/msg/LaserScan")
    assert {"range_max", "ranges[0]", "header.stamp.sec"} <= set(scan)
    assert "header.frame_id" not in scan
    assert plot.fields("std_msgs/msg/Bool") == ["data"]
    assert "points[0].x" in plot.fields("visualization_msgs/msg/Marker")
    with pytest.raises(LiveError, match="linear.x or ranges"):
        plot.parts_of("ranges[-1]")


def test_the_topics_that_are_published_are_offered(kernel, page):
    kernel.run(f"{NODE}\nros.start(Wheels)")
    page.subscribe("plot.topics")
    while ["/joint_states", "sensor_msgs/msg/JointState"] not in page.event()["data"]:
        pass


def test_commands_are_offered_before_somebody_drives_and_drawn_while_one_drives_by_hand(kernel, page):
    kernel.run("ros.stop()\nfrom course.world.node import World\nros.start(World)")
    page.subscribe("plot.topics")
    while ["/cmd_vel", "geometry_msgs/msg/Twist"] not in page.event()["data"]:
        pass
    page.subscribe("robot")
    page.subscribe("plot", name="/cmd_vel", field="linear.x")
    points: list = []
    while not points:
        page.ask("robot.drive", linear=0.2, angular=0.0)
        data = page.event()["data"]
        points = [value for _, value in filter(None, data.get("points", []))] if isinstance(data, dict) else []
    assert points[0] == 0.2


@pytest.mark.parametrize(
    ("field", "said"),
    [
        ("ranges[359]", ""),
        ("ranges[360]", "ranges ends at ranges[359]"),
        ("intensities[0]", "intensities is empty"),
        ("header.stamp.sec", ""),
    ],
)
def test_a_list_that_is_too_short_is_told(field, said):
    assert plot.end_of_list(LaserScan(ranges=[1.0] * 360), plot.parts_of(field)) == said


def test_a_list_within_a_list_that_is_too_short_is_told():
    trajectory = JointTrajectory(points=[JointTrajectoryPoint(positions=[1.0, 2.0])])
    for field, said in (
        ("points[0].positions[1]", ""),
        ("points[0].positions[2]", "points[0].positions ends at points[0].positions[1]"),
        ("points[1].positions[0]", "points ends at points[0]"),
    ):
        assert plot.end_of_list(trajectory, plot.parts_of(field)) == said


@pytest.mark.parametrize(
    ("field", "value", "says"),
    [
        ("effort[0]", 1.5, ""),
        ("effort[1]", None, ""),
        ("effort[7]", None, "In the last message, effort ends at effort[1]."),
    ],
)
def test_each_value_of_a_field_comes_with_its_time(kernel, page, field, value, says):
    """It is the time of the plot's clock: after a world's end this goes on from where the world was."""
    kernel.run(f"{NODE}\nros.start(Wheels)\nfrom course.lab.kernel.plot_clock import CLOCK\nbegan = CLOCK.now()")
    page.subscribe("plot", name="/joint_states", field=field)
    points, said = [], None
    while len(points) < 5:
        data = page.event()["data"]
        points += filter(None, data["points"])
        said = data["says"]
    assert {told for _, told in points} == {value}
    assert said == says
    times = [at for at, _ in points]
    assert times == sorted(times)
    assert kernel.run(f"print(began <= {times[-1]} <= CLOCK.now())") == "True"


def test_a_plot_says_when_nobody_publishes_and_goes_on_when_somebody_does(kernel, page):
    """It listens only to what nodes publish: a public check must not take it for the subscriber that it waits for."""
    kernel.run(f"ros.stop()\n{NODE}\nbench = ros.node.create_publisher(JointState, 'joint_states', 10)")
    page.subscribe("plot", name="/joint_states", field="effort[0]")
    data = page.event()["data"]
    says = "Only cells or the Inspector publish on /joint_states now, and the plot draws what nodes publish."
    assert (data["points"], data["says"]) == ([], says)
    assert kernel.run("print(bench.get_subscription_count())") == "0"
    kernel.run("ros.start(Wheels)")
    points_of(page, 3)
    page.close()
    assert kernel.run("print(ros.until(lambda: not bench.get_subscription_count()))") == "True"
    kernel.run("ros.node.destroy_publisher(bench)")


def test_what_was_published_before_the_plot_came_is_drawn_where_its_publisher_keeps_it(kernel, page):
    """Not where another publisher keeps nothing: such a subscription would not hear that one."""
    kernel.run("ros.stop()\nfrom course.world.node import World\nros.start(World, parameters={'room': 'office'})")
    page.subscribe("plot", name="/walls", field="points[1].x")
    assert [value for _, value in points_of(page, 1)] == [9.0]
    kernel.run(
        f"""{NODE}
from geometry_msgs.msg import Point
from rclpy.qos import QoSProfile, ReliabilityPolicy
from visualization_msgs.msg import Marker
wheels = ros.start(Wheels).node
other = wheels.create_publisher(Marker, '/walls', QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT))
told = wheels.create_timer(0.02, lambda: other.publish(Marker(points=[Point(), Point(x=-3.0)])))"""
    )
    while -3.0 not in [value for _, value in points_of(page, 1)]:
        pass


def test_the_slope_of_a_position_is_the_speed_while_a_world_runs_four_times_as_fast(kernel, page):
    """The time is the simulation's: in a pause it stands still, and after the world's end the wall clock goes on."""
    kernel.run(
        """from course.world.node import World
from geometry_msgs.msg import Twist
world = ros.start(World, parameters={'room': 'hall', 'speed': 4.0}).node
hand = ros.node.create_publisher(Twist, 'cmd_vel', 10)
command = Twist()
command.linear.x = 0.2
timer = ros.node.create_timer(0.05, lambda: hand.publish(command))"""
    )
    page.subscribe("plot", name="/odom", field="pose.pose.position.x")
    clock, points = {}, []
    while len(moved := [each for each in points if 1.2 < each[1] < 3.0]) < 8:
        data = page.event()["data"]
        clock, points = data["clock"], points + [each for each in data["points"] if each]
    assert clock["simulated"] and clock["rate"] == 4.0
    (begin, x), (end, to_x) = moved[0], moved[-1]
    slope = (to_x - x) / (end - begin)
    heading = kernel.run("import math; print(math.cos(world.simulation.pose[2]))")
    assert slope / float(heading) == pytest.approx(0.2, rel=0.2)
    kernel.run("from rclpy.parameter import Parameter\nworld.set_parameters([Parameter('paused', value=True)])")
    while (paused := page.event()["data"]["clock"])["simulated"] and paused["rate"]:
        pass
    assert paused["simulated"]
    points_of(page, 4)  # the last move is over
    paused = page.event()["data"]["clock"]
    points_of(page, 4)
    assert page.event()["data"]["clock"] == paused
    kernel.run("timer.cancel(); ros.node.destroy_publisher(hand); ros.stop()")
    while (told := page.event()["data"]["clock"])["simulated"]:
        pass
    assert told["now"] >= clock["now"] and told["rate"] == 1.0


@pytest.mark.parametrize(
    ("distances", "gaps"),
    [
        ([0.1] * 5 + [4.0] + [0.1] * 5, [5]),  # s
        ([0.1] * 5 + [0.3] * 5, []),
        ([2.0] * 5 + [8.0, 2.0, 2.0, 12.0], [8]),
        ([0.002] * 9 + [0.1, 0.002], []),  # a hiccup
        ([0.001, 3.0, 3.0, 3.0], []),  # too few before
        ([0.1] * 9 + [1.0] * 9, [9, 10, 11]),  # from now on it comes more seldom
        ([0.1] * 9 + [3.0, 0.1, 0.1, 3.0], [9, 12]),
    ],
)
def test_a_much_longer_distance_than_the_usual_one_is_a_gap(distances, gaps):
    rhythm, at = plot.Rhythm(), 1e9
    assert not rhythm.breaks(at)
    found = []
    for number, distance in enumerate(distances):
        at += distance
        found += [number] if rhythm.breaks(at) else []
    assert found == gaps


def test_a_time_in_which_nobody_publishes_is_a_gap(kernel, page):
    kernel.run(f"ros.stop()\n{NODE}\nros.start(Wheels)")
    page.subscribe("plot", name="/joint_states", field="effort[0]")
    points_of(page, 3)
    kernel.run("ros.stop()")
    while not (data := page.event()["data"])["says"]:
        pass
    assert data["points"][-1] is None
    kernel.run("ros.start(Wheels)")
    points_of(page, 3)


def test_a_flood_is_thinned_and_a_wrong_field_is_told(kernel, page):
    kernel.run(f"{NODE}\nnode = ros.start(Wheels).node")
    page.subscribe("plot", name="/joint_states", field="effort[0]")
    points_of(page, 1)
    kernel.run("for _ in range(1500): node.tell()")
    assert max(len(page.event()["data"]["points"]) for _ in range(5)) <= plot.POINTS
    answer = page.ask("subscribe", topic="plot", options={"name": "/joint_states", "field": "effort.0"})
    assert "is not a field" in answer["error"]


@pytest.mark.parametrize("field", ["torque[0]", "effort", "name[0]", "header", "header.stamp", "effort[0].x"])
def test_a_field_that_the_type_does_not_have_is_told(kernel, page, field):
    kernel.run(f"{NODE}\nros.start(Wheels)")
    page.subscribe("plot", name="/joint_states", field=field)
    assert page.event()["error"] == f"/joint_states has no number {field}: choose a field from the list."
