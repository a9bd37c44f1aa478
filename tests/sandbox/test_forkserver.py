"""A program that is forked is as confined, and runs as, one that is started; only then is it forked at all."""

import contextlib
import json
import os
import re
import signal
from collections.abc import Iterator

import psutil
import pytest

from autograder.errors import SandboxError
from autograder.sandbox import networks
from autograder.sandbox.forkserver import SUPPORTED, Forkserver
from autograder.sandbox.program import Program
from autograder.sandbox.sandbox import LIMITS, Sandbox
from course.foundation.waiting import wait_until

pytestmark = [
    pytest.mark.usefixtures("forks"),
    pytest.mark.skipif(not SUPPORTED, reason="this Python forks no programs"),
]
ENDED = 30.0  # s

# What a program can see of itself and of the machine.  Numbers of processes, descriptors and users differ by chance.
WORLD = """
import __main__, gc, importlib.util, json, locale, os, re, resource, signal, socket, sys, threading, traceback
status = dict(line.split(':', 1) for line in open('/proc/self/status').read().splitlines())
limits = [name for name in dir(resource) if name.startswith('RLIMIT_')]
mounts = sorted(line.split(' ', 5)[4:6] for line in open('/proc/self/mountinfo'))
world = dict(
    argv=sys.argv, orig=sys.orig_argv, path=sys.path, flags=repr(sys.flags), options=sys._xoptions,
    executable=sys.executable, prefix=sys.prefix, warnings=sys.warnoptions, recursion=sys.getrecursionlimit(),
    main={name: re.sub(' at 0x.*', '', repr(value)) for name, value in sorted(vars(__main__).items())
          if name.startswith('__') and name != '__warningregistry__'},
    names=[name for name in dir() if not name.startswith('__')], same=sys.modules['__main__'] is __main__,
    variables=dict(os.environ), environ=sorted(open('/proc/self/environ').read().strip(chr(0)).split(chr(0))),
    cmdline=open('/proc/self/cmdline').read().strip(chr(0)).split(chr(0)),
    comm=open('/proc/self/comm').read(), cwd=os.getcwd(), umask=os.umask(0), files=sorted(os.listdir('.')),
    status={name: status[name].split() for name in status if name.startswith(('Cap', 'NoNew', 'Seccomp', 'Groups'))},
    root=sorted(os.listdir('/')), users=[len({*os.getresuid()}), len({*os.getresgid()}), os.getuid() == os.getgid()],
    threads=[thread.name for thread in threading.enumerate()], stack=traceback.format_stack(),
    main_thread=threading.current_thread() is threading.main_thread(), frames=len(sys._current_frames()),
    limits={name: resource.getrlimit(getattr(resource, name)) for name in limits}, mounts=mounts,
    signals={str(number): str(signal.getsignal(number)) for number in signal.valid_signals()},
    masked=[str(number) for number in signal.pthread_sigmask(signal.SIG_BLOCK, [])],
    open=[os.readlink('/proc/self/fd/0'), *(os.readlink(f'/proc/self/fd/{n}').split(':')[0] for n in '12')],
    others=len(os.listdir('/proc/self/fd')), leader=os.getsid(0) == os.getpgid(0),
    out=[(stream.encoding, stream.errors, stream.line_buffering, stream.write_through, stream.mode)
         for stream in (sys.stdin, sys.stdout, sys.stderr)],
    interfaces=socket.if_nameindex(), host=socket.gethostname(), nice=os.nice(0), cores=len(os.sched_getaffinity(0)),
    grader=[name for name in (*sys.modules, 'autograder', 'course') if name.split('.')[0] in ('autograder', 'course')
            and (name in sys.modules or importlib.util.find_spec(name))],
    collected=[gc.isenabled(), gc.get_threshold(), gc.get_debug()], locale=locale.getlocale(),
    debugger=[str(sys.gettrace()), str(sys.getprofile()), sys.breakpointhook.__module__, sys.excepthook.__module__],
)
print(json.dumps(world, default=str))
"""
# Gives up while a task of its executor still waits: rclpy's objects must end in the usual order.
PENDING = """
import rclpy, sys
from rclpy.executors import MultiThreadedExecutor
from std_srvs.srv import Trigger
async def ask(client):
    return await client.call_async(Trigger.Request())
def main():
    rclpy.init()
    server, node = rclpy.create_node('server'), rclpy.create_node('caller')
    server.create_service(Trigger, '/nothing', print)
    client = node.create_client(Trigger, '/nothing')
    client.wait_for_service(5.0)
    executor = MultiThreadedExecutor(2)
    executor.add_node(node)
    executor.spin_until_future_complete(executor.create_task(ask, client), timeout_sec=0.5)
    sys.exit('no answer')
main()
"""
# What it has made ends by itself, while what is loaded is still there.
ENDING = """
import json, logging, rclpy
from rclpy.node import Node
class Left(Node):
    def __del__(self):
        print('ends', rclpy.ok(), json.dumps(self.get_name()), logging.__name__)
rclpy.init()
node = Left('left')
node.itself = node
rclpy.get_global_executor().add_node(node)
raise RuntimeError('not shut down')
"""
# Imports loaded modules in a thread that the end of the program cuts off.
GOES_ON = """
import threading, time
def work():
    while True:
        import random, fractions
        time.sleep(0.0001)
threading.Thread(target=work, daemon=True).start()
print('begun')
"""
# Looks in all that a program may write for PAIRS of halves, and prints the first half of those that it finds.
SEARCH = """
def is_in(content, first, second):
    at = content.find(first)
    while at >= 0 and not content.startswith(second, at + len(first)):
        at = content.find(first, at + 1)
    return at >= 0

found = set()
memory = open('/proc/self/mem', 'rb', 0)
for line in open('/proc/self/maps'):
    span, rights, *_ = line.split()
    if rights.startswith('rw'):
        start, end = (int(word, 16) for word in span.split('-'))
        memory.seek(start)
        content = memory.read(end - start)
        for secret in PAIRS:
            if is_in(content, *(half.encode() for half in secret)):
                found.add(secret[0])
        known = 'not secret'  # read in the regions that follow, or the next time
        del content
print(found)
"""


