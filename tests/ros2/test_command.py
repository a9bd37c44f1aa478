"""The command itself: help, usage errors, completion, doctor, and the hand-over to a real `ros2`."""

import importlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

from course.ros2 import main

HELP = """\
usage: ros2 [-h] [--use-python-default-buffering] Call `ros2 <command> -h` for more detailed usage. ...

ros2 is an extensible command-line tool for ROS 2.

"""
REAL = """\
#!/bin/sh
echo "real: $@"
echo "guard: ${_ROS_WHEELS_BOOTSTRAP_COMPLETE:-none}"
case "$LD_LIBRARY_PATH" in *site-packages*) echo polluted;; esac
exit 7
"""


def test_help(alone):
    """ros2cli's layout; a family and the command alone print their help with status 0."""
    plain, asked, family, verb = alone.outputs("", "-h", "service", "service call -h")
    assert plain == asked
    assert plain.startswith(HELP)
    assert "\nCommands:\n  action     Various action related sub-commands\n" in plain
    assert plain.endswith("\n  Call `ros2 <command> -h` for more detailed usage.\n")
    assert (
        "  call  Call a service\n  echo  Echo a service\n  find  Output a list of available services of a given type\n"
        in family
    )
    assert verb.startswith(
        "usage: ros2 service call [-h] [--stdin] [-r N] service_name service_type [values]\n\nCall a service\n"
    )


@pytest.mark.parametrize("family", main.COMMANDS)
def test_every_verb_has_help(family, capsys):
    """`-h` works everywhere, and needs no ROS."""
    verbs = getattr(importlib.import_module(f"course.ros2.{main.ALIASES.get(family, family)}"), "VERBS", {})
    for words in ([family], *([family, verb] for verb in verbs)):
        with pytest.raises(SystemExit, match="0"):
            main.make_parser(words).parse_args([*words, "-h"])
        assert capsys.readouterr().out.startswith(f"usage: ros2 {' '.join(words)} [-h]")


def test_usage_errors(alone):
    """argparse's message and status 2, as in ros2cli."""
    command, verb, missing, value = alone.each(
        "nothing", "topic nothing", "param get", "topic pub -r 0 /x std_msgs/msg/String"
    )
    assert "ros2: error: argument Call `ros2 <command> -h` for more detailed usage.: invalid choice: 'nothing'" in (
        command.stderr
    )
    assert "invalid choice: 'nothing'" in verb.stderr
    assert "ros2 param get: error: the following arguments are required: node_name, parameter_name" in missing.stderr
    assert "argument -r/--rate: Value must be positive" in value.stderr
    assert [done.returncode for done in (command, verb, missing, value)] == [2] * 4


@pytest.mark.parametrize("command", ["bag", "launch", "security", "extensions"])
def test_a_command_of_a_full_installation(command, monkeypatch):
    """One line says that it is elsewhere, and what there is here."""
    monkeypatch.setattr(sys, "argv", ["ros2", command, "play", "-x"])
    monkeypatch.setattr(main, "find_real", lambda: None)
    assert main.main() == (
        f"ros2 {command} needs a full installation of ROS 2 (https://docs.ros.org/en/jazzy/Installation.html): "
        "this ros2 has action, daemon, doctor, interface, lifecycle, node, param, pkg, run, service, topic, wtf"
    )


@pytest.mark.parametrize(
    ("command", "word"), [("component", "`ros2 run PACKAGE EXECUTABLE`"), ("multicast", "`ros2 doctor`")]
)
def test_a_command_that_nothing_here_needs_says_what_to_use(command, word, alone):
    """In a line, on stderr."""
    done = alone(command, "list")
    assert (done.returncode, done.stdout) == (1, "") and done.stderr.startswith(f"ros2 {command} ")
    assert word in done.stderr and done.stderr.count("\n") == 1


def test_there_is_no_daemon(alone):
    """Scripts that stop and start it go on."""
    line = "There is no daemon: this ros2 does not use one, and each command queries the graph itself\n"
    assert alone.outputs("daemon status", "daemon stop", "daemon start --debug") == [line] * 3


def test_a_name_that_ros_does_not_allow(alone):
    """rclpy's explanation, status 1, no traceback and no warnings."""
    ran = alone.each(
        "topic echo '/no good' std_msgs/msg/String",
        "topic hz '/no good'",
        "topic pub -1 -n 'no good' /x std_msgs/msg/String",
        "service call '/no good' std_srvs/srv/Trigger",
        "action info '/no good'",
        "action send_goal '/no good' example_interfaces/action/Fibonacci",
    )
    for done in ran:
        assert done.returncode == 1
        assert "must not contain characters other than" in done.stderr
        assert "Traceback" not in done.stderr and "Warning" not in done.stderr


