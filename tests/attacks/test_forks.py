"""A forked program, and one in a sandbox without the filter of system calls, that turn against whoever forks them.

What a program can see of the process that forked it is in tests/sandbox/test_forkserver.py.
"""

import ast
import contextlib
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator

import pytest

from autograder.errors import SandboxError, SandboxUnavailable
from autograder.sandbox import cgroup, forkserver, networks, seccomp, usage, users
from autograder.sandbox.forkserver import SUPPORTED, Forkserver
from autograder.sandbox.program import Program
from autograder.sandbox.sandbox import CONFINEMENTS, LIMITS, Sandbox
from course.foundation.waiting import wait_until

from .programs import SIBLINGS, ZOMBIES

ENDED = 30.0  # s
MUCH = [(4, 300 << 20, "GiB of memory"), (LIMITS["nproc"] + 10, 1, "processes and threads")]
CLOSING = 3  # descriptors of a process that is just beginning
SOON = 5.0  # s: an attack that is over holds nobody up

# Siblings that live: they take no place among its descendants.
HIDDEN = (
    SIBLINGS
    + """
for _ in range({processes}):
    if sibling() == 0:
        held = bytearray({memory})
        for page in range(0, len(held), 4096):
            held[page] = 1
        time.sleep(1000)
print('made', flush=True)
time.sleep(1000)
"""
)
# Their parent ends, so that others become it: a process of the sandbox, or whoever is outside of it.
ORPHANS = """
import os, time

def fork():
    try:
        return os.fork()
    except OSError:  # the user's limit: all are held until somebody counts them
        time.sleep(1000)

for _ in range({processes}):
    if not fork():
        os.setsid()
        if fork():
            os._exit(0)
        held = bytearray({memory})
        for page in range(0, len(held), 4096):
            held[page] = 1
        time.sleep(1000)
print('made', flush=True)
time.sleep(1000)
"""
# Children that come and go faster than anybody counts them.
CHURN = (
    SIBLINGS
    + """
end = time.time() + 2
while time.time() < end:
    if sibling() == 0:
        os._exit(0)
print('done', flush=True)
"""
)


@pytest.fixture(scope="module", autouse=True)
def forks(confinement):
    if confinement != "root" or not seccomp.available():
        pytest.skip("only root's programs are forked, and each variant is tried with and without the filter")


@pytest.fixture(autouse=True)
def own_users(monkeypatch):
    """Users that the gradings of another root on this machine, with locks of its own, do not come to take."""
    monkeypatch.setattr(users, "SPARE", range(61100, 61170))


@pytest.fixture(params=["with the filter", "without the filter"])
def filtered(request, monkeypatch) -> bool:
    """Return True if this test's programs have the filter of system calls: some machines have none."""
    if request.param == "without the filter":
        monkeypatch.setattr(seccomp, "available", lambda: False)
        without = "from autograder.sandbox import forkserver, seccomp; seccomp.available = bool; "
        monkeypatch.setattr(
            forkserver, "START", forkserver.START.replace("from autograder.sandbox import forkserver; ", without)
        )
    return request.param == "with the filter"


@pytest.fixture(scope="module")
def servers() -> Iterator[dict[bool, Forkserver]]:
    """The forking processes, by whether their programs have the filter: what one attack leaves would harm the next."""
    started: dict[bool, Forkserver] = {}
    yield started
    for server in started.values():
        assert server.alive
        server.close()


@pytest.fixture
def server(servers, filtered) -> Forkserver:
    """A forking process, which has been attacked before."""
    if not SUPPORTED:
        pytest.skip("this Python forks no programs")
    if filtered not in servers:
        servers[filtered] = Forkserver()
    return servers[filtered]


@contextlib.contextmanager
def running(server: Forkserver | None, text: str, core: int | None = None) -> Iterator[tuple[Program, int]]:
    """A program, and its host user; on a machine without control groups, on the processor core `core`."""
    (network,) = networks.make(1)
    with Sandbox("root", {"program.py": text.encode()}, core=core, forkserver=server) as sandbox:
        with networks.inside(network):
            started = sandbox.launch("program.py", domain=7)
        (user,) = sandbox._users
        yield Program("program.py", started.output, started.end, started.process.stop), user
    os.close(network)


