"""The members' servers: each is started in the box of its member, outlives the hub, and is ended with its nodes.

What was started is written down in `Classroom.state`/servers: the hub that is started next finds it again, and `down`
does without a hub.
"""

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Self

from autograder.classroom import box, serve
from autograder.classroom.members import Member
from autograder.classroom.plan import Classroom
from autograder.sandbox import cgroup
from autograder.sandbox.memory_files import MemoryFiles
from course.foundation import processes, storage
from course.foundation.waiting import wait_until

VARIABLE = "CLASSROOM"  # the environment variable that tells the hub its classroom's folder
GONE = 10.0  # s until a server that was killed is gone
LOG = 4 << 20  # bytes that are kept of what one server says
# Runs a command whose output another process reads: it keeps the first LOG bytes, and goes on reading, because a server
# whose output nobody reads stops.  Standard input is the pipe to read, output the same pipe to write, error the log.
LOGGED = f"""
keep() {{
    stdbuf -o0 head -c {LOG}
    if [ "$(head -c 1 | wc -c)" -gt 0 ]; then
        echo
        echo "What the server said after this is not kept."
        exec cat >/dev/null
    fi
}}
exec 3<&0
(keep <&3 3<&- >&2 2>/dev/null &)
exec "$@" </dev/null 2>&1 3<&-
"""


@dataclass(frozen=True)
class Running:
    """A process that was started: a server, or the hub."""

    pid: int
    born: int  # what tells it from a later process of the same number, see `processes.birth`
    groups: tuple[str, ...] = ()  # the folders of its control group

    @classmethod
    def from_fields(cls, fields: dict[str, Any]) -> Self:
        """Return what `asdict` made, as it comes back from JSON."""
        return cls(fields["pid"], fields["born"], tuple(fields.get("groups", ())))

    @property
    def alive(self) -> bool:
        """Return True if its process is there."""
        return self.pid > 0 and processes.alive(self.pid, self.born)

    def end(self) -> None:
        """End it with all that runs in its box."""
        if self.alive:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.pid, signal.SIGKILL)
            wait_until(lambda: not self.alive, GONE, alert=False)
        cgroup.Group([Path(folder) for folder in self.groups]).close()


def start(classroom: Classroom, member: Member, env: dict[str, str]) -> tuple[subprocess.Popen[bytes], Running]:
    """Start a member's server with JupyterHub's environment variables, after ending one that is left of theirs."""
    if left := started(classroom).get(member.name):
        forget(classroom, member.name, left)
    limits = classroom.limits_of(member)
    group = cgroup.make(limits.memory, limits.tasks, limits.cores, f"ros2-classroom-{classroom.run.name}-{member.name}")
    contents = MemoryFiles()
    log = _open_log(classroom, member)
    said, saying = os.pipe()
    listening = _listen(classroom.socket(member))
    try:
        # -P, -s: nothing in the home folder is a module of the server
        command = box.command(classroom, member, [sys.executable, "-P", "-s", box.SERVER], contents)
        logged = ["sh", "-c", LOGGED, "sh", *command]
        process = subprocess.Popen(
            group.command(logged) if group else logged,
            stdin=said,
            stdout=saying,
            stderr=log,
            start_new_session=True,
            pass_fds=(*contents.descriptors, listening.fileno()),
            env=env | box.variables(member) | {serve.SOCKET: str(listening.fileno())} | box.configured_by(member),
            umask=box.umask(member),
            cwd="/",
        )
    finally:
        contents.close()
        listening.close()
        for descriptor in (said, saying, log):
            os.close(descriptor)
    groups = tuple(map(str, group.folders)) if group else ()
    running = Running(process.pid, processes.birth(process.pid), groups)
    storage.replace(_record(classroom, member.name), json.dumps(asdict(running)).encode(), storage.PRIVATE)
    return process, running


def forget(classroom: Classroom, name: str, running: Running) -> None:
    """End a server and remove what it leaves, unless that belongs to a later one already."""
    if started(classroom).get(name) != running:
        return
    running.end()
    (classroom.run / "servers" / f"{name}.sock").unlink(missing_ok=True)
    _record(classroom, name).unlink(missing_ok=True)


def started(classroom: Classroom) -> dict[str, Running]:
    """The servers that were started and not forgotten, by member; some may have ended."""
    found = {}
    for path in (classroom.state / "servers").glob("*.json"):
        found[path.stem] = Running.from_fields(json.loads(path.read_text()))
    return found


def _open_log(classroom: Classroom, member: Member) -> int:
    """Return a descriptor of the member's log, where a server adds to what the one before said."""
    path = classroom.state / "servers" / f"{member.name}.log"
    with contextlib.suppress(FileNotFoundError):
        if path.stat().st_size > LOG:
            path.replace(path.with_suffix(".log.before"))
    return os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC, storage.PRIVATE)


def _listen(path: Path) -> socket.socket:
    path.unlink(missing_ok=True)
    listening = socket.socket(socket.AF_UNIX)
    listening.bind(str(path))
    listening.listen(128)
    return listening


def _record(classroom: Classroom, name: str) -> Path:
    return classroom.state / "servers" / f"{name}.json"
