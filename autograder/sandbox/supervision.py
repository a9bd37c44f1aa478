"""A confined program as its launcher sees it: started, watched for its use of resources, and ended, but not read.

Its end is written to a pipe that the judging process waits on (`program.Program`).
"""

import contextlib
import json
import os
import re
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import IO

from autograder.sandbox import machine_load
from autograder.sandbox.forkserver import BEGINS, ENDED
from autograder.sandbox.usage import parent, running, takes_more

GLANCE = 0.1  # s between two looks at memory and processes
CROWDS = 0.5  # s between two looks at how many threads run, which cost more, until they are too many
# Processes of a program that all run or could, and threads: more take the processor from other gradings.  A right
# answer has one process or two, whose threads share Python's lock.
BUSY_PROCESSES, BUSY_THREADS = 5, 12
BUSY_SECONDS = 2.0  # for which they may, in all; what they have used is forgotten four times as slowly as it grows
WHY = 300  # characters of why a program was ended: with them an End fits into any pipe at once

# Run by bubblewrap in place of a program: reports that the sandbox is made, and keeps it until stdin is closed.
HOLD = ["sh", "-c", "echo; exec >&-; read -r _"]


@dataclass(frozen=True)
class End:
    """The way in which a program ended."""

    exit_status: int  # as a shell shows it: 128 + signal
    stopped: str = ""  # why the grader ended it, in words for the student
    begun: bool = True  # whether bubblewrap could start it
    signal: int = 0  # that ended it for certain: a program may also return 128 and more by itself

    def to_bytes(self) -> bytes:
        """Return the bytes for the pipe."""
        return json.dumps(asdict(replace(self, stopped=self.stopped[:WHY]))).encode()

    @classmethod
    def from_bytes(cls, text: bytes) -> "End":
        """Return the End that `to_bytes` encoded; a launcher that died has written nothing."""
        return cls(**json.loads(text)) if text else cls(128 + signal.SIGKILL, "the grader was ended")


