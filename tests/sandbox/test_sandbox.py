"""The rights and the view of a program in the sandbox; grading as an ordinary user, and without a sandbox."""

import contextlib
import json
import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from autograder.paths import PACKAGE
from autograder.sandbox import networks, processor_core, sandbox, seccomp, view
from autograder.sandbox.sandbox import CONFINEMENTS
from autograder.sandbox.variables import ros_prefixes
from course.foundation.waiting import wait_until
from tests.hidden.answers import SOLUTIONS
from tests.hidden.answers.calculator import SERVER
from tests.hidden.answers.services import MOTORS, REFERENCE, RELAY
from tests.processes import processes, programs_left

AUTOGRADER = str(Path(sys.executable).with_name("autograder"))
ENDS = "def main(:\n"  # at once, and so it is judged quickly
ORDINARY_USER = 61150  # a host user that is not root, and none of the sandbox's own

# Where Python and ROS 2 are installed, and the folders that a program sees on the way there: /root, for one below it.
INSTALLED = [sys.prefix, sys.base_prefix, *map(str, ros_prefixes())]
PREFIXES = sorted({*INSTALLED, *map(os.path.realpath, INSTALLED)})
ABOVE = sorted({str(folder) for prefix in PREFIXES for folder in Path(prefix).parents})

PROBE = f"""
import json, os, pathlib, resource, socket

def tried(action):
    try:
        return bool(action()) or True
    except OSError as error:
        return type(error).__name__

prefixes, above = {PREFIXES!r}, {ABOVE!r}

def others(folder):
    # What can be seen in a folder but prefixes and the way to them.
    for name in os.listdir(folder) if os.path.isdir(folder) else []:
        path = os.path.join(folder, name)
        if path in above and path not in prefixes:
            yield from others(path)
        elif path not in prefixes:
            yield path

status = dict(line.split(':', 1) for line in open('/proc/self/status').read().splitlines())
print(json.dumps(dict(
    uid=os.getuid(), files=sorted(os.listdir('.')), home=os.environ['HOME'], variables=sorted(os.environ),
    capabilities=[status[name].strip('\\t0') for name in ('CapInh', 'CapPrm', 'CapEff', 'CapBnd', 'CapAmb')],
    privileges=status['NoNewPrivs'].strip(), processes=sum(name.isdigit() for name in os.listdir('/proc')),
    descriptors=len(os.listdir('/proc/self/fd')),
    seen=[path for path in ({str(SOLUTIONS)!r}, '/root', '/etc/shadow', '/var', '/run', '/sys')
          if os.path.exists(path) and path not in above],
    others=[path for folder in ({str(PACKAGE)!r}, '/root', '/var', '/run') for path in others(folder)],
    usr=tried(lambda: open('/usr/x', 'w')), root=tried(lambda: open('/x', 'w')), dev=tried(lambda: open('/dev/x', 'w')),
    own=tried(lambda: open('{SERVER}', 'a')), beside=tried(lambda: open('notes.txt', 'w')),
    tmp=tried(lambda: open('/tmp/new-of-the-program', 'w')), mine=tried(lambda: os.listdir('/tmp')),
    large=tried(lambda: open('/tmp/large', 'w').truncate(1 << 30)),
    out=tried(lambda: socket.create_connection(('192.0.2.1', 80), 1)), parent=tried(lambda: os.kill(1, 9)),
    memory=tried(lambda: os.memfd_create('x')),
    links=[name for _, name in socket.if_nameindex()], nproc=resource.getrlimit(resource.RLIMIT_NPROC)[1],
)))
"""


def test_a_workspace_that_the_instructor_has_sourced_is_not_seen(confinement, tmp_path, monkeypatch):
    """It may hold the solution; only what belongs to an installation of ROS 2 itself is shown."""
    modules = tmp_path / f"lib/python{sys.version_info.major}.{sys.version_info.minor}/site-packages"
    modules.mkdir(parents=True)
    (modules / "solution_of_the_instructor.py").touch()
    monkeypatch.setenv("AMENT_PREFIX_PATH", os.pathsep.join([str(tmp_path), os.environ["AMENT_PREFIX_PATH"]]))
    program = f"""
import importlib.util, os
print(importlib.util.find_spec("solution_of_the_instructor"), os.path.exists({str(tmp_path)!r}))
print({str(tmp_path)!r} in os.environ["AMENT_PREFIX_PATH"])
"""
    with sandbox.Sandbox(confinement, {SERVER: program.encode()}) as confined:
        command = [*sandbox.CONFINEMENTS[confinement], *confined.command([SERVER], domain=1)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=30, pass_fds=confined.descriptors)
    assert done.stdout.split() == ["None", "False", "False"], done.stderr


