"""A wrong argument of a world, a simulation or a drive is reported at once."""

import math

import pytest

from course.errors import CourseError, WorldError
from course.robot.driver import GoodDriver
from course.session.live import Session
from course.world import Laser, Robot, Room, Simulation
from course.world.node import World
from course.world.practice import practise, scan_of

NAN = math.nan


class Mute:
    def decide_action(self, laser_data):
        return None


class Turns:
    def decide_action(self, laser_data):
        return {"angular": 1.0}


class Words:
    def decide_action(self, laser_data):
        return {"linear": "0.3", "angular": 0.0}


def look(scan):
    return {"ranges": scan.ranges.clip(0.0, 3.0)}


def hall(**changes):
    return practise(**{"driver": GoodDriver(), "look": look, "rooms": ["hall"], "seconds": 0.2, "drives": 1} | changes)


WRONG = {
    "no beams": (lambda: Laser.turn(0), "beams must be from 1 to 3600, a whole number, not 0"),
    "fewer beams than none": (lambda: Laser.turn(-4), "not -4"),
    "half a beam": (lambda: Laser(beams=90.5), "not 90.5"),
    "beams in words": (lambda: Laser(beams="90"), "not '90'"),
    "degrees for the first beam": (lambda: Laser(angle_min=-180.0), "angle_min must be an angle in rad"),
    "degrees between beams": (lambda: Laser(angle_increment=30.0), "angle_increment must be an angle in rad"),
    "no angle": (lambda: Laser(angle_min=NAN), "angle_min must be an angle in rad"),
    "noise below zero": (lambda: Laser(noise=-1.0), "noise must be a distance"),
    "endless noise": (lambda: Laser(noise=math.inf), "noise must be a distance"),
    "a number for the laser": (lambda: Simulation("hall", 90), "`Laser(beams=180)`, not 90"),
    "a number for the robot": (lambda: Simulation("hall", robot=0.2), "`Robot(radius=0.2)`, not 0.2"),
    "a negative seed": (lambda: Simulation("hall", seed=-1), "`seed` is a whole number, 0 or more, not -1"),
    "a seed in words": (lambda: Simulation("hall", seed="a"), "not 'a'"),
    "a room's data": (lambda: Simulation({"boxes": [[0, 0, 4, 4]]}), "`Room.from_data(...)`"),
    "a list for a room": (lambda: Room.from_data([[0, 0, 4, 4]]), "{'boxes': [[0, 0, 8, 6]]}"),
    "degrees at the start": (lambda: Room.from_data({"start": [1, 1, 90]}), "an angle in rad, not 90.0"),
    "no such file": (lambda: Simulation("attic.json"), "attic.json cannot be read: No such file"),
    "a step in words": (lambda: Simulation().step("0.3", 0.0, 0.1), "not '0.3' and 0.0"),
    "a step of nothing": (lambda: Simulation().step(None, 0.0, 0.1), "not None and 0.0"),
    "a step back in time": (lambda: Simulation().step(0.3, 0.0, -1.0), "0 or more, not -1.0"),
    "an endless step": (lambda: Simulation().step(0.3, 0.0, math.inf), "not inf"),
    "a place without a heading": (lambda: Simulation().place((1.0, 1.0)), "heading (rad), not (1.0, 1.0)"),
    "a place with degrees": (lambda: Simulation().place((2.0, 2.0, 90.0)), "heading (rad), not (2.0, 2.0, 90.0)"),
    "a place in words": (lambda: Simulation().place("abc"), "heading (rad), not 'abc'"),
    "an obstacle in words": (lambda: Simulation().drop("1", 2.0), "an obstacle has finite numbers"),
    "the larger angle first": (lambda: Simulation().nearest(-60, -120), "the smaller one first"),
    "a driver's class": (lambda: hall(look=GoodDriver(), driver=look), "a driver with `decide_action`"),
    "no rooms": (lambda: practise(GoodDriver(), look), "missing a required argument: 'rooms'"),
    "a room as text": (lambda: hall(rooms="hall"), "rooms=['hall']"),
    "a room": (lambda: hall(rooms=Room.from_data({})), "rooms=[the_room]"),
    "a number of rooms": (lambda: hall(rooms=3), "such as rooms=['hall', 'pillars'], not 3"),
    "seconds in words": (lambda: hall(seconds="25"), "not 1 and '25'"),
    "half a drive": (lambda: hall(drives=1.5), "not 1.5 and 0.2"),
    "no decision": (lambda: hall(driver=Mute()), "has returned None"),
    "half a decision": (lambda: hall(driver=Turns()), "has returned {'angular': 1.0}"),
    "a decision in words": (lambda: hall(driver=Words()), "not '0.3' and "),
    "free beams": (lambda: hall(look=lambda scan: {"ranges": scan.ranges}), "the good driver needs distances that are"),
    "no beam": (lambda: GoodDriver().decide_action({"ranges": []}), "the good driver needs distances that are finite"),
    "a look at nothing": (lambda: hall(look=lambda: 3), "a function of a scan"),
    "a command too few": (lambda: Simulation().step(0.3, 0.0), "missing a required argument: 'duration'"),
    "a room of another name": (lambda: Simulation(rooms="hall"), "Its arguments are: room, laser, robot, seed"),
    "one box": (lambda: Room.from_data({"boxes": [0, 0, 4, 4]}), "`boxes` is [[x_min, y_min, x_max, y_max], ...]"),
    "no radius": (lambda: Room.from_data({"circles": [[1, 2]]}), "`circles` is [[x, y, radius], ...]"),
    "no heading": (lambda: Room.from_data({"start": [1, 2]}), "`start` is [x, y, heading]"),
    "walls in words": (lambda: Room.from_data({"walls": ["north"]}), "`walls` is [[[x, y], [x, y], ...], ...]"),
    "a scan of a room": (lambda: scan_of(Room.from_data({})), "`world.node.simulation`"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_meant_is_written_out(name):
    wrong, told = WRONG[name]
    with pytest.raises(CourseError) as error:
        wrong()
    assert told in str(error.value)


def test_a_room_that_is_no_json_says_so(tmp_path):
    (tmp_path / "lab.json").write_text("boxes: []")
    with pytest.raises(WorldError, match=r"lab\.json is not JSON"):
        Simulation(tmp_path / "lab.json")


def test_any_whole_turn_may_be_driven():
    room = Room.from_data({"boxes": [[0, 0, 4, 4]], "start": [2, 2, 3 * math.pi]})
    simulation = Simulation(room, Laser.turn(4, -2.0 * math.pi), Robot())
    assert simulation.step(math.nan, math.inf, 0.1) is None and simulation.step(0.3, 0.0, 0.0) is None
    assert simulation.time == pytest.approx(0.1)


@pytest.fixture(scope="module")
def ros():
    session = Session()
    yield session
    session.close()


@pytest.mark.parametrize(
    ("parameters", "told"),
    [
        ({"beams": 0}, "beams must be from 1 to 3600"),
        ({"angle_min": -180.0}, "angle_min must be an angle in rad"),
        ({"noise": -1.0}, "noise must be a distance"),
        ({"seed": -1}, "`seed` is a whole number"),
        ({"rate": 0.0}, "rate must be above 0 Hz"),
        ({"rate": math.inf}, "rate must be above 0 Hz"),
        ({"room": "attic.json"}, "attic.json cannot be read"),
    ],
)
@pytest.mark.parametrize("fast", [False, True])
def test_a_world_that_cannot_be_says_why(ros, parameters, told, fast):
    with pytest.raises(WorldError) as error:
        ros.start(World, parameters={**parameters, "fast": fast})
    assert told in str(error.value)


def test_a_drive_says_what_it_needs(ros):
    slow = ros.start(World).node
    with pytest.raises(WorldError, match="parameters={'fast': True}"):
        slow.drive(1.0)
    world = ros.start(World, parameters={"fast": True}).node
    for wrong, told in (
        (lambda: world.drive("30"), "a number of seconds, such as 60.0, not '30'"),
        (lambda: world.drive(NAN), "not nan"),
        (lambda: world.drive(-1.0), "not -1.0"),
        (lambda: world.drive(1.0, on_step=3), "`on_step` is a function"),
        (lambda: world.drive(1.0, on_step=lambda step: step), "`on_step` is a function"),
        (lambda: world.drive(1.0, answer_within="1"), "a time limit is a number of seconds"),
        (world.drive, "missing a required argument: 'seconds'"),
        (lambda: world.place((1.0, 2.0)), "heading (rad)"),
        (lambda: world.place(1.0, 2.0, 0.0), "Its arguments are: pose"),
        (lambda: world.drop((1.0, 2.0)), "missing a required argument: 'y'"),
        (lambda: world.reset(rooms="hall"), "Its arguments are: room, seed"),
        (lambda: setattr(world, "laser", 90), "`Laser(beams=180)`, not 90"),
        (lambda: world.reset(seed=-1), "`seed` is a whole number"),
        (lambda: scan_of(world), "`world.node.simulation`"),
    ):
        with pytest.raises(CourseError) as error:
            wrong()
        assert told in str(error.value)
    ros.stop("world")
    with pytest.raises(WorldError, match="this world has been ended"):
        world.drive(1.0)
    for node in (slow, world):
        with pytest.raises(WorldError, match="this world has been ended"):
            node.reset()
    assert len(world.simulation.path) == 1
