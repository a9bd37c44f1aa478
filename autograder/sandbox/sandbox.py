"""The sandbox of a student's program: how it is confined, and what it can see.

bubblewrap gives the program its own user, process, IPC and host-name namespaces, a read-only system with an empty home
folder (`view`), limits, and a filter of system calls (`seccomp`).  The network namespace is that of the program's ROS
domain: the worker enters it to start the program (`networks`), so that program and grader can talk over ROS 2 to each
other and to nobody else.  Not visible inside: the checkout, the hidden suites, the gradebook, other submissions, other
processes, the grader's environment variables.

If root grades, the program gets a host user of its own (`users`).  For other users it keeps their host id, inside user
namespaces.
"""

import contextlib
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import IO, NamedTuple, Self

from autograder.errors import SandboxUnavailable
from autograder.sandbox import cgroup, processor_core, seccomp, users, variables, view
from autograder.sandbox.forkserver import Forkserver, Request
from autograder.sandbox.memory_files import MemoryFiles
from autograder.sandbox.supervision import GLANCE, HOLD, Process
from autograder.sandbox.usage import Glance, of_sandbox
from course import environment
from course.interfaces.builder import cache_folder

# The confinements, and the command that starts the worker in each: with a network namespace, and a process namespace
# whose first process it is, so that nothing outlives it.  bubblewrap's --die-with-parent alone can act too late.
ALONE = ["--net", "--pid", "--fork", "--kill-child", "--mount-proc", "--"]
CONFINEMENTS = {
    "root": ["unshare", *ALONE],
    "user": ["unshare", "--user", "--map-root-user", *ALONE],
    "unsafe": [],  # no sandbox at all: chosen by --unsafe, and flagged in every result
}

MEMORY = 1 << 30  # bytes: of one process by rlimit, and of all processes of a program by supervision
LIMITS = {  # of each process, by prlimit(1)
    "nproc": 64,  # processes and threads of a program in total
    "data": MEMORY,  # not `as`: Fast DDS and malloc reserve far more addresses than they use
    "cpu": 60,  # s
    "fsize": 16 << 20,  # bytes
    "nofile": 128,  # a program with ten nodes has 19; data waiting in sockets takes kernel memory
    "core": 0,
    "msgqueue": 0,  # bytes
    "sigpending": 64,  # signals in a queue, which the kernel counts for the user
}

# Capabilities of the judging process: to enter the networks of the ROS domains, to become another user, to end its
# children.
JUDGE_CAPABILITIES = ("SYS_ADMIN", "SETUID", "SETGID", "SETPCAP", "KILL")
WATCHED = Glance(GLANCE)  # for all that watch programs in this process
STACK = 2 << 20  # bytes that each thread of the judging process reserves


def choose(unsafe: bool = False) -> str:
    """Return the confinement that works for this user on this machine; raises SandboxUnavailable when none does.

    With `unsafe`, the confinement is "unsafe": programs run as they are.
    """
    if unsafe:
        return "unsafe"
    for tool, package in (("bwrap", "bubblewrap"), ("unshare", "util-linux"), ("mount", "mount"), ("ip", "iproute2")):
        if not shutil.which(tool):
            raise SandboxUnavailable(f"{tool} is not installed (package {package}), so programs cannot be confined")
    confinement = "root" if os.geteuid() == 0 and users.available() else "user"
    with Sandbox(confinement, {}) as sandbox:
        command = [*CONFINEMENTS[confinement], *sandbox.command(["-S", "-c", ""], domain=0)]
        try:
            tried = subprocess.run(command, capture_output=True, text=True, pass_fds=sandbox.descriptors, timeout=30)
        except subprocess.TimeoutExpired:
            raise SandboxUnavailable("a program in the sandbox did not start within 30 s") from None
    if tried.returncode:
        why = (tried.stderr.strip().splitlines() or [f"exit status {tried.returncode}"])[-1]
        raise SandboxUnavailable(
            f"programs cannot be confined here ({why}); this user must be allowed to make namespaces"
        )
    return confinement


class Started(NamedTuple):
    """A started program: its process, and the descriptors for its output and its `End`."""

    process: Process
    output: int
    end: int


