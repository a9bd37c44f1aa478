"""The logs of a session's nodes: /rosout, and the output of their programs."""

import difflib
import math
from collections import deque
from collections.abc import Callable, Mapping

from rclpy.node import Node

from course.foundation.waiting import wait_until
from course.ros.names import base
from course.session.following import LogFollower, printed_by
from course.session.live_node import LiveNode
from course.session.logs import FLOOD, KEPT, NAME, Entry, LogBook, Logs, program_logs
from course.session.node_process import NodeProcess
from course.session.watch import Handle

ALIKE = 0.6  # least similarity of a line and the text that was waited for, if it may be meant
SLOW = 30.0  # s between two runs of a timer whose period may be meant in milliseconds
ENDED = 20  # programs at most that have ended, whose output is kept for pages
FLOODS = 20  # nodes at most that are reported for logging too much


class SessionLogs:
    """The log of the nodes in `handles`, and of others in the domain of `node`, which is spun elsewhere.

    `notice` is called with messages to the reader, about a node that logs too much.
    """

    def __init__(self, node: Node, handles: Mapping[str, Handle], notice: Callable[[str], None]):
        self._handles, self._notice = handles, notice
        self._flooding: set[str] = set()  # nodes already reported for logging too much
        self._book = LogBook(node, self._flooded)
        self._stopped: dict[str, NodeProcess] = {}  # the last of each name that was stopped, and not started again
        self._ended: deque[NodeProcess] = deque(
            maxlen=ENDED
        )  # those that were stopped, for a page that is loaded again

    def follow(self, wanted: Callable[[Entry], bool] | None = None) -> LogFollower:
        """Return a follower of new log entries, only those that are `wanted`.

        Its first ones include those of nodes that have ended and were started again.
        """
        return LogFollower(self._book, self._all_programs, wanted)

    def keep(self, program: NodeProcess) -> None:
        """Keep the log of a program that was stopped, until a node of its name is started again."""
        self._stopped[program.name] = program
        self._ended.append(program)

    def forget(self, node: str, before: float = math.inf) -> None:
        """Drop what `node` has logged before a time (s of `time.time()`), or all of it."""
        self._book.forget(node, before)
        for name, program in list(self._stopped.items()):
            if node in program.names:
                self._stopped.pop(name, None)

    def _programs(self) -> list[NodeProcess]:
        started = {key: each for key, each in list(self._handles.items()) if isinstance(each, NodeProcess)}
        return list({**self._stopped, **started}.values())

    def _all_programs(self) -> list[NodeProcess]:
        return list(dict.fromkeys([*self._ended, *self._programs()]))

    def wait(self, name: str | None, text: str, timeout: float) -> bool:
        """Wait, at most `timeout` s, for a line with `text` of the node or the file called `name`, or of any.

        The wait is over when the file's program has ended: it prints nothing more.  Returns False without such a line.
        """
        program = self._handles.get(name or "")
        seen: tuple[int, ...] = ()

        def is_there() -> bool:
            nonlocal seen
            before, seen = seen, self._amount()
            return before != seen and any(text in entry.text for entry in self.read(name))

        found = wait_until(is_there, timeout, unless=lambda: isinstance(program, NodeProcess) and program.ended)
        return found or is_there()  # its last lines may have come since the last look

    def _amount(self) -> tuple[int, ...]:
        """Return how much has been logged and printed so far: while this stays the same, `read` returns the same."""
        programs = self._programs()
        return self._book.count, *map(id, programs), *(each.printed + len(each.reports) for each in programs)

    def without(self, name: str | None, text: str) -> str:
        """Return a sentence on a log without a line with `text`: a line that is nearly the same, or a slow timer."""
        lines = [entry.text for entry in self.read(name)]
        said = f"The log of {repr(name) if name else 'all nodes'} has no line with {text!r}."
        if near := difflib.get_close_matches(text, lines, 1, ALIKE):
            return f"{said} Did you mean {near[0]!r}?"
        handle = self._handles.get((name or "").lstrip("/"))
        periods = [timer.timer_period_ns / 1e9 for timer in handle.node.timers] if isinstance(handle, LiveNode) else []
        slow = [period for period in periods if period >= SLOW]
        return said + (f" A timer of this node runs every {slow[0]:g} s: `create_timer` takes seconds." if slow else "")

    def read(self, name: str | None) -> Logs:
        """Return the log of the node or the file called `name`, or of all.

        For programs their terminal output, which is in order; for other nodes the messages on /rosout.
        """
        wanted = name.lstrip("/") if name else None
        printed = printed_by([program for program in self._all_programs() if program.output])
        entries = [entry for entry in self._book.read(wanted) if not printed(entry.node, entry.process)]
        for program in self._programs():
            if wanted in (None, program.name, *map(base, program.nodes)):
                entries += program_logs(program.name, program.output, [report.line for report in program.reports])
        return Logs(entries)

    def _flooded(self, node: str) -> None:
        """Report, once, a node that logs so much that most of it is lost, and how to end it."""
        if node in self._flooding or len(self._flooding) == FLOODS:
            return
        self._flooding.add(node)
        key = next((key for key, handle in list(self._handles.items()) if node in map(base, handle.nodes)), "")
        end = (
            f"To end it: ros.stop('{key}')."
            if key
            else "This session has not started it: end its program where it was started (Ctrl-C in its terminal)."
        )
        self._notice(
            f"The node {node[:NAME]!r} logs more than {FLOOD:,.0f} lines a second. Only the newest {KEPT:,} lines of "
            f"all nodes are kept. {end}"
        )
