"""Starts the servers of a classroom for JupyterHub, each in the box of its member, and ends them.

A server outlives the hub: the hub that is started next finds it again, and `down` does without a hub.  What was started
is written down in `Classroom.state`/servers.
"""

import asyncio
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

from jupyterhub.spawner import Spawner

from autograder.classroom import box, memory_limit, serve
from autograder.classroom.members import Member
from autograder.classroom.plan import GIB, Classroom, as_url
from autograder.sandbox import cgroup
from autograder.sandbox.memory_files import MemoryFiles
from course.foundation import processes, storage
from course.foundation.waiting import wait_until

VARIABLE = "CLASSROOM"  # the environment variable that tells the hub its classroom's folder
PORT = 8888  # which a server is told, and does not use
GONE = 10.0  # s until a server that was killed is gone
RETRY = 0.05  # s
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


class BoxSpawner(Spawner):
    """One member's server."""

    def __init__(self, **kwargs: Any):
        super().__init__(**kwargs)
        self._running = Running(0, 0)
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def classroom(self) -> Classroom:
        """The classroom, with its settings of now."""
        return Classroom.load(Path(os.environ[VARIABLE]))

    async def start(self) -> str:
        """Start the server; the URL to reach it."""
        classroom = self.classroom
        member = classroom.find(self.user.name)
        self.port = PORT
        self._process, self._running = start(classroom, member, self.get_env())
        self._tell_url(classroom, member)
        return as_url(classroom.socket(member))

    async def poll(self) -> int | None:
        """None while it runs, otherwise its exit status, or 0 when that is not known."""
        status = self._process.poll() if self._process else None
        if self._running.alive and status is None:
            if not self._running.groups:
                await asyncio.to_thread(self._bound_memory)
            return None
        if self._running.pid:
            forget(self.classroom, self.user.name, self._running)
            self._running = Running(0, 0)
        return status or 0

    async def stop(self, now: bool = False) -> None:
        """End it, with its kernels, terminals and nodes."""
        running = self._running
        with contextlib.suppress(ProcessLookupError):
            if running.alive:
                os.kill(running.pid, signal.SIGKILL)
        end = asyncio.get_running_loop().time() + GONE
        while await self.poll() is None and asyncio.get_running_loop().time() < end:
            await asyncio.sleep(RETRY)

    async def get_url(self) -> str:
        """Return where it is, also for a hub that was started after it."""
        return str(self.server.url)

    def get_state(self) -> dict[str, Any]:
        """Return what a hub that is started later needs to know."""
        return super().get_state() | {"running": asdict(self._running)}

    def load_state(self, state: dict[str, Any]) -> None:
        """Take up what `get_state` gave."""
        super().load_state(state)
        if "running" in state:
            self._running = Running.from_fields(state["running"])
        if self.server:
            with contextlib.suppress(KeyError):  # no longer a member
                self._tell_url(self.classroom, self.classroom.find(self.user.name))

    def clear_state(self) -> None:
        """Nothing runs."""
        super().clear_state()
        self._running, self._process = Running(0, 0), None

    def _bound_memory(self) -> None:
        """Bound the server's memory as a control group would."""
        classroom = self.classroom
        with contextlib.suppress(KeyError):  # no longer a member
            most = classroom.limits_of(classroom.find(self.user.name)).memory
            if pid := memory_limit.bound(self._running.pid, most):
                self.log.warning("%s took more than %.1f GiB: process %d was ended", self.user.name, most / GIB, pid)

    def _tell_url(self, classroom: Classroom, member: Member) -> None:
        """The hub's database has no place for the path of a socket."""
        self.server.bind_url = as_url(classroom.socket(member))


def start(classroom: Classroom, member: Member, env: dict[str, str]) -> tuple[subprocess.Popen[bytes], Running]:
    """Start a member's server with JupyterHub's environment variables, after ending one that is left of theirs."""
    if left := servers(classroom).get(member.name):
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
    if servers(classroom).get(name) != running:
        return
    running.end()
    (classroom.run / "servers" / f"{name}.sock").unlink(missing_ok=True)
    _record(classroom, name).unlink(missing_ok=True)


def servers(classroom: Classroom) -> dict[str, Running]:
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
