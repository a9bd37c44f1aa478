"""The one sandbox: how a student's program is confined, and what little it sees.

bubblewrap gives the program its own user, process, IPC and host-name namespaces, a read-only system, an empty home
folder with the handed-in files in it, limits, and a filter of system calls (`seccomp`).  The network namespace is that
of the program's ROS domain: the worker steps into it to start the program (`networks`), so that the two can speak ROS 2
to each other and to nobody else.  Not visible inside: the repository, the hidden suites, the gradebook, other submissions, other
processes, the environment.

Started by root, the program becomes a host user of its own (`_spare_uid`); bubblewrap's `--uid` alone would leave it
root on the host.  Started by anybody else it keeps that user's host id, inside user namespaces.
"""

import fcntl
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

from autograder.errors import SandboxUnavailable
from autograder.paths import PACKAGE
from autograder.sandbox import seccomp
from autograder.sandbox.program import Program
from course import environment

# How programs are confined, and what the worker is started with: a network of its own, and a process namespace whose
# first process it is, so that nothing outlives it.  bubblewrap's --die-with-parent alone can come too late.
ALONE = ["--net", "--pid", "--fork", "--kill-child", "--mount-proc", "--"]
BOXES = {
    "root": ["unshare", *ALONE],
    "user": ["unshare", "--user", "--map-root-user", *ALONE],
    "unsafe": [],  # no sandbox at all: asked for with --unsafe, and flagged in every result
}

MEMORY = 1 << 30  # bytes, of one process by rlimit and of a program's processes together by `Program`
LIMITS = {  # of each process, by prlimit(1)
    "nproc": 64,  # processes and threads of the program together
    "data": MEMORY,  # not `as`: Fast DDS and malloc reserve far more addresses than they use
    "cpu": 60,  # s
    "fsize": 16 << 20,  # bytes
    "nofile": 512,
    "core": 0,
}
SCRATCH = 64 << 20  # bytes of the home folder, and of /tmp
SHARED_MEMORY = 16 << 20  # bytes of /dev/shm

HOME = "/home/student"
INTERFACES = "/opt/interfaces"
PROFILE = "/opt/discovery.xml"
SYSTEM_FILES = {
    "/etc/passwd": "root:x:0:0::/:/bin/false\nstudent:x:{uid}:{uid}::" + HOME + ":/bin/sh\n",
    "/etc/group": "root:x:0:\nstudent:x:{uid}:\n",
    "/etc/hosts": "127.0.0.1 localhost\n",
    "/etc/nsswitch.conf": "passwd: files\ngroup: files\nhosts: files\n",
}
INSIDE_UID = 65534
SPARE_UIDS = range(60600, 61100)  # left alone by Debian's and systemd's own allocations
LOCKS = Path("/run/lock/ros2-autograder")


def choose(unsafe: bool = False) -> str:
    """The box that works for this user on this machine; raises SandboxUnavailable when none does.

    With `unsafe`, the box is "unsafe": programs run as they are.
    """
    if unsafe:
        return "unsafe"
    for tool, package in (("bwrap", "bubblewrap"), ("unshare", "util-linux"), ("ip", "iproute2")):
        if not shutil.which(tool):
            raise SandboxUnavailable(f"{tool} is not installed (package {package}), so programs cannot be confined")
    box = "root" if os.geteuid() == 0 and _mapped(SPARE_UIDS) else "user"
    with Sandbox(box, {}) as sandbox:
        command = [*BOXES[box], *sandbox.command(["-S", "-c", ""], domain=0)]
        try:
            tried = subprocess.run(command, capture_output=True, text=True, pass_fds=sandbox.descriptors, timeout=30)
        except subprocess.TimeoutExpired:
            raise SandboxUnavailable("a program in the sandbox did not start within 30 s") from None
    if tried.returncode:
        why = (tried.stderr.strip().splitlines() or [f"exit status {tried.returncode}"])[-1]
        raise SandboxUnavailable(f"programs cannot be confined here ({why}); namespaces must be allowed to this user")
    return box


def _mapped(uids: range) -> bool:
    """Whether root may become these users: in a container only some exist."""
    for line in Path("/proc/self/uid_map").read_text().splitlines():
        first, _, count = map(int, line.split())
        if first <= uids[0] and uids[-1] < first + count:
            return True
    return False