def completions(command, line: str) -> list[str]:
    """Return what the Tab key offers after `line`."""
    read, write = os.pipe()
    script = f"exec 8>&{write}; exec " + " ".join(command.words())
    environment = {
        **command.environment,
        "_ARGCOMPLETE": "1",
        "_ARGCOMPLETE_IFS": "\n",
        "COMP_LINE": line,
        "COMP_POINT": str(len(line)),
        "COMP_TYPE": "9",
    }
    subprocess.run(["bash", "-c", script], pass_fds=[write], env=environment, timeout=20, check=False)
    os.close(write)
    with os.fdopen(read) as answer:
        return [word.strip().replace("\\", "") for word in answer.read().split("\n") if word.strip()]


@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("ros2 ser", {"service"}),
        ("ros2 param de", {"delete", "describe"}),
        ("ros2 node info /par", {"/parameter_node"}),
        ("ros2 topic echo /chat", {"/chatter"}),
        ("ros2 service call /add_two_ints ex", {"example_interfaces/srv/AddTwoInts"}),
        ("ros2 param get /parameter_node max", {"max_speed"}),
        ("ros2 interface show std_srvs/srv/T", {"std_srvs/srv/Trigger"}),
        ("ros2 run cour", {"course"}),
        ("ros2 topic b", {"bw"}),
        ("ros2 topic delay /chat", {"/chatter"}),
        ("ros2 service echo /add_two_ints ex", {"example_interfaces/srv/AddTwoInts"}),
        ("ros2 action e", {"echo"}),
        ("ros2 interface p", {"package", "packages", "proto"}),
        ("ros2 pkg ", {"create", "executables", "list", "prefix", "xml"}),
        ("ros2 pkg prefix std_s", {"std_srvs"}),
        ("ros2 daemon st", {"start", "status", "stop"}),
        ("ros2 action send_goal /fib", {"/fibonacci"}),
    ],
)
def test_tab_completion(ros2, line, offered):
    """Commands, verbs, and the names of what is live."""
    assert set(completions(ros2, line)) == offered


def test_doctor(ros2):
    """The checks' warnings go to stderr, the verdict to stdout; warnings count only if asked for."""
    checked, strict, report = ros2.each("doctor", "doctor --include-warnings", "doctor --report -ep")
    assert (checked.returncode, checked.stdout) == (0, "\nAll 5 checks passed\n\n")
    assert "UserWarning: Publisher without subscriber detected on /heard.\n" in checked.stderr
    assert "Failed modules:" in strict.stdout and "topic" in strict.stdout.splitlines()[-1]
    assert "\n   RMW MIDDLEWARE\nmiddleware name" in report.stdout
    assert "distribution name" in report.stdout and "PACKAGE VERSIONS" not in report.stdout
    assert ros2("wtf").stdout == checked.stdout


@pytest.fixture
def real(tmp_path) -> Path:
    """A folder with a `ros2` that is not the course's, as a sourced installation puts on PATH."""
    path = tmp_path / "real" / "ros2"
    path.parent.mkdir()
    path.write_text(REAL)
    path.chmod(0o755)
    return path.parent


def test_a_real_ros2_is_handed_all_arguments(alone, real):
    """It runs in this command's place, with its status, and without the wheels' libraries."""
    path = alone.environment["PATH"] + os.pathsep + str(real)
    done = alone("run", "course", "x", "--ros-args", "-p", "a:='b c'", PATH=path)
    assert (done.returncode, done.stderr) == (7, "")
    assert done.stdout == "real: run course x --ros-args -p a:='b c'\nguard: none\n"


def test_another_environment_s_copy_of_this_command_is_not_a_real_one(alone, tmp_path):
    """Two environments on PATH do not hand over to each other for ever."""
    copy = tmp_path / "ros2"
    copy.write_text(f"#!{sys.executable}\nfrom course.ros2.main import main\n")
    copy.chmod(0o755)
    path = str(tmp_path) + os.pathsep + alone.environment["PATH"]
    assert alone.output("interface", "show", "std_srvs/srv/Trigger", PATH=path).startswith("---\n")
