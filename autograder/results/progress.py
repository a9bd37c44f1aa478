"""What is seen of a batch while it runs: a bar in a terminal, a line for each submission elsewhere."""

import contextlib
import sys
from collections import Counter
from collections.abc import Callable, Iterator

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    SpinnerColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from autograder.records import GRADED, Report


def line(report: Report) -> str:
    """A report in a line."""
    if report.status != GRADED:
        return f"{report.student}/{report.assignment}: {report.status}"
    return f"{report.student}/{report.assignment}: {report.score:g} of {report.max_score:g}, {report.duration_s:.1f} s"


def printable(text: str) -> str:
    """Without what would command the terminal: names and messages are a student's."""
    return "".join(c if c == "\n" or c.isprintable() else f"\\x{ord(c):02x}" for c in text)


@contextlib.contextmanager
def shown(total: int) -> Iterator[Callable[[Report], None]]:
    """Show how many of `total` submissions are graded; call what this gives with each report."""
    if not sys.stdout.isatty():
        yield _lines(total)
        return
    columns = (
        SpinnerColumn(),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        TextColumn("{task.fields[counts]}", markup=False),
    )
    with Progress(*columns, console=Console()) as progress:
        task = progress.add_task("", total=total, rate="", counts="")
        counts: Counter[str] = Counter()

        def advance(report: Report) -> None:
            counts[report.status] += 1
            if report.status != GRADED or report.flags:
                progress.console.print(printable(line(report)), markup=False, highlight=False)
            progress.advance(task)
            speed = progress.tasks[task].finished_speed or progress.tasks[task].speed
            progress.update(
                task,
                rate=f"{60 * speed:.0f} a minute" if speed else "",
                counts=", ".join(f"{count} {status.replace('_', ' ')}" for status, count in counts.items()),
            )

        yield advance


def _lines(total: int) -> Callable[[Report], None]:
    number = 0

    def advance(report: Report) -> None:
        nonlocal number
        number += 1
        print(printable(f"[{number}/{total}] {line(report)}"), flush=True)

    return advance
