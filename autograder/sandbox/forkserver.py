"""Programs that begin with Python and modules loaded: forks of one process, which is loaded once for all of them.

Loading rclpy takes three times the processor that a small program then needs, and loading JupyterLab most of what a
student's server takes to start.  The `Forkserver` is a process without anything of the grader's or the hub's: it has a
clean environment, and runs nothing of a student's.  Asked for a program, it forks; the fork goes into the namespaces
that bubblewrap has made for that program, becomes its user, gives up all else (`confine`), and has Python run the file
as its main program, with no other frame below it.

Such a program can tell that it was not started as `python FILE ARGS`: its parent is process 0, more modules are loaded,
and among the subclasses of `object` are classes of this module.  It finds nothing there that was meant for somebody
else: what the process is asked for is parsed in the fork alone, and wiped.  A program is started instead where the
difference could matter: one with a file that has the name of a loaded module, and one that uses a module that it has
not imported (`rclpy.node` after `import rclpy`).
"""

import _thread
import atexit
import builtins
import contextlib
import ctypes
import errno
import fcntl
import gc
import importlib
import json
import os
import re
import select
import signal
import socket
import subprocess
import sys
import threading
import types
from array import array
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import starmap
from pathlib import Path, PurePath
from typing import IO, NoReturn

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
START = (
    "import sys; sys.path.insert(0, {!r}); from autograder.sandbox import forkserver; forkserver.serve({}, {!r}, {!r})"
)
ROOM = " " * 4096  # for a program's own arguments and variables
READY = 60.0  # s until it is loaded, on a busy machine
LONGEST = 1 << 17  # bytes of a request
DESCRIPTORS = 16  # that come with a request: output, report, sandbox, control groups
REAPED = 1000  # of the dead that are buried in one turn, before other requests have theirs
LEAST = 3  # the same without control groups
KEPT = 3  # the number of the first descriptor that a program keeps
ASIDE = 100  # where descriptors are while those from KEPT on are made free
# From Python 3.13 on, Py_Exit breaks down (SIGSEGV) in a fork of a thread that is not the one Python began with, and so
# would each program at its end: each is started then.
SUPPORTED = sys.version_info < (3, 13)
FAILED = 125  # exit status of a fork that does not come to be a program
GLANCE = 0.1  # s between two looks at children that nobody has asked for

PR_SET_DUMPABLE = 4  # prctl(2)
# CLONE_NEWNS, NEWCGROUP, NEWUTS, NEWIPC and NEWNET of setns(2)
NAMESPACES = 0x00020000 | 0x02000000 | 0x04000000 | 0x08000000 | 0x40000000
NEW_UTS, NEW_PID = 0x04000000, 0x20000000
BEGINS, ENDED = "begins", "ended"

IMPORT = re.compile(r"\s*(?:from|import)\s+([\w.]+)")

_libc = ctypes.CDLL(None, use_errno=True)


@dataclass(frozen=True)
class Request:
    """A program to run: `python FILE ARGS` with these environment variables, limits (see `sandbox`), user and core."""

    file: str
    args: list[str]
    variables: dict[str, str]
    limits: dict[str, int]
    user: int
    core: int | None = None
    group: int | None = None  # default: of the same number as the user
    umask: int | None = None  # default: the forking process's
    directory: str = view.HOME
    path: tuple[str, ...] = ()  # of modules, before those that are installed
    options: tuple[str, ...] = ()  # of Python, which are those of the forking process
    kept: int = 0  # the number of descriptors that it keeps, from KEPT on


@dataclass(frozen=True)
class Template:
    """A forking process to start: what it loads, and how."""

    variables: dict[str, str]  # all that it has, and nothing that a program may not know
    modules: str = LOADED
    forgotten: str = ""  # modules that a program loads anew, and all in them
    options: tuple[str, ...] = ()  # of Python


def for_programs() -> Template:
    """The template of what is graded."""
    return Template(variables.of_program(0, view.HOME, None, view.PROFILE, confined=True))


