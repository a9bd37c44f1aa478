"""The world measures, moves and stops as its documentation says; a drive in lockstep repeats itself."""

import contextlib
import json
import math
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

from course.environment import prepare
from course.errors import WorldError
from course.foundation import waiting
from course.robot.agent import ObstacleAvoidanceAI
from course.robot.sectors import sectors
from course.session.domains import claim_domain
from course.world import ROOMS, Laser, Robot, Room, Simulation, find, load
from course.world.geometry import RayCaster, box, circle, clearance, polyline
from course.world.simulation import advance

INF = float("inf")
QUIET = Laser(noise=0.0)


def cast_one_by_one(segments, origin, angles):
    """The textbook's ray and segment intersection, to hold the vectorised one against."""
    nearest = []
    for angle in angles:
        direction, best = np.array([math.cos(angle), math.sin(angle)]), INF
        for p, q in segments:
            along, offset = q - p, p - origin
            cross = direction[0] * along[1] - direction[1] * along[0]
            if abs(cross) < 1e-14:
                continue
            distance = (offset[0] * along[1] - offset[1] * along[0]) / cross
            share = (offset[0] * direction[1] - offset[1] * direction[0]) / cross
            if distance > 0.0 and -1e-9 <= share <= 1.0 + 1e-9:
                best = min(best, distance)
        nearest.append(best)
    return np.array(nearest)


# Geometry and laser


@pytest.mark.parametrize("name", ROOMS)
def test_beams_agree_with_the_textbook(name):
    segments = ROOMS[name].segments
    angles = np.radians(np.arange(0.0, 360.0, 7.0)) + 0.01
    for origin in (np.array(ROOMS[name].start[:2]), np.array([7.3, 5.2])):
        np.testing.assert_allclose(
            RayCaster(segments).distances(origin, angles), cast_one_by_one(segments, origin, angles)
        )


def test_no_beam_slips_out_through_a_corner():
    caster = RayCaster(box(-1.0, -1.0, 1.0, 1.0))
    corners = np.radians([45.0, 135.0, 225.0, 315.0])
    np.testing.assert_allclose(caster.distances((0.0, 0.0), corners), math.sqrt(2.0))
    assert np.isfinite(RayCaster(circle(0.0, 0.0, 1.0)).distances((0.0, 0.0), np.linspace(0, 7, 5000))).all()


def test_a_beam_that_meets_nothing_has_no_distance():
    wall = polyline([(1.0, -1.0), (1.0, 1.0)])
    assert RayCaster(wall).distances((0.0, 0.0), np.array([0.0, math.pi])).tolist() == [1.0, INF]
    assert RayCaster(np.empty((0, 2, 2))).distances((0.0, 0.0), np.zeros(3)).tolist() == [INF] * 3


def test_clearance_is_the_distance_to_the_nearest_point():
    wall = polyline([(0.0, 0.0), (2.0, 0.0)])
    assert clearance((1.0, 0.5), wall) == pytest.approx(0.5)
    assert clearance((-3.0, 4.0), wall) == pytest.approx(5.0)
    assert clearance((0.0, 0.0), np.empty((0, 2, 2))) == INF


def test_scan_turns_with_the_robot_and_starts_at_angle_min():
    wall = Room.from_data({"walls": [[[2.0, -9.0], [2.0, 9.0]]], "start": [0.0, 0.0, math.pi / 2]})
    ranges = Simulation(wall, Laser(noise=0.0, range_max=5.0)).scan()
    assert ranges[270] == pytest.approx(2.0) and ranges[0] == INF and ranges.dtype == np.float32
    ranges = Simulation(wall, Laser.turn(720, -math.pi, noise=0.0)).scan()
    assert ranges[180] == pytest.approx(2.0) and len(ranges) == 720


def test_limits_read_as_rep_117_says():
    near = Room.from_data({"boxes": [[0.0, -0.3, 9.0, 0.3]], "start": [0.5, 0.0, 0.0]})
    ranges = Simulation(near, Laser(noise=0.0, range_min=0.4, range_max=3.0)).scan()
    assert ranges[0] == INF and ranges[90] == -INF and ranges[180] == pytest.approx(0.5)


