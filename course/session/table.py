"""The nodes of a session as a table: running and ended ones, since when, where, and why they ended."""

import html
import time
from collections.abc import Callable
from dataclasses import dataclass

from course.foundation.untrusted import one_line


@dataclass(frozen=True)
class Row:
    """A node started by the session, or a node of the domain started by others."""

    name: str
    state: str  # running, stopped, or how it ended
    since: float | None  # time.time() of its start, if known
    where: str
    started_as: str = ""  # its name for `stop` and `restart`: the node's, or the file's; '' if started by others
    alive: bool = True
    reports: tuple[str, ...] = ()  # reports on its exceptions and its end, with the reader's own lines
    process: tuple[int, int] | None = None  # id and birth of a process started by others that may be stopped here
    over: float | None = None  # time.time() of its end, if it has ended and that is known
    pid: int = 0  # the id of its process, 0 if unknown

    def texts(self) -> tuple[str, str, str, str]:
        """Return the texts of the row."""
        since = " to ".join(time.strftime("%H:%M:%S", time.localtime(at)) for at in (self.since, self.over) if at)
        return one_line(self.name), one_line(self.state), since, one_line(self.where)


HEAD = ("node", "state", "since", "where")


class Nodes(list[str]):
    """The sorted full names of the running nodes; a notebook shows a table of all started nodes."""

    def __init__(self, names: list[str], rows: list[Row], shown: Callable[[], None] = lambda: None):
        """Keep names and rows; `shown` is called when the table is shown."""
        super().__init__(names)
        self.rows = rows
        self._shown = shown

    def __str__(self) -> str:
        return list.__repr__(self)

    def __repr__(self) -> str:
        self._shown()
        if not self.rows:
            return "no nodes"
        lines = [HEAD, *(row.texts() for row in self.rows)]
        widths = [max(len(line[column]) for line in lines) for column in range(len(HEAD))]
        padded = ("  ".join(text.ljust(width) for text, width in zip(line, widths, strict=True)) for line in lines)
        return "\n".join(line.rstrip() for line in padded)

    def _repr_html_(self) -> str:
        def cells(texts: tuple[str, ...], tag: str) -> str:
            return "".join(f'<{tag} style="text-align:left">{html.escape(text)}</{tag}>' for text in texts)

        if not self.rows:
            return "<p>no nodes</p>"
        body = "\n".join(f"<tr>{cells(row.texts(), 'td')}</tr>" for row in self.rows)
        return f"<table><thead><tr>{cells(HEAD, 'th')}</tr></thead>\n<tbody>{body}</tbody></table>"