@pytest.fixture(scope="module")
def forkserver(confinement):
    server = Forkserver()
    yield server
    server.close()


@pytest.fixture(scope="module")
def forks(confinement):
    if confinement != "root":
        pytest.skip("only root's programs are forked")


@contextlib.contextmanager
def running(forkserver: Forkserver | None, text: str, *args: str, **files: str) -> Iterator[Program]:
    """A program that is forked or, without a forkserver, started; `files` are modules beside it."""
    (network,) = networks.make(1)
    content = {"program.py": text.encode()} | {f"{name}.py": file.encode() for name, file in files.items()}
    with Sandbox("root", content, forkserver=forkserver) as sandbox:
        with networks.inside(network):
            started = sandbox.launch("program.py", *args, domain=7)
        yield Program("program.py", started.output, started.end, started.process.stop)
    os.close(network)


def run(forkserver: Forkserver | None, text: str, *args: str, **files: str) -> Program:
    """One that has ended by itself."""
    with running(forkserver, text, *args, **files) as program:
        assert program.wait(ENDED), program.output
        return program


def test_it_sees_what_a_started_program_sees(forkserver):
    plain, forked = (json.loads(run(server, WORLD, "two words", "ü").output) for server in (None, forkserver))
    assert {name: (value, plain[name]) for name, value in forked.items() if plain[name] != value} == {}
    assert forked["grader"] == [] and forked["variables"]["ROS_DOMAIN_ID"] == "7"


def test_it_really_is_a_fork(forkserver):
    """Modules that the started program has not loaded are there."""
    text = "import sys; print('rclpy' in sys.modules)"
    assert [run(server, text).output for server in (None, forkserver)] == ["False\n", "True\n"]