def test_noise_is_what_the_laser_says_and_the_seed_repeats_it():
    scans = [Simulation("hall", Laser(noise=0.05, range_max=20.0), seed=seed).scan() for seed in (1, 1, 2)]
    assert np.array_equal(scans[0], scans[1]) and not np.array_equal(scans[0], scans[2])
    error = scans[0] - Simulation("hall", Laser(noise=0.0, range_max=20.0)).scan()
    assert 0.04 < np.std(error) < 0.06 and abs(np.mean(error)) < 0.01


# Robot


def test_robot_drives_straight_and_in_arcs():
    assert advance((0.0, 0.0, 0.0), 0.5, 0.0, 2.0) == pytest.approx((1.0, 0.0, 0.0))
    assert advance((0.0, 0.0, 0.0), math.pi / 2, math.pi / 2, 1.0) == pytest.approx((1.0, 1.0, math.pi / 2))
    assert advance((1.0, 1.0, 3.0), 0.0, 1.0, 1.0) == pytest.approx((1.0, 1.0, 4.0 - 2 * math.pi))


@pytest.mark.parametrize("command, speeds", [((9.0, -9.0), (0.5, -2.0)), ((-9.0, 9.0), (-0.5, 2.0)),
                                             ((math.nan, 0.1), (0.0, 0.0)), ((0.1, INF), (0.0, 0.0))])  # fmt: skip
def test_commands_beyond_the_robot_are_limited(command, speeds):
    assert Robot().limit(*command) == speeds


def test_robot_stops_at_a_wall_says_so_once_and_can_drive_away():
    simulation = Simulation(Room.from_data({"boxes": [[0.0, 0.0, 4.0, 2.0]], "start": [3.0, 1.0, 0.0]}), QUIET)
    hits = [simulation.step(0.5, 0.0, 0.1) for _ in range(30)]
    assert sum(hit is not None for hit in hits) == 1 == len(simulation.collisions)
    assert simulation.pose[0] == pytest.approx(4.0 - 0.18, abs=0.006)
    assert simulation.velocity[0] == 0.0
    assert "hit an obstacle" in str(simulation.collisions[0])
    assert simulation.step(0.0, 1.0, 0.1) is None  # turning on the spot is possible, and no new collision
    assert simulation.pose[2] == pytest.approx(0.1)
    assert simulation.step(0.3, 0.0, 0.1) is None
    for _ in range(5):
        simulation.step(-0.5, 0.0, 0.1)
    assert simulation.pose[0] < 3.7 and not simulation.touching
    assert any(simulation.step(0.5, 0.0, 0.1) for _ in range(10)) and len(simulation.collisions) == 2


def test_path_and_ground_covered_tell_where_it_was():
    simulation = Simulation("hall", QUIET)
    for _ in range(50):
        simulation.step(0.5, 0.0, 0.1)
    assert simulation.path.shape == (51, 4) and simulation.path[-1, 0] == pytest.approx(5.0)
    assert simulation.distance == pytest.approx(2.5)
    assert 1.0 < simulation.ground_covered() < 2.5
    simulation.reset()
    assert simulation.distance == 0.0 and simulation.path.shape == (1, 4)


def test_the_robot_is_placed_where_it_can_stand_and_an_obstacle_lasts_until_a_reset():
    simulation = Simulation("hall", QUIET)
    simulation.place((4.0, 3.0, math.pi))
    assert simulation.pose == pytest.approx((4.0, 3.0, math.pi)) and simulation.velocity == (0.0, 0.0)
    assert simulation.scan()[0] == pytest.approx(4.0)
    simulation.drop(3.0, 3.0)
    assert simulation.scan()[0] == pytest.approx(0.85, abs=0.01)
    for pose, why in (
        ((3.3, 3.0, 0.0), "touch an obstacle"),
        ((9.0, 3.0, 0.0), "outside the room"),
        ((math.nan, 3.0, 0.0), "finite"),
    ):
        with pytest.raises(ValueError, match=why):
            simulation.place(pose)
    with pytest.raises(ValueError, match="the robot stands there"):
        simulation.drop(4.3, 3.0)
    assert simulation.pose == pytest.approx((4.0, 3.0, math.pi))
    assert len(ROOMS["hall"].segments) == 4, "the room itself was changed"


