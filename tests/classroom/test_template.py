"""A student's server is forked: it is as confined as one that is started, and nothing of its template reaches it.

What each sees is told by a program that stands in for the server, in the same box.
"""

import json
import os
import signal
import subprocess
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from autograder.classroom import accounts, box, serve, servers, template
from autograder.classroom.servers import Running
from autograder.classroom.spawner import BoxSpawner
from autograder.sandbox.forkserver import SUPPORTED
from autograder.sandbox.usage import of_user
from course.foundation import processes
from course.foundation.waiting import wait_until
from tests.sandbox.test_forkserver import SEARCH, WORLD

pytestmark = pytest.mark.skipif(not SUPPORTED, reason="this Python forks no programs")
OWN = 50  # no process of a box that has just begun has a higher number
SECONDS = 60.0  # in which a process begins or ends on a busy machine
# What a server can see beside what any forked program can.
MORE = """
import stat
numbers = [name for name in os.listdir('/proc') if name.isdigit()]
world.update(
    ids=[os.getresuid(), os.getresgid(), os.getgroups()],
    processes=sorted(open(f'/proc/{number}/comm').read() for number in numbers), users=sorted(
        {os.stat(f'/proc/{number}').st_uid for number in numbers}), score=open('/proc/self/oom_score_adj').read(),
    terminals=[line.split(' - ')[1] for line in open('/proc/self/mountinfo') if 'devpts' in line],
    listens=socket.socket(fileno=int(os.environ.pop('CLASSROOM_SOCKET'))).getsockname(), root=os.stat('/').st_mode,
    groups=open('/proc/self/cgroup').read(), writable=[place for place in ('/', '/usr', '/opt', '/etc', '/dev', '/home')
        if os.access(place, os.W_OK)],
)
"""
SERVER = WORLD.replace("print(json", f"{MORE}\nprint(json")
# One is of the socket that keeps the box; what a box is held by is a process of its own; the hub's Python, which is
# started once more than the server's, has the same libraries in another order.
OF_FORKS = ("others", "processes", "cmdline", "environ")
END = "=== the end ==="
HOLD = "import time\nprint('here', flush=True)\ntime.sleep(600)"


# Looks through what modules, their classes and functions have kept, once all that a server loads is there.
TAKEN = """
import importlib, traitlets, types
WORD = WORDS[0]
look_at_home()
ask_no_node()
for name in LOADED:
    importlib.import_module(name)
def told(value):
    return value is not WORD and isinstance(value, (str, bytes, os.PathLike)) and WORD in os.fsdecode(value)
def parts(value):
    yield value
    if isinstance(value, dict):
        yield from [*value, *value.values()]
    elif isinstance(value, (list, tuple, set, frozenset)):
        yield from value
    elif isinstance(value, types.FunctionType):
        yield from [*(value.__defaults__ or ()), *(value.__kwdefaults__ or {}).values()]
    elif isinstance(value, traitlets.TraitType):
        yield from [value.default_value, *(getattr(value, 'default_args', None) or ())]
for module in [*sys.modules.values()]:
    for name, value in [*vars(module).items()]:
        within = vars(value).items() if isinstance(value, type) and value.__module__ == module.__name__ else ()
        for place, each in [(name, value), *((f'{name}.{inner}', each) for inner, each in within)]:
            if any(told(part) for part in parts(each)):
                print(f'{module.__name__}.{place}')
print('searched')
"""


# The name is in the configuration of each box; the next says what a CGI program is told, which none is here; the others
# where a package would be installed for one user alone.
KNOWN = (
    "jupyter_client.session.Session.username",
    "jupyter_client.session.Session._static_immutable_initial_values",
    "wsgiref.handlers.BaseHandler.os_environ",
    "sysconfig._CONFIG_VARS",
    "distutils.command.install.USER_BASE",
    "distutils.command.install.USER_SITE",
)


@pytest.fixture(scope="module")
def forkserver(able):
    made = template.start()
    assert made.ready()
    yield made
    made.close()


