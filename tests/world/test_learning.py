"""The examples of the learned agent of 3.4: a good driver, drives that repeat, and ways out."""

import numpy as np
import pytest

from course.robot.driver import GoodDriver
from course.robot.sectors import from_scan
from course.world import ROOMS, Simulation
from course.world.practice import practise, scan_of


def look(scan):
    return {"ranges": np.clip(scan.ranges[::10], 0.0, 3.0).tolist()}


@pytest.mark.parametrize("name", ROOMS)
def test_the_good_driver_gets_through_every_room(name):
    simulation, driver = Simulation(name, seed=1), GoodDriver()
    for _ in range(600):
        action = driver.decide_action(look(scan_of(simulation)))
        simulation.step(action["linear"], action["angular"], 0.1)
    assert not simulation.collisions
    assert simulation.distance > 15.0


def test_the_good_driver_turns_on_the_spot_to_the_open_side():
    ranges = [3.0] * 36
    ranges[0] = 0.3
    ranges[27:] = [0.3] * 9  # the right
    action = GoodDriver().decide_action({"ranges": ranges})
    assert action["linear"] == 0.0 and action["angular"] > 0.0


def test_practice_repeats_and_has_an_example_for_each_decision():
    seen, done = practise(GoodDriver(), look, ["hall", "corridor"], seconds=5.0, drives=2)
    assert len(seen) == len(done) == 2 * 2 * 50
    assert practise(GoodDriver(), look, ["hall", "corridor"], seconds=5.0, drives=2) == (seen, done)
    assert practise(GoodDriver(), look, ["hall", "corridor"], seconds=5.0, drives=2, seed=1) != (seen, done)


def test_practice_shoves_the_driver_from_its_way():
    straight = []
    simulation, driver = Simulation("hall"), GoodDriver()
    for _ in range(100):
        straight.append(look(scan_of(simulation)))
        action = driver.decide_action(straight[-1])
        simulation.step(action["linear"], action["angular"], 0.1)
    seen, _ = practise(driver, look, ["hall"], seconds=10.0, drives=1)
    last = (np.array(seen[-1]["ranges"]) - np.array(straight[-1]["ranges"])) ** 2
    assert last.sum() > 1.0  # far more than the laser's noise


def test_a_simulated_scan_is_cut_like_a_message():
    assert from_scan(scan_of(Simulation("hall")))["front"] > 1.0