def test_siblings_leave_nothing_behind(server, filtered):
    """Not even the dead: the kernel counts them among the processes of the user that another program gets."""
    with running(server, ZOMBIES) as (program, user):
        assert program.wait(ENDED), program.output
        made = int(re.fullmatch(r"siblings: (\d+)\n", program.output)[1])
        assert (made == 0) == filtered, "with the filter there must be none, without it the attack must be one"
        ended = time.monotonic()
    assert time.monotonic() - ended < SOON
    assert not usage.of_user(user) and users._is_unused(user)
    with running(server, FORKING) as (after, _):
        assert after.wait(ENDED) and after.output == "50\n"


def test_siblings_that_come_and_go_hold_nobody_up(server, filtered):
    """Other programs begin and end meanwhile."""
    with running(server, CHURN) as (program, _):
        while program.alive:
            began = time.monotonic()
            with running(server, "print(1)") as (other, _):
                assert other.wait(ENDED) and other.output == "1\n"
            assert time.monotonic() - began < SOON
        assert program.output in ("done\n", "")
    assert not filtered or program.output == "done\n"


@pytest.mark.parametrize("attack", [HIDDEN, ORPHANS], ids=["siblings", "orphans"])
@pytest.mark.parametrize(("processes", "memory", "why"), MUCH, ids=["memory", "processes"])
def test_what_has_another_parent_counts(server, filtered, monkeypatch, attack, processes, memory, why):
    """Without control groups, nothing else limits what a program's processes take together."""
    monkeypatch.setattr(cgroup, "make", lambda: None)
    if filtered and attack is HIDDEN:
        pytest.skip("there are none, see above")
    with running(server, attack.format(processes=processes, memory=memory)) as (program, user):
        assert program.wait(ENDED) and why in program.stopped
    assert not usage.of_user(user)


# Takes the processor from whoever is graded beside it, and would be judged again: its machine is busy.
BURNER = """
import os
for _ in range(20):
    if not os.fork():
        while True:
            pass
os.wait()
"""
# The same with pauses.
BURSTS = BURNER.replace(
    "        while True:\n            pass\n",
    """
        import time
        while True:
            end = time.monotonic() + 1.0
            while time.monotonic() < end:
                pass
            time.sleep(0.5)
""",
)
# Many threads, of which few have something to do, as those of ROS 2.
WAITING = """
import threading, time
for _ in range(30):
    threading.Thread(target=time.sleep, args=(4,)).start()
end = time.monotonic() + 4
while time.monotonic() < end:
    pass
print('done', flush=True)
"""


def test_many_busy_processes_are_ended_and_threads_that_wait_are_not(filtered, server, monkeypatch):
    """All on one core, so that they take no more than that."""
    if not filtered:
        pytest.skip("the filter changes nothing here")
    monkeypatch.setattr(cgroup, "make", lambda: None)
    core = min(os.sched_getaffinity(0))
    with (
        running(server, BURNER, core) as (burner, _),
        running(server, BURSTS, core) as (bursts, _),
        running(server, WAITING, core) as (waiting, _),
    ):
        for each in (burner, bursts):
            assert each.wait(ENDED) and "processes or 12 threads busy" in each.stopped
        assert waiting.wait(ENDED) and (waiting.output, waiting.stopped) == ("done\n", "")


# A worker's part, as an ordinary user has it: starts the program that is its argument, and says why it was stopped.
ORDINARY = """
import sys
from autograder.sandbox import cgroup
from autograder.sandbox.sandbox import Sandbox
from autograder.sandbox.program import Program
cgroup.make = lambda: None
with Sandbox('user', {'program.py': sys.argv[1].encode()}) as sandbox:
    started = sandbox.launch('program.py', domain=7)
    program = Program('program.py', started.output, started.end, started.process.stop)
    program.wait(30)
print(program.stopped, program.output)
"""


@pytest.mark.parametrize(("processes", "memory", "why"), MUCH, ids=["memory", "processes"])
def test_what_has_another_parent_counts_for_an_ordinary_user_too(processes, memory, why):
    """An ordinary user's programs have no user of their own: their process namespace is measured."""
    text = ORPHANS.format(processes=processes, memory=memory)
    done = subprocess.run(
        [*CONFINEMENTS["user"], sys.executable, "-c", ORDINARY, text], capture_output=True, text=True, timeout=2 * ENDED
    )
    assert why in done.stdout, done.stdout + done.stderr


