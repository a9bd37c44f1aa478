"""Sectors are found by angle, for any scanner, and bad measurements never count as obstacles or as free way."""

import math
import warnings
from types import SimpleNamespace

import numpy as np
import pytest

from course.robot import sectors as module
from course.robot.sectors import from_scan, members, sectors, wrap

INF = float("inf")
DEGREE = math.radians(1.0)


def measure(ranges, angle_min=0.0, angle_increment=DEGREE, range_min=0.1, range_max=10.0):
    return sectors(ranges, angle_min, angle_increment, range_min, range_max)


def scan_of(obstacles, angle_min, increment, count, far=5.0):
    """Ranges of a scanner that sees `obstacles` {angle in degrees: distance} in its nearest beams."""
    angles = np.degrees(wrap(angle_min + increment * np.arange(count)))
    ranges = np.full(count, far)
    for angle, distance in obstacles.items():
        ranges[np.argmin(np.abs(angles - angle))] = distance
    return ranges


@pytest.mark.parametrize(
    "angle_min, increment, count",
    [
        (0.0, DEGREE, 360),
        (-math.pi, DEGREE, 360),
        (math.pi, -DEGREE, 360),
        (0.0, -DEGREE, 360),
        (math.radians(-135), math.radians(0.25), 1081),
        (math.radians(-120), math.radians(8), 31),
        (math.radians(90), math.radians(0.5), 720),
        (4 * math.pi, DEGREE, 360),
        (np.float32(-math.pi), np.float32(2 * math.pi / 360), 360),
    ],
)
def test_an_obstacle_is_seen_in_its_sector_by_any_scanner(angle_min, increment, count):
    for angle, name in [(0, "front"), (-16, "front"), (16, "front"), (64, "left"), (-64, "right")]:
        found = measure(scan_of({angle: 0.7}, angle_min, increment, count), angle_min, increment)
        assert found == {**dict.fromkeys(("front", "left", "right"), 5.0), name: 0.7}
    behind = measure(scan_of({150: 0.2, -119: 0.2}, angle_min, increment, count), angle_min, increment)
    assert behind == {"front": 5.0, "left": 5.0, "right": 5.0}


@pytest.mark.parametrize("kind", [float, np.float32])
@pytest.mark.parametrize("start", [0, -180, -90, 13])
def test_a_beam_a_degree_gives_sixty_beams_a_sector(start, kind):
    inside = members(360, kind(math.radians(start)), kind(DEGREE))
    degrees = (start + np.arange(360) + 180) % 360 - 180
    assert sorted(degrees[inside["front"]]) == list(range(-30, 30))
    assert sorted(degrees[inside["left"]]) == list(range(30, 90))
    assert sorted(degrees[inside["right"]]) == list(range(-90, -30))


def test_a_clockwise_scanner_counts_the_same_beams():
    inside = members(360, np.float32(math.pi), np.float32(-DEGREE))
    degrees = 180 - np.arange(360)
    assert sorted(degrees[inside["front"]]) == list(range(-30, 30))
    assert sorted(degrees[inside["right"]]) == list(range(-90, -30))


def test_special_values_mean_what_rep_117_says():
    ranges = np.full(360, 4.0)
    ranges[0] = math.nan
    assert measure(ranges)["front"] == 4.0
    ranges[0] = INF
    assert measure(ranges)["front"] == 4.0
    ranges[0] = -INF
    assert measure(ranges)["front"] == 0.0


def test_values_outside_the_limits_are_discarded_and_the_limits_are_not():
    ranges = np.full(360, 4.0)
    ranges[0:3] = 0.05, 0.0, -1.0
    assert measure(ranges)["front"] == 4.0
    ranges[0] = 0.1
    assert measure(ranges)["front"] == 0.1
    assert measure(np.full(360, 11.0))["front"] == INF
    assert measure(np.full(360, 10.0))["front"] == 10.0


@pytest.mark.parametrize("ranges", [[], [math.nan] * 360, [INF] * 360, [20.0] * 360])
def test_a_sector_with_nothing_usable_is_free(ranges):
    assert measure(ranges) == {"front": INF, "left": INF, "right": INF}


@pytest.mark.parametrize("increment", [INF, -INF, math.nan, 1e308])
def test_a_beam_without_a_finite_angle_belongs_to_no_sector_and_nothing_warns_of_it(increment):
    """A scan of any program on the network is looked at while a student's cell runs, which would show the warning."""
    with warnings.catch_warnings(action="error"):
        inside = members(360, -math.pi, increment)
    assert not any(beams[2:].any() for beams in inside.values())


def test_wrapped_angles_are_above_minus_pi_and_up_to_pi():
    assert wrap(math.pi) == math.pi
    assert wrap(-math.pi) == math.pi
    assert wrap(3 * math.pi / 2) == pytest.approx(-math.pi / 2)
    assert wrap(0.0) == 0.0


def test_from_scan_reads_the_fields_of_a_message():
    scan = SimpleNamespace(ranges=[1.0, 2.0, 3.0], angle_min=-1.0, angle_increment=1.0, range_min=0.0, range_max=9.0)
    assert from_scan(scan) == {"right": 1.0, "front": 2.0, "left": 3.0}


def test_the_input_is_left_as_it_was():
    ranges = np.array([-INF, 50.0, math.nan])
    module.usable(ranges, 0.1, 10.0)
    assert ranges[0] == -INF and ranges[1] == 50.0
