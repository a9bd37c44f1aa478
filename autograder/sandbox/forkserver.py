"""Programs that start with Python and modules already loaded, as forks of one process.

Loading rclpy takes three times the processor time that a small program then needs, and loading JupyterLab takes most of
the start of a student's server.  The `Forkserver` is a process that has no data of the grader or the hub: it has a
clean environment, and runs no student code.  For each program it forks; the fork enters the namespaces that bubblewrap
has made for that program, becomes its user, gives up all other rights (`confine`), and has Python run the file as its
main program, with no other frame below it.

Such a program can tell that it was not started as `python FILE ARGS`: its parent is process 0, more modules are loaded,
and among the subclasses of `object` are classes of this module.  It finds no data meant for other programs there,
because a request is parsed only in its own fork, and wiped.  A program is started in the ordinary way instead if the
difference could matter: if one of its files has the name of a loaded module, or if it uses a module that it has not
imported (`rclpy.node` after `import rclpy`).

At its end, the loaded modules are left as they are: taking them apart would copy all pages that the fork shares, which
takes as long as the rest of a small program.  What the program itself has made ends in the usual order.
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

# The modules that rclpy loads with its first node, and those that most programs of the course use; not numpy.random,
# because forks would share its state.  Fast DDS is loaded with rclpy; it draws its participants' ids for the first
# participant, after the fork.
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
READY = 60.0  # s until the modules are loaded, on a busy machine
LONGEST = 1 << 17  # bytes of a request
DESCRIPTORS = 16  # received with a request: output, report, sandbox, control groups
REAPED = 1000  # zombies that are reaped in one turn, before the next request
LEAST = 3  # received with a request at least, without control groups
KEPT = 3  # the number of the first descriptor that a program keeps
ASIDE = 100  # where descriptors are moved while those from KEPT on are freed
# From Python 3.13 on, Py_Exit crashes (SIGSEGV) in a fork of any but the first thread, so each program would crash at
# its end: there, all programs are started in the ordinary way.
SUPPORTED = sys.version_info < (3, 13)
FAILED = 125  # exit status of a fork that failed before its program began
GLANCE = 0.1  # s between two looks at children that are not requested programs

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
    path: tuple[str, ...] = ()  # of modules, searched before the installed ones
    options: tuple[str, ...] = ()  # of Python, the same as those of the forking process
    kept: int = 0  # the number of descriptors that the program keeps, from KEPT on
    server: bool = False  # a class's, which may watch files


@dataclass(frozen=True)
class Template:
    """A forking process to start: its modules and its environment."""

    variables: dict[str, str]  # its whole environment, which programs may see
    modules: str = LOADED
    forgotten: str = ""  # modules that a program loads again, with their submodules
    options: tuple[str, ...] = ()  # of Python


def for_programs() -> Template:
    """Return the template for graded programs."""
    return Template(variables.of_program(0, view.HOME, None, view.PROFILE, confined=True))


class Forkserver:
    """The forking process, as seen by the launcher."""

    def __init__(self, template: Template | None = None) -> None:
        """Start it, by default with `for_programs()`; it ends with this process, or when it is closed."""
        template = template or for_programs()
        self._control, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._modules: frozenset[str] | None = None  # known once they are loaded
        self._used = re.compile("")  # finds uses of loaded modules that are in a package
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
            # The second pattern: a package imported under another name, whose uses cannot be found.
            self._used = re.compile(
                rf"(?<![\w.])({'|'.join(map(re.escape, sorted(inner)))})\b"
                rf"|^\s*import\s+((?:{'|'.join(sorted(packages))})\s+as)\b"
            )
        return bool(self._modules)

    def runs(self, file: str, files: Mapping[str, bytes]) -> bool:
        """Return True if the program `file`, with `files` beside it, would run in a fork as in the ordinary way."""
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
        """Return True if each loaded module that a text uses is also imported there.

        In a fork, `rclpy.node` would exist even after a mere `import rclpy`.
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
        """Run a program that prints to `output`, in the namespaces of the process of the pidfd `sandbox`.

        `groups` are the files for entering its control groups (`cgroup.Group.doors`), and `kept` the descriptors that
        it gets from KEPT on, `request.kept` of them.  Returns a stream of lines: BEGINS 0 when it begins, and ENDED
        with its exit status, as `os.waitstatus_to_exitcode` returns it.  Raises OSError.
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
    """Be the forking process: load modules, send their names, and serve requests from the socket `control`.

    For a program, neither the `forgotten` modules nor the grader's appear as loaded.
    """
    channel = socket.socket(fileno=control)
    own = _path(os.environ.get("PYTHONPATH", ""))
    before = {"", str(PACKAGE.parent), *own}  # sys.path entries of this command and of this package
    sys.path[:] = [entry for entry in sys.path if entry not in before]
    installed = [*sys.path]
    sys.path[:0] = own
    for name in modules.split():
        importlib.import_module(name)
    if "rclpy.action" in sys.modules:
        importlib.import_module("course.ros.rclpy_patches").patch()
    for name in [*sys.modules]:
        if any(f"{name}.".startswith(f"{each}.") for each in ("autograder", "course", *forgotten.split())):
            del sys.modules[name]
            around, _, last = name.rpartition(".")
            if around in sys.modules:
                vars(sys.modules[around]).pop(last, None)
    check(_libc.setns(os.pidfd_open(os.getpid()), NEW_UTS))  # fails before Linux 5.8
    _load_messages(modules.split())
    channel.send(" ".join(sys.modules).encode())
    _keep_at_exit()
    gc.collect()
    gc.freeze()
    # A program can see the frames of its thread.  In a fork only this new thread survives, and everything below the
    # program in it is C.
    run = ctypes.pythonapi.PyRun_AnyFileExFlags
    run.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_void_p]
    _thread.start_new_thread(deque, (map(_end, starmap(run, map(_become_program, [channel], [installed]))), 0))
    while True:
        signal.pause()


def _load_messages(modules: Sequence[str]) -> None:
    """Load the libraries of these modules' messages, which each program would load for its first node."""
    for name in modules:
        package, _, kind = name.rpartition(".")
        if kind in ("msg", "srv", "action"):
            for message in vars(sys.modules[name]).values():
                if load := getattr(type(message), "__import_type_support__", None):
                    load()
            with contextlib.suppress(OSError):  # rmw_fastrtps_cpp's; another middleware has others
                ctypes.CDLL(f"lib{package}__rosidl_typesupport_fastrtps_c.so")


