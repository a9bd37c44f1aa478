"""Starts and ends the servers of a classroom for JupyterHub."""

import asyncio
import contextlib
import math
import os
import signal
import subprocess
from collections.abc import AsyncIterator, Callable, Coroutine
from dataclasses import asdict
from pathlib import Path
from typing import Any, ClassVar

from jupyterhub.spawner import Spawner
from traitlets.log import get_logger

from autograder.classroom import accounts, memory_limit, servers, template
from autograder.classroom.members import Member
from autograder.classroom.plan import GIB, Classroom, as_url
from autograder.classroom.servers import Running
from autograder.classroom.start_queue import StartQueue
from autograder.sandbox.forkserver import Forkserver
from autograder.sandbox.usage import of_user, processes
from course.foundation.processes import processor_time

PORT = 8888  # passed to a server, which does not use it
STARTING = 0.8  # s of processor time that a server takes to start, as measured
AT_ONCE = os.cpu_count() or 1  # servers that are started at a time
HELD = 15.0  # s at most for which a server that does not answer delays the others
IDLE = 1.0  # s without processor time, after which it no longer delays the others
TAKES = 4 * STARTING  # s of processor time, after which a forked one no longer delays the others
LOOK = 0.25  # s between two looks at its processor time
TOLD = 1.0  # s between two messages to a member who waits
LONGER = 4.0  # times the usual wait, after which the message says that it takes longer
RETRY = 0.05  # s


class BoxSpawner(Spawner):
    """The spawner of one member's server."""

    forkserver: ClassVar[Forkserver | None] = None  # students' servers are forked from it
    _queue: ClassVar[StartQueue] = StartQueue(AT_ONCE)

    def __init__(self, **kwargs: Any):
        super().__init__(**kwargs)
        self._running = Running(0, 0)
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def classroom(self) -> Classroom:
        """Return the classroom with its present settings."""
        return Classroom.load(Path(os.environ[servers.VARIABLE]))

    async def start(self) -> str:
        """Start the server when its turn comes; return its URL."""
        async with self._queue.turn(self):
            classroom = self.classroom
            member = classroom.find(self.user.name)
            self.port = PORT
            if not member.instructor:
                self.begin()
            env, url = self.get_env(), self.server.base_url
            self.db.commit()  # otherwise other requests would roll these changes back
            self._process, self._running = await asyncio.to_thread(
                servers.start, classroom, member, env, self.forkserver, self.log.warning
            )
            self._tell_url(classroom, member)
            forked = self.forkserver is not None and not member.instructor
            with contextlib.suppress(OSError, TimeoutError):  # it has ended, or is slow: the hub handles that
                async with asyncio.timeout(HELD):
                    await _while_it_starts(
                        _answer(classroom.socket(member), url),
                        lambda: sum(map(processor_time, self._processes(classroom, member))),
                        TAKES if forked else math.inf,
                    )
        return as_url(classroom.socket(member))

    async def progress(self) -> AsyncIterator[dict[str, Any]]:
        """Yield messages for the member who waits, until the server has started; the hub's page shows them."""
        begun = asyncio.get_running_loop().time()
        while True:
            before = self._queue.ahead_of(self)
            waited = asyncio.get_running_loop().time() - begun
            yield {"progress": _progress(waited, before), "message": _waiting(before, waited)}
            await asyncio.sleep(TOLD)

    async def poll(self) -> int | None:
        """Return None while it runs, otherwise its exit status, or 0 if that is unknown."""
        status = self._process.poll() if self._process else None
        if self._running.alive and status is None:
            if not self._running.groups:
                await asyncio.to_thread(self._bound_memory)
            return None
        if self._running.pid:
            servers.forget(self.classroom, self.user.name, self._running)
            self._running = Running(0, 0)
        return status or 0

    async def stop(self, now: bool = False) -> None:
        """End the server, with its kernels, terminals and nodes."""
        running = self._running
        with contextlib.suppress(ProcessLookupError):
            if running.alive:
                os.kill(running.pid, signal.SIGKILL)
        end = asyncio.get_running_loop().time() + servers.GONE
        while await self.poll() is None and asyncio.get_running_loop().time() < end:
            await asyncio.sleep(RETRY)

    async def get_url(self) -> str:
        """Return the server's URL; also works in a hub that was started after the server."""
        return str(self.server.url)

    def get_state(self) -> dict[str, Any]:
        """Return the state that a later hub needs."""
        return super().get_state() | {"running": asdict(self._running)}

    def load_state(self, state: dict[str, Any]) -> None:
        """Restore the state that `get_state` returned."""
        super().load_state(state)
        if "running" in state:
            self._running = Running.from_fields(state["running"])
        if self.server:
            with contextlib.suppress(KeyError):  # no longer a member
                self._tell_url(self.classroom, self.classroom.find(self.user.name))

    def clear_state(self) -> None:
        """Forget the server, which has ended."""
        super().clear_state()
        self._running, self._process = Running(0, 0), None

    def _processes(self, classroom: Classroom, member: Member) -> dict[int, int]:
        """Return the server's processes with the number of threads of each, as `processes` does."""
        # A forked server is not a child of its box, so a student's processes are found by their user; an instructor's
        # graded programs run as other users.
        own = {} if member.instructor else of_user(accounts.ids(classroom, member)[0])
        return processes(self._running.pid) | own

    def _bound_memory(self) -> None:
        """Bound the server's memory as a control group would."""
        classroom = self.classroom
        with contextlib.suppress(KeyError):  # no longer a member
            member = classroom.find(self.user.name)
            most = classroom.limits_of(member).memory
            if pid := memory_limit.bound(self._processes(classroom, member), most):
                self.log.warning("%s took more than %.1f GiB: process %d was ended", self.user.name, most / GIB, pid)

    @classmethod
    def begin(cls) -> None:
        """Start the process that students' servers are forked from, before anybody logs in; again if it has ended."""
        if cls.forkserver and not cls.forkserver.alive:
            get_logger().warning("The process that students' servers are forked from has ended; it is started again")
            cls.forkserver.close()
            cls.forkserver = None
        if not cls.forkserver:
            try:
                cls.forkserver = template.start()
            except OSError as error:
                get_logger().warning("Students' servers load Python and JupyterLab for themselves: %s", error)

    def _tell_url(self, classroom: Classroom, member: Member) -> None:
        """Set the server's URL, because the hub's database cannot store the path of a socket."""
        self.server.bind_url = as_url(classroom.socket(member))