class Forkserver:
    """The process that forks, as the launcher has it."""

    def __init__(self, template: Template | None = None) -> None:
        """Start it; it ends when this process does, or closes it.  Default: the template of what is graded."""
        template = template or for_programs()
        self._control, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._modules: frozenset[str] | None = None  # known when it has loaded them
        self._used = re.compile("")  # finds the use of one of them that is in a package
        with theirs:
            self._process = subprocess.Popen(
                [
                    sys.executable,
                    *template.options,
                    "-c",
                    START.format(str(PACKAGE.parent), theirs.fileno(), template.modules, template.forgotten),
                    ROOM,
                ],
                pass_fds=[theirs.fileno()],
                env=template.variables | {"ROOM": ROOM},
                cwd="/",
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                start_new_session=True,
            )

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        """Return True if it is running."""
        return self._process.poll() is None

    def ready(self) -> bool:
        """Wait until it has loaded its modules; False when it cannot, or ends."""
        if self._modules is None:
            self._control.settimeout(READY)
            try:
                self._modules = frozenset(self._control.recv(LONGEST).decode().split())
            except OSError:
                self._modules = frozenset()
            self._control.settimeout(None)
            packages = {name.partition(".")[0] for name in LOADED.split()}
            inner = [name for name in self._modules if "." in name and name.partition(".")[0] in packages]
            # The second: a package under another name, whose uses cannot be seen.
            self._used = re.compile(
                rf"(?<![\w.])({'|'.join(map(re.escape, sorted(inner)))})\b"
                rf"|^\s*import\s+((?:{'|'.join(sorted(packages))})\s+as)\b"
            )
        return bool(self._modules)

    def runs(self, file: str, files: Mapping[str, bytes]) -> bool:
        """Return True if the program `file` would be the same as if it was started, with `files` beside it."""
        ready = self.ready()
        names = {PurePath(name).name.partition(".")[0] for name in files}
        try:
            texts = {name: content.decode() for name, content in files.items() if name.endswith(".py")}
        except UnicodeDecodeError:
            return False
        if not ready or names & (self._modules or set()) or "\0" in texts.get(file, "\0"):
            return False
        return all(self._imports_what_it_uses(text) for text in texts.values())

    def _imports_what_it_uses(self, text: str) -> bool:
        """Return True if each loaded module that a text names stands in an import there, too.

        In a fork, `rclpy.node` is there after `import rclpy` already.
        """
        used, imported = set[str](), set[str]()
        for line in text.splitlines():
            start = IMPORT.match(line)
            if start:
                imported.add(start[1])
            rest = line[start.end() :] if start and not self._used.match(line) else line
            used |= {found[1] or found[2] for found in self._used.finditer(rest)}
        return all(any(f"{known}.".startswith(f"{name}.") for known in imported) for name in used)

    def run(
        self, request: Request, groups: Sequence[Path], output: int, sandbox: int, kept: Sequence[int] = ()
    ) -> IO[bytes]:
        """Run a program that prints to `output`, in the namespaces of the process that the pidfd `sandbox` is of.

        `groups` are the files to go into its control groups by (`cgroup.Group.doors`), and `kept` the descriptors that
        it has from KEPT on, as many as the request says.  What is returned has lines: BEGINS 0 when it does, and ENDED
        with its exit status, as `os.waitstatus_to_exitcode` has it.  Raises OSError.
        """
        message = json.dumps(asdict(request)).encode()
        if len(message) > LONGEST:
            raise OSError(errno.EMSGSIZE, os.strerror(errno.EMSGSIZE))
        with contextlib.ExitStack() as doors:
            opened = [doors.enter_context(group.open("wb")).fileno() for group in groups]
            report, report_write = os.pipe()
            try:
                socket.send_fds(self._control, [message], [output, report_write, sandbox, *kept, *opened])
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


