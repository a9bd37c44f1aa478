"""No student reaches another one: each of these tests tries to, as the student, from the student's notebook.

A try is worth something only where it works on the student's own things, so each does that first.
"""

import json
import sys
from pathlib import Path

import pytest

from autograder import paths
from autograder.classroom import hub, servers
from autograder.classroom.plan import COURSE_ID

NODE = """
import rclpy
from rclpy.context import Context
def node(name, domain=17):
    context = Context()
    rclpy.init(context=context, domain_id=domain)
    return rclpy.create_node(name, context=context)
"""
SEEN = """
import time
def names(one, wanted, seconds):
    end = time.monotonic() + seconds
    while time.monotonic() < end and wanted not in one.get_node_names():
        time.sleep(0.1)
    return sorted(one.get_node_names())
"""


@pytest.fixture(scope="module")
def kernels(ada, bob):
    """A kernel of each, for all tries together."""
    both = ada.kernel(), bob.kernel()
    yield both
    for each in both:
        each.close()


@pytest.fixture(scope="module")
def walked(kernels):
    """Ada's kernel, in which `walked` has each folder that she sees, with what is in it."""
    assert kernels[0].run("import os; walked = list(os.walk('/'))").error == ""
    return kernels[0]


def test_nodes_in_the_same_ros_domain_do_not_meet(kernels):
    for live, name in zip(kernels, ("of_ada", "of_bob"), strict=True):
        assert live.run(f"{NODE}{SEEN}\nown = node('{name}')\nsecond = node('beside_{name}')").error == ""
        own = live.run(f"print(names(own, 'beside_{name}', 60))").text
        assert f"['beside_{name}', '{name}']" in own, "a node of one's own is not found"
    assert "bob" not in kernels[0].run("print(names(own, 'of_bob', 4))").text


def test_shared_memory_temporary_files_and_abstract_sockets_are_ones_own(kernels):
    make = """
import os, socket
for folder in ("/dev/shm", "/tmp"):
    with open(f"{folder}/seen", "w") as file:
        file.write("x")
held = socket.socket(socket.AF_UNIX)
held.bind("\\0seen")
held.listen()
"""
    look = """
import os, socket
print([os.path.exists(f"{folder}/seen") for folder in ("/dev/shm", "/tmp")])
with socket.socket(socket.AF_UNIX) as trying:
    print(trying.connect_ex("\\0seen"))
"""
    ada, bob = kernels
    bob.run(make)
    assert bob.run(look).text.split() == ["[True,", "True]", "0"]
    seen = ada.run(look).text.split()
    assert seen[:2] == ["[False,", "False]"] and seen[2] != "0"


def test_files_of_others_of_the_grader_and_of_the_hub_are_not_there(walked, classroom):
    secret = [paths.HIDDEN, paths.PACKAGE, paths.repository() / "solutions", paths.repository() / "tests"]
    secret += [
        paths.repository() / "notebooks",
        classroom.state,
        classroom.grading,
        classroom.homes,
        classroom.run / "servers",
    ]
    wanted = [*map(str, secret), "/home/bob", "/home/teacher", f"{classroom.homes}/bob", "/etc/shadow"]
    # Of root's home folder there is the way to Python at most.
    seen = [paths.repository(), Path(sys.prefix)]
    wanted += [str(path) for path in Path("/root").iterdir() if not any(each.is_relative_to(path) for each in seen)]
    look = f"import os; print([path for path in {wanted!r} + ['/home/ada'] if os.path.exists(path)])"
    assert walked.run(look).text == "['/home/ada']\n"
    search = "print([at for at, _, names in walked if 'suite.py' in names and 'hidden' in at])"
    assert walked.run(search).text == "[]\n"


def test_a_student_can_write_only_at_home_and_where_it_is_handed_in(walked):
    find = """
folders = {os.path.join(at, name) for at, names, _ in walked for name in names}
own = ("/proc", "/home/ada", "/tmp", "/dev")
print(sorted(at for at in folders if os.access(at, os.W_OK) and not at.startswith(own)))
"""
    assert walked.run(find).text == f"['/srv/exchange/{COURSE_ID}/inbound']\n"


def test_processes_and_kernels_of_others_are_out_of_reach(ada, bob, kernels):
    look = """
import os
users = {os.stat(f"/proc/{number}").st_uid for number in os.listdir("/proc") if number.isdigit()}
print(users - {0, os.getuid()})
"""
    assert kernels[0].run(look).text == "set()\n"
    assert ada.call("GET", "api/kernels").ok
    stolen = ada.session.get(f"{bob.base}api/kernels", headers={"Referer": ada.hub})
    assert stolen.status_code == 403, "ada sees the kernels of bob"
    assert ada.session.get(f"{ada.hub}hub/api/users").status_code == 403
    assert ada.session.delete(f"{ada.hub}hub/api/users/bob/server").status_code in (403, 404)


def test_what_others_hand_in_and_get_back_cannot_be_found(ada, bob, kernels, classroom):
    one, other = kernels
    made = f"import os\nos.makedirs('/srv/exchange/{COURSE_ID}/inbound/bob+services+2026-01-01 00:00:00.0 UTC+r4nd0m')"
    assert other.run(made).error == ""
    for folder in ("inbound", "feedback"):
        assert one.run(f"import os; os.listdir('/srv/exchange/{COURSE_ID}/{folder}')").error == "PermissionError"
    folder = f"/srv/exchange/{COURSE_ID}/inbound/bob+services+2026-01-01 00:00:00.0 UTC+r4nd0m"
    assert one.run(f"import os; os.rename('{folder}', '{folder}x')").error == "PermissionError"
    assert other.run(f"import os; os.rmdir('{folder}')").error == ""


def test_the_machine_cannot_be_reached(kernels, classroom):
    """Neither its services, among them the proxy's port, nor any other address."""
    look = f"""
import socket
def reaches(port, host="127.0.0.1"):
    with socket.socket() as trying:
        trying.settimeout(5)
        return trying.connect_ex((host, port)) == 0
with socket.socket() as own:
    own.bind(("127.0.0.1", 0))
    own.listen()
    print(reaches(own.getsockname()[1]))
print(reaches({classroom.port}), reaches(53, "192.0.2.1"), sorted(name for _, name in socket.if_nameindex()))
"""
    assert kernels[0].run(look).text.splitlines() == ["True", "False False ['lo']"]


def test_a_student_gets_no_more_rights(kernels):
    look = """
import subprocess
def can(*command):
    return subprocess.run(command, capture_output=True).returncode == 0
print(can("true"), can("unshare", "-Ur", "true"), can("mount", "-t", "tmpfs", "x", "/tmp"), can("su", "-c", "true"))
print([line for line in open("/proc/self/status") if line.startswith(("CapEff", "CapBnd", "NoNewPrivs"))])
"""
    said = kernels[0].run(look).text.splitlines()
    assert said[0] == "True False False False"
    zero = "0" * 16
    assert said[1] == str([f"CapEff:\t{zero}\n", f"CapBnd:\t{zero}\n", "NoNewPrivs:\t1\n"])


def test_the_passwords_and_the_hubs_database_are_for_root(classroom):
    for path in (classroom.state / hub.SHARED, classroom.state / "classroom.json"):
        assert path.stat().st_mode & 0o077 == 0
    assert classroom.state.stat().st_mode & 0o077 == 0
    assert json.loads((classroom.state / hub.SHARED).read_text()).keys() == {"students", "instructors"}
    assert all(server.alive for server in servers.started(classroom).values())
