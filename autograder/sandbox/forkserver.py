"""Programs that begin with Python and ROS 2 loaded: forks of one process, which is loaded once for many gradings.

Loading rclpy takes three times the processor that a small program then needs.  The `Forkserver` is a process without
anything of the grader's: it has a clean environment, and runs nothing of a student's.  Asked for a program, it forks;
the fork goes into the namespaces that bubblewrap has made for that program, becomes its user, gives up all else
(`confine`), and has Python run the file as its main program.  Such a program cannot tell that it was not started as
`python FILE ARGS`, but that more modules are loaded: one with a file that has the name of a loaded module is started.
"""

import builtins
import contextlib
import ctypes
import gc
import importlib
import json
import os
import re
import select
import socket
import subprocess
import sys
import types
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path, PurePath
from typing import IO

from autograder.paths import PACKAGE
from autograder.sandbox import variables, view
from autograder.sandbox.confine import confine
from autograder.sandbox.networks import check

# What rclpy loads with its first node, and what most programs of the course use; not numpy.random, whose numbers forks
# would have in common.  Fast DDS is loaded with rclpy, and draws what its participants are told apart by for the first.
LOADED = """
    random rclpy rclpy.action rclpy.callback_groups rclpy.duration rclpy.executors rclpy.logging rclpy.node
    rclpy.parameter rclpy.qos rclpy.time rosidl_generator_py action_msgs.msg action_msgs.srv builtin_interfaces.msg
    example_interfaces.action example_interfaces.srv geometry_msgs.msg rcl_interfaces.msg rcl_interfaces.srv
    rosgraph_msgs.msg sensor_msgs.msg service_msgs.msg std_msgs.msg std_srvs.srv type_description_interfaces.srv
    unique_identifier_msgs.msg
"""
START = "import sys; sys.path.insert(0, {!r}); from autograder.sandbox import forkserver; forkserver.serve({})"
ROOM = " " * 4096  # for a program's own arguments and variables
READY = 60.0  # s until it is loaded, on a busy machine
LONGEST = 1 << 17  # bytes of a request
DESCRIPTORS = 16  # that come with a request: output, report, sandbox, control groups

PR_SET_DUMPABLE = 4  # prctl(2)
# CLONE_NEWNS, NEWCGROUP, NEWUTS, NEWIPC and NEWNET of setns(2)
NAMESPACES = 0x00020000 | 0x02000000 | 0x04000000 | 0x08000000 | 0x40000000
NEW_UTS, NEW_PID = 0x04000000, 0x20000000
PROCESS, BEGINS, ENDED = "process", "begins", "ended"

_libc = ctypes.CDLL(None, use_errno=True)


@dataclass(frozen=True)
class Request:
    """A program to run: `python FILE ARGS` with all these environment variables, limits (see `box`), user and core."""

    file: str
    args: list[str]
    variables: dict[str, str]
    limits: dict[str, int]
    user: int
    core: int | None


class Forkserver:
    """The process that forks, as the launcher has it."""

    def __init__(self) -> None:
        """Start it; it ends when this process does, or closes it."""
        self._control, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._modules: frozenset[str] | None = None  # known when it has loaded them
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-c", START.format(str(PACKAGE.parent), theirs.fileno()), ROOM],
                pass_fds=[theirs.fileno()],
                env=variables.of_program(0, view.HOME, None, view.PROFILE, confined=True) | {"ROOM": ROOM},
                cwd="/",
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                start_new_session=True,
            )

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    def runs(self, file: str, files: Mapping[str, bytes]) -> bool:
        """Whether the program `file` would be the same as if it was started, with `files` beside it."""
        if self._modules is None:
            self._control.settimeout(READY)
            try:
                self._modules = frozenset(self._control.recv(LONGEST).decode().split())
            except OSError:
                self._modules = frozenset()
            self._control.settimeout(None)
        names = {PurePath(name).name.partition(".")[0] for name in files}
        try:
            text = files[file].decode()
        except UnicodeDecodeError:
            return False
        return bool(self._modules) and file.endswith(".py") and "\0" not in text and not names & self._modules

    def run(self, request: Request, groups: Sequence[Path], output: int, sandbox: int) -> IO[bytes]:
        """Run a program that prints to `output`, in the namespaces of the process that the pidfd `sandbox` is of.

        `groups` are the files to go into its control groups by (`cgroup.Group.doors`).  What is returned has lines:
        PROCESS with the program's process id, BEGINS 0 when it does, and ENDED with its exit status, as
        `os.waitstatus_to_exitcode` has it.  Raises OSError.
        """
        message = json.dumps(asdict(request)).encode()
        with contextlib.ExitStack() as doors:
            opened = [doors.enter_context(group.open("wb")).fileno() for group in groups]
            report, report_write = os.pipe()
            try:
                socket.send_fds(self._control, [message], [output, report_write, sandbox, *opened])
            except OSError:
                os.close(report)
                raise
            finally:
                os.close(report_write)
        return os.fdopen(report, "rb")

    def close(self) -> None:
        """End it.  The programs go on."""
        self._control.close()
        self._process.wait()