@pytest.mark.parametrize(
    "text",
    [
        "print('done')",
        "import sys; sys.exit(3)",
        "import sys; sys.exit('no server')",
        "raise SystemExit",
        "import os; print('x', end=''); os._exit(4)",
        "def f():\n    return 1 / 0\nf()",
        "try:\n    {}['a']\nexcept KeyError as error:\n    raise ValueError('b') from error",
        "def f(:\n    pass",
        "if True:\nprint(1)",
        "print('\\u00fc')  # -*- coding: latin-1 -*-",
        "raise KeyboardInterrupt",
        "import os, signal; os.kill(os.getpid(), signal.SIGTERM)",
        "import os; os.kill(os.getpid(), 9)",
        "import os; os.abort()",
        "import ctypes; ctypes.string_at(0)",
        "import atexit; atexit.register(print, 'last'); raise Exception('first')",
        "import threading, time\nthreading.Thread(target=lambda: (time.sleep(0.2), print('b'))).start()\nprint('a')",
        "import sys\nsys.excepthook = lambda *error: print('mine', error[1])\nraise Exception('told')",
        "import runpy, sys\nprint(__name__)\nif __name__ == '__main__': runpy.run_path(sys.argv[0], run_name='again')",
        """
import multiprocessing
if __name__ == '__main__':
    process = multiprocessing.get_context('spawn').Process(target=print, args=('c',))
    process.start()
    process.join()
    print(process.exitcode)
""",
        "import pickle\nclass A: pass\nprint(type(pickle.loads(pickle.dumps(A()))).__module__)",
        PENDING,
        ENDING,
        GOES_ON,
        "import os, sys; os.execv(sys.executable, [sys.executable, '-c', 'print(2)'])",
    ],
)
def test_it_ends_as_a_started_program_does(forkserver, text):
    """The same exit status, and the same words, tracebacks too."""
    plain, forked = (run(server, text) for server in (None, forkserver))
    assert (forked.exit_status, forked.output) == (plain.exit_status, plain.output)


@pytest.mark.parametrize(
    ("text", "status", "signal"), [("import sys; sys.exit(139)", 139, ""), ("import os; os.abort()", 134, "SIGABRT")]
)
def test_a_status_of_its_own_is_no_signal(forkserver, text, status, signal):
    program = run(forkserver, text)
    assert (program.exit_status, program.signal) == (status, signal)


def test_a_ros_2_program_runs(forkserver):
    text = """
import rclpy, sys
from rclpy.node import Node
rclpy.init(args=sys.argv)
node = Node('a')
print(node.get_name(), node.get_logger().get_effective_level().name)
rclpy.shutdown()
"""
    for program in (run(forkserver, text), run(forkserver, text.replace("rclpy.shutdown()", "node.destroy_node()"))):
        assert (program.output, program.exit_status) == ("a INFO\n", 0)
    args = ["--ros-args", "-r", "__node:=b", "--log-level", "debug"]
    program = run(forkserver, text, *args)
    assert "b DEBUG" in program.output and program.exit_status == 0


def test_its_rclpy_is_patched_as_the_graders(forkserver):
    """No answer of an action is lost, and no thread of an executor kept waiting, with which a right answer fails."""
    text = """
import rclpy, time
from rclpy.action import ActionClient
from rclpy.executors import MultiThreadedExecutor
rclpy.init()
executor = MultiThreadedExecutor(2)
start = time.perf_counter()
executor._executor.submit(int)
print(hasattr(ActionClient.send_goal_async, '__wrapped__'), time.perf_counter() - start >= 50e-6)
"""
    assert run(forkserver, text).output == "True True\n"


@pytest.mark.parametrize(("module", "is_fork"), [("numpy", False), ("queue", False), ("my_module", True)])
def test_a_file_with_the_name_of_a_loaded_module_is_what_is_imported(forkserver, module, is_fork):
    program = run(forkserver, f"import sys; print('rclpy' in sys.modules); import {module}", **{module: "print('own')"})
    assert program.output == f"{is_fork}\nown\n"


