"""Following the log: new entries of a session's log book and of its programs since the last read."""

import time
from collections.abc import Callable, Iterable, Mapping
from itertools import chain

from course.ros.names import base
from course.session.live_node import LiveNode
from course.session.logs import KEPT, Entry, LogBook, entry_of, entry_of_line, node_of
from course.session.node_process import NodeProcess
from course.session.watch import Handle


class LogFollower:
    """Reads new entries of the book and of the programs' output, if they are `wanted`.

    `handles` are what runs in this session, and `programs` returns its programs, with those that were stopped.
    """

    def __init__(
        self,
        book: LogBook,
        handles: Mapping[str, Handle],
        programs: Callable[[], list[NodeProcess]],
        wanted: Callable[[Entry], bool] | None = None,
    ):
        self._book, self._handles, self._programs, self._wanted = book, handles, programs, wanted
        self._logged = 0  # the number of the book's messages that were read
        self._held: list[bytes] = []  # messages held until it is known whether a program also prints them
        self._printed: dict[NodeProcess, int] = {}  # the number of lines read of each program
        self._ended: set[tuple[NodeProcess, int]] = set()  # reported ends of programs, with the reports before
        self.older: int | None = None  # the number of entries, from before the first read, that exceeded its limit

    def read(self, limit: int) -> tuple[list[Entry], int]:
        """Return the newest entries, at most `limit` from the book and from each program, and the number of lost ones.

        Entries are lost if they come faster than they are read, or exceed the limit; at the first read, they are older.
        """
        programs = self._programs()
        self._printed = {each: self._printed.get(each, 0) for each in programs}
        # For programs their terminal output, which is in order; for other nodes the messages on /rosout.
        found, lost = self._from_book(limit, programs)
        for program in programs:
            entries, more = self._from_program(program, limit)
            found, lost = [*found, *entries], lost + more
        if self.older is None:
            self.older, lost = lost, 0
        return found, lost

    def _from_book(self, limit: int, programs: list[NodeProcess]) -> tuple[list[Entry], int]:
        starting = any(program.starting for program in programs)  # read before the book: later messages are not held
        before, (self._logged, messages) = self._logged, self._book.since(self._logged)
        lost = self._logged - before - len(messages) if before else 0  # older ones are not counted as lost
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
        """Divide messages into those of nodes in this process, and the others."""
        nodes = [node for each in list(self._handles.values()) if isinstance(each, LiveNode) for node in each.nodes]
        mine = {base(node) for node in nodes}
        of_mine = [message for message in messages if node_of(message) in mine]
        return of_mine, [message for message in messages if node_of(message) not in mine]

    def _from_program(self, program: NodeProcess, limit: int) -> tuple[list[Entry], int]:
        before = self._printed[program]
        over = program.ended  # read first: an ended program prints nothing more
        self._printed[program], lines = program.printed_since(before)
        lost = self._printed[program] - before - len(lines)
        if self._wanted is None:
            lost += max(0, len(lines) - limit)
            lines = lines[-limit:]
        entries = (entry_of_line(program.name, line, at) for at, line in lines)
        return self._newest(chain(entries, self._news(program, over)), limit + 10, lost)

    def _news(self, program: NodeProcess, over: bool) -> Iterable[Entry]:
        """Return the entry on how the program ended, once."""
        for number, report in enumerate(program.reports if over else []):
            if (program, number) not in self._ended:
                self._ended.add((program, number))
                yield Entry("ENDED", program.name, report.line, int(1e9 * (program.over or time.time())))

    def _newest(self, entries: Iterable[Entry], limit: int, lost: int) -> tuple[list[Entry], int]:
        found = [entry for entry in entries if self._wanted is None or self._wanted(entry)]
        return found[-limit:], lost + max(0, len(found) - limit)