def _keep_at_exit() -> None:
    """Have each fork end without taking apart the modules that are loaded now, but for those of rclpy that it changes.

    A fork with other threads, which could import them meanwhile, ends in the ordinary way.
    """
    kept = [(name, module) for name, module in sys.modules.items() if name not in ("__main__", "builtins", "sys")]
    state = {name: {**vars(module)} for name, module in kept if name.partition(".")[0] == "rclpy"}
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(kept))  # for ever

    def keep() -> None:
        if len(sys._current_frames()) == 1:
            for name, module in kept:
                if name not in state or state[name] == vars(module):
                    sys.modules.pop(name, None)

    atexit.register(keep)


def _become_program(channel: socket.socket, installed: list[str]) -> tuple[int, bytes, int, None]:
    """Fork for each request; return only in the forks, with the arguments for the interpreter to run the program."""
    try:
        request = _fork_for_each(channel)
        sys.path[:] = [*request.path, *_path(request.variables.get("PYTHONPATH", "")), *installed]
        return _prepared(request.options, request.file, request.args)
    except BaseException as error:
        os.write(2, f"{type(error).__name__}: {error}\n".encode(errors="replace"))
        os._exit(FAILED)


def _fork_for_each(channel: socket.socket) -> Request:
    """Fork for each request from the socket; return only in the forks, once they are confined."""
    home = os.pidfd_open(os.getpid())
    tracing = Tracing()
    programs: dict[int, tuple[int, int]] = {}  # by process id: a pidfd, and the descriptor to report its end to
    buffer = bytearray(LONGEST)
    while True:
        timeout = _reap(programs)
        waiting = [channel.fileno(), *(ended for ended, _ in programs.values())]
        if channel.fileno() not in select.select(waiting, [], [], timeout)[0]:
            continue
        message, descriptors = _receive(channel, buffer)
        if len(descriptors) >= LEAST:
            output, report, sandbox, *more = descriptors
            child = -1
            with contextlib.suppress(OSError):  # the sandbox has ended
                check(_libc.setns(sandbox, NEW_PID))  # applies to children only
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
        message[:] = bytes(len(message))  # wiped, so that the next program cannot read it
        for descriptor in descriptors:
            os.close(descriptor)