def test_forks_have_no_random_numbers_in_common(forkserver):
    text = "import numpy, random, uuid; print(random.random(), numpy.random.random(), uuid.uuid4(), uuid.uuid1())"
    numbers = [word for _ in range(2) for word in run(forkserver, text).output.split()]
    assert len({*numbers}) == len(numbers) == 8


def test_the_participants_of_forks_can_be_told_apart(forkserver):
    """By the first twelve bytes of their GUIDs (DDSI-RTPS 2.5, 8.2.4.2), which all their endpoints have in common."""
    text = """
import rclpy
from rclpy.node import Node
rclpy.init()
node = Node('a')
while not (found := node.get_publishers_info_by_topic('/rosout')):
    rclpy.spin_once(node, timeout_sec=0.1)
print(bytes(found[0].endpoint_gid[:12]).hex())
"""
    prefixes = [run(forkserver, text).output for _ in range(4)]
    assert len({*prefixes}) == 4


def test_a_node_that_is_not_destroyed_leaves_the_graph_at_its_end(forkserver):
    """Its participant says so: others would count it for a lease's 20 s otherwise."""
    left = """
import rclpy, time
rclpy.init()
node = rclpy.create_node('left')
while 'last' not in node.get_node_names():
    time.sleep(0.01)
"""
    watch = """
import rclpy, time
rclpy.init()
node = rclpy.create_node('watch')
while 'left' not in node.get_node_names():
    time.sleep(0.01)
last = rclpy.create_node('last')
seen = time.monotonic()
while 'left' in node.get_node_names():
    time.sleep(0.01)
print(time.monotonic() - seen < 10)
"""
    (network,) = networks.make(1)
    files = {"left.py": left.encode(), "watch.py": watch.encode()}
    with Sandbox("root", files, forkserver=forkserver) as sandbox, networks.inside(network):
        started = [sandbox.launch(name, domain=7) for name in ("watch.py", "left.py")]
        watching, leaving = (Program("p.py", each.output, each.end, each.process.stop) for each in started)
        assert leaving.wait(ENDED) and leaving.exit_status == 0, leaving.output
        assert watching.wait(ENDED), watching.output
    os.close(network)
    assert watching.output == "True\n"


def test_its_memory_holds_no_secret(confinement, monkeypatch):
    """Neither a variable of whoever starts the forkserver, nor what another program was given or has printed."""
    secrets = ["said only to", " the grader", "printed by another", " program", "an argument of", " another"]
    monkeypatch.setenv("SECRET_OF_THE_GRADER", "".join(secrets[:2]))
    server = Forkserver()
    run(server, f"print({''.join(secrets[2:4])!r})", "".join(secrets[4:]))
    # It never puts the two halves together itself, or it would find its own.
    pairs = [secrets[:2], secrets[2:4], secrets[4:], ["not se", "cret"]]
    text = f"PAIRS = {pairs}\n{SEARCH}"
    assert run(server, text).output == "{'not se'}\n"
    server.close()


def test_no_frame_and_no_request_of_the_forkserver_can_be_reached(forkserver):
    run(forkserver, "print(1)", "an argument of another")
    text = """
import gc, sys, types
gc.unfreeze()
known = {id(known) for known in (sys._getframe(), globals())}
frames = [each for each in gc.get_objects() if isinstance(each, types.FrameType) and id(each) not in known]
named = ('Request', 'Forkserver')
of_forkserver = [each for each in gc.get_objects() if type(each).__name__ in named]
print(sys._getframe().f_back, frames, of_forkserver, 'an argument of' + ' another' in map(str, gc.get_objects()))
"""
    program = run(forkserver, text)
    assert program.output == "None [] [] False\n"


def test_no_descriptor_is_inherited_whatever_its_number(confinement):
    """A process may have open what is beyond a limit that was set later: pipes and control groups of other programs."""
    with contextlib.ExitStack() as held:
        for _ in range(2 * LIMITS["nofile"]):
            held.enter_context(open(os.devnull, "rb"))
        server = Forkserver()  # its own socket has a high number
    text = """
import os
print(sorted(name for name in os.listdir('/proc/self/fd') if os.path.exists(f'/proc/self/fd/{name}')))
"""
    assert run(server, text).output == "['0', '1', '2']\n"
    server.close()


