"""A student who takes all there is: a neighbour's cell still runs, and the machine has enough left.

The programs run in ada's box, and in no control group, which is what holds on every machine.  Each says what it got,
and keeps it until it is told to end.  bob is the neighbour.
"""

import ast
import contextlib
import os
import pwd
import signal
import subprocess
import sys
import tracemalloc
from pathlib import Path

import pytest

from autograder.classroom import accounts, assignments, box, servers
from autograder.sandbox.memory_files import MemoryFiles
from course.foundation import processes
from course.foundation.waiting import wait_until

SECONDS = 30.0  # within which a process changes its state
HOLD = "\nprint(got, flush=True)\ninput()\n"
FORKS = """
import os, signal
got = 0
while got < 4000:
    try:
        number = os.fork()
    except OSError:
        break
    if not number:
        signal.pause()
    got += 1
"""
DESCRIPTORS = """
import os
got = 0
while got < 30000:
    try:
        os.dup(0)
    except OSError:
        break
    got += 1
"""
TERMINALS = """
import os
got = 0
while got < 400:
    try:
        os.open("/dev/ptmx", os.O_RDWR | os.O_NOCTTY)
    except OSError:
        break
    got += 1
"""
INOTIFY = """
import ctypes, os
libc, got = ctypes.CDLL(None), 0
while got < 5000 and libc.inotify_init() >= 0:
    got += 1
"""
PLACES = """
import os
got = {}
for line in open("/proc/self/mounts"):
    _, at, kind, options, *_ = line.split()
    if kind != "tmpfs":
        continue
    here = [folder for folder, _, _ in os.walk(at) if os.stat(folder).st_dev == os.stat(at).st_dev]
    if any(os.access(folder, os.W_OK) for folder in here):
        size = os.statvfs(at)
        got[at] = size.f_blocks * size.f_frsize
"""
UNCOUNTED = """
import ctypes, os
libc = ctypes.CDLL(None, use_errno=True)
got = []
try:
    got.append(os.memfd_create("hidden"))
except PermissionError:
    pass
for made in (libc.shmget(0, 4096, 0o1600), libc.msgget(0, 0o1600), libc.semget(0, 1, 0o1600)):
    if made >= 0:
        got.append(made)
try:
    got.append(len(bytearray(4 << 30)))
except MemoryError:
    pass
"""
KILL = """
import os, signal
got = []
for number in {pids}:
    for reach in (lambda: os.kill(number, signal.SIGKILL), lambda: open(f"/proc/{{number}}/mem", "rb+")):
        try:
            reach()
            got.append(number)
        except (ProcessLookupError, FileNotFoundError, PermissionError):
            pass
try:
    os.kill(-1, signal.SIGKILL)
except ProcessLookupError:
    pass
"""
FLOOD = """
import os
target = os.readlink(f"/proc/{os.getppid()}/fd/1")
def same(number):
    try:
        return os.readlink(f"/proc/self/fd/{number}") == target
    except OSError:
        return False
log = next(int(number) for number in os.listdir("/proc/self/fd") if same(number))
print(sum(os.write(log, b"x" * (1 << 16)) for _ in range(512)))
"""


@pytest.fixture
def hostile(classroom):
    """Return a function that runs a program in ada's box and returns what it got."""
    with contextlib.ExitStack() as ends:

        def run(code: str) -> str:
            contents = MemoryFiles()
            ends.callback(contents.close)
            argv = [sys.executable, "-I", "-c", code + HOLD]
            member = classroom.find("ada")
            process = subprocess.Popen(
                box.command(classroom, member, argv, contents),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                pass_fds=contents.descriptors,
                env=box.variables(member),
                text=True,
                cwd="/",
            )
            ends.callback(process.communicate)
            ends.callback(process.kill)
            return process.stdout.readline().strip()

        yield run


@pytest.fixture
def neighbour(bob, kernel):
    """A kernel of bob's that runs before and after."""
    live = kernel(bob)
    assert live.run("print(6 * 7)").text == "42\n"
    yield live
    assert live.run("import subprocess; print(subprocess.run(['echo', '42'], capture_output=True).stdout)").error == ""


