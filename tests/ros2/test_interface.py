"""`ros2 interface` shows definitions as ros2cli does."""

import os
import pty
import subprocess

TWIST = """\
# This expresses velocity in free space broken into its linear and angular parts.

Vector3  linear
\tfloat64 x
\tfloat64 y
\tfloat64 z
Vector3  angular
\tfloat64 x
\tfloat64 y
\tfloat64 z
"""
STAMPED = """\
std_msgs/Header header
\tbuiltin_interfaces/Time stamp
\t\tint32 sec
\t\tuint32 nanosec
\tstring frame_id
Vector3 vector
\tfloat64 x
\tfloat64 y
\tfloat64 z
"""


def test_show_a_message_a_service_and_an_action(alone):
    """Nested messages are below their field, indented; the separators stay."""
    twist, service, action, plain = alone.outputs(
        "interface show geometry_msgs/msg/Twist",
        "interface show example_interfaces/srv/AddTwoInts",
        "interface show example_interfaces/action/Fibonacci",
        "interface show --no-comments geometry_msgs/msg/Vector3Stamped",
    )
    assert twist == TWIST
    assert service == "int64 a\nint64 b\n---\nint64 sum\n"
    assert action == "# Goal\nint32 order\n---\n# Result\nint32[] sequence\n---\n# Feedback\nint32[] sequence\n"
    assert plain == STAMPED


def test_show_all_comments(alone):
    """The nested definitions' comments too."""
    said = alone.output("interface", "show", "--all-comments", "geometry_msgs/msg/Twist")
    assert said.startswith(TWIST.partition("\t")[0] + "\t# This represents a vector in free space.\n")


def test_a_terminal_obeys_no_comment(alone, tmp_path):
    """Control characters of a foreign definition are escaped in a terminal; a pipe gets them unchanged."""
    evil = "# \x1b]52;c;cm0=\x07\x1b[2J \u202egnp.exe \x9b2J <img src=x>"
    (tmp_path / "share/evil/msg").mkdir(parents=True)
    (tmp_path / "share/evil/msg/Evil.msg").write_text(f"{evil}\nint32 a {evil}\n", encoding="utf-8")
    for resource, content in (("packages", ""), ("rosidl_interfaces", "msg/Evil.msg\n")):
        marker = tmp_path / "share/ament_index/resource_index" / resource / "evil"
        marker.parent.mkdir(parents=True)
        marker.write_text(content)
    environment = alone.environment | {"AMENT_PREFIX_PATH": f"{tmp_path}:{alone.environment['AMENT_PREFIX_PATH']}"}
    words = ["interface", "show", "evil/msg/Evil"]
    assert alone.output(*words, **environment) == f"{evil}\nint32 a {evil}\n"
    ours, terminals = pty.openpty()
    done = subprocess.run(alone.words(*words), stdout=terminals, env=environment, timeout=60)
    os.close(terminals)
    with open(ours, "rb", buffering=0) as shown:
        said = shown.read(4096).decode()
    told = r"# \x1b]52;c;cm0=\x07\x1b[2J \x202egnp.exe \x9b2J <img src=x>"
    assert (done.returncode, said) == (0, f"{told}\r\nint32 a {told}\r\n")


def test_show_reads_a_type_from_a_pipe(alone):
    """`ros2 topic type /x | ros2 interface show -`."""
    assert alone.output("interface", "show", "-", stdin="std_msgs/msg/Bool\n").endswith("bool data\n")


def test_list_and_package(alone):
    """All kinds, or one; a package's interfaces."""
    everything, services, package, actions = alone.outputs(
        "interface list",
        "interface list -s",
        "interface package example_interfaces",
        "interface package -a example_interfaces",
    )
    assert everything.startswith("Messages:\n    action_msgs/msg/GoalInfo\n")
    assert "\nServices:\n    action_msgs/srv/CancelGoal\n" in everything
    assert "\nActions:\n" in everything
    assert services.startswith("Services:\n    action_msgs/srv/CancelGoal\n") and "/msg/" not in services
    assert package == "example_interfaces/action/Fibonacci\nexample_interfaces/srv/AddTwoInts\n"
    assert actions == "example_interfaces/action/Fibonacci\n"


def test_packages(alone):
    """All packages with interfaces, or those with one kind."""
    everything, messages, services, actions = (
        said.splitlines()
        for said in alone.outputs(
            "interface packages", "interface packages -m", "interface packages -s", "interface packages -a"
        )
    )
    assert everything == sorted(everything)
    assert {"std_msgs", "std_srvs", "example_interfaces"} <= set(everything)
    assert "std_msgs" in messages and "std_srvs" not in messages
    assert "std_srvs" in services and "std_msgs" not in services
    assert "example_interfaces" in actions and "std_srvs" not in actions


def test_proto(alone):
    """A message, a request or a goal to copy, in quotes or without."""
    assert alone.outputs(
        "interface proto std_msgs/msg/String",
        "interface proto --no-quotes example_interfaces/srv/AddTwoInts",
        "interface proto --no-quotes example_interfaces/action/Fibonacci",
    ) == ["\"data: ''\n\"\n", "a: 0\nb: 0\n\n", "order: 0\n\n"]


def test_what_is_not_there(alone):
    """ros2cli's messages, status 1."""
    ran = alone.each(
        "interface package nowhere",
        "interface show nowhere/msg/No",
        "interface show std_msgs/String",
        "interface show std_msgs/msg/No",
    )
    assert [done.returncode for done in ran] == [1] * 4
    assert [done.stderr for done in ran[:3]] == [
        "Unknown package 'nowhere'\n",
        "Unknown package 'nowhere'\n",
        "Invalid name 'std_msgs/String'. Expected three parts separated by '/'\n",
    ]
    assert ran[3].stderr.startswith("Could not find the interface '")