class Sandbox:
    """Starts the handed-in files as confined programs; closing it ends them all."""

    def __init__(
        self,
        confinement: str,
        files: Mapping[str, bytes],
        interfaces: Path | None = None,
        core: int | None = None,
        forkserver: Forkserver | None = None,
    ):
        """Prepare; `files` are put into each program's home folder, `interfaces` is an install prefix to import from.

        All programs run on the processor core `core`, if one is given and they cannot have a control group.  A
        `forkserver`, which needs the confinement "root", forks the programs that it can.
        """
        environment.prepare()
        self.confinement = confinement
        self.files = dict(files)
        self.interfaces = interfaces
        self.core = core
        self.forkserver = forkserver
        self._memory = MemoryFiles()  # from which bubblewrap reads the next program's files
        self._started: list[Process] = []
        self._group: cgroup.Group | None = None
        self._grouped = False  # whether making the group was tried
        self._users: dict[int, int] = {}  # the programs' user ids, with their locks
        self._folder = tempfile.TemporaryDirectory(prefix="autograder-") if confinement == "unsafe" else None

    @property
    def descriptors(self) -> list[int]:
        """Return the descriptors that the next command must inherit, from which bubblewrap reads files."""
        return self._memory.descriptors

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End all programs and everything that they started."""
        for process in self._started:
            process.stop()
        for process in self._started:
            process.join()
        self._started.clear()
        if self._group:
            self._group.close()
            self._group = None
        self._memory.close()
        users.give_back(self._users)
        self._users.clear()
        if self._folder:
            self._folder.cleanup()

    def launch(
        self, file: str, *args: str, domain: int, files: Mapping[str, bytes] | None = None, afresh: bool = False
    ) -> Started:
        """Start `python FILE ARGS` in ROS domain `domain`, for another process to talk to.  Call it in the main thread.

        The program ends with the thread that started it.  `files` are also put into its home folder, for this program
        only.  With `afresh` it is not forked, so that only modules that it imports are loaded.  If this raises, nothing
        is left behind.
        """
        if not self._folder and not self._grouped:
            self._group, self._grouped = cgroup.make(), True
        users_before = {*self._users}
        with contextlib.ExitStack() as made, contextlib.ExitStack() as undo:
            made.callback(self._memory.close)
            status, status_write = _pipe(undo, made)
            output, output_write = _pipe(undo, made)
            end, end_write = os.pipe()
            for descriptor in (end, end_write):
                undo.callback(os.close, descriptor)
            undo.callback(self._give_back_all_but, users_before)
            all_files = {**self.files, **(files or {})}
            fork = None
            if self.forkserver and not afresh and self.forkserver.runs(file, all_files):
                command, fork = self._forked(file, list(args), domain, status_write, all_files)
            else:
                command = self._together(self.command([file, *args], domain, status=status_write, files=files))
            user = next(iter({*self._users} - users_before), None)
            process = Process(
                command,
                output=output_write,
                end=end_write,
                pass_fds=(*self.descriptors, status_write),
                memory=MEMORY,
                tasks=LIMITS["nproc"],
                measured=of_sandbox if user is None else lambda _: WATCHED.of_user(user),
                killed=self._why_killed,
                status=None if self._folder else status,
                cwd=self._folder.name if self._folder else None,
                env=self._variables(domain) if self._folder else {"PATH": os.defpath},
                fork=fork,
            )
            undo.pop_all()
        if self._folder:
            os.close(status)
        self._started.append(process)
        return Started(process, output, end)

    def _give_back_all_but(self, kept: set[int]) -> None:
        taken = {user: self._users.pop(user) for user in {*self._users} - kept}
        users.give_back(taken)

    def command(
        self, argv: list[str], domain: int, status: int | None = None, files: Mapping[str, bytes] | None = None
    ) -> list[str]:
        """Return the command line that runs `python ARGV` confined.  It reads files from `self.descriptors`."""
        files = {**self.files, **(files or {})}
        limits = ["prlimit", *(f"--{name}={value}" for name, value in LIMITS.items()), "--"]
        python = [sys.executable, *argv]
        if self._folder:
            for name, content in files.items():
                Path(self._folder.name, name).write_bytes(content)
            limits.remove(f"--nproc={LIMITS['nproc']}")  # it would count all processes of this user
            return ["setpriv", "--pdeathsig=KILL", "--", *limits, *python]
        if self.confinement == "root":
            uid = self._take_user()
            # Capabilities only for becoming the spare user, which drops them for good.
            more = [word for name in ("SETUID", "SETGID", "SETPCAP") for word in ("--cap-add", f"CAP_{name}")]
            become = ["setpriv", f"--reuid={uid}", f"--regid={uid}", "--clear-groups"]
            become += ["--bounding-set=-all", "--inh-caps=-all", "--no-new-privs", "--"]
        else:
            uid, become = users.INSIDE, []
            more = ["--unshare-user", "--disable-userns", "--uid", str(uid), "--gid", str(uid)]
        return self._confined([*become, *limits, *python], uid, more, domain, files, status)

    def _forked(
        self, file: str, args: list[str], domain: int, status: int, files: Mapping[str, bytes]
    ) -> tuple[list[str], Callable[[int, int], IO[bytes]]]:
        """Return the command line that makes a program's sandbox, and the function that forks `file` into it."""
        assert self.forkserver
        uid = self._take_user()
        core = None if self._group else self.core
        known = self._variables(domain) | {"PWD": view.HOME}
        request = Request(file, args, known, LIMITS, uid, core, path=(view.HOME,))
        groups = self._group.doors if self._group else []
        return (self._confined(HOLD, uid, [], domain, files, status), partial(self.forkserver.run, request, groups))

    def _take_user(self) -> int:
        """Return a host user id for one program, taken until this sandbox is closed."""
        uid, lock = users.take()
        self._users[uid] = lock
        return uid

    def _confined(
        self,
        command: list[str],
        uid: int,
        options: list[str],
        domain: int,
        files: Mapping[str, bytes],
        status: int | None,
    ) -> list[str]:
        """Return the command line that runs `command` in a program's namespaces, with these `options` of bubblewrap."""
        bwrap = ["bwrap", "--unshare-pid", "--unshare-ipc", "--unshare-uts", "--unshare-cgroup-try", "--new-session"]
        bwrap += ["--hostname", "robot", "--die-with-parent", "--cap-drop", "ALL", "--clearenv", *options]
        if status is not None:
            bwrap += ["--json-status-fd", str(status)]
        if seccomp.available():
            bwrap += ["--seccomp", self._memory(seccomp.program())]
        bwrap += view.options(uid, files, self.interfaces, self._memory)
        for name, value in self._variables(domain).items():
            bwrap += ["--setenv", name, value]
        return view.with_store([*bwrap, "--chdir", view.HOME, "--", *command])

    def judge_command(self, argv: list[str]) -> list[str]:
        """Return the command line of the judging process: `python ARGV` with the view of `view.of_judge`.

        It keeps the capabilities that it needs until it gives them up (`confine`).  It reads files from
        `self.descriptors`.
        """
        python = ["prlimit", f"--stack={STACK}", "--", sys.executable, "-P", *argv]
        if self._folder:
            return python
        bwrap = ["bwrap", "--unshare-pid", "--as-pid-1", "--unshare-ipc", "--unshare-uts", "--unshare-cgroup-try"]
        bwrap += ["--new-session", "--die-with-parent", "--clearenv", "--cap-drop", "ALL"]
        bwrap += [word for name in JUDGE_CAPABILITIES for word in ("--cap-add", f"CAP_{name}")]
        packages = cache_folder() / "interfaces"
        packages.mkdir(parents=True, exist_ok=True)
        bwrap += view.of_judge(packages, self._memory)
        for name, value in variables.of_judge(view.JUDGE_HOME).items():
            bwrap += ["--setenv", name, value]
        return view.with_store([*bwrap, "--chdir", "/", "--", *python])

    def _together(self, command: list[str]) -> list[str]:
        """Return a command line that runs `command` under the joint limits of all programs of a grading."""
        if self._group:
            return self._group.command(command)
        return command if self.core is None or self._folder else processor_core.command(self.core, command)

    def _variables(self, domain: int) -> dict[str, str]:
        """Return all environment variables of a program."""
        if self._folder:
            own = str(self.interfaces) if self.interfaces else None
            profile = str(environment.DISCOVERY_PROFILE)
            return variables.of_program(domain, self._folder.name, own, profile, confined=False)
        own = view.INTERFACES if self.interfaces else None
        return variables.of_program(domain, view.HOME, own, view.PROFILE, confined=True)

    def _why_killed(self) -> str:
        """Return why the kernel killed a program, in words for the student; '' if unknown."""
        if self._group and self._group.out_of_memory:
            return f"your programs together took more than {cgroup.MEMORY >> 30} GiB of memory; keep only what you need"
        return ""


def _pipe(undo: contextlib.ExitStack, made: contextlib.ExitStack) -> tuple[int, int]:
    """Make a pipe: `undo` closes the read end, `made` the write end."""
    read, write = os.pipe()
    undo.callback(os.close, read)
    made.callback(os.close, write)
    return read, write