# Tries to reach every process that it can see or name but its own, and says what it could do.
REACHING = """
import ctypes, os, signal
libc = ctypes.CDLL(None, use_errno=True)
found = []

def tries(what, attempt):
    try:
        if attempt() is not False:
            found.append(what)
    except OSError:
        pass

def call(number, *arguments):
    return libc.syscall(number, *arguments) != -1

own = os.getpid()
others = [int(name) for name in os.listdir('/proc') if name.isdigit() and int(name) != own]
for other in [*others, os.getppid() or 1]:
    for number in (0, signal.SIGSTOP, signal.SIGINT, signal.SIGCHLD, signal.SIGKILL):
        tries(f'signal {number}', lambda: os.kill(other, number))
        tries(f'signal {number} by pidfd', lambda: signal.pidfd_send_signal(os.pidfd_open(other), number))
    tries('priority', lambda: os.setpriority(os.PRIO_PROCESS, other, 19))
    tries('scheduler', lambda: os.sched_setscheduler(other, os.SCHED_IDLE, os.sched_param(0)))
    tries('attach', lambda: libc.ptrace(0x4206, other, 0, 0) == 0)
    tries('limits', lambda: __import__('resource').prlimit(other, 7, (3, 3)))
    tries('descriptor', lambda: call(438, os.pidfd_open(other), 0, 0))
    for name in ('mem', 'environ', 'maps', 'root/etc', 'cwd/.', 'fd/0', 'exe', 'io', 'ns/net', 'ns/mnt', 'map_files'):
        tries(name, lambda: os.close(os.open(f'/proc/{other}/{name}', os.O_RDONLY)))
    for name in ('oom_score_adj', 'comm', 'timerslack_ns', 'clear_refs', 'coredump_filter'):
        tries(f'writes {name}', lambda: os.write(os.open(f'/proc/{other}/{name}', os.O_WRONLY), b'1'))
    for kind in ('net', 'pid', 'mnt', 'ipc', 'uts', 'cgroup'):
        tries(f'joins {kind}', lambda: libc.setns(os.open(f'/proc/{other}/ns/{kind}', os.O_RDONLY), 0) == 0)
print(len(others), sorted({*found}))
"""
FORKING = """
import os, warnings
warnings.simplefilter('ignore')  # from Python 3.12 on, of a fork beside threads, as LTTng's
print(sum(os.fork() == 0 and os._exit(0) or 1 for _ in range(50)))
"""
# Takes of all that the kernel counts for a host user as much as it can get, in several processes, and says how much.
TAKING = """
import array, ctypes, fcntl, mmap, os, select, signal, socket, time, warnings
warnings.simplefilter('ignore')
libc = ctypes.CDLL(None, use_errno=True)

def until_refused(take, most=200):
    held = []
    try:
        while len(held) < most and (got := take()) not in (None, -1):
            held.append(got)
    except OSError:
        pass
    return held

def large_pipe():
    read, write = os.pipe()
    return read, write, fcntl.fcntl(write, fcntl.F_SETPIPE_SZ, 1 << 20) >= 1 << 20 or None

def in_flight():
    one, other = socket.socketpair()
    one.sendmsg([b'x'], [(socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array('i', [0] * 50))])
    return one, other

def queued():
    return libc.sigqueue(os.getpid(), signal.SIGRTMAX, None) or True

def timer():
    return None if libc.timer_create(0, None, ctypes.byref(ctypes.c_void_p())) else True

def locked():
    memory = mmap.mmap(-1, 1 << 20)
    return memory if libc.mlock(ctypes.addressof(ctypes.c_char.from_buffer(memory)), 1 << 20) == 0 else None

signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGRTMAX])
KINDS = dict(inotify=lambda: libc.inotify_init1(0), epoll=select.epoll, pipe=large_pipe, flight=in_flight,
             signals=queued, locked=locked, queue=lambda: libc.msgget(0, 0o1600),
             semaphores=lambda: libc.semget(0, 9, 0o1600), timers=timer)
counts = {}
for kind, take in KINDS.items():
    # One process after the other takes, and all hold it until they are killed.
    for number in range(3):
        read, write = os.pipe()
        if not os.fork():
            held = until_refused(take, 40_000 if kind == 'signals' else 200)
            os.write(write, len(held).to_bytes(4, 'little'))
            time.sleep(1000)
        counts[f'{kind} {number}'] = int.from_bytes(os.read(read, 4), 'little')
        os.close(read)
        os.close(write)
print(counts, flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_it_reaches_no_other_process(server):
    with running(server, REACHING) as (program, _):
        assert program.wait(ENDED), program.output
    seen, _, reached = program.output.partition(" ")
    assert int(seen) >= 1 and reached == "[]\n"


LOCKING = """
import fcntl, sys

