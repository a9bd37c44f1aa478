"""The progress of a batch: a bar in a terminal, elsewhere a line for each graded submission."""

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
from autograder.results.text import line, printable


@contextlib.contextmanager
def shown(total: int) -> Iterator[Callable[[Report], None]]:
    """Show how many of `total` submissions are graded; yields a function to call with each report."""
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