class Process:
    """A running program."""

    def __init__(
        self,
        command: list[str],
        *,
        output: int,
        end: int,
        env: Mapping[str, str],
        cwd: str | None,
        memory: int,
        tasks: int,
        measured: Callable[[int], dict[int, int]],
        killed: Callable[[], str],
        status: int | None,
        pass_fds: Sequence[int],
        fork: Callable[[int, int], IO[bytes]] | None = None,
    ):
        """Start `command`, and stop it when it takes more than `memory` bytes or `tasks` processes and threads.

        `measured` returns the program's processes with their numbers of threads, given the id of the process of
        `command`.  The program prints to the descriptor `output`; its `End` is written to `end`, which is then closed.
        `killed` returns the reason when the program was killed by something else.  `status` is the descriptor on which
        bubblewrap reports that it has started the program.  With `fork`, `command` only makes the sandbox, by HOLD, and
        `fork(output, sandbox)` starts the program in it, see `Forkserver.run`.
        """
        self._why, self._killed = "", killed
        self._status, self._fork = status, fork
        self._measured = measured
        self._fork_output = -1
        with contextlib.ExitStack() as undo:
            if fork:
                self._fork_output = os.dup(output)
                undo.callback(os.close, self._fork_output)
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE if fork else subprocess.DEVNULL,
                stdout=subprocess.PIPE if fork else output,
                stderr=output,
                start_new_session=True,
                pass_fds=pass_fds,
                cwd=cwd,
                env=env,
            )
            undo.callback(self._process.communicate)
            undo.callback(self._process.kill)
            watch = threading.Thread(target=self._watch, args=(memory, tasks), daemon=True)
            self._waiter = threading.Thread(target=self._wait, args=(end, watch), daemon=True)
            self._waiter.start()
            undo.pop_all()  # from here on the waiting thread owns all this

    @property
    def alive(self) -> bool:
        """Return True if it is still running."""
        return self._waiter.is_alive()

    def stop(self, why: str = "") -> None:
        """End the program: SIGKILL to bubblewrap ends its namespaces with all their processes."""
        if self.alive:
            self._why = self._why or why
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)

    def join(self) -> None:
        """Wait until it has ended."""
        self._waiter.join()

    def _wait(self, end: int, watch: threading.Thread) -> None:
        try:
            watch.start()
        except RuntimeError:  # this machine cannot start another thread
            self.stop("this machine is too busy to watch it")
        code, begun = self._run_fork(self._fork) if self._fork else self._run()
        if code in (-signal.SIGKILL, 128 + signal.SIGKILL):  # bubblewrap's, or the program's as it reports it
            self._why = self._why or self._killed()
        if self._status is not None:
            os.close(self._status)
        with contextlib.suppress(BrokenPipeError):  # nobody is waiting for it any more
            os.write(end, End(code if code >= 0 else 128 - code, self._why, begun, max(0, -code)).to_bytes())
        os.close(end)

    def _run(self) -> tuple[int, bool]:
        """Return the exit status, or minus the signal, and whether the program has begun."""
        code = self._process.wait()
        return code, self._status is None or self._first_inside() is not None

    def _run_fork(self, fork: Callable[[int, int], IO[bytes]]) -> tuple[int, bool]:
        """Return the same for a forked program."""
        begun, status = False, -signal.SIGKILL
        try:
            with contextlib.suppress(OSError):  # bubblewrap or the forking process was killed
                sandbox = self._made_sandbox()
                try:
                    report = fork(self._fork_output, sandbox)
                finally:
                    os.close(sandbox)
                with report:
                    for line in report:
                        what, number = line.decode().split()
                        begun = begun or what == BEGINS
                        status = int(number) if what == ENDED else status
        finally:
            os.close(self._fork_output)
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)  # with the processes that the program left running
            self._process.communicate()
        return status, begun

    def _made_sandbox(self) -> int:
        """Wait for the sandbox, and return a pidfd of its first process; raises OSError when that is gone."""
        assert self._process.stdout
        self._process.stdout.read(1)
        first = self._first_inside() or 0
        sandbox = os.pidfd_open(first)
        # bubblewrap is not reaped yet, so its process id is not reused; that of its child could be.
        if parent(first) != self._process.pid:
            os.close(sandbox)
            raise ProcessLookupError
        return sandbox

    def _first_inside(self) -> int | None:
        """Return the id of the first process in the sandbox, as reported by bubblewrap; None if there was none."""
        assert self._status is not None
        found = re.search(rb'"child-pid": (\d+)', os.read(self._status, 4096))
        return int(found[1]) if found else None

    def _watch(self, most_memory: int, most_tasks: int) -> None:
        busy, look, last, crowd = 0.0, 0.0, time.monotonic(), False  # s, but for the last
        while self.alive:
            tasks = self._measured(self._process.pid)
            now = time.monotonic()
            if busy or now >= look:
                crowd, look = _is_crowd(tasks), now + CROWDS
            busy = max(0.0, busy + (now - last) * (1.0 if crowd else -0.25))
            last = now
            if busy > BUSY_SECONDS:
                self.stop(
                    f"it kept {BUSY_PROCESSES} processes or {BUSY_THREADS} threads busy; let them wait, or end them"
                )
            if sum(tasks.values()) >= most_tasks:
                self.stop(f"it started {most_tasks} processes and threads; do not start processes in an endless loop")
            if takes_more(tasks, most_memory):
                self.stop(f"it took more than {most_memory >> 30} GiB of memory; keep only what you need")
            self._waiter.join(GLANCE)


def _is_crowd(tasks: Mapping[int, int]) -> bool:
    """Return True if too many of these processes, given with their numbers of threads, are busy at once."""
    if len(tasks) < BUSY_PROCESSES and sum(tasks.values()) < BUSY_THREADS:
        return False
    if machine_load.waiting() < BUSY_PROCESSES:  # so each thread need not be looked at, ten times a second
        return False
    found = [running([pid]) for pid in tasks]
    return sum(number > 0 for number in found) >= BUSY_PROCESSES or sum(found) >= BUSY_THREADS
