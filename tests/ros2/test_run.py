"""`ros2 run` finds and runs nodes, and ends as its node ends."""

import contextlib
import os
import pty
import signal
import subprocess
import sys
from xml.etree import ElementTree

import pytest

from course.foundation.waiting import wait_until
from course.interfaces import install
from course.ros import packages
from course.session.domains import claim_domain
from tests.ros2.conftest import SECONDS, Command

NODE = """\
import sys

import rclpy
from rclpy.node import Node


def main(args=None):
    rclpy.init(args=args)
    node = Node("parameter_node")
    node.declare_parameter("robot_name", "atlas")
    print(node.get_fully_qualified_name(), node.get_parameter("robot_name").value, sys.argv[1:], flush=True)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
"""
WAITING = "import time\nprint('up', flush=True)\ntime.sleep(60)\n"
MANIFEST = "<package format='3'><name>my_robot</name><version>0.0.0</version></package>"


@pytest.fixture
def folder(tmp_path):
    """A reader's folder, with a package in it."""
    package = tmp_path / "my_package"
    package.mkdir()
    (package / "parameter_node.py").write_text(NODE)
    (package / "waiting.py").write_text(WAITING)
    (package / "failing.py").write_text("raise SystemExit(3)\n")
    return tmp_path


def test_runs_a_node_of_the_reader_s_folder_with_ros_arguments(alone, folder):
    """The chapter's `ros2 run my_package parameter_node --ros-args -p robot_name:=optimus`, and a remapped name."""
    words = ("run", "my_package", "parameter_node", "--ros-args", "-p", "robot_name:=optimus", "-r", "__ns:=/lab")
    said = alone.output(*words, cwd=folder)
    assert said == f"/lab/parameter_node optimus {list(words[3:])}\n"


def test_a_cell_is_told_that_it_lasts_as_long_as_the_program(alone, folder):
    """In a cell, `!` gives the program a terminal of its own."""
    parent, child = pty.openpty()
    command = alone.words("run", "my_package", "waiting")
    environment = alone.environment | {"JPY_PARENT_PID": "1"}
    program = subprocess.Popen(command, cwd=folder, env=environment, stdin=child, stdout=child, stderr=child)
    os.close(child)
    said = b""
    while b"ended by" not in said and len(said) < 1000:
        said += os.read(parent, 1000)
    program.send_signal(signal.SIGTERM)
    program.wait(SECONDS)
    os.close(parent)
    assert b"This cell lasts as long as the program, and is ended by the" in said


def test_parameter_files_pass_through(alone, folder):
    """`--params-file` reaches the node."""
    (folder / "file.yaml").write_text("/parameter_node:\n  ros__parameters:\n    robot_name: talos\n")
    said = alone.output("run", "my_package", "parameter_node", "--ros-args", "--params-file", "file.yaml", cwd=folder)
    assert said.startswith("/parameter_node talos ")


def test_a_package_is_known_by_its_manifest(alone, folder):
    """A package.xml names the package, and its modules can import each other by that name."""
    module = folder / "src" / "robot" / "my_robot"
    module.mkdir(parents=True)
    (module.parent / "package.xml").write_text(MANIFEST)
    (module / "__init__.py").write_text("")
    (module / "parts.py").write_text("JOINTS = 2\n")
    (module / "count.py").write_text("from my_robot.parts import JOINTS\nprint(JOINTS)\n")
    assert alone.output("run", "my_robot", "count", cwd=folder) == "2\n"
    assert alone.output("run", "my_robot", "count.py", cwd=folder / "src") == "2\n"


@pytest.mark.timeout(30)  # s
def test_a_manifest_and_a_program_are_small_ordinary_files(folder, monkeypatch):
    """A pipe is not waited for, and a manifest of 80 MB would take more than 1 GB."""
    monkeypatch.chdir(folder)
    for name in ("pipe", "large", "strange"):
        (folder / name).mkdir()
    os.mkfifo(folder / "pipe" / "package.xml")
    os.mkfifo(folder / "my_package" / "pipe.py")
    (folder / "large" / "package.xml").write_text(f"{MANIFEST}{' ' * 1_000_000}")
    (folder / "strange" / "package.xml").write_bytes(b"<?xml version='1.0' encoding='nothing'?><package/>")
    assert set(packages.own_folders()) == {"my_package", "pipe", "large", "strange"}
    assert set(packages.find_executables("my_package")) == {"parameter_node", "waiting", "failing"}