def test_what_a_program_sees(confinement):
    with sandbox.Sandbox(confinement, {SERVER: PROBE.encode()}) as confined:
        os.environ["SECRET_OF_THE_GRADER"] = "1"
        command = [*sandbox.CONFINEMENTS[confinement], *confined.command([SERVER], domain=1)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=30, pass_fds=confined.descriptors)
    seen = json.loads(done.stdout)
    assert seen["uid"] not in (0, os.getuid())
    assert seen["files"] == [SERVER] and seen["home"] == view.HOME
    assert "SECRET_OF_THE_GRADER" not in seen["variables"]
    assert seen["capabilities"] == [""] * 5 and seen["privileges"] == "1"
    assert seen["processes"] <= 3  # bubblewrap, prlimit become python
    assert seen["descriptors"] <= 4
    assert (seen["seen"], seen["others"]) == ([], [])
    assert "Error" in seen["usr"] and "Error" in seen["root"] and "Error" in seen["dev"] and "Error" in seen["own"]
    assert (seen["beside"], seen["tmp"], seen["mine"]) == (True, True, True)
    assert "Error" in seen["large"] and seen["out"] == "OSError"
    assert seen["memory"] == ("PermissionError" if seccomp.available() else True)
    assert seen["links"] == ["lo"] and seen["nproc"] == 64


HAS_GROUP = """
import sys
from autograder.sandbox import cgroup
group = cgroup.make()
if group:
    group.close()
sys.exit(bool(group))
"""
GREEDY = """
import itertools, json, os, socket

def until_refused(take):
    held = []
    try:
        for number in range(20_000):
            held.append(take(number))
    except OSError as error:
        return [len(held), error.strerror]
    return [len(held), '']

print(json.dumps(dict(
    files={folder: until_refused(lambda number: os.close(os.open(f'{folder}/{number}', os.O_CREAT | os.O_WRONLY)))
           for folder in ('.', '/tmp', '/dev/shm')},
    sockets=until_refused(lambda _: socket.socketpair()),
    cores=len(os.sched_getaffinity(0)), moved=until_refused(lambda _: os.sched_setaffinity(0, range(os.cpu_count()))),
)))
"""


def test_what_the_kernel_keeps_for_a_program_is_bounded(confinement):
    """Empty files and waiting sockets are memory that counts for no process."""
    with sandbox.Sandbox(confinement, {SERVER: GREEDY.encode()}) as confined:
        command = [*sandbox.CONFINEMENTS[confinement], *confined.command([SERVER], domain=1)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, pass_fds=confined.descriptors)
    seen = json.loads(done.stdout)
    files, why = zip(*seen["files"].values(), strict=True)
    assert sum(files) < view.FILES and set(why) == {"No space left on device"}
    assert seen["sockets"][0] * 2 < sandbox.LIMITS["nofile"]
    if seccomp.available():
        assert seen["moved"] == [0, "Operation not permitted"]


