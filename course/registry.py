"""The registry of live sessions on this machine: each keeps a small file up to date, which other processes read.

The file tells the session's process, ROS domain, folder and nodes, and how nodes came to their ends.  It is in a folder
that only its user may enter, and says nothing once its process has ended.
"""

import contextlib
import json
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path

from filelock import FileLock

from course.foundation import storage
from course.foundation.folders import runtime_folder
from course.foundation.processes import alive

LOCK = 10.0  # s to wait for others who look for a domain


@dataclass(frozen=True)
class NodeRecord:
    """A started node."""

    name: str
    state: str  # in a line: running, stopped, or how it ended
    alive: bool
    since: float  # time.time() of its start
    where: str
    services: list[str] = field(default_factory=list)
    stories: list[str] = field(default_factory=list)  # its exceptions, and its end, as texts
    told: list[float] = field(default_factory=list)  # time.time() of each report


@dataclass(frozen=True)
class ShellRecord:
    """A terminal of the course."""

    pid: int
    born: int  # as SessionRecord.born
    folder: str
    domain: int  # where it is now
    own: int = 0  # the domain of all terminals of this user that are with no notebook; 0 if none was left
    chosen: bool = False  # somebody has exported `domain` there


@dataclass(frozen=True)
class SessionRecord:
    """A live session."""

    pid: int
    domain: int
    folder: str
    since: float  # time.time()
    born: int  # what tells its process from a later one of the same number, see `course.foundation.processes.birth`
    nodes: list[NodeRecord] = field(default_factory=list)
    kernel: str = ""  # its kernel's id in Jupyter, if it has one


def lock() -> contextlib.AbstractContextManager[object]:
    """Held by whoever looks for a domain, until the domain is written down."""
    try:
        return FileLock(runtime_folder() / ".lock", timeout=LOCK)
    except OSError:
        return contextlib.nullcontext()


def write(record: SessionRecord | ShellRecord) -> None:
    """Write the file of a session or a terminal; what cannot be written is left out: others then do not know of it."""
    with contextlib.suppress(OSError):
        path = runtime_folder() / f"{'shell-' if isinstance(record, ShellRecord) else ''}{record.pid}.json"
        storage.replace(path, json.dumps(asdict(record)).encode(), storage.PRIVATE)


def changes() -> Path:
    """A file whose text is another one after each beginning and end of a session; a terminal looks at it."""
    return runtime_folder() / "changes"


def note_change() -> None:
    """Have the terminals look again which sessions run."""
    with contextlib.suppress(OSError):
        storage.replace(changes(), f"{time.time_ns()}\n".encode(), storage.PRIVATE)


def front(server: int) -> Path:
    """The file with the id of the kernel whose notebook is in front, in the JupyterLab of the process `server`."""
    return runtime_folder() / f"front-{server}"


def put_in_front(server: int, kernel: str) -> None:
    """Write down which notebook's kernel is in front; '' for none."""
    with contextlib.suppress(OSError):
        storage.replace(front(server), f"{kernel}\n".encode(), storage.PRIVATE)


def forget_front(server: int) -> None:
    """Remove the file of a JupyterLab that ends."""
    with contextlib.suppress(OSError):
        front(server).unlink(missing_ok=True)


def tell(record: SessionRecord, report: str) -> None:
    """Let a session know that the reader was told `report`, so that its next cell does not say it again."""
    with contextlib.suppress(OSError), open(runtime_folder() / f"{record.pid}.told", "a", encoding="utf-8") as file:
        file.write(json.dumps(report) + "\n")


def told_elsewhere(pid: int) -> set[str]:
    """The stories that other processes have told the reader."""
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
    """The sessions whose process is alive, the oldest first; files of others are removed."""
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
    """The session in a ROS domain, if one of this machine is there."""
    return next((record for record in running() if record.domain == domain), None)


def _read(path: Path) -> SessionRecord | None:
    try:
        fields = json.loads(path.read_text(encoding="utf-8"))
        return SessionRecord(**fields | {"nodes": [NodeRecord(**node) for node in fields["nodes"]]})
    except (OSError, ValueError, TypeError, KeyError):
        return None
