"""A student's running program, as seen by the judging process: its output, and its end."""

import contextlib
import os
import re
import select
import signal
import threading
import time
from collections.abc import Callable

from autograder.errors import SandboxError
from autograder.sandbox.cleaning import without_hidden, without_paths
from autograder.sandbox.supervision import End

KEPT = 1 << 20  # bytes of output that are kept, half from the beginning and half from the end
FLOOD = 64 << 20  # bytes of output after which a program is stopped
DRAINED = 2.0  # s for reading the rest of the output after the program has ended


class Program:
    """A running program.  `stopped` says why the grader ended it, or is empty."""

    def __init__(self, name: str, output: int, end: int, stop: Callable[[str], None]):
        """Read the program's output from the descriptor `output`, and its `End` from `end`.

        `stop` is called with a reason to have the program ended.
        """
        self.name = name
        self.hidden: set[float | str] = set()  # hidden numbers and words that `last_words` must not show to the student
        self.stopped = ""
        self._head, self._tail, self._total = bytearray(), bytearray(), 0
        self._lock = threading.Lock()
        self._stop, self._output = stop, output
        self._end = os.fdopen(end, "rb", buffering=0)
        self._ending = threading.Lock()
        self._how: End | None = None
        self.started = self._ended = time.monotonic()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def alive(self) -> bool:
        """Return True if it is still running."""
        return self._look(0.0) is None

    @property
    def exit_status(self) -> int | None:
        """Return its exit status as a shell shows it (128 + signal), or None while it is running."""
        how = self._look(0.0)
        return how.exit_status if how else None

    @property
    def signal(self) -> str:
        """Return the name of the signal that ended it for certain, such as SIGSEGV; else ''."""
        how = self._look(0.0)
        return signal.Signals(how.signal).name if how and how.signal else ""

    @property
    def output(self) -> str:
        """Return its output, stdout and stderr in order; the middle of a long output is left out."""
        with self._lock:
            return (bytes(self._head) + bytes(self._tail)).decode(errors="replace")

    def wait(self, timeout: float) -> bool:
        """Wait until it has ended and all its output is read; False when it is still running after `timeout` s.

        Raises SandboxError when bubblewrap could not start it.
        """
        how = self._look(timeout)
        if how is None:
            return False
        self._reader.join(DRAINED)
        if not how.begun and not self.stopped:
            raise SandboxError(f"bubblewrap did not start {self.name}: {self.output.strip()[-500:]}")
        return True

    @property
    def age(self) -> float:
        """Return the time (s) since it was started."""
        return time.monotonic() - self.started

    def kill(self, why: str = "") -> None:
        """End it and every process that it has started; `why` becomes `stopped`."""
        self._kill(why)
        self._look(None)
        self._reader.join(DRAINED)

    @property
    def duration(self) -> float:
        """Return the seconds from its start to its end, once it has ended."""
        return self._ended - self.started

    @property
    def raised(self) -> bool:
        """Return True if it died of a Python exception and has printed the traceback."""
        return bool(self.exit_status) and (
            "Traceback (most recent call last)" in self.output
            or bool(re.search(r"^(Syntax|Indentation|Tab)Error: ", self.output, re.MULTILINE))
        )

    @property
    def raised_by_itself(self) -> bool:
        """Return True if its exception was raised by its own code, and not beneath a call of a library, as `spin`."""
        own = f"/{self.name}"
        files = re.findall(
            r'^  File "(.+)", line \d+, in ', self.output.rpartition("Traceback (most recent")[2], re.MULTILINE
        )
        first = next((number for number, file in enumerate(files) if file.endswith(own)), len(files))
        return self.raised and bool(files[first:]) and all(file.endswith(own) for file in files[first:])

    def last_words(self) -> str:
        """Return why it ended, in a line for the student: the exception and where in their file, or the signal."""
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
        return f"signal {self.signal}" if self.signal else f"exit status {self.exit_status}"

    def _look(self, timeout: float | None) -> End | None:
        """Return how it ended; None when it is still running after `timeout` s."""
        if self._how is None:
            watched = select.poll()
            watched.register(self._end, select.POLLIN)
            if watched.poll(None if timeout is None else 1000 * max(0.0, timeout)):
                with self._ending:  # two threads may call this
                    if self._how is None:
                        how = End.from_bytes(self._end.read(4096))
                        self.stopped = self.stopped or how.stopped
                        self._how = how
        return self._how

    def _kill(self, why: str) -> None:
        if self.alive:
            self.stopped = self.stopped or why
            self._stop(why)

    def _read(self) -> None:
        with contextlib.closing(os.fdopen(self._output, "rb", buffering=0)) as pipe:
            while chunk := pipe.read(1 << 16):
                with self._lock:
                    self._total += len(chunk)
                    left = KEPT // 2 - len(self._head)
                    self._head += chunk[: max(left, 0)]
                    self._tail += chunk[max(left, 0) :]
                    del self._tail[: -KEPT // 2]
                if self._total > FLOOD:
                    self._kill(f"it printed more than {FLOOD >> 20} MiB; print less, above all inside loops")
                    return
        self._ended = time.monotonic()
