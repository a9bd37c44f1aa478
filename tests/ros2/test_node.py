"""`ros2 node` shows the graph as ros2cli does."""

import contextlib
import subprocess
import sys
import time

import pytest

from course.ros import graph
from course.session import domains

from .conftest import Command

TALKER = """\
/talker
  Subscribers:

  Publishers:
    /chatter: std_msgs/msg/String
    /numbers: std_msgs/msg/Float64MultiArray
    /parameter_events: rcl_interfaces/msg/ParameterEvent
    /rosout: rcl_interfaces/msg/Log
  Service Servers:
    /talker/describe_parameters: rcl_interfaces/srv/DescribeParameters
    /talker/get_parameter_types: rcl_interfaces/srv/GetParameterTypes
    /talker/get_parameters: rcl_interfaces/srv/GetParameters
    /talker/get_type_description: type_description_interfaces/srv/GetTypeDescription
    /talker/list_parameters: rcl_interfaces/srv/ListParameters
    /talker/set_parameters: rcl_interfaces/srv/SetParameters
    /talker/set_parameters_atomically: rcl_interfaces/srv/SetParametersAtomically
  Service Clients:

  Action Servers:

  Action Clients:

"""
TWINS = """
import rclpy, sys
rclpy.init()
twins = [rclpy.create_node("twin") for _ in range(2)]
print("ready", flush=True)
sys.stdin.read()
"""


def test_list_names_every_node_sorted_and_hides_the_hidden(ros2):
    """The look ends only once every node is known, whatever the machine's load."""
    expected = ["add_two_ints_server", "fibonacci_action_server", "listener", "parameter_node", "silent", "talker"]
    listing = "".join(f"/{name}\n" for name in expected)
    assert ros2.outputs("node list", "node list --no-daemon", "node list --spin-time 1.5") == [listing] * 3


def test_list_all_shows_hidden_nodes_and_this_command_s_own(ros2):
    """`-a` shows names that begin with an underscore."""
    lines = ros2.output("node", "list", "-a").splitlines()
    assert "/_hidden" in lines
    assert sum(line.startswith("/_ros2cli_") for line in lines) == 1
    assert len(lines) == 8


def test_list_counts(ros2, alone):
    """`-c` prints a number, 0 where there is no node."""
    assert ros2.output("node", "list", "-c") == "6\n"
    assert alone.output("node", "list", "-c") == "0\n"
    assert alone.output("node", "list") == ""


@contextlib.contextmanager
def twins(environment):
    """Two nodes of one name, in a process of their own."""
    process = subprocess.Popen(
        [sys.executable, "-c", TWINS],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env=environment,
        text=True,
    )
    try:
        assert process.stdout.readline() == "ready\n"
        yield
    finally:
        process.kill()
        process.wait()


def test_list_in_a_domain_whose_ports_cannot_be_counted(alone):
    """From domain 101 on it waits as long as ros2cli does."""
    high = Command({**alone.environment, "ROS_DOMAIN_ID": "101"}, alone.loaded)
    with twins(high.environment):
        assert high.output("node", "list", "-c") == "2\n"


def test_every_session_is_in_a_domain_whose_nodes_can_be_counted():
    """There `ros2` knows when it has seen them all."""
    assert set(domains.DOMAINS) <= set(graph.COUNTABLE)


def test_list_warns_of_two_nodes_with_one_name(alone):
    """A cell that was run twice leaves two nodes: the listing must say so."""
    with twins(alone.environment):
        listing = alone("node", "list")
        info = alone("node", "info", "/twin")
    assert listing.stdout == "/twin\n/twin\n"
    assert listing.stderr == (
        "WARNING: Be aware that there are nodes in the graph that share an exact name, "
        "which can have unintended side effects.\n"
    )
    assert info.stdout.startswith("/twin\n  Subscribers:\n")
    assert info.stderr == (
        'There are 2 nodes in the graph with the exact name "/twin". '
        "You are seeing information about only one of them.\n"
    )


def test_info_lists_topics_services_and_actions(ros2):
    """The sections and their order are ros2cli's, an empty one is an empty line."""
    talker, fibonacci, hidden = ros2.outputs(
        "node info /talker", "node info /fibonacci_action_server", "node info --include-hidden /fibonacci_action_server"
    )
    assert talker == TALKER
    assert "  Action Servers:\n    /fibonacci: example_interfaces/action/Fibonacci\n" in fibonacci
    assert "/_action/" not in fibonacci
    assert "    /fibonacci/_action/feedback: example_interfaces/action/Fibonacci_FeedbackMessage\n" in hidden


def test_info_of_an_unknown_node(ros2):
    """One line on stderr, status 1."""
    done = ros2("node", "info", "/nobody")
    assert (done.returncode, done.stdout, done.stderr) == (1, "", "Unable to find node '/nobody'\n")


@pytest.mark.parametrize(
    ("line", "meant", "said"),
    [
        ("node info talker", "/talker", "Unable to find node 'talker'"),
        ("param get /talke use_sim_time", "/talker", "Node not found"),
        ("param get /talker use_sim_tme", "use_sim_time", "Parameter not set"),
        ("run course add_two_ints_clent", "add_two_ints_client", "No executable found"),
        ("service call /a std_srv/srv/Trigger", "std_srvs/srv/Trigger", "The passed service type is invalid"),
        ("service call /a my_package/srv/Trigger", "std_srvs/srv/Trigger", "The passed service type is invalid"),
        ("service call /a AddTwoInts", "example_interfaces/srv/AddTwoInts", "The passed service type is invalid"),
        (
            "action send_goal /a Fibonacci {}",
            "course_interfaces/action/Fibonacci or example_interfaces/action/Fibonacci",
            "The passed action type is invalid",
        ),
        ("topic pub /a std_msgs/msg/Strin", "std_msgs/msg/String", "The passed message type is invalid"),
    ],
)
def test_a_name_that_is_nearly_right_is_followed_by_the_right_one(ros2, line, meant, said):
    done = ros2(*line.split())
    assert (done.returncode, done.stderr) == (1, f"Did you mean {meant}?\n{said}\n")


def test_values_without_quotation_marks_are_told(ros2):
    done = ros2("service", "call", "/add", "example_interfaces/srv/AddTwoInts", "{a:", "5,", "b:", "3}")
    assert done.returncode == 2 and "unrecognized arguments: 5, b: 3}" in done.stderr
    assert done.stderr.endswith("Without them each blank ends a word.\n")


def test_nodes_without_the_course_s_profile_are_listed_at_once(ros2, alone):
    """Those of any ROS 2, which announce themselves every 3 s: each is asked, and all answer before the next time.

    How long the same takes beside nodes with the course's profile tells how busy the machine is.
    """
    plain = {name: value for name, value in alone.environment.items() if name != "FASTRTPS_DEFAULT_PROFILES_FILE"}

    def seconds(command: Command) -> tuple[float, str]:
        began = time.monotonic()
        listed = command.output("node", "list", "-c")
        return time.monotonic() - began, listed

    with twins(plain), twins(plain):
        looks = [(seconds(alone), seconds(ros2)) for _ in range(6)]
    without, with_profile = zip(*looks, strict=True)
    assert {listed for _, listed in without} == {"4\n"}
    # If none is asked, half of the looks take 2 to 3 s; a busy machine may delay one of them.
    assert sorted(without)[4][0] < sorted(with_profile)[4][0] + 1, looks