HOUSE = Room.from_data(  # a room in a house; a block and a wall in front of it; a desk that touches the other's corner
    {
        "boxes": [[-1, -1, 11, 7], [0, 0, 10, 6], [4, 2, 6, 4], [6, 4, 7, 5]],
        "polygons": [[[7, 0], [10, 0], [10, 3]]],
        "walls": [[[3.2, 2], [3.2, 4]], [[8, 4], [9, 4], [9, 5], [8, 5]]],
        "start": [1, 1, 0],
    }
)


@pytest.mark.parametrize(
    ("x", "y", "why"),
    [
        (5.0, 3.0, "inside an obstacle"),
        (6.5, 4.5, "inside an obstacle"),
        (9.0, 1.0, "inside an obstacle"),  # outside of the slanted wall
        (-0.5, 3.0, "outside the room"),  # between the room and the house around it
        (3.6, 3.0, ""),  # between a wall and the block
        (8.5, 4.5, ""),  # between walls that leave a way in
        (7.4, 3.0, ""),
        (2.0, 5.0, ""),
    ],
)
def test_neither_a_robot_nor_an_obstacle_is_put_where_closed_walls_keep_the_robot_away(x, y, why):
    simulation = Simulation(HOUSE, QUIET)
    for put in (lambda: simulation.place((x, y, 0.0)), lambda: simulation.drop(x, y, 0.05)):
        if why:
            with pytest.raises(WorldError, match=why):
                put()
        else:
            put()
            simulation.place((1.0, 1.0, 0.0))


@pytest.mark.parametrize(
    ("x", "why"),
    [
        (4.0, "it is inside an obstacle"),  # on another one
        (4.1, "it is inside an obstacle"),
        (4.28, "it would touch a wall or an obstacle"),
        (4.31, ""),  # beside it
        (0.02, "it would touch a wall or an obstacle"),  # half outside of the room
        (0.15, ""),  # at the wall
        (-0.02, "it is outside the room"),
    ],
)
def test_an_obstacle_stands_apart_from_walls_and_other_obstacles(x, why):
    simulation = Simulation("hall", QUIET)
    simulation.drop(4.0, 3.0)
    if why:
        with pytest.raises(WorldError, match=f"no obstacle fits at x={x:.2f} m, y=3.00 m: {why}"):
            simulation.drop(x, 3.0)
    else:
        simulation.drop(x, 3.0)


# Rooms


@pytest.mark.parametrize("name", ROOMS)
@pytest.mark.parametrize("seed", [0, 1])
def test_the_chapters_agent_drives_every_room_without_a_collision(name, seed):
    simulation, agent = Simulation(name, seed=seed), ObstacleAvoidanceAI()
    laser = simulation.laser
    for _ in range(600):
        seen = sectors(simulation.scan(), laser.angle_min, laser.angle_increment, laser.range_min, laser.range_max)
        action = agent.decide_action(seen)
        simulation.step(action["linear"], action["angular"], 0.1)
    assert simulation.collisions == [] and simulation.distance > 10.0 and simulation.ground_covered() > 5.0


@pytest.mark.parametrize("name", ROOMS)
def test_a_robot_that_only_drives_forward_hits_something_in_every_room(name):
    simulation = Simulation(name)
    for _ in range(600):
        simulation.step(0.3, 0.0, 0.1)
    assert simulation.collisions


def test_room_from_data_and_from_a_file(tmp_path):
    data = {"boxes": [[0, 0, 4, 4]], "circles": [[3, 3, 0.2]], "polygons": [[[1, 3], [2, 3], [1, 2]]],
            "walls": [[[2, 0], [2, 1]]], "start": [1, 1, 0], "description": "a test"}  # fmt: skip
    path = tmp_path / "lab.json"
    path.write_text(json.dumps(data))
    room = find(str(path))
    assert room.name == "lab" and room.start == (1.0, 1.0, 0.0) and room.bounds == (0.0, 0.0, 4.0, 4.0)
    assert room.segments.shape == (4 + 16 + 3 + 1, 2, 2)
    assert np.array_equal(load(path).segments, Room.from_data(data).segments)
    assert find(room) is room


@pytest.mark.parametrize("data, message", [
    ({"boxs": []}, "no setting called boxs"), ({"boxes": [[0, 0, 1]]}, "room 'room'"),
    ({"start": [0, 0]}, "room 'room'"),
    ({"circles": [[0, 0, INF]]}, "finite"), ({"walls": [[[0, "a"], [1, 1]]]}, "room 'room'"),
])  # fmt: skip
def test_bad_room_data_is_refused_with_a_reason(data, message):
    with pytest.raises(ValueError, match=message):
        Room.from_data(data)


