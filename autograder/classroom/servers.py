"""The members' servers: each is started in its member's box, outlives the hub, and is ended with its nodes.

Started servers are recorded in `Classroom.state`/servers, so that the next hub finds them, and `down` needs no hub.
"""

import contextlib
import json
import os
import select
import signal
import socket
import struct
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Self

from autograder.classroom import accounts, box, serve, template
from autograder.classroom.members import Member
from autograder.classroom.plan import Classroom
from autograder.sandbox import cgroup, usage
from autograder.sandbox.forkserver import BEGINS, KEPT, Forkserver, Request
from autograder.sandbox.memory_files import MemoryFiles
from course.foundation import processes, storage
from course.foundation.waiting import wait_until

VARIABLE = "CLASSROOM"  # the environment variable that tells the hub its classroom's folder
GONE = 10.0  # s until a server that was killed is gone
LOG = 4 << 20  # bytes kept of the output of one server
# Leaves a process behind that copies a server's output from stdin to stdout, and keeps the first LOG bytes. It goes on
# reading, because a server whose output nobody reads stops.
KEEPER = f"""
keep() {{
    stdbuf -o0 head -c {LOG}
    if [ "$(head -c 1 | wc -c)" -gt 0 ]; then
        echo
        echo "What the server said after this is not kept."
        exec cat >/dev/null
    fi
}}
exec 3<&0
(keep <&3 3<&- 2>/dev/null &)
"""
MADE, FORKED = 60.0, 30.0  # s until a box is made, and until a server has been forked into it


@dataclass(frozen=True)
class Running:
    """A process that was started: a server, or the hub."""

    pid: int
    born: int  # distinguishes it from a later process of the same id, see `processes.birth`
    groups: tuple[str, ...] = ()  # the folders of its control group

    @classmethod
    def from_fields(cls, fields: dict[str, Any]) -> Self:
        """Return the instance that `asdict` made `fields` of, after a way through JSON."""
        return cls(fields["pid"], fields["born"], tuple(fields.get("groups", ())))

    @property
    def alive(self) -> bool:
        """Return True if the process runs."""
        return self.pid > 0 and processes.alive(self.pid, self.born)

    def end(self) -> None:
        """End the process, and everything in its box."""
        if self.alive:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.pid, signal.SIGKILL)
            wait_until(lambda: not self.alive, GONE, alert=False)
        cgroup.Group([Path(folder) for folder in self.groups]).close()


def start(
    classroom: Classroom,
    member: Member,
    env: dict[str, str],
    forkserver: Forkserver | None = None,
    warn: Callable[[str], None] = lambda _: None,
) -> tuple[subprocess.Popen[bytes], Running]:
    """Start a member's server with JupyterHub's environment variables, after ending an earlier one of the same member.

    With a `forkserver`, a student's server is forked (`template`); if that fails, `warn` is told why and it is started.
    """
    if left := started(classroom).get(member.name):
        forget(classroom, member.name, left)
    limits = classroom.limits_of(member)
    group = cgroup.make(limits.memory, limits.tasks, limits.cores, f"ros2-classroom-{classroom.run.name}-{member.name}")
    env = env | box.variables(member) | box.configured_by(member)
    said, saying = os.pipe()
    with contextlib.ExitStack() as ends:
        for descriptor in (log := _open_log(classroom, member), said, saying):
            ends.callback(os.close, descriptor)
        keeper = ["sh", "-c", KEEPER]
        # It outlives the hub, so it holds none of the hub's descriptors.
        command = group.command(keeper) if group else keeper
        subprocess.run(command, stdin=said, stdout=log, stderr=log, start_new_session=True)
        listening = ends.enter_context(_listen(classroom.socket(member)))
        process = None
        if forkserver and not member.instructor:
            try:
                process = _fork(classroom, member, env, forkserver, group, saying, listening.fileno())
            except OSError as error:
                warn(f"The server of {member.name} was not forked, and loads Python and JupyterLab itself: {error}")
        # -P, -s: the server imports nothing from the home folder
        python = [sys.executable, *template.OPTIONS, box.SERVER]
        number = listening.fileno()
        own = env | {serve.SOCKET: str(number)}
        process = process or _open_box(
            classroom, member, python, group, subprocess.DEVNULL, saying, env=own, pass_fds=[number]
        )
    groups = tuple(map(str, group.folders)) if group else ()
    running = Running(process.pid, processes.birth(process.pid), groups)
    storage.replace(_record(classroom, member.name), json.dumps(asdict(running)).encode(), storage.PRIVATE)
    return process, running


