"""A loop in which a cell only waits: where it is, and what it waits for.

Python tells nothing about it, and an interruption (■) shows no more than the line.
"""

import ast
import linecache
import re
import sys
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

from rclpy.action import ActionClient
from rclpy.client import Client

from course.explaining.outline import serves
from course.explaining.source import covers, is_cell, name_of, parse, text_at
from course.foundation.syntax import walk

IDLE = ("sleep", "print", "spin_once")  # calls in a loop that only waits
ASKS = ("service_is_ready", "wait_for_service", "server_is_ready", "wait_for_server")  # methods of a client
# A program run by a shell, as in a cell, or as IPython writes it; nothing stands before or behind it.
RUN = re.compile(r"""(?:^!|\.system\(['"])\s*python3?\s+(?:-u\s+)?([\w/.-]+\.py)\b[\w\s.:=-]*(?:$|['"]\))""")
CLOCK = re.compile(r"\b(?:time|monotonic|perf_counter|now)\b")  # such a loop may have a limit


@dataclass(frozen=True)
class CellLoop:
    """A loop of a cell that only waits, by its line and its condition."""

    line: int
    test: str
    client: Client | ActionClient | None  # whose server it waits for, if that is known

    def __str__(self) -> str:
        return f"line {self.line} of the cell, `while {self.test}:`"

    @property
    def instead(self) -> str:
        """Return what to write in the place of the loop."""
        if self.client is not None:
            return "`wait_for_service(timeout_sec=5.0)` (of an action, `wait_for_server`) returns False after 5 s."
        until = self.test.removeprefix("not ") if self.test.startswith("not ") else f"not ({self.test})"
        return f"`ros.until(lambda: {until})` waits for 5 s at most, and says why nothing has come if it knows."


def cell_loop(thread: int) -> CellLoop | None:
    """Return the loop in which the cell that this thread runs is, if it only waits there; else None."""
    frame: FrameType | None = sys._current_frames().get(thread)
    while frame is not None and not is_cell(frame.f_code.co_filename):
        frame = frame.f_back
    if frame is None:
        return None
    tree = parse("".join(linecache.getlines(frame.f_code.co_filename)))
    loops = [node for node in walk(tree) if isinstance(node, ast.While) and not node.orelse]
    around = [node for node in loops if covers(node, frame.f_lineno)]
    for loop in around[-1:]:
        if (
            not isinstance(loop.test, ast.Constant)
            and all(map(_only_waits, loop.body))
            and not CLOCK.search(ast.unparse(loop.test))
        ):
            return CellLoop(loop.lineno, ast.unparse(loop.test), _client(loop.test, frame))
    return None


def server_waited_for(thread: int) -> str:
    """Return the file for whose end the cell of this thread waits, `!python3 server.py`, if it is that of a server."""
    frame: FrameType | None = sys._current_frames().get(thread)
    while frame is not None and not is_cell(frame.f_code.co_filename):
        frame = frame.f_back
    line = linecache.getline(frame.f_code.co_filename, frame.f_lineno) if frame else ""
    found = RUN.search(line)
    return found[1] if found and serves(text_at(Path(found[1]))) else ""


def _only_waits(statement: ast.stmt) -> bool:
    if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Call):
        return name_of(statement.value.func) in IDLE
    of_no_effect = isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)
    return of_no_effect or isinstance(statement, (ast.Pass, ast.Continue))


def _client(test: ast.expr, frame: FrameType) -> Client | ActionClient | None:
    """Return the client that a condition asks whether its server is there, if a variable has it."""
    for node in walk(test):
        if isinstance(node, ast.Attribute) and node.attr in ASKS and isinstance(node.value, ast.Name):
            client = frame.f_locals.get(node.value.id, frame.f_globals.get(node.value.id))
            if isinstance(client, (Client, ActionClient)):
                return client
    return None
