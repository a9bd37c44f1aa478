"""Reports as text for a terminal."""

from collections.abc import Mapping

from autograder.records import FAULT, GRADED, PASSED, Report, Result
from course.foundation.untrusted import one_line, printable

MESSAGE, DETAIL, PRINTED = "         ", "         > ", "  | "  # before each line of such a text

__all__ = [
    "counted",
    "describe",
    "line",
    "one_line",
    "printable",
    "quoted",
    "result",
    "score",
]  # a student's names may contain anything


def counted(number: int, what: str) -> str:
    """Return a number with its noun, in the plural unless it is 1."""
    return f"{number} {what}{'' if number == 1 else 's'}"


def line(report: Report) -> str:
    """Return a report in one line: student, exercise, and the score with the grading time, or the status."""
    name = one_line(f"{report.student}/{report.assignment}")
    if report.status != GRADED:
        return f"{name}: {report.status}"
    return f"{name}: {report.score:g} of {report.max_score:g}, {report.duration_s:.1f} s"


def score(report: Report) -> str:
    """The score out of the maximum, or the status when there is no score."""
    return report.status if report.score is None else f"{report.score:g} of {report.max_score:g}"


def quoted(text: str, mark: str) -> str:
    """Return a text with `mark` before each line, so that no line of a program's can look like one of a report's."""
    return "\n".join(mark + said for said in text.split("\n"))


def result(test: Result) -> str:
    """Return the outcome of one test, indented, with its message below it."""
    passed = test.outcome == PASSED
    outcome = "" if passed else f" [{test.outcome.replace('_', ' ')}]"
    head = f"  {'+' if passed else '-'} {test.points:g}/{test.max_points:g}  {test.title}{outcome}"
    return f"{head}\n{quoted(test.message, MESSAGE)}" if test.message else head


def describe(report: Report, details: Mapping[str, str] | None = None, all_tests: bool = True) -> str:
    """Return a report: its line, and below it each test, or only those not passed.

    `details`, by test, are for instructors only.
    """
    details = details or {}
    flags = f", {', '.join(report.flags)}" if report.flags else ""
    lines = [f"{line(report)} (seed {report.seed}{flags})"]
    if report.status == GRADED:
        for test in report.tests:
            if test.outcome == PASSED and not all_tests:
                continue
            lines.append(result(test))
            if detail := details.get(test.id):
                lines.append(quoted(detail, DETAIL))
    else:
        lines.append(quoted(report.tests[0].message, "  "))
    if fault := details.get(FAULT):
        lines.append(quoted(fault, DETAIL))
    return "\n".join(lines)
