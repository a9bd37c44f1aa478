"""`ros2 service` finds and calls services as ros2cli does."""

import os
import re
import select
import signal
from dataclasses import replace

import pytest

from course import registry
from course.foundation.processes import birth
from tests.ros2.conftest import Command

ADD = ("/add_two_ints", "example_interfaces/srv/AddTwoInts")
EVENT = """\
info:
  event_type: {}
  stamp:
    sec: N
    nanosec: N
  client_gid: LIST
  sequence_number: N
request: {}
response: {}
---
"""
SUM = """\
requester: making request: example_interfaces.srv.AddTwoInts_Request(a=2, b=3)

response:
example_interfaces.srv.AddTwoInts_Response(sum=5)

"""


def test_list_type_and_find(ros2):
    """Names, types, and from a type back to the names."""
    lines = ros2.output("service", "list", "-t").splitlines()
    assert "/add_two_ints [example_interfaces/srv/AddTwoInts]" in lines
    assert "/never [std_srvs/srv/Trigger]" in lines
    assert "/talker/list_parameters [rcl_interfaces/srv/ListParameters]" in lines
    assert lines == sorted(lines)
    assert not any("/_" in line for line in lines)
    assert ros2.outputs(
        "service list -c",
        "service type /add_two_ints",
        "service find example_interfaces/srv/AddTwoInts",
        "service find -c std_srvs/srv/SetBool",
    ) == [f"{len(lines)}\n", "example_interfaces/srv/AddTwoInts\n", "/add_two_ints\n", "0\n"]


def test_hidden_services_are_listed_on_request(ros2):
    """The option works on the verb and on the family."""
    for said in ros2.outputs("service list --include-hidden-services", "service --include-hidden-services list"):
        assert "/fibonacci/_action/send_goal" in said.splitlines()


def test_info_counts_clients_and_servers(ros2):
    """Jazzy's `service info`."""
    assert ros2.output("service", "info", "/add_two_ints") == (
        "Type: example_interfaces/srv/AddTwoInts\nClients count: 0\nServices count: 1\n"
    )


def test_an_unknown_service(ros2):
    """`type` fails silently, `info` with a line, as in ros2cli."""
    its_type, info = ros2.each("service type /nobody", "service info /nobody")
    assert (its_type.returncode, its_type.stdout, its_type.stderr) == (1, "", "")
    assert (info.returncode, info.stdout, info.stderr) == (1, "", "Unknown service '/nobody'\n")


def test_call_prints_request_and_response(ros2):
    """The chapter's call, with the full type and the short one."""
    assert ros2.outputs(
        "service call /add_two_ints example_interfaces/srv/AddTwoInts '{a: 2, b: 3}'",
        "service call /add_two_ints example_interfaces/AddTwoInts '{a: 2, b: 3}'",
    ) == [SUM, SUM]


def test_call_takes_values_from_stdin_and_defaults_without_any(ros2):
    """`--stdin` reads YAML; no values leave the fields at their defaults."""
    assert ros2.output("service", "call", *ADD, "--stdin", stdin="a: 2\nb: 3\n") == SUM
    assert "AddTwoInts_Response(sum=0)" in ros2.output("service", "call", *ADD)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ("{c: 1}", "'AddTwoInts_Request' object has no attribute 'c'"),
        ("{a: 1,5, b: 2}", "'1,5': a number has a decimal point, as in 1.5"),
        ("{a: two}", "invalid literal for int() with base 10: 'two'"),
        ("[1, 2]", "Value '[1, 2]' is expected to be a dictionary but is a list"),
        ("", "Value 'None' is expected to be a dictionary but is a NoneType"),
        (
            "{a: 99999999999999999999}",
            "The 'a' field must be an integer in [-9223372036854775808, 9223372036854775807]",
        ),
        ("{a: 1", "while parsing a flow mapping"),
    ],
)
def test_call_says_which_value_does_not_fit(ros2, values, message):
    """A wrong field, type, range or YAML is a message of one line and status 1, never a traceback."""
    done = ros2("service", "call", *ADD, values)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.startswith(f"Failed to populate field: {message}")


def test_call_says_that_a_field_takes_a_list(ros2):
    """A number in the place of a list of numbers: the message shows the list."""
    done = ros2("service", "call", "/x", "rcl_interfaces/srv/GetParameterTypes", "{names: 2}")
    assert done.stderr == "Failed to populate field: 'names' takes a list, even for a single value: names: [2]\n"


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("nowhere/srv/Add", "The passed service type is invalid\n"),
        ("example_interfaces/srv/Nothing", "The passed service type is invalid\n"),
        ("std_msgs/msg/String", "The passed type is not a service\n"),
        ("Add", "The passed service type is invalid\n"),
    ],
)
def test_call_refuses_what_is_no_service_type(ros2, name, message):
    """ros2cli's messages for a type that is not there, and for one that is not a service's."""
    done = ros2("service", "call", "/add_two_ints", name)
    assert (done.returncode, done.stdout, done.stderr) == (1, "", message)