def serve(control: int, modules: str, forgotten: str) -> None:
    """The forking process: load modules, tell their names, and do what comes through the socket `control`.

    A program finds the `forgotten` ones not loaded, nor anything of the grader by its name.
    """
    channel = socket.socket(fileno=control)
    own = _path(os.environ.get("PYTHONPATH", ""))
    before = {"", str(PACKAGE.parent), *own}  # of this command, and of this package
    sys.path[:] = [entry for entry in sys.path if entry not in before]
    installed = [*sys.path]
    sys.path[:0] = own
    for name in modules.split():
        importlib.import_module(name)
    for name in [*sys.modules]:
        if any(f"{name}.".startswith(f"{each}.") for each in ("autograder", "course", *forgotten.split())):
            del sys.modules[name]
            around, _, last = name.rpartition(".")
            if around in sys.modules:
                vars(sys.modules[around]).pop(last, None)
    check(_libc.setns(os.pidfd_open(os.getpid()), NEW_UTS))  # fails before Linux 5.8
    channel.send(" ".join(sys.modules).encode())
    gc.collect()
    gc.freeze()
    # What has called them is among the frames of a thread.  In a fork only this thread goes on, in which nothing has
    # been called but what is written in C.
    run = ctypes.pythonapi.PyRun_AnyFileExFlags
    run.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_void_p]
    _thread.start_new_thread(deque, (map(_end, starmap(run, map(_become_program, [channel], [installed]))), 0))
    while True:
        signal.pause()


def _become_program(channel: socket.socket, installed: list[str]) -> tuple[int, bytes, int, None]:
    """Fork for each request; returns in forks only: how the interpreter is told to run the program."""
    try:
        request = _fork_for_each(channel)
        sys.path[:] = [*request.path, *_path(request.variables.get("PYTHONPATH", "")), *installed]
        return _prepared(request.options, request.file, request.args)
    except BaseException as error:
        os.write(2, f"{type(error).__name__}: {error}\n".encode(errors="replace"))
        os._exit(FAILED)


def _fork_for_each(channel: socket.socket) -> Request:
    """Fork for each request that comes through the socket; returns in forks only, which are confined by then."""
    home = os.pidfd_open(os.getpid())
    tracing = _Tracing()
    programs: dict[int, tuple[int, int]] = {}  # by process id: a pidfd, and where to report its end
    room = bytearray(LONGEST)
    while True:
        timeout = _bury(programs)
        waiting = [channel.fileno(), *(ended for ended, _ in programs.values())]
        if channel.fileno() not in select.select(waiting, [], [], timeout)[0]:
            continue
        message, descriptors = _receive(channel, room)
        if len(descriptors) >= LEAST:
            output, report, sandbox, *more = descriptors
            child = -1
            with contextlib.suppress(OSError):  # the sandbox has ended
                check(_libc.setns(sandbox, NEW_PID))  # for children alone
                child = tracing.fork()
            if not child:
                request = Request(**json.loads(bytes(message)))
                _confine(request, output, report, sandbox, more)
                tracing.begin()
                return request
            check(_libc.setns(home, NEW_PID))
            if child > 0:
                descriptors.remove(report)
                programs[child] = os.pidfd_open(child), report
        message[:] = bytes(len(message))  # the next program finds nothing of it
        for descriptor in descriptors:
            os.close(descriptor)


def _bury(programs: dict[int, tuple[int, int]]) -> float | None:
    """Wait for the dead, and report those that are programs; returns after how many seconds to look again.

    Others are children of a program's that it made this process's (`clone` with CLONE_PARENT), where the filter of
    system calls does not keep it from that.  Unburied, they would count for their user.
    """
    with contextlib.suppress(ChildProcessError):
        for _ in range(REAPED):
            child, status = os.waitpid(-1, os.WNOHANG)
            if not child:
                return GLANCE
            if child in programs:
                ended, report = programs.pop(child)
                _tell(report, ENDED, os.waitstatus_to_exitcode(status))
                os.close(report)
                os.close(ended)
        return 0.0
    return None