@pytest.mark.parametrize(
    ("text", "is_fork"),
    [
        ("import rclpy", True),
        ("from rclpy.node import Node\nNode", True),
        ("import rclpy.node\nrclpy.node.Node", True),
        ("import rclpy.action.server\nrclpy.action.server", True),
        ("import rclpy\nrclpy.node.Node", False),
        ("import rclpy; rclpy.node.Node", False),
        ("import rclpy as r\nr.node.Node", False),
        ("import std_srvs\nstd_srvs.srv.SetBool", False),
    ],
)
def test_a_module_that_is_used_and_not_imported_is_missing(forkserver, text, is_fork):
    """As where the program is started as `python FILE`: in a robot's terminal, in the notebook."""
    forked = run(forkserver, f"import sys; print('rclpy' in sys.modules)\n{text}")
    plain = run(None, text)
    assert forked.output.startswith(str(is_fork))
    assert forked.exit_status == plain.exit_status == (0 if is_fork else 1), forked.output
    assert run(forkserver, "import helper", helper=text).exit_status == plain.exit_status


def test_a_program_can_be_started_afresh(forkserver):
    (network,) = networks.make(1)
    with Sandbox(
        "root", {"program.py": b"import sys; print('rclpy' in sys.modules)"}, forkserver=forkserver
    ) as sandbox:
        with networks.inside(network):
            started = sandbox.launch("program.py", domain=7, afresh=True)
        program = Program("program.py", started.output, started.end, started.process.stop)
        assert program.wait(ENDED) and program.output == "False\n"
    os.close(network)


def test_it_cannot_end_what_holds_its_sandbox(forkserver):
    text = """
import os, signal
for process in [name for name in os.listdir('/proc') if name.isdigit() and os.stat(f'/proc/{name}').st_uid == 0]:
    try:
        os.kill(int(process), signal.SIGKILL)
        print('killed', process)
    except PermissionError as error:
        print(error.strerror)
"""
    assert {*run(forkserver, text).output.splitlines()} == {"Operation not permitted"}


def test_what_it_leaves_running_ends_with_it(forkserver):
    marker = "left_by_a_forked_program"
    program = run(
        forkserver, f"import subprocess, sys; subprocess.Popen([sys.executable, '-c', 'input()  # {marker}'])"
    )
    assert program.exit_status == 0
    assert not [p for p in psutil.process_iter(["cmdline"]) if any(marker in word for word in p.info["cmdline"] or [])]


def test_it_can_be_stopped(forkserver):
    with running(forkserver, "print('here'); import time; time.sleep(1000)") as program:
        assert wait_until(lambda: "here" in program.output, ENDED)
        program.kill("enough")
        assert (program.exit_status, program.stopped) == (128 + signal.SIGKILL, "enough")


def test_it_is_stopped_when_it_takes_too_much(forkserver):
    processes = "import contextlib, os\nwhile True:\n    with contextlib.suppress(OSError):\n        os.fork()"
    # Of the two limits, of processes at all and of busy ones, a busy machine comes to the second first.
    assert re.search("it started|threads busy", run(forkserver, processes).stopped)
    memory = """
import os, time
for _ in range(3):
    if not os.fork():
        break
x = b'x' * (500 << 20)
time.sleep(1000)
"""
    assert "GiB of memory" in run(forkserver, memory).stopped
    assert "MemoryError" in run(forkserver, f"x = b'x' * {LIMITS['data'] + 1}").output


def test_without_its_forkserver_no_program_begins(confinement):
    server = Forkserver()
    assert run(server, "print(1)").output == "1\n"
    psutil.Process(server.pid).kill()
    with running(server, "print(1)") as program, pytest.raises(SandboxError):
        program.wait(ENDED)
    server.close()