def test_unknown_rooms_and_blocked_starts_are_refused():
    with pytest.raises(ValueError, match="choose one of hall, pillars"):
        Simulation("attic")
    with pytest.raises(ValueError, match="touches an obstacle"):
        Simulation(Room.from_data({"boxes": [[0, 0, 4, 4]], "start": [0.1, 2, 0]}))


# The node


@pytest.fixture
def domain():
    """A ROS domain for this test alone: nodes of a test before may not have left theirs yet."""
    prepare()
    claim, domain = claim_domain()
    yield domain
    claim.close()


@pytest.fixture
def context(domain):
    import rclpy
    from rclpy.context import Context

    context = Context()
    rclpy.init(context=context, domain_id=domain)
    yield context
    rclpy.shutdown(context=context)


def parameter(name, value):
    from rclpy.parameter import Parameter

    return Parameter(name, value=value)


def world(context, room="pillars", **parameters):
    from course.world.node import World

    overrides = [parameter(name, value) for name, value in parameters.items()]
    return World(room, context=context, parameter_overrides=overrides)


@pytest.fixture
def driver(domain):
    """The chapter's controller in a process of its own, on simulated time."""
    command = [sys.executable, "-m", "course.nodes.ai_robot_controller", "--ros-args", "-p", "use_sim_time:=true"]
    process = subprocess.Popen(
        command, env={**os.environ, "ROS_DOMAIN_ID": str(domain)}, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    yield process
    process.kill()
    process.wait()


def test_a_lockstep_drive_repeats_itself_and_equals_the_pure_simulation(context, driver):
    node = world(context, fast=True)
    steps = []
    first = node.drive(12.0, on_step=lambda: steps.append(node.simulation.time))
    (refused,) = node.set_parameters([parameter("beams", 24)])
    assert not refused.successful and "start it with other parameters" in refused.reason
    node.reset()
    second = node.drive(12.0)
    assert (first.answered, first.missed, first.collisions) == (120, 0, [])
    assert np.array_equal(first.path, second.path) and len(steps) == 120

    simulation, agent, laser = Simulation("pillars"), ObstacleAvoidanceAI(), Laser()
    for _ in range(120):
        seen = sectors(simulation.scan(), laser.angle_min, laser.angle_increment, laser.range_min, laser.range_max)
        action = agent.decide_action(seen)
        simulation.step(action["linear"], action["angular"], 0.1)
    np.testing.assert_allclose(first.path, simulation.path, atol=1e-9)
    assert "pillars: " in str(first) and "12.0 s, 0 collisions" in str(first)

    # Another room, the same driver; then without it.
    node.reset("hall")
    assert node.drive(2.0).room == "hall"
    driver.send_signal(signal.SIGINT)
    driver.wait(10.0)
    node.reset("hall")
    with pytest.raises(TimeoutError, match="publishes cmd_vel"):
        while True:  # until the middleware has noticed that the driver is gone
            node.drive(0.1, find_within=0.2, answer_within=0.05)


@pytest.fixture
def told():
    """The remarks for the reader of a cell during a drive."""
    said = []
    waiting.tellers.append(said.append)
    yield said
    waiting.tellers.remove(said.append)


def own_driver(context, pause: float, by_timer: bool, name: str = "driver"):
    """A driver that commands at each scan, after a pause, or ten times a second."""
    from geometry_msgs.msg import Twist
    from rclpy.node import Node
    from sensor_msgs.msg import LaserScan

    class Driver(Node):
        def __init__(self):
            simulated = [parameter("use_sim_time", not by_timer)]
            super().__init__(name, context=context, parameter_overrides=simulated)
            self.commands = self.create_publisher(Twist, "cmd_vel", 10)
            self.create_subscription(LaserScan, "scan", self.on_scan, 10)
            if by_timer:
                self.create_timer(0.1, lambda: self.commands.publish(Twist()))

        def on_scan(self, scan):
            time.sleep(pause)
            if not by_timer:
                self.commands.publish(Twist())

    return Driver()


@pytest.mark.parametrize(
    ("pause", "by_timer", "says"),
    [
        (0.0, True, "driver does not use simulated time, so this drive takes as long as in reality"),
        (0.4, False, "3 scans had no command within 0.1 s"),
        (0.0, False, ""),
    ],
)
def test_a_drive_that_takes_long_says_why(context, told, monkeypatch, pause, by_timer, says):
    monkeypatch.setattr("course.world.lockstep.FIRST", 15)
    node, driver = world(context, fast=True), own_driver(context, pause, by_timer)
    with spinning(node, context), spinning(driver, context):
        node.drive(2.0, answer_within=0.1 if pause else 5.0)
    assert len(told) == bool(says) and says in "".join(told)


def test_a_driver_that_was_stopped_in_the_middle_of_a_drive_is_told_as_that(context, told):
    node, driver = world(context, fast=True), own_driver(context, 0.0, False)
    with spinning(node, context), contextlib.ExitStack() as driving:
        driving.enter_context(spinning(driver, context))
        node.drive(500.0, answer_within=0.05, on_step=lambda: node.simulation.time > 0.5 and driving.close())
    (said,) = told
    assert said.endswith("this drive goes on without one. The node that drove has ended, or was stopped.")


def test_a_driver_that_answers_no_scan_is_told_before_the_drive(context, told, monkeypatch):
    monkeypatch.setattr("course.world.node.SILENT", 0.3)
    node, driver = world(context, fast=True), own_driver(context, 1.5, False)
    with spinning(node, context), spinning(driver, context):
        node.drive(0.1, answer_within=5.0)
    assert len(told) == 1
    assert told[0].startswith("/driver has sent no command for ") and "Its callback must not sleep" in told[0]


def test_a_driver_that_is_idle_and_sends_nothing_ends_the_drive(context, told, monkeypatch):
    """As one whose callback for the scan keeps it in a variable of its own."""
    from geometry_msgs.msg import Twist
    from rclpy.node import Node
    from sensor_msgs.msg import LaserScan

    monkeypatch.setattr("course.world.node.SILENT", 0.3)
    node, mute = world(context, fast=True), Node("mute", context=context)
    mute.create_subscription(LaserScan, "scan", lambda scan: None, 10)
    mute.create_publisher(Twist, "cmd_vel", 10)
    with (
        spinning(node, context),
        spinning(mute, context),
        pytest.raises(TimeoutError, match="/mute sent no command within 1 s, though scans came. It answers otherwise"),
    ):
        node.drive(600.0, find_within=1.0, answer_within=10.0)
    (said,) = told
    assert said.startswith("/mute has sent no command for ") and "It answers otherwise" in said


@pytest.mark.parametrize(
    ("scan", "command", "says"),
    [
        ("laser_scan", "cmd_vel", "/half publishes /cmd_vel, but subscribes to /laser_scan, not to /scan"),
        ("scan", "cmdvel", "/half subscribes to /scan, but publishes /cmdvel, not /cmd_vel"),
    ],
)
def test_a_driver_that_uses_another_name_is_named(context, told, monkeypatch, scan, command, says):
    from geometry_msgs.msg import Twist
    from rclpy.node import Node
    from sensor_msgs.msg import LaserScan

    monkeypatch.setattr("course.world.node.PATIENCE", 1.0)
    node, half = world(context, fast=True), Node("half", context=context)
    half.create_subscription(LaserScan, scan, lambda scan: None, 10)
    half.create_publisher(Twist, command, 10)
    whole = f"publishes cmd_vel and subscribes to scan: {says}$"
    with spinning(node, context), spinning(half, context), pytest.raises(TimeoutError, match=whole):
        node.drive(1.0, find_within=2.0)
    (said,) = told
    assert said.endswith(f"start one before it. {says}.")


def test_a_node_beside_the_driver_that_does_not_use_simulated_time_is_no_cause(context, told, monkeypatch):
    monkeypatch.setattr("course.world.lockstep.FIRST", 15)
    node, driver, other = world(context, fast=True), own_driver(context, 0.1, False), own_driver(context, 0, True, "o")
    with spinning(node, context), spinning(driver, context), spinning(other, context):
        node.drive(2.0, answer_within=5.0)
    assert told == []


def test_a_drive_without_a_driver_says_that_it_waits(context, told, monkeypatch):
    monkeypatch.setattr("course.world.node.PATIENCE", 0.1)
    with pytest.raises(TimeoutError, match="publishes cmd_vel"):
        world(context, fast=True).drive(1.0, find_within=0.3)
    assert len(told) == 1 and told[0].startswith("This drive waits for its driver, a node that publishes cmd_vel")


def test_a_driver_that_has_died_is_not_waited_for(context):
    """It may die before it is found, or of the first scan; a test that waited would run into its time limit."""
    from geometry_msgs.msg import Twist
    from rclpy.node import Node
    from sensor_msgs.msg import LaserScan

    node, looks = world(context, fast=True), iter([True] * 3)
    with pytest.raises(TimeoutError, match="publishes cmd_vel"):
        node.drive(0.1, find_within=1000.0, alive=lambda: next(looks, False))
    mute = Node("mute", context=context)
    mute.create_subscription(LaserScan, "scan", lambda scan: None, 10)
    mute.create_publisher(Twist, "cmd_vel", 10)
    looks = iter([True] * 100)  # until it is found, and has not answered
    assert node.drive(0.1, find_within=1000.0, answer_within=0.05, alive=lambda: next(looks, False)).answered == 0
    for each in (node, mute):
        each.destroy_node()


def test_who_only_looks_on_is_taken_for_no_driver(context):
    """The robot view's node and `ros2 topic echo`, both hidden, see the scan; what they do must change no drive."""
    from geometry_msgs.msg import Twist
    from rclpy.node import Node
    from sensor_msgs.msg import LaserScan

    node = world(context, fast=True)
    looks = Node("_course_session", context=context)
    looks.create_subscription(LaserScan, "scan", lambda scan: None, 10)
    sends = Node("sends_without_looking", context=context)
    sends.create_publisher(Twist, "cmd_vel", 10)
    with pytest.raises(TimeoutError, match="subscribes to scan"):
        node.drive(0.1, find_within=1.0, answer_within=0.05)
    looks.create_publisher(Twist, "cmd_vel", 10)  # a hidden node may drive, too
    node.drive(0.1, find_within=3.0, answer_within=0.05)  # nobody answers; that it begins is what counts
    sees = Node("sees_for_the_other", context=context)  # as when one node sees and another one drives
    sees.create_subscription(LaserScan, "scan", lambda scan: None, 10)
    looks.destroy_node()
    node.drive(0.1, find_within=3.0, answer_within=0.05)
    for each in (node, sends, sees):
        each.destroy_node()


@contextlib.contextmanager
def spinning(node, context):
    """A background thread spins `node` meanwhile."""
    from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor

    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)

    def spin():
        with contextlib.suppress(ExternalShutdownException):
            executor.spin()

    thread = threading.Thread(target=spin)
    thread.start()
    try:
        yield
    finally:
        executor.shutdown()
        thread.join()
        node.destroy_node()