def test_runs_an_executable_of_an_ament_package(alone, tmp_path):
    """An executable as colcon installs it, in lib/<package> of a prefix in AMENT_PREFIX_PATH, is run."""
    index = tmp_path / "share" / "ament_index" / "resource_index" / "packages"
    index.mkdir(parents=True)
    (index / "installed_package").write_text("")
    executable = tmp_path / "lib" / "installed_package" / "hello"
    executable.parent.mkdir(parents=True)
    executable.write_text("#!/bin/sh\necho hello $1\n")
    executable.chmod(0o755)
    words = ("run", "installed_package", "hello", "world")
    assert alone.output(*words, AMENT_PREFIX_PATH=str(tmp_path)) == "hello world\n"
    assert alone.output("run", "--prefix", "echo would", *words[1:], AMENT_PREFIX_PATH=str(tmp_path)) == (
        f"would {executable} world\n"
    )
    twin = executable.parent / "other" / "hello"
    twin.parent.mkdir()
    twin.write_text("#!/bin/sh\n")
    twin.chmod(0o755)
    done = alone(*words, AMENT_PREFIX_PATH=str(tmp_path))
    assert (done.returncode, done.stderr) == (1, f"Multiple executables found:\n- {executable}\n- {twin}\n")
    other = executable.with_name("other_hello")
    other.write_text("#!/bin/sh\necho other\n")
    other.chmod(0o755)
    assert alone.output("run", "installed_package", "other_hello", AMENT_PREFIX_PATH=str(tmp_path)) == "other\n"
    folder = tmp_path / "here" / "installed_package"
    folder.mkdir(parents=True)
    (folder / "other_hello.py").write_text("print('from the folder')\n")
    for name in ("other_hello", "other_hello.py"):
        words = ("run", "installed_package", name)
        assert alone.output(*words, cwd=folder.parent, AMENT_PREFIX_PATH=str(tmp_path)) == "other\n"


def test_the_course_s_nodes_are_its_modules(alone, tmp_path, monkeypatch):
    """Each module of course/nodes runs under its name; another name is told from an unknown package."""
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    found = packages.find_executables("course")
    assert found["world"] == [[sys.executable, "-P", "-m", "course.nodes.world"]]
    assert "__init__" not in found
    install.register(tmp_path)
    (command,) = packages.find_executables("course")["world"]
    assert command == [str(tmp_path / "lib" / "course" / "world")]
    assert sorted(packages.find_executables("course")) == sorted(found)
    unknown = alone("run", "course", "nothing")
    assert (unknown.returncode, unknown.stderr) == (1, "No executable found\n")


def test_the_course_is_a_package_for_any_ros2(tmp_path):
    """Its executables stand in lib/course, and run without this environment, beside a folder called `course` too."""
    install.register(tmp_path)
    assert (tmp_path / "share" / "ament_index" / "resource_index" / "packages" / "course").exists()
    assert ElementTree.parse(tmp_path / "share" / "course" / "package.xml").getroot().findtext("name") == "course"
    (tmp_path / "course").mkdir()
    (tmp_path / "course" / "__init__.py").write_text("raise SystemExit('the wrong one')\n")
    program = tmp_path / "lib" / "course" / "add_two_ints_client"
    done = subprocess.run([program], capture_output=True, text=True, cwd=tmp_path, env={"PATH": "/usr/bin:/bin"})
    assert "usage" in (done.stdout + done.stderr).lower(), done


def test_what_is_not_there(alone, folder):
    """ros2cli's messages, status 1; a path is no executable's name."""
    package, executable, path = (
        alone("run", *words.split(), cwd=folder)
        for words in ("nowhere node", "my_package nothing", "my_package ../my_package/waiting")
    )
    assert (package.returncode, package.stderr) == (1, "Package 'nowhere' not found\n")
    assert (executable.returncode, executable.stderr) == (1, "No executable found\n")
    assert (path.returncode, path.stderr) == (1, "No executable found\n")


def test_the_node_s_exit_status_is_the_command_s(alone, folder):
    """ros2cli adds a line."""
    done = alone("run", "my_package", "failing", cwd=folder)
    assert (done.returncode, done.stdout) == (3, "[ros2run]: Process exited with failure 3\n")