def _reap(programs: dict[int, tuple[int, int]]) -> float | None:
    """Reap ended children, and report those that are programs; return the seconds until the next look.

    Others are children that a program has given to this process (`clone` with CLONE_PARENT), if the system call filter
    does not prevent that.  As zombies they would count against their user.
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


def _receive(channel: socket.socket, buffer: bytearray) -> tuple[memoryview, list[int]]:
    """Return the next request, in `buffer`, with its descriptors; ends this process when the launcher is gone.

    A truncated request has no descriptors.
    """
    descriptors = array("i")
    try:
        size, extra, flags, _ = channel.recvmsg_into([buffer], socket.CMSG_LEN(DESCRIPTORS * descriptors.itemsize))
    except ConnectionResetError:
        os._exit(0)
    for _, _, data in extra:
        descriptors.frombytes(data[: len(data) - len(data) % descriptors.itemsize])
    if not size:
        os._exit(0)
    if flags & (socket.MSG_TRUNC | socket.MSG_CTRUNC):
        while descriptors:
            os.close(descriptors.pop())
    return memoryview(buffer)[:size], [*descriptors]


def _tell(report: int, what: str, number: int = 0) -> None:
    with contextlib.suppress(BrokenPipeError):  # nobody waits for it any more
        os.write(report, f"{what} {number}\n".encode())


class Tracing:
    """LTTng's library, loaded with rclpy.  It has threads, which it ends at exit, so a fork must have its own.

    See `ust_before_fork` and its companions in lttng/ust.h; since LTTng 2.13 their names begin with `lttng_`.
    """

    def __init__(self) -> None:
        loaded = re.search(r"/\S*/liblttng-ust(-[0-9a-f]+)?\.so\S*", Path("/proc/self/maps").read_text())
        self._library = ctypes.CDLL(loaded[0]) if loaded else None
        waits_at = re.search(rb"lttng-ust-wait-\d+", Path(loaded[0]).read_bytes()) if loaded else None
        self._waits_at = f"/dev/shm/{waits_at[0].decode()}" if waits_at else ""
        self._prefix = "lttng_ust_" if hasattr(self._library, "lttng_ust_before_fork") else "ust_"
        self._signals = ctypes.create_string_buffer(1024)  # a sigset_t: the signals blocked before the fork

    def fork(self) -> int:
        """Call os.fork(); the child must call `begin` once it is confined."""
        self._call("before_fork")
        child = -1
        try:
            child = os.fork()
        finally:
            if child:
                self._call("after_fork_parent")
        return child

    def begin(self) -> None:
        """Start LTTng's threads in a fork."""
        for name in (self._waits_at, f"{self._waits_at}-{os.getuid()}") if self._waits_at else ():
            with contextlib.suppress(OSError):  # otherwise each forks a process to make these files
                Path(name).write_bytes(bytes(os.sysconf("SC_PAGE_SIZE")))
        self._call("after_fork_child")

    def _call(self, name: str) -> None:
        if self._library:
            getattr(self._library, self._prefix + name)(self._signals)


def _path(variable: str) -> list[str]:
    return [entry for entry in variable.split(os.pathsep) if entry]


def _confine(request: Request, output: int, report: int, sandbox: int, more: list[int]) -> None:
    """Enter the program's control groups and namespaces, confine this process, and report that the program begins.

    `more` are the descriptors that it keeps, and those of its control groups.  Only the kept ones and its output stay
    open.
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
    for name in os.listdir("/proc/self/fd"):  # before the limit is set: higher descriptors would stay open
        if int(name) not in (0, 1, 2, report, *kept):
            with contextlib.suppress(OSError):  # the descriptor of the listing itself
                os.close(int(name))
    for number, descriptor in enumerate(kept, KEPT):
        os.dup2(descriptor, number, inheritable=False)
        os.close(descriptor)
    confine(request.user, request.limits, group=request.group, server=request.server)
    os.chdir(request.directory)
    if request.umask is not None:
        os.umask(request.umask)
    check(_libc.prctl(PR_SET_DUMPABLE, 1, 0, 0, 0))  # as after execve(2): the program may read its own /proc
    _tell(report, BEGINS)
    os.close(report)
    os.environ.clear()
    os.environ.update(request.variables)
    places = Path("/proc/self/stat").read_text().rpartition(")")[2].split()  # see proc(5)
    arguments, variables = (int(places[45]), int(places[46])), (int(places[47]), int(places[48]))
    _show([sys.executable, *request.options, request.file, *request.args], *arguments)
    _show([f"{name}={value}" for name, value in request.variables.items()], *variables)


def _show(words: Sequence[str], start: int, end: int) -> None:
    """Write these words to the memory from `start` to `end`, which /proc/PID/cmdline or environ shows."""
    text = b"".join(os.fsencode(word) + b"\0" for word in words)[: end - start - 1]
    ctypes.memmove(start, text.ljust(end - start, b"\0"), end - start)


def _prepared(options: Sequence[str], file: str, args: list[str]) -> tuple[int, bytes, int, None]:
    """Make this process look like `python OPTIONS FILE ARGS`; return the arguments of PyRun_AnyFileExFlags to run it.

    So the interpreter itself runs the file, prints its exceptions, and handles its exit.
    """
    sys.argv = [file, *args]
    sys.orig_argv = [sys.executable, *options, *sys.argv]
    main = types.ModuleType("__main__")
    vars(main).update(__annotations__={}, __builtins__=builtins)
    vars(sys.modules["__main__"]).clear()  # belongs to the command that started this process
    sys.modules["__main__"] = main
    path = os.path.abspath(file).encode()
    _libc.fopen.restype = ctypes.c_void_p
    return _libc.fopen(path, b"rb"), path, 1, None


def _end(failed: int) -> NoReturn:
    """End the process as the interpreter does after running the main file."""
    if failed and sys.last_type is KeyboardInterrupt:
        threading._shutdown()  # type: ignore[attr-defined]  # waits for the program's threads
        atexit._run_exitfuncs()
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        os.kill(os.getpid(), signal.SIGINT)
    ctypes.pythonapi.Py_Exit(int(bool(failed)))
    raise AssertionError("the interpreter has not ended")
