"""A node in its own process: the reader's file, started and ended by the session."""

import contextlib
import itertools
import os
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Collection, Iterator
from concurrent.futures import Future
from pathlib import Path
from typing import IO

from course.explaining.endless_waits import EndlessSpin
from course.explaining.failure_report import (
    GOAL_FAILED,
    MARK,
    NO_DECISION,
    STATE_NOT_SET,
    FailureReport,
    Frame,
    failed_goals,
    of_exit,
    of_program,
)
from course.explaining.lines_that_wait import crowded, executor_threads
from course.explaining.source import text_at
from course.foundation import processes
from course.foundation.waiting import wait_until
from course.ros.discovery import mark
from course.ros.names import base
from course.session.logs import LONGEST, node_of_line
from course.session.stacks import Stacks
from course.session.started.sitecustomize import LEAVE

KEPT_LINES = 2000
GRACE = 3.0  # s for a program to end after Ctrl-C
BUSY = 1.0  # s of a processor that it may use meanwhile: more means that it is in a loop
LEAVING = 3.0  # s at most for it to destroy its nodes, which takes long where others use the processor, too


class NodeProcess:
    """`python FILE ARGUMENTS` in its own process session, so that it is not interrupted with a cell.

    It ends with this process, however that ends.
    """

    def __init__(
        self,
        path: Path,
        arguments: list[str],
        changed: Callable[[], None] = lambda: None,
        introspecting: bool = False,
        domain: int | None = None,
    ):
        """Start it, in another ROS `domain` if one is given; with `introspecting`, its services are introspected.

        `changed` is called, in another thread, when it has ended or one of its goals has failed.
        """
        self._stacks = Stacks()
        self._variables = self._stacks.environment(os.environ, introspecting=introspecting)
        if domain is not None:
            self._variables = {**self._variables, "ROS_DOMAIN_ID": str(domain)}
        self._changed = changed
        self.path = path.absolute()
        self.name = path.name
        self._begun_with = text_at(self.path)
        self.nodes: list[str] = []
        self.services: set[str] = set()  # services that it has offered
        self._loggers: set[str] = set()  # its nodes that have logged on its terminal
        self._children: set[int] = set()  # the marks of processes that it has started, which print on its terminal
        self.stopped = False  # whether the reader stopped it through the session
        self._report: FailureReport | None = None
        self._goals = False  # whether a goal has failed
        self._failed: list[FailureReport] = []
        self._read_lines = 0  # lines of its output
        self._searched_lines = 0  # lines searched for failed goals
        self._searched_stacks = 0  # bytes of its stacks searched for calls of exit()
        self._printing = threading.Lock()
        self._lines: deque[str] = deque(maxlen=KEPT_LINES)
        self._came: deque[int] = deque(maxlen=KEPT_LINES)  # when each of these lines came, ns since 1970
        self.started = time.time()
        self.over: float | None = None  # when it was first seen to have ended, as `started`
        self._popen: subprocess.Popen[str]
        started: Future[None] = Future()
        self._reader = threading.Thread(
            target=self._run, args=(arguments, started), name=f"output of {self.name}", daemon=True
        )
        self._reader.start()
        started.result()

    def _run(self, arguments: list[str], started: "Future[None]") -> None:
        """Start the program, and read its output until it ends.

        Both in one thread: Linux ends the program with the thread that started it (prctl(2), PR_SET_PDEATHSIG).
        """
        try:
            self._popen = subprocess.Popen(
                ["setpriv", "--pdeathsig", "KILL", sys.executable, self.path.name, *arguments],
                cwd=self.path.parent,
                env={**os.environ, "PYTHONFAULTHANDLER": "1", "PYTHONUNBUFFERED": "1", **self._variables},
                start_new_session=True,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                errors="replace",
                pass_fds=[self._stacks.descriptor],
            )
        except OSError as error:
            started.set_exception(error)
            return
        started.set_result(None)
        self._read()

    def _read(self) -> None:
        assert self._popen.stdout is not None
        awaited = ""  # after a failed goal: the first line of its traceback, and then the last
        last: list[str] = []  # from the first traceback of a program that is being stopped
        for line in _lines(self._popen.stdout):
            if self.stopped and (last or line.startswith(MARK)):
                last.append(line)
                continue
            self._keep(line)
            if GOAL_FAILED in line:
                self._goals, awaited = True, "begin"
            elif STATE_NOT_SET in line or NO_DECISION in line:
                self._goals = True
                self._changed()
            elif awaited == "begin" and line.rstrip().endswith(MARK):
                awaited = "end"
            elif awaited == "end" and not line.startswith(" "):
                awaited = ""
                self._changed()
        if last[-1:] != ["KeyboardInterrupt\n"]:  # which is how stopping ends a program, and says nothing of it
            for line in last:
                self._keep(line)
        self._popen.wait()
        self.over = self.over or time.time()
        self._changed()

    def _keep(self, line: str) -> None:
        """Keep a line of its output."""
        with self._printing:
            self._lines.append(line)
            self._came.append(time.time_ns())
            self._read_lines += 1
            if "]: " in line and (node := node_of_line(line)):
                self._loggers.add(node)

    @property
    def alive(self) -> bool:
        """Return True while the process runs."""
        if self._popen.poll() is None:
            return True
        self.over = self.over or time.time()
        return False

    @property
    def pid(self) -> int:
        """Return its process id."""
        return self._popen.pid

    @property
    def returncode(self) -> int | None:
        """Return its exit status, None while it runs."""
        return self._popen.poll()

    @property
    def output(self) -> str:
        """Return the last 2,000 lines of its output."""
        if not self.alive and threading.current_thread() is not self._reader:
            self._reader.join(1.0)
        return "".join(self._lines).rstrip("\n")

    @property
    def printed(self) -> int:
        """Return the number of lines printed so far."""
        return self._read_lines

    def printed_since(self, count: int) -> tuple[int, list[tuple[int, str]]]:
        """Return the number of lines printed so far, and the newest after the first `count`.

        Each line comes with the time at which it was read, in ns since 1970.
        """
        with self._printing:
            lines, came, now = self._lines.copy(), self._came.copy(), self._read_lines
        new = zip(came, lines, strict=True)
        old = len(lines) - min(now - count, len(lines))
        return now, [(at, line.rstrip("\n")) for at, line in itertools.islice(new, old, None)]

    @property
    def names(self) -> set[str]:
        """Return the names, without namespace, of its nodes known so far, from the graph or its log lines."""
        with self._printing:
            return {base(node) for node in self.nodes} | self._loggers

    def has_printed(self, node: str, process: int) -> bool:
        """Return True if its terminal also has what `node` logs in the process with this mark (0 if unknown).

        By the process, because others may have a node of the same name.
        """
        if process in (0, mark(self.pid)):
            return process != 0 or node in self.names
        if process not in self._children and self.alive and processes.in_session(self.pid, process):
            self._children.add(process)
        return process in self._children

    @property
    def ended(self) -> bool:
        """Return True once it has ended and all its output was read."""
        return not self.alive and not self._reader.is_alive()

    @property
    def source(self) -> str:
        """Return the program's text, '' if its file is gone."""
        return text_at(self.path)

    @property
    def edited(self) -> bool:
        """Return True if its file has another text than when it was started."""
        return self.source not in ("", self._begun_with)

    @property
    def died(self) -> bool:
        """Return True if it has ended by itself."""
        return not self.alive and not self.stopped

    @property
    def reports(self) -> list[FailureReport]:
        """Return its failure reports: exceptions in an action's execute callback, and how it ended."""
        if self._goals and self._searched_lines != self._read_lines:
            self._searched_lines = self._read_lines
            found = failed_goals(self.path, "".join(self._lines))
            self._failed += [report for report in found if report not in self._failed]
        if self._stacks.size != self._searched_stacks:
            self._searched_stacks = self._stacks.size
            if frames := self._own(self._stacks.exits(self.path)):
                left = of_exit(self.name, frames)
                self._failed += [left] if left not in self._failed else []
        if not self.died or self.returncode is None:
            return self._failed
        if self._report is None:
            exited = self._own(self._stacks.exit(self.path))
            self._report = of_program(
                self.path, self.output, self.returncode, before_its_node=not self.nodes, exited=exited
            )
        return [*self._failed, self._report]

    @staticmethod
    def _own(frames: tuple[Frame, ...]) -> tuple[Frame, ...]:
        """Return frames that are in functions other than `main`; () if the last one is not."""
        return () if not frames or frames[-1].function in ("main", "<module>") else frames

    def doing(self) -> tuple[Frame, ...]:
        """Return the frames of the program in its file: in a callback, or else in its main part; () if unknown.

        Also () if it only waits for callbacks.
        """
        return self._stacks.doing(self.pid, self.path) if self.alive else ()

    def loop(self) -> tuple[Frame, ...]:
        """Return the frames of a loop, if the program has only used the processor since its start; else ()."""
        return self._stacks.loop(self.pid, self.path) if self.alive else ()

    def hang(self, callbacks: Collection[str], limit: float) -> tuple[Frame, ...]:
        """Return the frames of a callback that will not return in time, as `hangs.hang` does."""
        return self._stacks.hang(self.pid, self.path, callbacks, limit) if self.alive else ()

    def beginning(self, *, endless: bool = False) -> tuple[Frame, ...]:
        """Return the frames of the program if it runs no callbacks yet, as `hangs.beginning` does; else ()."""
        return self._stacks.beginning(self.pid, self.path, endless=endless) if self.alive else ()

    def unspun(self) -> tuple[Frame, ...]:
        """Return the frames of the program if a loop keeps it from spinning its node, as `hangs.unspun` does."""
        may = self.alive and "while" in self.source  # most have no loop, and are not asked
        return self._stacks.unspun(self.pid, self.path) if may else ()

    def in_calls(self) -> int:
        """Return the number of its threads that block in a `call(...)`, as `hangs.in_calls` does."""
        return self._stacks.in_calls(self.pid, self.path) if self.alive else 0

    def deadlocked(self) -> tuple[Frame, ...]:
        """Return the frames of a callback if all threads of its executor wait for answers, without a limit; else ()."""
        source = self.source
        may = ".call(" in source and "timeout_sec" not in source and executor_threads(source)[1]
        return self.doing() if may and crowded(source, self.in_calls()) else ()

    def endless_wait(self) -> str:
        """Return why the program waits without end where there is no server, as `endless_waits.endless_wait` does."""
        return self._stacks.endless_wait(self.pid, self.path, {}) if self.alive else ""

    def endless_spin(self) -> EndlessSpin | None:
        """Return where the program spins until a future is done, as `endless_waits.endless_spin` does."""
        return self._stacks.endless_spin(self.pid, self.path) if self.alive else None

    @property
    def asleep(self) -> bool:
        """Return True if it has ended, or all its threads wait."""
        return not self.alive or processes.sleeping(self.pid)

    def is_at_rest(self) -> bool:
        """Return True if it is a server that has nothing left to do until it is asked again."""
        return self.alive and self._stacks.is_at_rest(self.pid, self.path)

    @property
    def state(self) -> str:
        """Return a line: running, stopped, or how it ended."""
        if self.alive:
            return "; ".join(["running", *(report.line for report in self.reports[-1:])])
        return self.reports[-1].line if self.reports else "stopped"

    @property
    def where(self) -> str:
        """Return where it runs."""
        return f"{self.name}, process {self.pid}"

    def stop(self) -> None:
        """End it as Ctrl-C does, and by force after 3 s, or earlier if it works on."""
        self._end()

    def _end(self) -> tuple[Frame, ...]:
        self.stopped = self.stopped or self.alive
        with contextlib.suppress(ProcessLookupError):
            if self.alive:
                spent = processes.processor_time(self.pid)
                os.killpg(self.pid, signal.SIGINT)

                def works() -> bool:
                    return processes.processor_time(self.pid) - spent > BUSY

                if not wait_until(lambda: not self.alive, GRACE, unless=works, alert=False):
                    self._leave()
            os.killpg(self._popen.pid, signal.SIGKILL)  # with all processes that it started
        self._popen.wait()
        self._reader.join(1.0)
        return ()

    def _leave(self) -> None:
        """Have it destroy its nodes, which others would see otherwise until their lease is over."""
        if processes.catches(self.pid, LEAVE):
            os.kill(self.pid, LEAVE)
            wait_until(lambda: not self.alive, LEAVING, alert=False)

    def __repr__(self) -> str:
        nodes = f" as {', '.join(self.nodes)}" if self.alive else ""
        return f"<{self.name}: {self.state}{nodes}>"


def _lines(output: IO[str]) -> Iterator[str]:
    """Yield the lines of a program's output, at most LONGEST characters each, because a line may never end."""
    while line := output.readline(LONGEST + 1):
        rest = line
        while len(rest) > LONGEST and not rest.endswith("\n"):
            rest = output.readline(LONGEST + 1)
        yield line if rest is line else f"{line[:LONGEST]}…\n"
