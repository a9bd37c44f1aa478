"""The lines of its own file on which the threads of a Python program are, asked from outside.

The program writes them itself at a signal (`started/sitecustomize.py`), also amid a loop that never ends.
"""

import contextlib
import os
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path

from course.foundation import processes
from course.foundation.waiting import wait_until
from course.session.failure_report import Frame, where
from course.session.started import sitecustomize

ASKED = 1.0  # s for a program to say what it is doing
OUTERMOST = b" in <module>\n"  # what ends all that is said: the main thread comes last
STILL = 0.2  # s without a further word, where a program's outermost frame is another
SPENT = 3.0  # s of the processor's time, after which a program that has done nothing yet is in a loop
LOOPS = ("while ", "for ", "pass", "continue")  # a line that calls something may take long, and ends


class Stacks:
    """A file for what the threads of one program are doing."""

    def __init__(self) -> None:
        # A file without a name, not a memfd: that is refused in the box of a class on one server.
        self._file = tempfile.TemporaryFile()  # noqa: SIM115  # as long as this object

    @property
    def descriptor(self) -> int:
        """The open file's number, which the program must inherit."""
        return self._file.fileno()

    def environment(self, variables: Mapping[str, str], *, introspecting: bool = False) -> dict[str, str]:
        """Return the variables that the program needs beside its `variables`."""
        return sitecustomize.environment(variables, self.descriptor, introspecting=introspecting)

    def doing(self, pid: int, path: Path) -> tuple[Frame, ...]:
        """Return where in the file at `path` the process is: in a callback, or else in its main part.

        () when that is not known, and for a program that only waits for callbacks.
        """
        if not processes.catches(pid, sitecustomize.ASK):
            return ()
        before = sizes = os.fstat(self.descriptor).st_size
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, sitecustomize.ASK)

        grown = time.monotonic()

        def written() -> bool:  # all of it: to the outermost frame of the main thread, which is the last
            nonlocal sizes, grown
            last, sizes = sizes, os.fstat(self.descriptor).st_size
            if last != sizes:
                grown = time.monotonic()
            whole = os.pread(self.descriptor, len(OUTERMOST), max(before, sizes - len(OUTERMOST))) == OUTERMOST
            return before < sizes and (whole or time.monotonic() - grown > STILL)

        wait_until(written, ASKED, alert=False)
        return where(os.pread(self.descriptor, sizes - before, before).decode(errors="replace"), path)

    def loop(self, pid: int, path: Path, since: float = 0.0) -> tuple[Frame, ...]:
        """Return where the process loops, () while nothing speaks for a loop.

        It does when it has used the processor for `SPENT` s since it had used it for `since` s, and is in a line of a
        loop that calls nothing else for long.
        """
        if processes.processor_time(pid) - since < SPENT:
            return ()
        frames = self.doing(pid, path)
        return frames if frames and frames[-1].code.strip().startswith(LOOPS) else ()
