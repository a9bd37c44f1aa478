"""Finds out, from outside, the lines at which the threads of a Python program are.

The program itself writes them at a signal (`started/sitecustomize.py`), even in an endless loop.
"""

import contextlib
import itertools
import os
import tempfile
import time
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

from course.explaining.endless_waits import EndlessSpin, endless_spin, endless_wait, is_at_rest
from course.explaining.failure_report import Frame, where
from course.explaining.hangs import beginning, hang, in_calls, unspun
from course.foundation import processes
from course.foundation.waiting import wait_until
from course.session.started import sitecustomize

ASKED = 1.0  # s for a program to write its stacks
OUTERMOST = b" in <module>\n"  # the end of the output, because the main thread comes last
STILL = 0.2  # s without further output, if a program's outermost frame is a different one
SPENT = 3.0  # s of processor time, after which a program without any effect is taken to loop
LOOPS = ("while ", "for ", "pass", "continue")  # other lines may call something that takes long but ends


class Stacks:
    """A file for the stacks of one program's threads."""

    def __init__(self) -> None:
        # An unnamed file, not a memfd, which is refused in the box of a class member.
        self._file = tempfile.TemporaryFile()  # noqa: SIM115  # lives as long as this object

    @property
    def descriptor(self) -> int:
        """Return the descriptor of the file, which the program must inherit."""
        return self._file.fileno()

    def environment(self, variables: Mapping[str, str], *, introspecting: bool = False) -> dict[str, str]:
        """Return the environment that the program needs, based on `variables`."""
        return sitecustomize.environment(variables, self.descriptor, introspecting=introspecting)

    def doing(self, pid: int, path: Path) -> tuple[Frame, ...]:
        """Return the frames of the process in the file at `path`: in a callback, or else in its main part.

        () if unknown, or if the program only waits for callbacks.
        """
        return where(self._written(pid), path)

    def endless_wait(self, pid: int, path: Path, served: Mapping[str, Sequence[str]]) -> str:
        """Return why the process waits for something that cannot come; '' without a sign of that.

        `served` are the services and actions that have a server, with their types.
        """
        return endless_wait(self._written(pid), path, served)

    def endless_spin(self, pid: int, path: Path) -> EndlessSpin | None:
        """Return where the process spins until a future is done, as `endless_waits.endless_spin` does."""
        return endless_spin(self._written(pid), path)

    def is_at_rest(self, pid: int, path: Path) -> bool:
        """Return True if the process, a server, has nothing left to do until it is asked again."""
        return is_at_rest(self._written(pid), path)

    def hang(self, pid: int, path: Path, callbacks: Collection[str], limit: float) -> tuple[Frame, ...]:
        """Return the frames of a callback of the process that will not return in time, as `hangs.hang` does."""
        return hang(self._written(pid), path, callbacks, limit)

    def beginning(self, pid: int, path: Path, *, endless: bool) -> tuple[Frame, ...]:
        """Return the frames of the process if it runs no callbacks yet, as `hangs.beginning` does."""
        return beginning(self._written(pid), path, endless=endless)

    def unspun(self, pid: int, path: Path) -> tuple[Frame, ...]:
        """Return the frames of the process if a loop keeps it from spinning its node, as `hangs.unspun` does."""
        return unspun(self._written(pid), path)

    def in_calls(self, pid: int, path: Path) -> int:
        """Return the number of threads of the process that block in a `call(...)`, as `hangs.in_calls` does."""
        return in_calls(self._written(pid), path)

    def exits(self, path: Path) -> tuple[Frame, ...]:
        """Return the frames, in the file at `path`, of the last call of `exit()` in another thread than the main one.

        There it ends a callback, but not the program.
        """
        return self._exit(path, "other thread")

    def exit(self, path: Path) -> tuple[Frame, ...]:
        """Return the frames, in the file at `path`, of the call of `exit()` that has ended the program."""
        return self._exit(path, "main thread")

    def _exit(self, path: Path, thread: str) -> tuple[Frame, ...]:
        text = os.pread(self.descriptor, os.fstat(self.descriptor).st_size, 0).decode(errors="replace")
        mark = f"{sitecustomize.EXIT} in the {thread} (most recent call first):\n"
        _, found, stack = text.rpartition(mark)
        lines = list(itertools.takewhile(lambda line: line.startswith("  File "), stack.splitlines()))
        return where("\n".join([mark, *lines]), path) if found else ()

    @property
    def size(self) -> int:
        """Return the number of bytes that the program has written."""
        return os.fstat(self.descriptor).st_size

    def _written(self, pid: int) -> str:
        """Have the process write the stacks of its threads, and return them; '' if it cannot."""
        if not processes.catches(pid, sitecustomize.ASK):
            return ""
        before = sizes = os.fstat(self.descriptor).st_size
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, sitecustomize.ASK)

        grown = time.monotonic()

        def written() -> bool:  # complete, up to the outermost frame of the main thread, which comes last
            nonlocal sizes, grown
            last, sizes = sizes, os.fstat(self.descriptor).st_size
            if last != sizes:
                grown = time.monotonic()
            whole = os.pread(self.descriptor, len(OUTERMOST), max(before, sizes - len(OUTERMOST))) == OUTERMOST
            return before < sizes and (whole or time.monotonic() - grown > STILL)

        wait_until(written, ASKED, alert=False)
        return os.pread(self.descriptor, sizes - before, before).decode(errors="replace")

    def loop(self, pid: int, path: Path, since: float = 0.0) -> tuple[Frame, ...]:
        """Return the frames of a loop in the process, () if there is no sign of one.

        The process counts as looping if it has used `SPENT` s of processor time since it had used `since` s, and is at
        a line of a loop that calls nothing that takes long.
        """
        if processes.processor_time(pid) - since < SPENT:
            return ()
        frames = self.doing(pid, path)
        return frames if frames and frames[-1].code.strip().startswith(LOOPS) else ()