async def _while_it_starts(answer: Coroutine[Any, Any, None], used: Callable[[], float], most: float) -> None:
    """Wait for a server's answer, unless it is idle, or has `used` more than `most` s of processor time.

    So one member's broken or slow server does not delay all others.
    """
    answering, loop = asyncio.ensure_future(answer), asyncio.get_running_loop()
    before, active = 0.0, loop.time()
    try:
        while not (await asyncio.wait([answering], timeout=LOOK))[0]:
            now = await asyncio.to_thread(used)
            if now > before:
                before, active = now, loop.time()
            if now > most or loop.time() - active > IDLE:
                return
        await answering
    finally:
        answering.cancel()


async def _answer(path: Path, url: str) -> None:
    """Wait until the server that listens there answers; raises OSError when it ends."""
    reader, writer = await asyncio.open_unix_connection(str(path))
    try:
        writer.write(f"GET {url}api HTTP/1.1\r\nHost: classroom\r\nConnection: close\r\n\r\n".encode())
        await reader.read(1)
    finally:
        writer.close()


def _seconds(before: int) -> float:
    """Return how long (s) a server takes to start when `before` others start first and nothing else runs."""
    return STARTING * max(1.0, (before + 1) / AT_ONCE)


def _progress(waited: float, before: int) -> int:
    return min(95, round(100 * waited / (waited + _seconds(before))))


def _waiting(before: int, waited: float) -> str:
    longer = " It takes longer than usual." if waited > LONGER * _seconds(before) else ""
    if not before:
        return f"Starting your server.{longer}"
    others = "1 other is" if before == 1 else f"{before} others are"
    takes = longer or f" It takes about {_seconds(before):.0f} s."
    return f"Starting your server: {others} before you.{takes}"