class Sandbox:
    """Starts the handed-in files as confined programs; closing it ends them all."""

    def __init__(self, box: str, files: Mapping[str, bytes], interfaces: Path | None = None):
        """`files` are laid into each program's home folder; `interfaces` is an install prefix to import from."""
        environment.prepare()
        self.box = box
        self.files = dict(files)
        self.interfaces = interfaces
        self.descriptors: list[int] = []  # of the next program: what bubblewrap reads files from
        self.programs: list[Program] = []
        self._locks: list[int] = []
        self._folder = tempfile.TemporaryDirectory(prefix="autograder-") if box == "unsafe" else None

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        self.close()

    def close(self) -> None:
        """End all programs and everything that they started."""
        for program in self.programs:
            program.kill()
        self._release()
        for lock in self._locks:
            os.close(lock)
        self._locks.clear()
        if self._folder:
            self._folder.cleanup()

    def start(self, file: str, *args: str, domain: int, files: Mapping[str, bytes] | None = None) -> Program:
        """Start `python FILE ARGS` in ROS domain `domain`.  Call it from the main thread: the program dies with it.

        `files` are laid into its home folder too, for this one program.
        """
        status, write = os.pipe()
        command = self.command([file, *args], domain, status=write, files=files)
        try:
            program = Program(
                file,
                command,
                pass_fds=(*self.descriptors, write),
                memory=MEMORY,
                tasks=LIMITS["nproc"],
                status=status if self.box != "unsafe" else None,
                cwd=self._home(),
                env=self._environment(domain) if self.box == "unsafe" else {"PATH": os.defpath},
            )
        finally:
            os.close(write)
            self._release()
        self.programs.append(program)
        return program

    def command(
        self, argv: list[str], domain: int, status: int | None = None, files: Mapping[str, bytes] | None = None
    ) -> list[str]:
        """The command line that runs `python ARGV` confined.  It reads files from `self.descriptors`."""
        files = {**self.files, **(files or {})}
        limits = ["prlimit", *(f"--{name}={value}" for name, value in LIMITS.items()), "--"]
        python = [sys.executable, *argv]
        if self.box == "unsafe":
            for name, content in files.items():
                Path(self._home(), name).write_bytes(content)
            limits.remove(f"--nproc={LIMITS['nproc']}")  # it would count all that this user runs
            return ["setpriv", "--pdeathsig=KILL", "--", *limits, *python]
        uid = self._spare_uid() if self.box == "root" else INSIDE_UID
        bwrap = [
            "bwrap",
            "--unshare-pid",
            "--unshare-ipc",
            "--unshare-uts",
            "--unshare-cgroup-try",
            "--hostname",
            "robot",
            "--new-session",
            "--die-with-parent",
            "--cap-drop",
            "ALL",
            "--clearenv",
        ]
        if status is not None:
            bwrap += ["--json-status-fd", str(status)]
        if self.box == "root":
            # Capabilities only for the step to the spare user, which drops them for good.
            bwrap += [word for name in ("SETUID", "SETGID", "SETPCAP") for word in ("--cap-add", f"CAP_{name}")]
            limits = [
                "setpriv",
                f"--reuid={uid}",
                f"--regid={uid}",
                "--clear-groups",
                "--bounding-set=-all",
                "--inh-caps=-all",
                "--no-new-privs",
                "--",
                *limits,
            ]
        else:
            bwrap += ["--unshare-user", "--disable-userns", "--uid", str(uid), "--gid", str(uid)]
        if seccomp.available():
            bwrap += ["--seccomp", self._descriptor(seccomp.program())]
        bwrap += self._view(uid, files)
        for name, value in self._environment(domain).items():
            bwrap += ["--setenv", name, value]
        return [*bwrap, "--chdir", HOME, "--", *limits, *python]

    def _view(self, uid: int, files: Mapping[str, bytes]) -> list[str]:
        """bubblewrap's options for the file system."""
        view = ["--ro-bind", "/usr", "/usr"]
        for name in ("bin", "sbin", "lib", "lib32", "lib64"):
            if Path("/", name).is_symlink():
                view += ["--symlink", os.readlink(f"/{name}"), f"/{name}"]
            else:
                view += ["--ro-bind-try", f"/{name}", f"/{name}"]
        for name in ("ld.so.cache", "alternatives", "localtime"):
            view += ["--ro-bind-try", f"/etc/{name}", f"/etc/{name}"]
        for name, text in SYSTEM_FILES.items():
            view += ["--perms", "0444", "--ro-bind-data", self._descriptor(text.format(uid=uid).encode()), name]
        view += [
            "--proc",
            "/proc",
            "--dev",
            "/dev",
            "--perms",
            "1777",
            "--size",
            str(SHARED_MEMORY),
            "--tmpfs",
            "/dev/shm",
            "--remount-ro",
            "/dev",
            "--perms",
            "1777",
            "--size",
            str(SCRATCH),
            "--tmpfs",
            "/tmp",
            "--perms",
            "0777",
            "--size",
            str(SCRATCH),
            "--tmpfs",
            HOME,
        ]
        bound = [Path("/usr")]
        for folder in _prefixes():
            if folder != self.interfaces and not any(folder.is_relative_to(outer) for outer in bound):
                # bubblewrap would make the folders above readable to root alone.
                for parent in reversed(folder.parents[:-1]):
                    view += ["--perms", "0755", "--dir", str(parent)]
                view += ["--ro-bind", str(folder), str(folder)]
                bound.append(folder)
        # The grader itself, when it is installed inside one of them, stays out of sight.
        if any(PACKAGE.is_relative_to(folder.resolve()) for folder in bound):
            view += ["--tmpfs", str(PACKAGE), "--remount-ro", str(PACKAGE)]
        view += ["--perms", "0755", "--dir", "/opt", "--ro-bind", str(environment.DISCOVERY_PROFILE), PROFILE]
        if self.interfaces:
            view += ["--ro-bind", str(self.interfaces), INTERFACES]
        for name, content in files.items():
            view += ["--perms", "0444", "--file", self._descriptor(content), f"{HOME}/{name}"]
        return [*view, "--remount-ro", "/"]

    def _environment(self, domain: int) -> dict[str, str]:
        """All of a program's environment variables."""
        confined = self.box != "unsafe"
        prefixes = [str(folder) for folder in ros_prefixes()]
        python, libraries = [], [e for e in os.environ.get("LD_LIBRARY_PATH", "").split(os.pathsep) if e]
        if self.interfaces:
            own = INTERFACES if confined else str(self.interfaces)
            prefixes.insert(0, own)
            python.append(f"{own}/lib/python")
        version = f"python{sys.version_info.major}.{sys.version_info.minor}"
        python += [f"{prefix}/lib/{version}/site-packages" for prefix in ros_prefixes() if str(prefix) != sys.prefix]
        return {
            "PATH": f"{sys.prefix}/bin:/usr/local/bin:/usr/bin:/bin",
            "HOME": self._home() or HOME,
            "LANG": "C.UTF-8",
            "PYTHONUNBUFFERED": "1",  # a log kept by print() must be seen when it is written
            "PYTHONDONTWRITEBYTECODE": "1",
            "PYTHONPATH": os.pathsep.join(python),
            "LD_LIBRARY_PATH": os.pathsep.join(libraries),
            "AMENT_PREFIX_PATH": os.pathsep.join(prefixes),
            "ROS_PYTHON_CHECK_FIELDS": "1",  # a field of a wrong type is an exception, not the end of the process
            "ROS_DISTRO": os.environ.get("ROS_DISTRO", "jazzy"),
            "ROS_VERSION": "2",
            "ROS_LOG_DIR": "/tmp/log" if confined else f"{self._home()}/log",
            "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1",
            **ros_variables(domain, confined),
            "FASTRTPS_DEFAULT_PROFILES_FILE": PROFILE if confined else str(environment.DISCOVERY_PROFILE),
        }

    def _home(self) -> str | None:
        return self._folder.name if self._folder else None

    def _descriptor(self, content: bytes) -> str:
        """A file in memory that the next program's bubblewrap copies from."""
        descriptor = os.memfd_create("file")
        os.write(descriptor, content)
        os.lseek(descriptor, 0, os.SEEK_SET)
        self.descriptors.append(descriptor)
        return str(descriptor)

    def _release(self) -> None:
        for descriptor in self.descriptors:
            os.close(descriptor)
        self.descriptors.clear()

    def _spare_uid(self) -> int:
        """A host user that no other program on this machine has: process limits are counted by user."""
        LOCKS.mkdir(parents=True, exist_ok=True)
        for uid in SPARE_UIDS:
            lock = os.open(LOCKS / str(uid), os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                os.close(lock)
                continue
            self._locks.append(lock)
            return uid
        raise RuntimeError(f"all {len(SPARE_UIDS)} user ids for students' programs are taken")


def ros_variables(domain: int, own_network: bool) -> dict[str, str]:
    """What the grader's and the student's ROS processes have in common.

    Over UDP, because the two share no /dev/shm; by multicast, because LOCALHOST discovery is not enough across
    namespaces.
    """
    return {
        "ROS_DOMAIN_ID": str(domain),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET" if own_network else "LOCALHOST",
        "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp",
        "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4",
        "FASTRTPS_DEFAULT_PROFILES_FILE": str(environment.DISCOVERY_PROFILE),
    }


def ros_prefixes() -> list[Path]:
    """The install prefixes of ROS 2 packages: this environment's, and a sourced installation's."""
    return [Path(entry) for entry in os.environ["AMENT_PREFIX_PATH"].split(os.pathsep) if Path(entry).is_dir()]


def _prefixes() -> list[Path]:
    """The folders outside /usr that Python and ROS 2 are installed in."""
    return [Path(sys.prefix), Path(sys.base_prefix), *ros_prefixes()]
