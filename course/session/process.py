"""A node in a process of its own: the reader's file, started and ended by the session."""

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from pathlib import Path

KEPT_LINES = 2000
GRACE = 3.0  # s for a program to end after Ctrl-C


class NodeProcess:
    """`python FILE ARGUMENTS` in a session of its own, so that interrupting a cell does not reach it.

    It dies with this process, however this one ends.
    """

    def __init__(self, path: Path, arguments: list[str]):
        self.name = path.name
        self.nodes: list[str] = []
        self._lines: deque[str] = deque(maxlen=KEPT_LINES)
        self.started = time.time()
        self._popen = subprocess.Popen(
            ["setpriv", "--pdeathsig", "KILL", sys.executable, path.name, *arguments],
            cwd=path.absolute().parent,
            env={**os.environ, "PYTHONUNBUFFERED": "1"},
            start_new_session=True,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
        )
        self._reader = threading.Thread(target=self._read, name=f"output of {self.name}", daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self._popen.stdout is not None
        for line in self._popen.stdout:
            self._lines.append(line[:10_000])

    @property
    def alive(self) -> bool:
        """Whether the process runs."""
        return self._popen.poll() is None

    @property
    def returncode(self) -> int | None:
        """Its exit status, None while it runs."""
        return self._popen.poll()

    @property
    def output(self) -> str:
        """What it has printed and logged on its terminal, the last 2,000 lines."""
        if not self.alive:
            self._reader.join(1.0)
        return "".join(self._lines).rstrip("\n")

    def stop(self) -> None:
        """End it as Ctrl-C does, and by force when that does not help within 3 s."""
        self._end()

    def _end(self) -> None:
        with contextlib.suppress(ProcessLookupError):
            if self.alive:
                os.killpg(self._popen.pid, signal.SIGINT)
                with contextlib.suppress(subprocess.TimeoutExpired):
                    self._popen.wait(GRACE)
            os.killpg(self._popen.pid, signal.SIGKILL)  # and whatever it started
        self._popen.wait()
        self._reader.join(1.0)

    def __repr__(self) -> str:
        state = f"running as {', '.join(self.nodes)}" if self.alive else f"ended with exit status {self.returncode}"
        return f"<{self.name}: {state}>"