def test_drive_works_while_a_background_thread_spins_the_node(context, driver):
    node = world(context, fast=True)
    with spinning(node, context):
        result = node.drive(3.0)
    assert (result.answered, result.missed) == (30, 0) and result.distance > 0.5


def test_a_drive_ends_after_the_callback_that_sent_its_last_command(context, monkeypatch):
    from rclpy.parameter import Parameter

    from course.nodes.ai_robot_controller import AIRobotController

    node, told, asked = world(context, fast=True), [], []
    controller = AIRobotController(context=context, parameter_overrides=[Parameter("use_sim_time", value=True)])

    def observe(decision):
        time.sleep(0.02)  # after the command has been sent
        told.append(decision)

    def cross(timeout, crossed=node._barrier.cross):
        asked.append(node.received)
        return crossed(timeout)

    monkeypatch.setattr(node._barrier, "cross", cross)
    controller.observers.append(observe)
    with spinning(node, context), spinning(controller, context):
        result = node.drive(1.0)
        assert (result.answered, len(told)) == (10, 10)
    assert asked[-1] == 10, "the driver was not asked again after its last command"


def test_without_commands_the_robot_stands_and_a_drive_ends_in_time(context):
    node = world(context, fast=True)
    result = node.drive(5.0, find_within=0.0)
    assert (result.answered, result.missed, result.distance) == (0, 50, 0.0) and result.seconds == pytest.approx(5.0)
    assert node.drive(1e6, find_within=0.0, wall_limit=0.2).seconds < 1e6
    with pytest.raises(RuntimeError, match="fast"):
        world(context).drive(1.0)