@pytest.fixture
def room(quiet):
    accounts.make(quiet)
    return quiet


@pytest.fixture
def begin(room, monkeypatch, tmp_path):
    """Return a function that starts a program in place of a member's server."""
    started = []

    def run(name: str, text: str, forkserver, **env: str) -> tuple[subprocess.Popen[bytes], Running]:
        program = tmp_path / "program.py"
        program.write_text(text)
        program.chmod(0o644)
        monkeypatch.setattr(serve, "__file__", str(program))
        environment = {"PATH": os.defpath, "LANG": "C.UTF-8"} | template.libraries() | env
        warned: list[str] = []
        process, running = servers.start(room, room.find(name), environment, forkserver, warned.append)
        started.append((name, process, running))
        assert bool(warned) is (forkserver is not None and not forkserver.alive), warned
        return process, running

    yield run
    for name, process, running in started:
        servers.forget(room, name, running)
        running.end()
        process.wait()


def adas(room) -> list[int]:
    """Return what runs for ada; zombies stay where the machine's first process does not reap orphans."""
    return [number for number in of_user(accounts.ids(room, room.find("ada"))[0]) if processes.birth(number)]


def names(room) -> list[str]:
    return [Path(f"/proc/{number}/comm").read_text().strip() for number in adas(room)]


def said(room, name: str) -> str:
    return (room.state / "servers" / f"{name}.log").read_text()


@pytest.fixture
def output(room, begin):
    """Return a function that runs such a program to its end and returns what it has printed."""

    def run(text: str, forkserver, name: str = "ada", **env: str) -> str:
        log = room.state / "servers" / f"{name}.log"
        log.unlink(missing_ok=True)
        process, _ = begin(name, f"{text}\nprint({END!r}, flush=True)", forkserver, **env)
        assert process.wait(SECONDS) is not None
        assert wait_until(lambda: END in log.read_text() or "Traceback" in log.read_text(), SECONDS), said(room, name)
        return log.read_text().partition(END)[0]

    return run


def test_it_sees_what_a_started_server_sees(output, forkserver):
    """The same user, groups, capabilities, limits, signals, files, mounts, network, processes, modules on the path."""
    plain, forked = (json.loads(output(SERVER, each)) for each in (None, forkserver))
    for each in plain, forked:
        assert each["variables"].pop("CLASSROOM_SOCKET").isdecimal()
        assert each["variables"].pop("PWD") in (each["cwd"], "/")
    different = {name: (value, plain[name]) for name, value in forked.items() if plain[name] != value}
    assert {name: both for name, both in different.items() if name not in OF_FORKS} == {}
    assert [each for each in forked["processes"] if each not in plain["processes"]] == ["sh\n"], "which holds the box"
    assert forked["others"] == plain["others"] + 1, "a descriptor that ends the box"
    assert forked["cmdline"][:4] == plain["cmdline"]


def test_no_secret_of_the_hub_and_nothing_of_another_student_is_in_its_memory(room, output, begin, monkeypatch):
    """Neither a variable of the hub's, nor what the server of a neighbour was told, nor what that has read."""
    halves = ["said only to", " the hub", "the token of a", " neighbour", "printed by a", " neighbour"]
    monkeypatch.setenv("SECRET_OF_THE_HUB", "".join(halves[:2]))
    forkserver = template.start()
    begin("bob", f"print({''.join(halves[4:])!r})\n{HOLD}", forkserver, JUPYTERHUB_API_TOKEN="".join(halves[2:4]))
    assert wait_until(lambda: "here" in said(room, "bob"), SECONDS)
    pairs = [[*halves[:2]], [*halves[2:4]], [*halves[4:]], ["not se", "cret"]]
    # It never puts two halves together itself, or it would find its own.
    assert output(f"PAIRS = {pairs}\n{SEARCH}", forkserver) == "{'not se'}\n"
    forkserver.close()