def _receive(channel: socket.socket, room: bytearray) -> tuple[memoryview, list[int]]:
    """The next request, in `room`, with its descriptors; ends this process when the launcher is gone.

    There are no descriptors with a request that has come in part.
    """
    descriptors = array("i")
    try:
        size, extra, flags, _ = channel.recvmsg_into([room], socket.CMSG_LEN(DESCRIPTORS * descriptors.itemsize))
    except ConnectionResetError:
        os._exit(0)
    for _, _, data in extra:
        descriptors.frombytes(data[: len(data) - len(data) % descriptors.itemsize])
    if not size:
        os._exit(0)
    if flags & (socket.MSG_TRUNC | socket.MSG_CTRUNC):
        while descriptors:
            os.close(descriptors.pop())
    return memoryview(room)[:size], [*descriptors]


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


def _confine(request: Request, output: int, report: int, sandbox: int, more: list[int]) -> None:
    """Go into the program's control groups and namespaces, be confined as it must be, and report that it begins.

    `more` are the descriptors that it keeps, and those of its control groups.  Nothing else is open then but what it
    prints to.
    """
    for standard in (1, 2):
        os.dup2(output, standard)
    os.setsid()
    for group in more[request.kept :]:
        os.write(group, b"0")
    if request.core is not None:
        os.sched_setaffinity(0, {request.core})
    check(_libc.setns(sandbox, NAMESPACES))
    report, *kept = (fcntl.fcntl(each, fcntl.F_DUPFD_CLOEXEC, ASIDE) for each in (report, *more[: request.kept]))
    for name in os.listdir("/proc/self/fd"):  # now: what has a number beyond the limit is open all the same
        if int(name) not in (0, 1, 2, report, *kept):
            with contextlib.suppress(OSError):  # the list's own
                os.close(int(name))
    for number, descriptor in enumerate(kept, KEPT):
        os.dup2(descriptor, number, inheritable=False)
        os.close(descriptor)
    confine(request.user, request.limits, group=request.group)
    os.chdir(request.directory)
    if request.umask is not None:
        os.umask(request.umask)
    check(_libc.prctl(PR_SET_DUMPABLE, 1, 0, 0, 0))  # as after execve(2): it may read its own /proc
    _tell(report, BEGINS)
    os.close(report)
    os.environ.clear()
    os.environ.update(request.variables)
    places = Path("/proc/self/stat").read_text().rpartition(")")[2].split()  # see proc(5)
    arguments, variables = (int(places[45]), int(places[46])), (int(places[47]), int(places[48]))
    _show([sys.executable, *request.options, request.file, *request.args], *arguments)
    _show([f"{name}={value}" for name, value in request.variables.items()], *variables)


def _show(words: Sequence[str], start: int, end: int) -> None:
    """Have these words in the memory from `start` to `end`, which /proc/PID/cmdline or environ shows."""
    text = b"".join(os.fsencode(word) + b"\0" for word in words)[: end - start - 1]
    ctypes.memmove(start, text.ljust(end - start, b"\0"), end - start)


def _prepared(options: Sequence[str], file: str, args: list[str]) -> tuple[int, bytes, int, None]:
    """Have this process look like `python OPTIONS FILE ARGS`; returns how PyRun_AnyFileExFlags is told to run it.

    The interpreter itself runs it, tells of its exceptions, and ends when it says so.
    """
    sys.argv = [file, *args]
    sys.orig_argv = [sys.executable, *options, *sys.argv]
    main = types.ModuleType("__main__")
    vars(main).update(__annotations__={}, __builtins__=builtins)
    vars(sys.modules["__main__"]).clear()  # of the command that this process was started with
    sys.modules["__main__"] = main
    path = os.path.abspath(file).encode()
    _libc.fopen.restype = ctypes.c_void_p
    return _libc.fopen(path, b"rb"), path, 1, None


def _end(failed: int) -> NoReturn:
    """End a program as the interpreter does once the main file has been run."""
    if failed and sys.last_type is KeyboardInterrupt:
        threading._shutdown()  # type: ignore[attr-defined]  # waits for the program's threads
        atexit._run_exitfuncs()
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        os.kill(os.getpid(), signal.SIGINT)
    ctypes.pythonapi.Py_Exit(int(bool(failed)))
    raise AssertionError("the interpreter has not ended")