def serve(control: int) -> None:
    """The forking process: load modules, tell their names, and do what comes through the socket `control`."""
    channel = socket.socket(fileno=control)
    own = _path(os.environ["PYTHONPATH"])
    sys.path[:] = [entry for entry in sys.path[2:] if entry not in own]  # that of this package, and of this command
    installed = [*sys.path]
    sys.path[:0] = own
    for name in LOADED.split():
        importlib.import_module(name)
    for name in [name for name in sys.modules if name.partition(".")[0] in ("autograder", "course")]:
        del sys.modules[name]  # a program finds nothing of the grader by its name
    check(_libc.setns(os.pidfd_open(os.getpid()), NEW_UTS))  # fails before Linux 5.8
    channel.send(" ".join({name.partition(".")[0] for name in sys.modules}).encode())
    home = os.pidfd_open(os.getpid())
    tracing = _Tracing()
    reports: dict[int, tuple[int, int]] = {}  # by pidfd: the program's process id, and where to report its end
    gc.collect()
    gc.freeze()
    while True:
        ready = select.select([channel.fileno(), *reports], [], [])[0]
        for ended in reports.keys() & ready:
            child, report = reports.pop(ended)
            _report_end(child, report)
            os.close(ended)
        if channel.fileno() not in ready:
            continue
        message, (output, report, sandbox, *groups) = _receive(channel)
        child = -1
        with contextlib.suppress(OSError):  # the sandbox has ended
            check(_libc.setns(sandbox, NEW_PID))  # for children alone
            child = tracing.fork()
        if not child:
            channel.detach()
            request = Request(**json.loads(message))
            _confine(request, output, report, sandbox, groups)
            tracing.begin()
            sys.path[:] = [view.HOME, *_path(request.variables["PYTHONPATH"]), *installed]
            return _run(request.file, request.args)
        check(_libc.setns(home, NEW_PID))
        for descriptor in (output, sandbox, *groups):
            os.close(descriptor)
        if child > 0:
            reports[os.pidfd_open(child)] = child, report
            _tell(report, PROCESS, child)
        else:
            os.close(report)


def _receive(channel: socket.socket) -> tuple[bytes, list[int]]:
    """The next request, with its descriptors; ends this process when the launcher is gone."""
    try:
        message, descriptors, _, _ = socket.recv_fds(channel, LONGEST, DESCRIPTORS)
    except ConnectionResetError:
        descriptors = []
    if not descriptors:
        os._exit(0)
    return message, descriptors