def test_nothing_that_jupyterlab_has_loaded_knows_the_templates_home_name_or_address(output, forkserver):
    text = Path(serve.__file__).read_text().partition('if __name__ == "__main__"')[0]
    said = output(f"{text}\nLOADED = {template.LOADED.split()}\nWORDS = [{template.NOBODY!r}]\n{TAKEN}", forkserver)
    assert [each for each in said.split() if each not in KNOWN] == ["searched"]


def test_it_is_out_of_reach(output, forkserver):
    """No process of the machine's is there to be signalled or read, the template's least."""
    # On a machine that has just begun, lower numbers may be those of the box's own processes.
    numbers = [number for number in (forkserver.pid, os.getpid(), os.getppid()) if number > OWN]
    tried = f"""
import os, signal
reached = []
for number in {numbers}:
    for reach in (lambda: os.kill(number, signal.SIGKILL), lambda: open(f'/proc/{{number}}/mem', 'rb')):
        try:
            reach()
            reached.append(number)
        except (ProcessLookupError, FileNotFoundError):
            pass
print(reached, os.getppid(), os.access('/proc/1/environ', os.R_OK), os.listdir('/proc/self/fd')[:3])
print({END!r}, flush=True)  # what follows ends the box, and so this process
try:
    os.kill(-1, signal.SIGKILL)  # all that it may: its own
except ProcessLookupError:
    pass
"""
    assert output(tried, forkserver) == "[] 0 False ['0', '1', '2']\n"
    assert forkserver.alive


def test_its_box_ends_with_it_and_it_with_its_box(room, begin, forkserver):
    child = "import subprocess\nsubprocess.Popen(['sleep', '600'])\n"
    process, _ = begin("ada", f"{child}print('over')", forkserver)
    assert process.wait(SECONDS) == 0 and wait_until(lambda: not adas(room), SECONDS, alert=False)
    process, running = begin("ada", child + HOLD, forkserver)
    assert wait_until(lambda: "here" in said(room, "ada"), SECONDS) and adas(room)
    running.end()
    assert process.wait(SECONDS) == -signal.SIGKILL and wait_until(lambda: not adas(room), SECONDS, alert=False)


def test_it_goes_on_when_the_hub_ends(room, begin):
    forkserver = template.start()
    _, running = begin("ada", HOLD, forkserver)
    assert wait_until(lambda: "here" in said(room, "ada"), SECONDS)
    forkserver.close()
    assert running.alive and "python" in names(room)
    running.end()
    assert wait_until(lambda: not adas(room), SECONDS, alert=False)


def test_without_the_template_a_server_is_started_and_the_hub_is_told(room, begin):
    """`begin` sees to what was told."""
    forkserver = template.start()
    assert forkserver.ready()
    os.kill(forkserver.pid, signal.SIGKILL)
    assert wait_until(lambda: not forkserver.alive, SECONDS)
    begin("ada", HOLD, forkserver)
    assert wait_until(lambda: "here" in said(room, "ada"), SECONDS)
    forkserver.close()


def test_a_box_that_cannot_be_made_leaves_nothing(room, begin, forkserver, monkeypatch):
    monkeypatch.setattr(box, "HOLD", ["false"])
    with pytest.raises(ProcessLookupError):
        servers._fork(room, room.find("ada"), {}, forkserver, None, 2, 2)
    assert not adas(room)


def test_its_memory_is_bounded_although_it_is_no_child_of_its_box(room, begin, forkserver, monkeypatch):
    small = replace(room, limits=replace(room.limits, memory=200 << 20))
    small.save()
    monkeypatch.setenv(servers.VARIABLE, str(room.folder))
    monkeypatch.setattr(servers.cgroup, "make", lambda *_: None)
    monkeypatch.setattr(servers.box, "limits", lambda *_: {})
    process, running = begin("ada", f"held = b'x' * {300 << 20}\n{HOLD}", forkserver)
    assert wait_until(lambda: "here" in said(room, "ada"), SECONDS)
    spawner = BoxSpawner()
    spawner.user, spawner._running = SimpleNamespace(name="ada"), running
    spawner._bound_memory()
    assert process.wait(SECONDS) == 0, "the box has not ended with its server"