def test_a_driver_that_sends_without_end_does_not_hold_a_drive(context):
    """It has no parameter services either, which would tell when it has handled a scan."""
    from geometry_msgs.msg import Twist
    from rclpy.node import Node
    from sensor_msgs.msg import LaserScan

    node = world(context, fast=True)
    driver = Node("sends", context=context, start_parameter_services=False)
    driver.create_subscription(LaserScan, "scan", lambda scan: None, 10)
    commands, ended, held = driver.create_publisher(Twist, "cmd_vel", 10), threading.Event(), []

    def send():
        end = time.monotonic() + 20.0
        while not ended.wait(0.0005):
            commands.publish(Twist())
            if time.monotonic() > end:
                held.append(node.received)
                return

    thread = threading.Thread(target=send)
    thread.start()
    try:
        assert node.drive(1e6, answer_within=0.2, wall_limit=2.0).answered > 0
    finally:
        ended.set()
        thread.join()
    assert not held
    for each in (node, driver):
        each.destroy_node()


def test_odometry_is_made_only_for_those_who_have_subscribed(context, monkeypatch):
    from builtin_interfaces.msg import Time
    from nav_msgs.msg import Odometry

    from course.foundation.waiting import wait_until

    node, made = world(context, fast=True), []
    monkeypatch.setattr(node, "_show_odometry", made.append)
    node._show(Time(sec=1))
    assert made == []
    node.create_subscription(Odometry, "odom", lambda message: None, 10)
    assert wait_until(lambda: node.count_subscribers("odom") and node._odom_pub.get_subscription_count(), 10.0)
    node._show(Time(sec=2))
    assert made == [Time(sec=2)]


