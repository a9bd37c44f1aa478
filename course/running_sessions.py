"""`course sessions`: lists the sessions on this machine, and ends forgotten ones."""

import contextlib
import os
import signal
import sys
import time

from rich.console import Console
from rich.markup import escape
from rich.table import Column, Table

from course import registry
from course.foundation import processes
from course.foundation.times import MINUTES
from course.foundation.untrusted import one_line
from course.foundation.waiting import wait_until

GRACE = 5.0  # s for a kernel to end by itself


def show() -> int:
    """Print a table of the sessions; always return 0."""
    found = registry.running()
    if not found:
        print("No live session of yours runs on this machine.")
        return 0
    # In a narrow terminal a path goes on in the next line: its end says which notebook it is.
    table = Table("number", "ROS domain", "since", Column("folder", overflow="fold"), "nodes")
    for record in found:
        since = time.strftime(MINUTES, time.localtime(record.since))
        nodes = "\n".join(one_line(f"{node.name}: {node.state}") for node in record.nodes) or "none"
        table.add_row(str(record.pid), str(record.domain), since, escape(one_line(record.folder)), escape(nodes))
    Console(width=None if sys.stdout.isatty() else 160).print(table)
    return 0


def end(numbers: list[int], *, everything: bool) -> int:
    """End the sessions with these numbers, or all; for an unknown number print a line and return 2."""
    found = {record.pid: record for record in registry.running()}
    if unknown := sorted(set(numbers) - set(found)):
        print(f"There is no session {unknown[0]}; `course sessions` lists them.", file=sys.stderr)
        return 2
    for pid in found if everything else numbers:
        _end(found[pid])
        registry.remove(pid)
        print(f"Ended: session {pid} in {found[pid].folder}, with {len(found[pid].nodes)} nodes.")
    return 0


def _end(record: registry.SessionRecord) -> None:
    """End a session's process, by force if needed; its nodes' processes end with it."""
    with contextlib.suppress(ProcessLookupError):
        os.kill(record.pid, signal.SIGTERM)
        if not wait_until(lambda: not processes.alive(record.pid, record.born), GRACE):
            os.kill(record.pid, signal.SIGKILL)
