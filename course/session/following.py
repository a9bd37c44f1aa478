"""The log as it grows: what has come to a session's log book and from its programs since one looked last."""

from collections.abc import Callable, Iterable, Mapping
from itertools import chain

from course.ros.names import base
from course.session.live_node import LiveNode
from course.session.logs import KEPT, Entry, LogBook, entry_of, entry_of_line, node_of
from course.session.node_process import NodeProcess
from course.session.watch import Handle


class LogFollower:
    """Reads on in the book and in the programs' output; what is not `wanted` is left out."""

    def __init__(self, book: LogBook, handles: Mapping[str, Handle], wanted: Callable[[Entry], bool] | None = None):
        self._book, self._handles, self._wanted = book, handles, wanted
        self._logged = 0  # of the book's messages that were read
        self._held: list[bytes] = []  # of these, until it is known whether a program prints them as well
        self._printed: dict[NodeProcess, int] = {}  # of the lines of each program
        self._ended: set[tuple[NodeProcess, int]] = set()  # the programs' ends that were told, and the reports before

    def read(self, limit: int) -> tuple[list[Entry], int]:
        """The newest new entries, `limit` at most from the book and as many from each program, and how many are lost.

        Lost are those that came faster than they were read, or are more than the limit.
        """
        programs = [handle for handle in list(self._handles.values()) if isinstance(handle, NodeProcess)]
        self._printed = {each: self._printed.get(each, 0) for each in programs}
        # Of programs what they wrote on their terminal, where it is in order; of the others what is on /rosout.
        found, lost = self._from_book(limit, programs)
        for program in programs:
            entries, more = self._from_program(program, limit)
            found, lost = [*found, *entries], lost + more
        return found, lost

    def _from_book(self, limit: int, programs: list[NodeProcess]) -> tuple[list[Entry], int]:
        starting = any(program.starting for program in programs)  # asked before the book: what comes later is not held
        before, (self._logged, messages) = self._logged, self._book.since(self._logged)
        lost = self._logged - before - len(messages) if before else 0  # what was forgotten before is not lost
        messages, self._held = self._held + messages, []
        if printed := {name for program in programs for name in program.names}:
            messages = [message for message in messages if node_of(message) not in printed]
        if starting:
            messages, self._held = self._hold(messages)
            lost += max(0, len(self._held) - KEPT)
            self._held = self._held[-KEPT:]
        if self._wanted is None:
            lost += max(0, len(messages) - limit)
            messages = messages[-limit:]
        return self._newest(map(entry_of, messages), limit, lost)

    def _hold(self, messages: list[bytes]) -> tuple[list[bytes], list[bytes]]:
        """The messages of nodes in this process, and the others."""
        nodes = [node for each in list(self._handles.values()) if isinstance(each, LiveNode) for node in each.nodes]
        mine = {base(node) for node in nodes}
        of_mine = [message for message in messages if node_of(message) in mine]
        return of_mine, [message for message in messages if node_of(message) not in mine]

    def _from_program(self, program: NodeProcess, limit: int) -> tuple[list[Entry], int]:
        before = self._printed[program]
        over = program.ended  # asked first: whoever has ended prints no more
        self._printed[program], lines = program.printed_since(before)
        lost = self._printed[program] - before - len(lines)
        if self._wanted is None:
            lost += max(0, len(lines) - limit)
            lines = lines[-limit:]
        entries = (entry_of_line(program.name, line) for line in lines)
        return self._newest(chain(entries, self._news(program, over)), limit + 10, lost)

    def _news(self, program: NodeProcess, over: bool) -> Iterable[Entry]:
        """Return how it has ended, once."""
        for number, report in enumerate(program.reports if over else []):
            if (program, number) not in self._ended:
                self._ended.add((program, number))
                yield Entry("ENDED", program.name, report.line)

    def _newest(self, entries: Iterable[Entry], limit: int, lost: int) -> tuple[list[Entry], int]:
        found = [entry for entry in entries if self._wanted is None or self._wanted(entry)]
        return found[-limit:], lost + max(0, len(found) - limit)