def test_at_real_time_it_reports_scans_odometry_and_one_collision(context):
    from geometry_msgs.msg import Twist
    from nav_msgs.msg import Odometry
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.node import Node
    from sensor_msgs.msg import LaserScan
    from std_msgs.msg import String

    room = Room.from_data({"boxes": [[0, 0, 2, 2]], "start": [1.74, 1.0, 0.0]})
    node, watcher = world(context, room, rate=50.0, angle_min=-math.pi), Node("watcher", context=context)
    got = {"scan": [], "odom": [], "collision": []}
    for topic, kind in (("scan", LaserScan), ("odom", Odometry), ("collision", String)):
        watcher.create_subscription(kind, topic, got[topic].append, 10)
    publisher = watcher.create_publisher(Twist, "cmd_vel", 10)
    watcher.create_timer(0.02, lambda: publisher.publish(forward))
    forward = Twist()
    forward.linear.x = 0.5
    executor = SingleThreadedExecutor(context=context)
    for one in (node, watcher):
        executor.add_node(one)
    while not (got["collision"] and len(got["scan"]) > 9 and got["odom"]):
        executor.spin_once(timeout_sec=5.0)
    executor.shutdown()

    scan = got["scan"][-1]
    assert len(scan.ranges) == 360 and scan.header.frame_id == "laser"
    assert scan.angle_min == pytest.approx(-math.pi) and scan.angle_max == pytest.approx(math.pi - scan.angle_increment)
    assert got["odom"][-1].child_frame_id == "base_link" and got["odom"][-1].pose.pose.position.x > 1.7
    assert len(got["collision"]) == 1 and "x=1.8" in got["collision"][0].data
    assert len(node.simulation.collisions) == 1


