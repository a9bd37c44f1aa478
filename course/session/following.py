"""Following the log: new entries of a session's log book and of its programs since the last read."""

import functools
import heapq
import time
from collections.abc import Callable, Iterable
from itertools import chain

from course.ros.discovery import mark
from course.session.logs import Entry, LogBook, entry_of, entry_of_line, node_of, process_of
from course.session.node_process import NodeProcess


class LogFollower:
    """Reads new entries of the book and of the programs' output, if they are `wanted`.

    `programs` returns the session's programs, with those that were stopped.
    """

    def __init__(
        self, book: LogBook, programs: Callable[[], list[NodeProcess]], wanted: Callable[[Entry], bool] | None = None
    ):
        self._book, self._programs, self._wanted = book, programs, wanted
        self._logged = 0  # the number of the book's messages that were read
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
        book, lost = self._from_book(limit, programs)
        found = [book]
        for program in programs:
            entries, more = self._from_program(program, limit)
            found.append(entries)
            lost += more
        if self.older is None:
            self.older, lost = lost, 0
        return list(heapq.merge(*found, key=lambda entry: entry.at)), lost

    def _from_book(self, limit: int, programs: list[NodeProcess]) -> tuple[list[Entry], int]:
        before, (self._logged, messages) = self._logged, self._book.since(self._logged)
        lost = self._logged - before - len(messages)  # at the first read, what the book no longer has
        printed = printed_by(programs)
        messages = [message for message in messages if not printed(node_of(message), process_of(message))]
        if self._wanted is None:
            lost += max(0, len(messages) - limit)
            messages = messages[-limit:]
        return self._newest(map(entry_of, messages), limit, lost)

    def _from_program(self, program: NodeProcess, limit: int) -> tuple[list[Entry], int]:
        before = self._printed[program]
        over = program.ended  # read first: an ended program prints nothing more
        self._printed[program], lines = program.printed_since(before)
        lost = self._printed[program] - before - len(lines)
        if self._wanted is None:
            lost += max(0, len(lines) - limit)
            lines = lines[-limit:]
        entries = (entry_of_line(program.name, line, at, mark(program.pid)) for at, line in lines)
        return self._newest(chain(entries, self._endings(program, over)), limit + 10, lost)

    def _endings(self, program: NodeProcess, over: bool) -> Iterable[Entry]:
        """Return the entry on how the program ended, once."""
        for number, report in enumerate(program.reports if over else []):
            if (program, number) not in self._ended:
                self._ended.add((program, number))
                at = int(1e9 * (program.over or time.time()))
                yield Entry("ENDED", program.name, report.line, at, mark(program.pid))

    def _newest(self, entries: Iterable[Entry], limit: int, lost: int) -> tuple[list[Entry], int]:
        found = [entry for entry in entries if self._wanted is None or self._wanted(entry)]
        return found[-limit:], lost + max(0, len(found) - limit)


def printed_by(programs: list[NodeProcess]) -> Callable[[str, int], bool]:
    """Return a function that tells, as `NodeProcess.has_printed` does, whether one of the programs has printed this."""
    return functools.cache(lambda node, process: any(program.has_printed(node, process) for program in programs))