def test_call_repeats_at_a_rate_until_interrupted(ros2):
    """`-r` goes on calling; Ctrl-C ends it without a traceback, with ros2cli's status (the number of SIGINT)."""
    status, output, errors = ros2.interrupted("service", "call", "-r", "50", *ADD, "{a: 2, b: 3}", after="sum=5")
    assert (status, errors) == (2, "")
    assert output.startswith(SUM.rstrip())
    done = ros2("service", "call", "-r", "-1", *ADD)
    assert (done.returncode, done.stderr) == (1, "rate must be greater than zero\n")


def test_call_of_a_service_that_never_answers_ends_with_ctrl_c(ros2):
    """It waits for ever, as ros2cli does, and is interrupted cleanly."""
    status, output, errors = ros2.interrupted(
        "service", "call", "/never", "std_srvs/srv/Trigger", after="making request"
    )
    assert (status, errors) == (2, "")
    assert output.rstrip() == "requester: making request: std_srvs.srv.Trigger_Request()"


def test_call_of_a_service_that_does_not_answer_says_after_a_while_that_it_waits(ros2):
    """On stderr, after 5 s; then it goes on waiting."""
    program = ros2.start("service", "call", "/never", "std_srvs/srv/Trigger")
    assert select.select([program.stderr], [], [], 30.0)[0]
    assert program.stderr.readline() == "still waiting for the answer. Ctrl-C ends this.\n"
    assert program.poll() is None
    program.send_signal(signal.SIGINT)
    program.communicate(timeout=30.0)


def waiting_line(program) -> str:
    """Return the first line on stderr of a command that waits, and end it."""
    try:
        assert select.select([program.stderr], [], [], 30.0)[0]
        return program.stderr.readline()
    finally:
        program.kill()
        program.communicate()


@pytest.mark.parametrize(
    ("words", "kind", "asked"),
    [
        ("service call /add_two_ints", "example_interfaces/srv/AddTwoInts", "std_srvs/srv/Trigger"),
        ("action send_goal /fibonacci", "example_interfaces/action/Fibonacci", "course_interfaces/action/Lift"),
    ],
)
def test_a_name_of_another_type_is_told_with_the_line_to_write(ros2, words, kind, asked):
    name = words.split()[-1]
    assert waiting_line(ros2.start(*words.split(), asked)) == (
        f"still waiting; {name} is served with the type {kind}, and you ask for {asked}. Ctrl-C ends this; then write: "
        f"ros2 {words} {kind} ...\n"
    )


@pytest.mark.parametrize("name", ["/add_two_ints", "/add_too_ints"])
def test_a_program_that_has_ended_and_never_served_the_name_is_not_blamed(ros2, monkeypatch, tmp_path, name):
    """`makes` are the services that it could make."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    node = registry.NodeRecord("hello.py", "ended", False, 0.0, "", stories=["hello.py ended."], told=[0.0], makes=[])
    domain, pid = int(ros2.environment["ROS_DOMAIN_ID"]), os.getpid()
    record = registry.SessionRecord(pid, domain, "", 0.0, birth(pid), [node])
    registry.write(record)
    here = Command(ros2.environment | {"XDG_RUNTIME_DIR": str(tmp_path)}, ros2.loaded)
    said = waiting_line(here.start("service", "call", name, "std_srvs/srv/Trigger"))
    assert said.startswith("still waiting; ") and "/add_two_ints" in said
    registry.write(replace(record, nodes=[replace(node, makes=["~/add_too_ints"])]))
    if name == "/add_too_ints":
        done = here("service", "call", name, "std_srvs/srv/Trigger")
        assert done.stderr == "There is no such service. hello.py ended.\n"


def test_call_waits_for_a_service_that_is_not_there(alone):
    """It says that it waits; Ctrl-C ends it."""
    line = "waiting for service to become available...\n"
    assert alone.interrupted("service", "call", *ADD, after="waiting") == (2, line, "")


def test_echo_prints_requests_and_responses(ros2):
    """The server publishes both; the kind of an event is told by its name."""
    echo = ros2.start("service", "echo", "/add_two_ints", "--flow-style")
    try:
        said = ""
        while "RESPONSE_SENT" not in said or not said.endswith("---\n"):  # the first call may come too early
            ros2("service", "call", *ADD, "{a: 2, b: 3}")
            while select.select([echo.stdout], [], [], 1.0)[0]:
                said += os.read(echo.stdout.fileno(), 65536).decode()
    finally:
        echo.kill()
        echo.wait()
    said = re.sub(r"(?<=gid: )\[[0-9, ]+\]", "LIST", said)
    said = re.sub(r"(?<=sec: )\d+|(?<=number: )\d+", "N", said)
    assert EVENT.format("REQUEST_RECEIVED", "[{a: 2, b: 3}]", "[]") in said
    assert EVENT.format("RESPONSE_SENT", "[]", "[{sum: 5}]") in said


def test_echo_of_what_publishes_no_events(ros2):
    """ros2cli's question, and its messages for what is not there."""
    silent = (
        "No publishers on topic '/never/_service_event'; is service introspection on the client or server enabled?\n"
    )
    assert ros2.interrupted("service", "echo", "/never", after="No publishers") == (2, silent, "")
    unknown, wrong = ros2.each("service echo /nobody", "service echo /never std_msgs/msg/String")
    assert (unknown.returncode, unknown.stderr) == (1, "Cannot find type for '/nobody'\n")
    assert (wrong.returncode, wrong.stderr) == (1, "The service type 'std_msgs/msg/String' is invalid\n")