def _report_end(child: int, report: int) -> None:
    _tell(report, ENDED, os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
    os.close(report)


def _tell(report: int, what: str, number: int = 0) -> None:
    with contextlib.suppress(BrokenPipeError):  # nobody waits for it any more
        os.write(report, f"{what} {number}\n".encode())


class _Tracing:
    """LTTng's library, which is loaded with rclpy.  It has threads, and ends them at exit: a fork must have its own.

    See `ust_before_fork` and its companions in lttng/ust.h; since LTTng 2.13 their names begin with `lttng_`.
    """

    def __init__(self) -> None:
        loaded = re.search(r"/\S*/liblttng-ust(-[0-9a-f]+)?\.so\S*", Path("/proc/self/maps").read_text())
        self._library = ctypes.CDLL(loaded[0]) if loaded else None
        waits_at = re.search(rb"lttng-ust-wait-\d+", Path(loaded[0]).read_bytes()) if loaded else None
        self._waits_at = f"/dev/shm/{waits_at[0].decode()}" if waits_at else ""
        self._prefix = "lttng_ust_" if hasattr(self._library, "lttng_ust_before_fork") else "ust_"
        self._signals = ctypes.create_string_buffer(1024)  # a sigset_t: what was blocked before the fork

    def fork(self) -> int:
        """os.fork(); the child, once it is confined, must `begin`."""
        self._call("before_fork")
        child = -1
        try:
            child = os.fork()
        finally:
            if child:
                self._call("after_fork_parent")
        return child

    def begin(self) -> None:
        """Start the threads in a fork."""
        for name in (self._waits_at, f"{self._waits_at}-{os.getuid()}") if self._waits_at else ():
            with contextlib.suppress(OSError):  # otherwise they fork a process each, to make these files
                Path(name).write_bytes(bytes(os.sysconf("SC_PAGE_SIZE")))
        self._call("after_fork_child")

    def _call(self, name: str) -> None:
        if self._library:
            getattr(self._library, self._prefix + name)(self._signals)


def _path(variable: str) -> list[str]:
    return [entry for entry in variable.split(os.pathsep) if entry]


def _confine(request: Request, output: int, report: int, sandbox: int, groups: list[int]) -> None:
    """Go into the program's control groups and namespaces, be confined as it must be, and report that it begins.

    Nothing but what it prints to is open then.
    """
    try:
        for standard in (1, 2):
            os.dup2(output, standard)
        os.setsid()
        for group in groups:
            os.write(group, b"0")
        if request.core is not None:
            os.sched_setaffinity(0, {request.core})
        check(_libc.setns(sandbox, NAMESPACES))
        os.chdir(view.HOME)
        confine(request.user, request.limits)
        check(_libc.prctl(PR_SET_DUMPABLE, 1, 0, 0, 0))  # as after execve(2): it may read its own /proc
        _tell(report, BEGINS)
        os.closerange(3, os.sysconf("SC_OPEN_MAX"))
    except BaseException as error:
        os.write(1, f"{type(error).__name__}: {error}\n".encode())
        os._exit(125)
    os.environ.clear()
    os.environ.update(request.variables)
    places = Path("/proc/self/stat").read_text().rpartition(")")[2].split()  # see proc(5)
    arguments, variables = (int(places[45]), int(places[46])), (int(places[47]), int(places[48]))
    _show([sys.executable, request.file, *request.args], *arguments)
    _show([f"{name}={value}" for name, value in request.variables.items()], *variables)


def _show(words: Sequence[str], start: int, end: int) -> None:
    """Have these words in the memory from `start` to `end`, which /proc/PID/cmdline or environ shows."""
    text = b"".join(os.fsencode(word) + b"\0" for word in words)[: end - start - 1]
    ctypes.memmove(start, text.ljust(end - start, b"\0"), end - start)


def _run(file: str, args: list[str]) -> None:
    """Be `python FILE ARGS` from here on; returns, if at all, for this process to end without a further word."""
    sys.argv = [file, *args]
    sys.orig_argv = [sys.executable, *sys.argv]
    main = types.ModuleType("__main__")
    vars(main).update(__annotations__={}, __builtins__=builtins)
    sys.modules["__main__"] = main
    path = os.path.abspath(file).encode()
    _libc.fopen.restype = ctypes.c_void_p
    # The interpreter itself runs it, tells of its exceptions, and ends when it says so.
    run = ctypes.pythonapi.PyRun_AnyFileExFlags
    run.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_void_p]
    failed = run(_libc.fopen(path, b"rb"), path, 1, None)
    if failed and sys.last_type is not KeyboardInterrupt:  # for which the interpreter has an end of its own
        sys.exit(1)
