"""The agent decides as the chapter says, and needs no ROS to do it."""

import subprocess
import sys

import pytest

from course.robot.agent import ObstacleAvoidanceAI, RobotState

FORWARD = {"linear": 0.3, "angular": 0.0}
LEFT = {"linear": 0.0, "angular": 0.5}
RIGHT = {"linear": 0.0, "angular": -0.5}


@pytest.mark.parametrize(
    "distances, action, state",
    [
        ({"front": 2.0, "left": 1.0, "right": 1.0}, FORWARD, RobotState.FORWARD),
        ({"front": 0.4, "left": 2.0, "right": 1.0}, LEFT, RobotState.TURNING_LEFT),
        ({"front": 0.4, "left": 1.0, "right": 2.0}, RIGHT, RobotState.TURNING_RIGHT),
        # a tie turns right; the threshold itself is clear
        ({"front": 0.4, "left": 1.0, "right": 1.0}, RIGHT, RobotState.TURNING_RIGHT),
        ({"front": 0.4, "left": float("inf"), "right": float("inf")}, RIGHT, RobotState.TURNING_RIGHT),
        ({"front": 0.5, "left": 0.1, "right": 0.1}, FORWARD, RobotState.FORWARD),
        ({"front": 0.0, "left": 0.2, "right": 0.1}, LEFT, RobotState.TURNING_LEFT),
        # a missing sector counts as free
        ({}, FORWARD, RobotState.FORWARD),
        ({"front": 0.4, "right": 9.0}, LEFT, RobotState.TURNING_LEFT),
        ({"front": 0.4, "left": 9.0}, RIGHT, RobotState.TURNING_RIGHT),
    ],
)
def test_action_and_state_follow_the_distances(distances, action, state):
    agent = ObstacleAvoidanceAI()
    assert agent.decide_action(distances) == action
    assert agent.state is state


def test_threshold_is_the_callers():
    agent = ObstacleAvoidanceAI(obstacle_distance_threshold=1.0)
    assert agent.decide_action({"front": 0.8, "left": 2.0, "right": 1.0}) == LEFT
    agent.obstacle_threshold = 0.5
    assert agent.decide_action({"front": 0.8, "left": 2.0, "right": 1.0}) == FORWARD


def test_a_decision_does_not_depend_on_the_one_before():
    agent = ObstacleAvoidanceAI()
    agent.decide_action({"front": 0.1, "left": 2.0, "right": 1.0})
    assert agent.decide_action({"front": 3.0}) == FORWARD


def test_stop_is_a_state_of_its_own():
    agent = ObstacleAvoidanceAI()
    assert agent.stop() == {"linear": 0.0, "angular": 0.0}
    assert agent.state is RobotState.STOPPED


@pytest.mark.parametrize(
    "module",
    ["course.robot.agent", "course.robot.sectors", "course.robot.driver", "course.world", "course.world.practice"],
)
def test_importing_it_loads_no_ros(module):
    program = (
        f"import sys, {module}\n"
        "names = {name.split('.')[0] for name in sys.modules}\n"
        "print(sorted(n for n in names if n == 'rclpy' or n.endswith(('_msgs', '_srvs', '_interfaces'))))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=20)
    assert done.stdout.strip() == "[]", done.stdout + done.stderr
