"""A summary of a class's results: scores, each hidden test, and the submissions that an instructor should look at."""

import os
import statistics
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from autograder.records import CRASHED, FAILED, GRADED, INVALID_SUBMISSION, OUTCOMES, PASSED, TIMED_OUT, Report, Result
from autograder.results import pages
from autograder.results.looks import Known, looks
from autograder.results.text import counted, one_line
from autograder.submissions import exercises
from course.foundation import storage

NEARLY = 0.9  # share that passed: a test above it is not listed first
ODD = -0.2  # a correlation below this is unlikely to be chance
BARS = 10  # of the histogram of scores


@dataclass(frozen=True)
class Item:
    """One hidden test over all graded submissions of its exercise."""

    id: str
    title: str
    outcomes: dict[str, int]  # submissions by outcome
    discrimination: float | None  # correlation of passing with the rest of the score; None if either is constant

    @property
    def tried(self) -> int:
        """Return the number of submissions that the test judged."""
        return sum(self.outcomes.values())

    @property
    def passed(self) -> float:
        """The share that passed, 0 to 1."""
        return self.outcomes[PASSED] / self.tried

    @property
    def tells(self) -> bool:
        """Return True if the test divides the class, or something may be wrong with it."""
        return self.passed <= NEARLY or (self.passed < 1 and bool(self.remark))

    @property
    def remark(self) -> str:
        """Return a question about the test for the instructor, or ""."""
        if self.passed in (0, 1):
            return "everybody passed" if self.passed else "nobody passed: is the task clear, is the test right?"
        if self.discrimination is not None and self.discrimination < ODD:
            return "passed mostly by weaker submissions: is the test right?"
        return ""


@dataclass(frozen=True)
class Class:
    """The results of one exercise; scores, seconds and items cover only the submissions that were graded."""

    assignment: str
    statuses: dict[str, int]  # submissions by status
    max_score: float
    scores: list[float]
    seconds: list[float]  # the duration of each grading
    items: list[Item]
    by_hand: float = 0.0  # points of questions marked by hand, which are not in the scores

    @property
    def telling(self) -> list[Item]:
        """Return the tests to look at, those with the fewest passes first."""
        return sorted((item for item in self.items if item.tells), key=lambda item: item.passed)

    @property
    def rest(self) -> list[Item]:
        """The tests that nearly everybody passed."""
        return [item for item in self.items if not item.tells]

    @property
    def histogram(self) -> list[int]:
        """Submissions by score: BARS bins of equal width from 0 to the maximum, which counts in the last bin."""
        bars = [0] * BARS
        for score in self.scores:
            bars[min(BARS - 1, int(BARS * score / self.max_score))] += 1
        return bars

    @property
    def quartiles(self) -> list[float]:
        """The three quartiles of the scores; three times the same when there is only one score."""
        return statistics.quantiles(self.scores, method="inclusive") if len(self.scores) > 1 else self.scores * 3


def classes(reports: Iterable[Report]) -> list[Class]:
    """The results of each exercise, in alphabetical order."""
    by_name: dict[str, list[Report]] = {}
    for report in reports:
        by_name.setdefault(report.assignment, []).append(report)
    return [_class(name, group) for name, group in sorted(by_name.items())]


def show(reports: list[Report], console: Console | None = None, known: Known | None = None) -> None:
    """Print the summary of a batch: what needs a look, and then each exercise with the tests that divide the class."""
    console = console or Console()
    console = Console(width=max(100, console.width)) if not console.is_terminal else console
    if found := looks(reports, known):
        console.print("\n[bold]Needs a look[/bold]")
        for look in found:
            who = one_line("; ".join(look.who))
            console.print(f" {escape(look.why)}: {escape(who)}", highlight=False, soft_wrap=True)
    for one in classes(reports):
        statuses = ", ".join(f"{count} {status.replace('_', ' ')}" for status, count in one.statuses.items())
        refused = " (refused: 0 points, and not included below)" if INVALID_SUBMISSION in one.statuses else ""
        console.print(f"\n[bold]{one.assignment}[/bold]: {statuses}{refused}", highlight=False)
        if not one.scores:
            continue
        low, middle, high = one.quartiles
        console.print(
            f"score of {one.max_score:g}: median {middle:g}, quartiles {low:g} and {high:g}, "
            f"mean {statistics.fmean(one.scores):.1f}; {statistics.median(one.seconds):.1f} s a grading",
            highlight=False,
        )
        if one.by_hand:
            console.print(f"and {one.by_hand:g} points for answers that are marked by hand", highlight=False)
        if not one.telling:
            console.print("Nearly everybody passed each of the hidden tests.")
            continue
        table = Table("hidden test", "passed", "failed", "crashed", "timed out", "", box=None, pad_edge=False)
        for item in one.telling:
            table.add_row(
                item.title,
                f"{item.passed:.0%}",
                *(str(item.outcomes[outcome] or "") for outcome in (FAILED, CRASHED, TIMED_OUT)),
                item.remark,
            )
        console.print(table)
        if one.rest:
            console.print(f"{counted(len(one.rest), 'more hidden test')} passed by nearly everybody.", highlight=False)


def students(reports: Iterable[Report]) -> dict[str, dict[str, Report]]:
    """The report on each assignment of each student, in alphabetical order."""
    found: dict[str, dict[str, Report]] = {}
    for report in sorted(reports, key=lambda report: (report.student, report.assignment)):
        found.setdefault(report.student, {})[report.assignment] = report
    return found


def page(reports: list[Report], feedback: str = "feedback", known: Known | None = None) -> str:
    """The summary as an HTML page with plots; everything in it is escaped.

    `feedback` is the relative path from the page to the folder of the students' pages.
    """

    def link(report: Report) -> str:
        return quote(f"{feedback}/{report.student}/{report.assignment}.html", errors="surrogateescape")

    return pages.render(
        "report.html",
        classes=classes(reports),
        looks=looks(reports, known),
        students=students(reports),
        link=link,
        bars=BARS,
        counted=counted,
        fmean=statistics.fmean,
        median=statistics.median,
    )


def write(reports: list[Report], target: Path, out: Path, known: Known | None = None) -> None:
    """Write the page on the results in the output folder `out`, readable by the instructor only."""
    way = os.path.relpath(out / "feedback", target.parent)
    storage.write(target, page(reports, way, known).encode(errors="replace"), storage.PRIVATE)


def _class(name: str, reports: list[Report]) -> Class:
    graded = [report for report in reports if report.status == GRADED]
    tests: dict[str, list[tuple[Report, Result]]] = {}
    for report in graded:
        for result in report.tests:
            tests.setdefault(result.id, []).append((report, result))
    return Class(
        name,
        Counter(report.status for report in reports),
        max(report.max_score for report in reports),
        [report.score for report in graded if report.score is not None],
        [report.duration_s for report in graded],
        [_item(found) for found in tests.values()],
        exercises.points_by_hand(name),
    )


def _item(found: list[tuple[Report, Result]]) -> Item:
    counts = Counter(result.outcome for _, result in found)
    passed = [float(result.outcome == PASSED) for _, result in found]
    rest = [(report.score or 0.0) - result.points for report, result in found]
    varied = len({*passed}) > 1 and len({*rest}) > 1
    _, first = found[0]
    return Item(
        first.id,
        first.title,
        {outcome: counts[outcome] for outcome in OUTCOMES},
        statistics.correlation(passed, rest) if varied else None,
    )