def test_at_real_time_ros_controls_it(context):
    from geometry_msgs.msg import Point, PointStamped, PoseWithCovarianceStamped, Twist, Vector3
    from rcl_interfaces.srv import SetParametersAtomically
    from rclpy.node import Node
    from sensor_msgs.msg import LaserScan
    from std_srvs.srv import Empty
    from visualization_msgs.msg import Marker

    from course.foundation.waiting import wait_until
    from course.world.controls import LATCHED

    node, user = world(context, "hall", rate=50.0), Node("user", context=context)
    walls, scans = [], []

    user.create_subscription(Marker, "walls", walls.append, LATCHED)
    user.create_subscription(LaserScan, "scan", scans.append, 10)
    place = user.create_publisher(PoseWithCovarianceStamped, "initialpose", 10)
    drop = user.create_publisher(PointStamped, "clicked_point", 10)
    drive = user.create_publisher(Twist, "cmd_vel", 10)
    client = user.create_client(SetParametersAtomically, "world/set_parameters_atomically")
    reset = user.create_client(Empty, "world/reset")

    def put(x, y):
        message = PoseWithCovarianceStamped()
        message.pose.pose.position.x, message.pose.pose.position.y = x, y
        message.pose.pose.orientation.w = 1.0
        place.publish(message)

    def call(client, request):
        future = client.call_async(request)
        assert wait_until(future.done, 30.0)
        return future.result()

    def set_all(**values):
        wanted = [parameter(name, value).to_parameter_msg() for name, value in values.items()]
        return call(client, SetParametersAtomically.Request(parameters=wanted)).result

    with spinning(node, context), spinning(user, context):
        for end in (place, drop, drive):
            assert wait_until(end.get_subscription_count, 30.0)
        assert wait_until(lambda: client.service_is_ready() and reset.service_is_ready() and walls, 30.0)
        assert (walls[0].text, len(walls[0].points)) == ("hall", 8)

        put(4.0, 3.0)
        assert wait_until(lambda: node.simulation.pose == (4.0, 3.0, 0.0), 30.0)
        drop.publish(PointStamped(point=Point(x=4.1, y=3.0)))  # the robot stands there
        drop.publish(PointStamped(point=Point(x=6.0, y=3.0)))
        assert wait_until(lambda: len(walls[-1].points) > 8, 30.0)
        assert len(walls[-1].points) == 8 + 2 * 16
        assert wait_until(lambda: scans[-1].ranges[180] == pytest.approx(4.0, abs=0.1), 30.0), (
            "the next scan is from there"
        )

        assert set_all(paused=True, beams=720, angle_min=-math.pi).successful
        seen = len(scans)
        drive.publish(Twist(linear=Vector3(x=0.5)))
        assert wait_until(lambda: len(scans) > seen + 3, 30.0), "a paused world still shows what the robot sees"
        assert len(scans[-1].ranges) == 720 and scans[-1].angle_min == pytest.approx(-math.pi)

        for values, reason in (
            ({"room": "nowhere"}, "there is no room 'nowhere'"),
            ({"beams": 0}, "beams must be from 1"),
            ({"noise": -1.0}, "noise"),
            ({"speed": 9.0}, "range"),
            ({"room": "office", "beams": 0}, "beams"),
            ({"rate": 20.0}, "read-only"),
            ({"seed": 1}, "read-only"),
            ({"fast": True}, "read-only"),
        ):
            refused = set_all(**values)
            assert not refused.successful and reason in refused.reason
        assert node.simulation.room.name == "hall" and node.simulation.pose == (4.0, 3.0, 0.0)

        assert call(reset, Empty.Request()) is not None
        assert node.simulation.pose == ROOMS["hall"].start and len(node.simulation.room.segments) == 4
        assert set_all(room="office").successful
        assert wait_until(lambda: walls[-1].text == "office", 30.0) and node.simulation.pose == ROOMS["office"].start
        assert len({(each.ns, each.id, each.action) for each in walls}) == 1, "each is drawn in the place of the last"
        late = []
        user.create_subscription(Marker, "walls", late.append, LATCHED)
        assert set_all(room="bends").successful
        assert wait_until(lambda: late and late[-1].text == "bends", 30.0)
        assert {each.text for each in late} <= {"office", "bends"}, "a late subscriber is given no earlier room"


def test_time_passes_as_fast_as_its_speed_says_and_not_in_a_pause(context):
    node = world(context, "hall")
    for controls, passed in (({}, 0.1), ({"speed": 2.5}, 0.25), ({"paused": True}, 0.0)):
        node.set_parameters_atomically([parameter(name, value) for name, value in controls.items()])
        before = node.simulation.time
        node._on_timer()
        assert node.simulation.time - before == pytest.approx(passed)
    node.destroy_node()


def test_nothing_can_change_a_drive_in_lockstep(context):
    node = world(context, fast=True)
    assert "/world/reset" not in {service.service_name for service in node.services}
    topics = {end.topic_name for end in (*node.publishers, *node.subscriptions)}
    assert "/scan" in topics and not topics & {"/walls", "/initialpose", "/clicked_point"}
    assert not node.has_parameter("paused")
    node.destroy_node()
