"""Starts and ends the servers of a classroom for JupyterHub."""

import asyncio
import contextlib
import os
import signal
import subprocess
from collections.abc import AsyncIterator
from dataclasses import asdict
from pathlib import Path
from typing import Any, ClassVar
from weakref import WeakSet

from jupyterhub.spawner import Spawner

from autograder.classroom import memory_limit, servers
from autograder.classroom.members import Member
from autograder.classroom.plan import GIB, Classroom, as_url
from autograder.classroom.servers import Running

PORT = 8888  # which a server is told, and does not use
STARTING = 2.0  # s of a processor that a server takes to start, as measured
TOLD = 1.0  # s between two messages to who waits
RETRY = 0.05  # s


class BoxSpawner(Spawner):
    """One member's server."""

    _all: ClassVar["WeakSet[BoxSpawner]"] = WeakSet()

    def __init__(self, **kwargs: Any):
        super().__init__(**kwargs)
        self._all.add(self)
        self._running = Running(0, 0)
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def classroom(self) -> Classroom:
        """The classroom, with its settings of now."""
        return Classroom.load(Path(os.environ[servers.VARIABLE]))

    async def start(self) -> str:
        """Start the server; the URL to reach it."""
        classroom = self.classroom
        member = classroom.find(self.user.name)
        self.port = PORT
        self._process, self._running = servers.start(classroom, member, self.get_env())
        self._tell_url(classroom, member)
        return as_url(classroom.socket(member))

    async def progress(self) -> AsyncIterator[dict[str, Any]]:
        """Tell who waits what for, for as long as it takes: the hub's page shows it."""
        begun = asyncio.get_running_loop().time()
        while True:
            others = sum(each.pending == "spawn" for each in self._all if each is not self)
            waited = asyncio.get_running_loop().time() - begun
            yield {"progress": _progress(waited, others), "message": _waiting(others)}
            await asyncio.sleep(TOLD)

    async def poll(self) -> int | None:
        """None while it runs, otherwise its exit status, or 0 when that is not known."""
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
        """End it, with its kernels, terminals and nodes."""
        running = self._running
        with contextlib.suppress(ProcessLookupError):
            if running.alive:
                os.kill(running.pid, signal.SIGKILL)
        end = asyncio.get_running_loop().time() + servers.GONE
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


def _seconds(others: int) -> float:
    """Return how long a start takes (s) while so many others start, if the processors do nothing else."""
    return STARTING * max(1.0, (others + 1) / (os.cpu_count() or 1))


def _progress(waited: float, others: int) -> int:
    return min(95, round(100 * waited / (waited + _seconds(others))))


def _waiting(others: int) -> str:
    if not others:
        return "Python loads JupyterLab."
    servers = "1 other server starts" if others == 1 else f"{others} other servers start"
    return f"Python loads JupyterLab. At this moment {servers}, too: that takes about {_seconds(others):.0f} s in all."
