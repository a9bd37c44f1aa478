"""A student's program while it runs: what it prints, how it ends, and how it is stopped when it uses too much."""

import contextlib
import os
import re
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from autograder.errors import SandboxError
from autograder.sandbox.cleaning import without_hidden, without_paths

KEPT = 1 << 20  # bytes of output that are kept: the first and the last half of it
FLOOD = 64 << 20  # bytes of output after which a program is stopped
GLANCE = 0.1  # s between two looks at memory and processes
WRAPPERS = 1  # of bubblewrap's own two processes, the inner one counts towards an ordinary user's limit


class Program:
    """A running program.  `stopped` says why the grader ended it, or is empty."""

    def __init__(
        self,
        name: str,
        command: list[str],
        *,
        env: Mapping[str, str],
        cwd: str | None,
        memory: int,
        tasks: int,
        status: int | None,
        pass_fds: Sequence[int],
    ):
        """Start `command`, and stop it when it takes more than `memory` bytes or `tasks` processes and threads.

        `status` is the descriptor on which bubblewrap reports that it has started the program itself.
        """
        self.name = name
        self.hidden: set[float | str] = set()  # numbers and words that its last words must not repeat to the student
        self.stopped = ""
        self._head, self._tail, self._total = bytearray(), bytearray(), 0
        self._lock = threading.Lock()
        self._status = status
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            pass_fds=pass_fds,
            cwd=cwd,
            env=env,
        )
        self.started = self._ended = time.monotonic()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        threading.Thread(target=self._watch, args=(memory, tasks), daemon=True).start()

    @property
    def alive(self) -> bool:
        """Whether it is still running."""
        return self._process.poll() is None

    @property
    def exit_status(self) -> int | None:
        """Its exit status as a shell shows it (128 + signal), or None while it is running."""
        code = self._process.poll()
        return code if code is None or code >= 0 else 128 - code

    @property
    def output(self) -> str:
        """What it has printed, stdout and stderr in order; the middle is left out when it is long."""
        with self._lock:
            return (bytes(self._head) + bytes(self._tail)).decode(errors="replace")

    def wait(self, timeout: float) -> bool:
        """Wait until it has ended and all its output is read; False when it is still running after `timeout` s.

        Raises SandboxError when bubblewrap could not start it.
        """
        try:
            self._process.wait(timeout)
        except subprocess.TimeoutExpired:
            return False
        self._reader.join(2)
        if self._status is not None:
            report = os.read(self._status, 4096)
            os.close(self._status)
            self._status = None
            if b"child-pid" not in report and not self.stopped:
                raise SandboxError(f"bubblewrap did not start {self.name}: {self.output.strip()[-500:]}")
        return True

    def kill(self, why: str = "") -> None:
        """End it and every process that it has started; `why` becomes `stopped`."""
        self._stop(why)
        self._process.wait()
        self._reader.join(2)
        if self._status is not None:
            os.close(self._status)
            self._status = None

    @property
    def duration(self) -> float:
        """Seconds from its start to its end, once it has ended."""
        return self._ended - self.started

    @property
    def raised(self) -> bool:
        """Whether it died of a Python exception, which it has printed."""
        return bool(self.exit_status) and (
            "Traceback (most recent call last)" in self.output
            or bool(re.search(r"^(Syntax|Indentation|Tab)Error: ", self.output, re.MULTILINE))
        )

    def last_words(self) -> str:
        """Why it ended, in a line for the student: the exception and where in their file, or the signal."""
        if self.stopped:
            return self.stopped
        errors = re.findall(
            r"^((?:\w+\.)*\w*(?:Error|Exception|Exit|Interrupt|Warning|Unavailable|Invalid\w*)\b.*)$",
            self.output,
            re.MULTILINE,
        )
        lines = re.findall(rf'File "[^"]*/{re.escape(self.name)}", line (\d+)', self.output)
        if errors and self.raised:
            where = f" ({self.name}, line {lines[-1]})" if lines else ""
            return without_hidden(without_paths(errors[-1]), self.hidden)[:300] + where
        names = {known.value + 128: known.name for known in signal.Signals}
        status = self.exit_status
        return f"signal {names[status]}" if status in names else f"exit status {status}"

    def _read(self) -> None:
        assert self._process.stdout
        pipe = self._process.stdout.fileno()
        while chunk := os.read(pipe, 1 << 16):
            with self._lock:
                self._total += len(chunk)
                room = KEPT // 2 - len(self._head)
                self._head += chunk[: max(room, 0)]
                self._tail += chunk[max(room, 0) :]
                del self._tail[: -KEPT // 2]
            if self._total > FLOOD:
                self._stop(f"it printed more than {FLOOD >> 20} MiB; print less, above all inside loops")
                return
        self._ended = time.monotonic()

    def _stop(self, why: str) -> None:
        """SIGKILL to bubblewrap, whose namespaces end with it: no process in them outlives it."""
        if self.alive:
            self.stopped = self.stopped or why
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)

    def _watch(self, most_memory: int, most_tasks: int) -> None:
        while self.alive:
            tree = processes(self._process.pid)
            if sum(tree.values()) >= most_tasks + WRAPPERS:
                self._stop(f"it started {most_tasks} processes and threads; do not start processes in an endless loop")
            if total(tree, resident) > most_memory and total(tree, proportional) > most_memory:
                self._stop(f"it took more than {most_memory >> 30} GiB of memory; keep only what you need")
            time.sleep(GLANCE)


def processes(root: int) -> dict[int, int]:
    """Process `root` and all its descendants, with the number of threads of each."""
    tree, found = [root], {}
    for pid in tree:
        with contextlib.suppress(OSError):  # it has ended meanwhile
            tasks = os.listdir(f"/proc/{pid}/task")
            for task in tasks:
                tree += map(int, Path(f"/proc/{pid}/task/{task}/children").read_text().split())
            found[pid] = len(tasks)
    return found


def total(pids: Iterable[int], measure: Callable[[int], int]) -> int:
    """The memory of some processes together, in bytes, by `measure` of one."""
    found = 0
    for pid in pids:
        with contextlib.suppress(OSError, IndexError):  # it has ended meanwhile
            found += measure(pid)
    return found


def resident(pid: int) -> int:
    """Bytes of a process's memory; quick, but forks share pages and each counts them."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def proportional(pid: int) -> int:
    """Bytes of a process's memory, shared pages divided by the number of their users; slow for a large process."""
    found = re.search(r"^Pss:\s+(\d+) kB", Path(f"/proc/{pid}/smaps_rollup").read_text(), re.MULTILINE)
    return int(found[1]) << 10 if found else 0