@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="this machine has one core")
def test_without_control_groups_each_grading_has_a_core(confinement, tmp_path, monkeypatch):
    """As many gradings as there are cores have one each, and the next shares one; programs stay on theirs."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))  # other gradings of this user have cores, too
    with contextlib.ExitStack() as held:
        given = [held.enter_context(processor_core.taken()) for _ in range(len(os.sched_getaffinity(0)) + 1)]
    assert {*given[:-1]} == os.sched_getaffinity(0) and given[-1] == given[0]
    with sandbox.Sandbox(confinement, {SERVER: GREEDY.encode()}) as confined:
        command = processor_core.command(
            given[1], [*sandbox.CONFINEMENTS[confinement], *confined.command([SERVER], domain=1)]
        )
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, pass_fds=confined.descriptors)
    assert json.loads(done.stdout)["cores"] == 1


def test_no_sandbox_without_bubblewrap(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    done = subprocess.run(
        [AUTOGRADER, "check", str(SOLUTIONS / "calculator"), "--assignment", "calculator"],
        capture_output=True,
        text=True,
        timeout=30,
    )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1 and "bubblewrap" in done.stderr and "--unsafe" in done.stderr


def hand_in(folder: Path) -> Path:
    """Lay down the right relay, and motors that end at once."""
    folder.mkdir()
    for name, content in REFERENCE.items():
        (folder / name).write_bytes(content)
    (folder / MOTORS).write_text(ENDS)
    return folder


def test_unsafe_is_flagged(tmp_path):
    folder = hand_in(tmp_path / "services")
    done = subprocess.run(
        [AUTOGRADER, "check", str(folder), "--assignment", "services", "--unsafe", "--json"],
        capture_output=True,
        text=True,
        timeout=240,  # on a busy machine it waits for calm, and judges again
    )
    report = json.loads(done.stdout)
    # No score is promised: without a network of its own a grading can meet whatever else runs on this machine.
    assert (done.returncode, report["status"], report["flags"]) == (0, "graded", ["unsafe"])


@pytest.mark.skipif(os.geteuid() != 0, reason="the other tests are run by an ordinary user already")
def test_as_an_ordinary_user(tmp_path):
    """On most machines a user has no control groups: all programs of a grading are on one core then."""
    home = Path("/tmp") / f"autograder-test-{os.getpid()}"
    home.mkdir()
    try:
        relay = hand_in(home / "services") / RELAY
        relay.write_text("import os\nprint('cores:', *os.sched_getaffinity(0))\n" + relay.read_text())
        os.chown(home, ORDINARY_USER, ORDINARY_USER)
        user = ["setpriv", f"--reuid={ORDINARY_USER}", f"--regid={ORDINARY_USER}", "--clear-groups", "--"]
        if subprocess.run([*user, sys.executable, "-c", "import autograder"], cwd="/", capture_output=True).returncode:
            pytest.skip("an ordinary user cannot read this installation")
        done = subprocess.run(
            [*user, AUTOGRADER, "check", str(home / "services"), "--assignment", "services", "--json"],
            capture_output=True,
            text=True,
            timeout=120,
            cwd="/",
            env=os.environ | {"HOME": str(home), "XDG_CACHE_HOME": str(home / "cache")},
        )
        report = json.loads(done.stdout or "{}")
        assert (done.returncode, report.get("score"), report.get("flags")) == (0, 10, []), done.stderr
        assert programs_left() == []
        has_group = subprocess.run([*user, sys.executable, "-c", HAS_GROUP], cwd="/", capture_output=True).returncode
        cores = set(re.findall(r"cores: (.*)", str(report["logs"]).replace("\\n", "\n")))
        assert cores and (has_group or all(len(line.split()) == 1 for line in cores)), cores
    finally:
        shutil.rmtree(home)


def test_the_networks_of_a_grading_are_as_the_command_ip_makes_them(confinement):
    """As it does for a student's server."""
    if confinement != "root":
        pytest.skip("only root makes networks outside of a worker")
    (made,) = networks.make(1)
    show = "ip address show lo && ip route show table all"
    by_command = subprocess.run(
        ["unshare", "--net", "sh", "-c", f"ip -batch - <<'END' && {show}\n{networks.SET_UP}END\n"],
        check=True,
        capture_output=True,
        text=True,
    )
    with networks.inside(made):
        here = subprocess.run(["sh", "-c", show], check=True, capture_output=True, text=True)
    os.close(made)
    assert "MULTICAST,UP" in here.stdout and "224.0.0.0/4 dev lo" in here.stdout
    assert here.stdout == by_command.stdout


def test_nothing_outlives_a_worker(confinement):
    """Not even what has lost its parents: the worker is the first process of a namespace."""
    marker = f"{time.monotonic_ns() / 1e6:.6f}"  # s, and nobody else's
    orphan = f"import os; os.fork() or (os.setsid(), os.fork() or os.execlp('sleep', 'sleep', '{marker}'))"
    subprocess.run([*CONFINEMENTS[confinement], sys.executable, "-c", orphan], check=True)
    assert wait_until(lambda: not any(marker in process.info["cmdline"] for process in processes()), 5)