held = []
for path in ('/usr/bin/env', sys.executable):
    for take in (fcntl.flock, fcntl.lockf):
        try:
            file = open(path)
            take(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
            held.append((take.__name__, path, file))
        except PermissionError:
            pass
print([each[:2] for each in held], flush=True)
"""


def test_it_locks_no_file_that_other_sandboxes_and_the_host_share(server, filtered):
    """Two programs could talk by such locks, and the host would wait for them."""
    with running(server, LOCKING) as (program, _):
        assert program.wait(ENDED), program.output
    assert (program.output == "[]\n") == filtered, program.output


def test_what_counts_for_a_user_does_not_outlive_a_program(server, filtered, few_users, monkeypatch):
    """The next program of the same user gets as much."""
    monkeypatch.setattr(users, "SPARE", few_users[:1])
    taken = []
    for _ in range(3):
        with running(server, TAKING) as (program, _):
            assert program.wait(ENDED), program.output
        counts = ast.literal_eval(program.output)
        totals: dict[str, int] = {}
        for name, count in counts.items():
            kind = name.partition(" ")[0]
            totals[kind] = totals.get(kind, 0) + count
        taken.append(totals)
    first = taken[0]
    # A descriptor that is just being closed counts, too; what a program leaves would be all that it has taken.
    assert [(kind, later) for later in taken[1:] for kind in first if abs(later[kind] - first[kind]) > CLOSING] == [], (
        taken
    )
    assert not filtered or {first[kind] for kind in ("queue", "semaphores", "inotify", "timers")} == {0}
    assert first["signals"] <= 3 * LIMITS["sigpending"]


@pytest.fixture
def few_users(own_users, monkeypatch, tmp_path) -> range:
    """Two users, with locks that are nobody else's."""
    few = range(61180, 61182)
    monkeypatch.setattr(users, "SPARE", few)
    monkeypatch.setattr(users, "LOCKS", tmp_path / "locks")
    return few


def left_over(user: int) -> subprocess.Popen:
    """A process of that user, which nobody waits for."""
    left = subprocess.Popen(["setpriv", f"--reuid={user}", f"--regid={user}", "--clear-groups", "sleep", "60"])
    assert wait_until(lambda: usage.of_user(user), SOON)
    return left


def test_a_user_of_whom_a_killed_worker_has_left_something_is_not_given(few_users):
    """Its lock is free, and its processes may be in a namespace that nobody else sees: the kernel is asked."""
    user, lock = users.take()
    left = left_over(user)
    os.close(lock)
    other, lock = users.take()
    assert {user, other} == {*few_users}
    with pytest.raises(SandboxError, match="taken"):
        users.take()
    left.kill()
    left.wait()
    again, second_lock = users.take()
    assert again == user
    users.give_back({other: lock, again: second_lock})


def test_a_user_whom_another_containers_grader_has_is_not_given(few_users):
    """Its locks are in a file system of its own, and the kernel counts the processes of both as one user's."""
    theirs, ours = few_users
    left = left_over(theirs)
    for _ in range(10):  # wherever the search begins
        user, lock = users.take()
        assert user == ours
        users.give_back({user: lock})
    left.kill()
    left.wait()


def test_a_user_of_whom_a_zombie_is_left_is_not_given(few_users, monkeypatch, caplog):
    monkeypatch.setattr(users, "GONE", 0.1)
    user, lock = users.take()
    left = left_over(user)
    left.kill()
    users.give_back({user: lock})
    assert f"processes [{left.pid}] of user {user}" in caplog.text
    other, lock = users.take()
    assert other != user
    users.give_back({other: lock})
    left.wait()
    both = dict(users.take() for _ in few_users)
    assert {*both} == {*few_users}
    users.give_back(both)


def test_locks_that_somebody_else_has_made_are_refused(few_users, tmp_path):
    """/run/lock is everybody's on many machines: a link there would have root write into another file."""
    users.LOCKS.mkdir()
    precious = tmp_path / "precious"
    precious.write_text("kept")
    for user in few_users:
        (users.LOCKS / str(user)).symlink_to(precious)
    with pytest.raises(OSError, match="symbolic"):
        users.take()
    os.chown(users.LOCKS, few_users[1], -1)
    with pytest.raises(SandboxUnavailable, match="must belong to root"):
        users.take()
    assert precious.read_text() == "kept"
