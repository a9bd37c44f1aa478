"""The registry of live sessions on this machine: each maintains a small file that other processes read.

The file has the session's process, ROS domain, folder and nodes, and how nodes ended.  It is in a folder that only its
user can enter, and is ignored once its process has ended.
"""

import contextlib
import json
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path

from course.foundation import storage
from course.foundation.folders import runtime_folder
from course.foundation.processes import alive

LOCK = 10.0  # s to wait for other processes that look for a domain


@dataclass(frozen=True)
class NodeRecord:
    """A started node."""

    name: str
    state: str  # one line: running, stopped, or how it ended
    alive: bool
    since: float  # time.time() of its start
    where: str
    services: list[str] = field(default_factory=list)
    stories: list[str] = field(default_factory=list)  # texts about its exceptions and its end
    told: list[float] = field(default_factory=list)  # time.time() of each report
    makes: list[str] | None = None  # the services that it can make by its text, as written there; None for any


@dataclass(frozen=True)
class ShellRecord:
    """A terminal of the course."""

    pid: int
    born: int  # as SessionRecord.born
    folder: str
    domain: int  # its present ROS domain
    own: int = 0  # the domain of all this user's terminals without a notebook; 0 if none was free
    chosen: bool = False  # whether the user has exported `domain` there


@dataclass(frozen=True)
class SessionRecord:
    """A live session."""

    pid: int
    domain: int
    folder: str
    since: float  # time.time()
    born: int  # distinguishes its process from a later one of the same id, see `course.foundation.processes.birth`
    nodes: list[NodeRecord] = field(default_factory=list)
    kernel: str = ""  # its kernel's id in Jupyter, if it has one


def lock() -> contextlib.AbstractContextManager[object]:
    """Return the lock to hold while looking for a domain, until the domain is recorded."""
    from filelock import FileLock  # here, because each `ros2` command reads the registry, and takes no lock

    try:
        return FileLock(runtime_folder() / ".lock", timeout=LOCK)
    except OSError:
        return contextlib.nullcontext()


def write(record: SessionRecord | ShellRecord) -> None:
    """Write the file of a session or a terminal; if that fails, other processes do not know of it."""
    with contextlib.suppress(OSError):
        path = runtime_folder() / f"{'shell-' if isinstance(record, ShellRecord) else ''}{record.pid}.json"
        storage.replace(path, json.dumps(asdict(record)).encode(), storage.PRIVATE)


def changes() -> Path:
    """Return the file whose text changes with each start and end of a session; terminals watch it."""
    return runtime_folder() / "changes"


def note_change() -> None:
    """Have terminals look again for running sessions."""
    with contextlib.suppress(OSError):
        storage.replace(changes(), f"{time.time_ns()}\n".encode(), storage.PRIVATE)


def front(server: int) -> Path:
    """Return the file with the kernel and the folder of the notebook in front in the JupyterLab of process `server`."""
    return runtime_folder() / f"front-{server}"


def put_in_front(server: int, kernel: str, folder: str = "") -> None:
    """Record the kernel and the folder of the notebook in front; '' for none."""
    with contextlib.suppress(OSError):
        storage.replace(front(server), f"{kernel}\n{folder}\n".encode(), storage.PRIVATE)


def forget_front(server: int) -> None:
    """Remove the file of a JupyterLab that ends."""
    with contextlib.suppress(OSError):
        front(server).unlink(missing_ok=True)


def tell(record: SessionRecord, report: str) -> None:
    """Tell a session that the reader has seen `report`, so that its next cell does not repeat it."""
    with contextlib.suppress(OSError), open(runtime_folder() / f"{record.pid}.told", "a", encoding="utf-8") as file:
        file.write(json.dumps(report) + "\n")


def told_elsewhere(pid: int) -> set[str]:
    """Return the reports that other processes have shown to the reader."""
    try:
        lines = (runtime_folder() / f"{pid}.told").read_text(encoding="utf-8").splitlines()
    except OSError:
        return set()
    return {json.loads(line) for line in lines}


def remove(pid: int) -> None:
    """Remove a session's files."""
    with contextlib.suppress(OSError):
        for suffix in ("json", "told"):
            (runtime_folder() / f"{pid}.{suffix}").unlink(missing_ok=True)
    note_change()


def running() -> list[SessionRecord]:
    """Return the sessions whose process is alive, the oldest first; removes the files of others."""
    found = []
    with contextlib.suppress(OSError):
        for path in runtime_folder().glob("[0-9]*.json"):
            record = _read(path)
            if record is not None and alive(record.pid, record.born):
                found.append(record)
            elif record is not None:
                remove(record.pid)
    return sorted(found, key=lambda record: record.since)


def shells() -> list[ShellRecord]:
    """The terminals whose shell is alive."""
    found = []
    with contextlib.suppress(OSError):
        for path in runtime_folder().glob("shell-*.json"):
            with contextlib.suppress(OSError, ValueError, TypeError):
                record = ShellRecord(**json.loads(path.read_text(encoding="utf-8")))
                if alive(record.pid, record.born):
                    found.append(record)
                else:
                    path.unlink(missing_ok=True)
    return found


def of_domain(domain: int) -> SessionRecord | None:
    """Return this machine's session in a ROS domain, or None."""
    return next((record for record in running() if record.domain == domain), None)


def of_kernel(pid: int) -> SessionRecord | None:
    """Return this machine's session in the notebook's kernel that is process `pid`, or None."""
    return next((record for record in running() if record.pid == pid and record.kernel), None)


def _read(path: Path) -> SessionRecord | None:
    try:
        fields = json.loads(path.read_text(encoding="utf-8"))
        return SessionRecord(**fields | {"nodes": [NodeRecord(**node) for node in fields["nodes"]]})
    except (OSError, ValueError, TypeError, KeyError):
        return None