def _open_box(
    classroom: Classroom,
    member: Member,
    argv: list[str],
    group: cgroup.Group | None,
    reads: int,
    says: int,
    *,
    env: dict[str, str],
    pass_fds: Sequence[int] = (),
) -> subprocess.Popen[bytes]:
    """Run a command in a member's box, with these descriptors as standard input and output."""
    contents = MemoryFiles()
    try:
        command = box.command(classroom, member, argv, contents)
        return subprocess.Popen(
            group.command(command) if group else command,
            stdin=reads,
            stdout=says,
            stderr=says,
            start_new_session=True,
            pass_fds=(*contents.descriptors, *pass_fds),
            env=env,
            umask=box.umask(member),
            cwd="/",
        )
    finally:
        contents.close()


def _fork(
    classroom: Classroom,
    member: Member,
    env: dict[str, str],
    forkserver: Forkserver,
    group: cgroup.Group | None,
    says: int,
    listening: int,
) -> subprocess.Popen[bytes]:
    """Fork a student's server into a new box, which ends with it; raises OSError, and then leaves nothing behind."""
    if not forkserver.ready():
        raise ProcessLookupError("the process that has them loaded did not come up")
    uid, gid = accounts.ids(classroom, member)
    request = Request(
        box.SERVER,
        [],
        env | template.libraries() | {serve.SOCKET: str(KEPT), "PWD": box.home(member)},
        box.limits(classroom, member),
        uid,
        group=gid,
        umask=box.umask(member),
        directory=box.home(member),
        options=template.OPTIONS,
        kept=2,  # the listening socket, and the one whose closing ends the box
        server=True,
    )
    with contextlib.ExitStack() as ends, contextlib.ExitStack() as undo:
        held, holding = (ends.enter_context(each) for each in socket.socketpair())
        held.setsockopt(socket.SOL_SOCKET, socket.SO_PASSCRED, 1)
        held.settimeout(MADE)
        process = _open_box(classroom, member, box.HOLD, group, holding.fileno(), says, env={"PATH": os.defpath})
        undo.callback(process.wait)
        undo.callback(process.kill)  # with everything in its namespaces
        holding.close()
        sandbox = _holder(held, process.pid)
        ends.callback(os.close, sandbox)
        doors = group.doors if group else []
        report = ends.enter_context(forkserver.run(request, doors, says, sandbox, [listening, held.fileno()]))
        if not select.select([report], [], [], FORKED)[0] or not report.readline().decode().startswith(BEGINS):
            raise ProcessLookupError("its fork did not begin")
        undo.pop_all()
    return process


def _holder(held: socket.socket, box_pid: int) -> int:
    """Return a pidfd of the process in the box that writes to the other end of `held`; raises OSError."""
    room = socket.CMSG_SPACE(struct.calcsize("3i"))
    written, extra, _, _ = held.recvmsg(1, room)
    if not written or not extra:
        raise ProcessLookupError("the box could not be made")
    pid, _, _ = struct.unpack("3i", extra[0][2])  # as this process sees it, see unix(7)
    sandbox = os.pidfd_open(pid)
    # It waits until `held` is closed.  If it was killed, its process id could belong to another process by now.
    if pid not in usage.processes(box_pid) or select.select([sandbox], [], [], 0)[0]:
        os.close(sandbox)
        raise ProcessLookupError("the box has ended")
    return sandbox


def forget(classroom: Classroom, name: str, running: Running) -> None:
    """End a server and remove its record, unless a later server has replaced it."""
    if started(classroom).get(name) != running:
        return
    running.end()
    (classroom.run / "servers" / f"{name}.sock").unlink(missing_ok=True)
    _record(classroom, name).unlink(missing_ok=True)


def started(classroom: Classroom) -> dict[str, Running]:
    """Return the recorded servers by member; some may have ended."""
    found = {}
    for path in (classroom.state / "servers").glob("*.json"):
        found[path.stem] = Running.from_fields(json.loads(path.read_text()))
    return found


def _open_log(classroom: Classroom, member: Member) -> int:
    """Open the member's log, to which each server appends; return the descriptor."""
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
