"""The submissions that an instructor should look at first, grouped by reason."""

from collections.abc import Iterable
from dataclasses import dataclass, field

from autograder.errors import UsageError
from autograder.records import (
    CRASHED,
    INFRASTRUCTURE_ERROR,
    INVALID_SUBMISSION,
    KILLED_JUDGE,
    STUB_OF,
    TIME_UNKNOWN,
    Report,
)
from autograder.submissions import exercises

NEAR = 0.8  # of an exercise's time limit
ALIKE = "more alike than others (`autograder similar` shows them)"
REPLACED = "handed in again since this result (`autograder regrade` grades the new files)"
UNGRADED = "handed in, but not graded yet (`autograder grade` with --resume grades the rest)"
HOUR, DAY = 3600, 86_400  # s
FLAGS = {  # other flags are shown by name
    TIME_UNKNOWN: "time of handing in unknown, nothing deducted",
    KILLED_JUDGE: "killed judge: the judging process crashed, perhaps from a program's messages; check the source",
}


@dataclass(frozen=True)
class Known:
    """Facts that are not in the results, as far as they are known."""

    late: dict[tuple[str, str], float] = field(default_factory=dict)  # seconds, by student and exercise
    missing: dict[str, list[str]] = field(default_factory=dict)  # students of the roster, by exercise
    alike: dict[str, list[str]] = field(
        default_factory=dict
    )  # a line for a group of submissions; its pairs, if several
    ungraded: list[tuple[str, str]] = field(default_factory=list)  # handed in, and not in the results
    replaced: list[tuple[str, str]] = field(default_factory=list)  # students and exercises, see `Basis.is_replaced`


@dataclass(frozen=True)
class Look:
    """One reason to look, and the submissions that it is about."""

    why: str
    who: list[str]
    details: dict[str, list[str]] = field(default_factory=dict)  # further lines of some of them, which fold


def looks(reports: Iterable[Report], known: Known | None = None) -> list[Look]:
    """The reasons to look at submissions, the gravest first."""
    known = known or Known()
    found: dict[str, list[str]] = {}

    def note(why: str, who: str) -> None:
        found.setdefault(why, []).append(who)

    reports = list(reports)
    for report in reports:
        name = f"{report.student}/{report.assignment}"
        if report.status == INFRASTRUCTURE_ERROR:
            note("no score, because the grader failed; --resume grades it again", name)
    for report in reports:
        name = f"{report.student}/{report.assignment}"
        if report.status == INVALID_SUBMISSION:
            note("refused, nothing was run", name + "".join(f" ({test.message})" for test in report.tests[:1]))
    for report in reports:
        name = f"{report.student}/{report.assignment}"
        if crashed := sum(test.outcome == CRASHED for test in report.tests):
            note("programs crashed", f"{name} (in {crashed} of {len(report.tests)} tests)")
    for report in reports:
        if stubs := [flag.removeprefix(STUB_OF) for flag in report.flags if flag.startswith(STUB_OF)]:
            note(
                "a file was not handed in, and the notebook's unsolved cell was graded instead",
                f"{report.student}/{report.assignment} ({', '.join(stubs)})",
            )
    for report in reports:
        for flag in report.flags:
            if flag.startswith(STUB_OF):
                continue
            note(f"flagged: {FLAGS.get(flag, flag.replace('_', ' '))}", f"{report.student}/{report.assignment}")
    for report in reports:
        if (limit := _limit(report.assignment)) and report.duration_s > NEAR * limit:
            note(
                "near the time limit, or beyond it with a second try",
                f"{report.student}/{report.assignment} ({report.duration_s:.0f} s of {limit:.0f} s)",
            )
    for (student, assignment), seconds in sorted(known.late.items()):
        note("handed in late", f"{student}/{assignment} ({_long(seconds)})")
    for student, assignment in sorted(known.replaced):
        note(REPLACED, f"{student}/{assignment}")
    for student, assignment in sorted(known.ungraded):
        note(UNGRADED, f"{student}/{assignment}")
    for assignment, absent in sorted(known.missing.items()):
        for student in absent:
            note(f"{assignment} not handed in", student)
    for group in known.alike:
        note(ALIKE, group)
    return [Look(why, who, known.alike if why == ALIKE else {}) for why, who in found.items()]


def _limit(assignment: str) -> float:
    try:
        return exercises.load(assignment).time_limit
    except UsageError:  # the exercise no longer exists
        return 0.0


def _long(seconds: float) -> str:
    if seconds >= DAY:
        return f"{seconds / DAY:.1f} days"
    return f"{seconds / HOUR:.1f} h" if seconds >= HOUR else f"{max(1, seconds / 60):.0f} min"