def test_a_fork_bomb_takes_the_students_own_processes_alone(hostile, neighbour, classroom):
    got = int(hostile(FORKS))
    assert 0 < got < classroom.limits.tasks
    made = "import subprocess; print(subprocess.run(['echo', '42'], capture_output=True, text=True).stdout)"
    assert neighbour.run(made).text.strip() == "42"


def test_all_processes_of_a_student_leave_descriptors_to_the_machine(hostile, classroom):
    got = int(hostile(DESCRIPTORS))
    assert 0 < got < box.DESCRIPTORS
    assert got * classroom.limits.tasks < int(Path("/proc/sys/fs/file-max").read_text())


def test_terminals_are_left_to_the_neighbour(hostile, neighbour):
    assert 0 < int(hostile(TERMINALS)) <= box.TERMINALS
    assert neighbour.run("import os; print(len(os.openpty()))").text == "2\n"


def test_inotify_is_counted_for_each_student(hostile, neighbour):
    assert 0 < int(hostile(INOTIFY)) <= int(Path("/proc/sys/fs/inotify/max_user_instances").read_text())
    assert neighbour.run("import ctypes; print(ctypes.CDLL(None).inotify_init() >= 0)").text == "True\n"


def test_memory_that_belongs_to_no_process_has_a_limit_too(hostile):
    places = ast.literal_eval(hostile(PLACES))
    assert set(places) == {"/tmp", "/dev/shm"}
    assert places["/tmp"] <= box.TEMPORARY and places["/dev/shm"] <= box.SHARED_MEMORY


def test_memory_that_nothing_counts_is_refused(hostile):
    assert hostile(UNCOUNTED) == "[]"


def test_no_signal_and_no_write_reaches_a_neighbours_server(hostile, neighbour, classroom):
    running = servers.started(classroom)
    assert hostile(KILL.format(pids=[each.pid for each in running.values()])) == "[]"
    assert all(each.alive for name, each in running.items() if name != "ada")


def test_a_flood_of_the_servers_log_ends_at_its_limit(ada, kernel, classroom):
    live = kernel(ada)
    flood = live.run(FLOOD)
    assert flood.text == f"{512 << 16}\n"
    log = classroom.state / "servers" / "ada.log"
    assert log.stat().st_size <= 2 * servers.LOG + 200, "the one before may have said as much"
    assert wait_until(lambda: b"is not kept" in log.read_bytes()[-200:], SECONDS, alert=False)
    assert live.run("print(6 * 7)").text == "42\n" and ada.call("GET", "api/kernels").ok


@pytest.fixture
def sleeper(able):
    """A process of nobody else's user, nor of `users.SPARE`, which its parent waits for at the end alone."""
    uid = next(number for number in range(61100, 65000) if not _taken(number))
    with subprocess.Popen(["sleep", "600"], user=uid, group=uid) as process:
        yield uid, servers.Running(process.pid, processes.birth(process.pid))
        process.kill()


def _taken(number: int) -> bool:
    with contextlib.suppress(KeyError):
        return bool(pwd.getpwuid(number))
    return False


def test_a_zombie_is_no_running_server(sleeper):
    _, running = sleeper
    assert running.alive
    assert not servers.Running(running.pid, running.born - 1).alive, "a later process of the same number"
    os.kill(running.pid, signal.SIGKILL)
    assert wait_until(lambda: not running.alive, SECONDS, alert=False)
    assert "Z (zombie)" in Path(f"/proc/{running.pid}/status").read_text()


def test_a_users_zombie_is_no_process_to_be_ended(sleeper):
    uid, running = sleeper
    assert accounts._end({uid})
    assert wait_until(lambda: not running.alive, SECONDS, alert=False)
    assert Path(f"/proc/{running.pid}").exists()
    assert not accounts._end({uid})


def test_what_students_lay_into_the_exchange_is_not_held_in_memory(tmp_path):
    for number in range(20_000):
        (tmp_path / f"{number}+services").touch()
    tracemalloc.start()
    try:
        assert sum(1 for _ in assignments.each_entry(tmp_path)) == 20_000
        assert tracemalloc.get_traced_memory()[1] < 500_000  # bytes; all entries together take 4,000,000
    finally:
        tracemalloc.stop()
    assert not [*assignments.each_entry(tmp_path / "missing")]