def test_ctrl_c_is_the_node_s_to_handle(alone, folder):
    """The terminal sends Ctrl-C to both: the command waits for the node, and adds no traceback of its own."""
    child = alone.start("run", "my_package", "waiting", cwd=folder)
    assert child.stdout.readline() == "up\n"
    child.send_signal(signal.SIGINT)  # the command alone: it goes on waiting
    child.send_signal(signal.SIGTERM)  # is passed on, so that no node is left behind
    said, errors = child.communicate(timeout=20)
    assert (said, errors) == ("[ros2run]: Terminated\n", "")
    assert child.returncode == 256 - signal.SIGTERM


DEAF_AT_FIRST = """
import signal

signal.signal(signal.SIGTERM, lambda *_: signal.signal(signal.SIGTERM, signal.SIG_DFL))
print("up", flush=True)
while True:
    signal.pause()
"""


def test_a_program_that_misses_the_first_signal_to_end_is_told_again(alone, tmp_path):
    """As one node in a hundred does that has no timer: rclpy wakes its executor before there is a reason to end."""
    (tmp_path / "my_package").mkdir()
    (tmp_path / "my_package" / "deaf.py").write_text(DEAF_AT_FIRST)
    child = alone.start("run", "my_package", "deaf", cwd=tmp_path)
    assert child.stdout.readline() == "up\n"
    child.terminate()
    assert child.communicate(timeout=20)[0] == "[ros2run]: Terminated\n"


def test_the_books_package_is_the_course_until_the_reader_has_one(alone, tmp_path):
    (tmp_path / "hello.py").write_text("print('hello')\n")
    assert alone.output("run", "my_package", "hello", cwd=tmp_path) == "hello\n"
    with contextlib.chdir(tmp_path):
        assert (
            packages.find_executables("my_package")["parameter_node"]
            == packages.find_executables("course")["parameter_node"]
        )
    (tmp_path / "my_package").mkdir()
    (tmp_path / "my_package" / "own.py").write_text("print('own')\n")
    assert alone.output("run", "my_package", "own", cwd=tmp_path) == "own\n"
    assert alone("run", "my_package", "parameter_node", cwd=tmp_path).returncode == 1


def test_the_tutorials_demos_have_their_names_and_say_what_they_say_there(environment, tmp_path):
    """Talker and listener, the client with its two numbers, and the keeper of any parameter."""
    claim, domain = claim_domain()
    ros2 = Command({**environment, "ROS_DOMAIN_ID": str(domain), "RCUTILS_LOGGING_USE_STDOUT": "1"})
    talker = ros2.start("run", "demo_nodes_cpp", "talker", cwd=tmp_path)
    server = ros2.start("run", "demo_nodes_py", "add_two_ints_server", cwd=tmp_path)
    board = ros2.start("run", "demo_nodes_cpp", "parameter_blackboard", "--ros-args", "-p", "speed:=3", cwd=tmp_path)
    listener = ros2.start("run", "demo_nodes_py", "listener", cwd=tmp_path)
    try:
        names = "/add_two_ints_server\n/listener\n/parameter_blackboard\n/talker\n"
        assert wait_until(lambda: ros2.output("node", "list") == names, SECONDS)
        assert "I heard: [Hello World: " in listener.stdout.readline()
        asked = ros2("run", "demo_nodes_py", "add_two_ints_client", cwd=tmp_path)
        assert asked.returncode == 0 and "2 + 3 = 5" in asked.stdout, asked
        assert ros2.output("param", "set", "/parameter_blackboard", "name", "Ada") == "Set parameter successful\n"
        assert ros2.output("param", "get", "/parameter_blackboard", "speed") == "Integer value is: 3\n"
        assert ros2.output("param", "get", "/parameter_blackboard", "name") == "String value is: Ada\n"
    finally:
        for child in (talker, server, board, listener):
            child.terminate()
            child.communicate(timeout=SECONDS)
        claim.close()
    assert "demo_nodes_py talker\n" in ros2.output("pkg", "executables", "demo_nodes_py")
    assert ros2("run", "demo_nodes_py", "parameter_blackboard").stderr == "No executable found\n"
