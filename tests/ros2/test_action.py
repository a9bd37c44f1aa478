"""`ros2 action` finds actions and sends goals as ros2cli does."""

import os
import re
import select

import pytest

FIBONACCI = ("/fibonacci", "example_interfaces/action/Fibonacci")
INFO = "Action: /fibonacci\nAction clients: 0\nAction servers: 1\n"
GOAL = """\
Waiting for an action server to become available...
Sending goal:
     order: 3

Goal accepted with ID: ID

Feedback:
    sequence:
- 0
- 1
- 1

Feedback:
    sequence:
- 0
- 1
- 1
- 2

Result:
    sequence:
- 0
- 1
- 1
- 2

Goal finished with status: SUCCEEDED
"""


def test_list_info_and_type(ros2):
    """Names, types, and who serves the action."""
    assert ros2.outputs(
        "action list",
        "action list -t",
        "action list -c",
        "action type /fibonacci",
        "action info /fibonacci",
        "action info /fibonacci -t",
        "action info /fibonacci -c",
    ) == [
        "/fibonacci\n",
        "/fibonacci [example_interfaces/action/Fibonacci]\n",
        "1\n",
        "example_interfaces/action/Fibonacci\n",
        f"{INFO}    /fibonacci_action_server\n",
        f"{INFO}    /fibonacci_action_server [example_interfaces/action/Fibonacci]\n",
        INFO,
    ]


def test_an_unknown_action(ros2):
    """`info` counts nobody, `type` fails silently, as in ros2cli."""
    info, its_type = ros2.each("action info /nothing", "action type /nothing")
    assert info.stdout == "Action: /nothing\nAction clients: 0\nAction servers: 0\n"
    assert (its_type.returncode, its_type.stdout, its_type.stderr) == (1, "", "")


def test_send_goal_shows_feedback_and_result(ros2):
    """The whole conversation, in ros2cli's words."""
    said = ros2.output("action", "send_goal", "--feedback", *FIBONACCI, "{order: 3}")
    assert re.sub(r"(?<=ID: )[0-9a-f]{32}", "ID", said) == GOAL


def test_send_goal_without_feedback_shows_the_result_alone(ros2):
    """`--feedback` is what asks for it."""
    said = ros2.output("action", "send_goal", *FIBONACCI, "--stdin", stdin="order: 2")
    assert "Feedback" not in said
    assert said.endswith("Result:\n    sequence:\n- 0\n- 1\n- 1\n\nGoal finished with status: SUCCEEDED\n")


def test_send_goal_tells_a_rejection(ros2):
    """The server refuses a negative order."""
    said = ros2.output("action", "send_goal", *FIBONACCI, "{order: -1}")
    assert said.endswith("Sending goal:\n     order: -1\n\nGoal was rejected.\n")


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ("{steps: 3}", "AttributeError(\"'Fibonacci_Goal' object has no attribute 'steps'\")"),
        ("{order:4}", "ValueError(\"'order:4': write a blank after the colon, as in 'order: 4'\")"),
        ("{order: three}", "ValueError(\"invalid literal for int() with base 10: 'three'\")"),
    ],
)
def test_send_goal_says_which_value_does_not_fit(ros2, values, message):
    """ros2cli's message, with the error as Python writes it."""
    done = ros2("action", "send_goal", *FIBONACCI, values)
    assert (done.returncode, done.stderr) == (1, f"Failed to populate message fields: {message}\n")


def test_send_goal_refuses_what_is_no_action_type(ros2):
    """ros2cli's message for a type that is not there."""
    done = ros2("action", "send_goal", "/fibonacci", "nowhere/action/Nothing", "{}")
    assert (done.returncode, done.stderr) == (1, "The passed action type is invalid\n")


def test_ctrl_c_cancels_the_goal(ros2):
    """The goal does not go on running on the robot after its sender was stopped."""
    status, said, errors = ros2.interrupted(
        "action", "send_goal", "--feedback", *FIBONACCI, "{order: 40}", after="Goal accepted"
    )
    assert (status, errors) == (2, "")
    assert "Canceling goal...\n" in said and said.endswith("Goal canceled.\n")


FEEDBACK = """\
interface: FEEDBACK_TOPIC
goal_id:
  uuid: LIST
feedback:
  sequence: [0, 1, 1]
---
"""


def test_echo_prints_feedback_and_states(ros2):
    """A verb of later releases: each message under the name of its interface."""
    echo = ros2.start("action", "echo", "/fibonacci", "--flow-style", "-i", "feedback_topic|STATUS_TOPIC")
    try:
        said = ""
        while FEEDBACK not in said:  # the first goal may come too early
            ros2("action", "send_goal", *FIBONACCI, "{order: 2}")
            while select.select([echo.stdout], [], [], 1.0)[0]:
                said += os.read(echo.stdout.fileno(), 65536).decode()
            said = re.sub(r"(?<=uuid: )\[[0-9, ]+\]", "LIST", said)
    finally:
        echo.kill()
        echo.wait()
    assert "interface: STATUS_TOPIC\nstatus_list: [" in said


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("/fibonacci -i FEEDBACK", '"FEEDBACK" is incorrect interface name.\n'),
        ("/fibonacci -i ''", "Input action interface name is empty.\n"),
        ("/nothing", "Cannot find type for '/nothing'\n"),
        ("/fibonacci std_srvs/srv/Trigger", "The action type 'std_srvs/srv/Trigger' is invalid\n"),
    ],
)
def test_echo_refuses_what_it_cannot_show(ros2, words, message):
    """One line, status 1."""
    (done,) = ros2.each(f"action echo {words}")
    assert (done.returncode, done.stdout, done.stderr) == (1, "", message)
