"""`ros2 lifecycle` on rclpy's own lifecycle node, whose states are those of the design (design.ros2.org)."""

import subprocess
import sys

import pytest

from course.session.domains import claim_domain
from tests.ros2.conftest import Command

NODES = """
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.lifecycle import Node, TransitionCallbackReturn


class Pump(Node):
    def on_activate(self, state):
        return TransitionCallbackReturn.FAILURE


rclpy.init()
executor = SingleThreadedExecutor()
for node in (Node("lc_talker"), Pump("pump"), rclpy.create_node("plain")):
    executor.add_node(node)
print("ready", flush=True)
executor.spin()
"""


@pytest.fixture(scope="module")
def ros2(environment, loaded) -> Command:
    """The command beside two nodes with a lifecycle and one without."""
    claim, domain = claim_domain()
    variables = {**environment, "ROS_DOMAIN_ID": str(domain)}
    child = subprocess.Popen([sys.executable, "-c", NODES], stdout=subprocess.PIPE, text=True, env=variables)
    assert child.stdout.readline() == "ready\n"
    yield Command(variables, loaded)
    child.kill()
    child.communicate()
    claim.close()


def test_nodes_and_their_states(ros2):
    assert ros2.outputs(
        "lifecycle nodes", "lifecycle nodes -c", "lifecycle get", "lifecycle get /lc_talker", "lifecycle get pump"
    ) == [
        "/lc_talker\n/pump\n",
        "2\n",
        "/lc_talker: unconfigured [1]\n/pump: unconfigured [1]\n",
        "unconfigured [1]\n",
        "unconfigured [1]\n",
    ]


def test_a_node_goes_through_its_life(ros2):
    assert ros2.output("lifecycle", "list", "/lc_talker") == (
        "- configure [1]\n\tStart: unconfigured\n\tGoal: configuring\n"
        "- shutdown [5]\n\tStart: unconfigured\n\tGoal: shuttingdown\n"
    )
    for asked, state in (("configure", "inactive [2]"), ("3", "active [3]"), ("deactivate", "inactive [2]")):
        assert ros2.output("lifecycle", "set", "/lc_talker", asked) == "Transitioning successful\n"
        assert ros2.output("lifecycle", "get", "/lc_talker") == f"{state}\n"
    everything = ros2.output("lifecycle", "list", "lc_talker", "-a")
    assert "- cleanup [2]\n\tStart: inactive\n\tGoal: cleaningup\n" in everything and everything.count("Start:") > 10
    wrong = ros2("lifecycle", "set", "/lc_talker", "fly")
    assert wrong.returncode == 1 and wrong.stderr == (
        "Unknown transition requested, available ones are:\n- cleanup [2]\n- activate [3]\n- shutdown [6]\n"
    )


def test_a_transition_that_the_node_refuses(ros2):
    assert ros2.output("lifecycle", "set", "/pump", "configure") == "Transitioning successful\n"
    refused = ros2("lifecycle", "set", "/pump", "activate")
    assert (refused.stdout, refused.stderr) == ("", "Transitioning failed\n")
    assert ros2.output("lifecycle", "get", "/pump") == "inactive [2]\n"


@pytest.mark.parametrize("words", ["get /plain", "list /nobody", "set /plain configure"])
def test_a_node_without_a_lifecycle_is_not_found(ros2, words):
    done = ros2("lifecycle", *words.split())
    assert (done.returncode, done.stdout, done.stderr) == (1, "", "Node not found\n")
