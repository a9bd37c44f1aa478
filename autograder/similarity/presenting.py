"""The findings as text for a terminal, and as a page with the texts of each pair side by side."""

from collections.abc import Iterable
from pathlib import Path

from autograder.results import pages
from autograder.results.text import counted
from autograder.similarity.comparing import LONGEST, STRIKING, Finding, Group, Pair
from course.foundation import storage
from course.foundation.untrusted import one_line

HIDDEN = "cannot be compared, because these files have no class and do not use rclpy: look at what they execute"
TOO_LONG = f"not compared, because these files have more than {LONGEST:,} characters without comments: look at them"
REPLACED = "handed in again since the grading; compared is the new hand-in: `autograder regrade` grades it, too"
DOUBTFUL = "compared, but these files may run other code, or are mainly literals: look at what that is"


def describe(finding: Finding) -> str:
    """The pairs for a person at a terminal."""
    head = f"{finding.assignment}: {counted(finding.programs, 'submission')}, {counted(len(finding.scores), 'pair')}"
    if finding.scores:
        head += f"; half of them score at most {finding.below(50):.0f}, 95 of 100 at most {finding.below(95):.0f}"
    lines = [head]  # a student's name may contain anything
    for pair in finding.pairs:
        same = f", the same to the letter: {', '.join(pair.identical)}" if pair.identical else ""
        lines.append(one_line(f"{pair.score:4.0f}  {pair.left} and {pair.right} ({pair.shared:.0f} % in common{same})"))
    for why, who in reasons(finding):
        lines.append(one_line(f"      {why}: {', '.join(who)}"))
    if finding.left_out:
        left_out = ", ".join(finding.left_out)
        lines.append(
            one_line(f"      not compared, because no program could be read, or it is far too long: {left_out}")
        )
    return "\n".join(lines)


def reasons(finding: Finding) -> list[tuple[str, list[str]]]:
    """Return why somebody should look at a submission, whatever it is like, and who it is about."""
    found = [
        (REPLACED, finding.replaced),
        (HIDDEN, finding.hidden),
        (TOO_LONG, finding.too_long),
        (DOUBTFUL, finding.doubtful),
    ]
    return [(why, who) for why, who in found if who]


def striking(finding: Finding, most: int) -> dict[str, list[str]]:
    """Return the groups that are reported unasked, at most `most`, a line each; with it the group's pairs, a line each.

    The pairs are those that the finding shows; two students alone have no further lines.
    """
    found = {}
    for group in finding.groups[:most]:
        *names, last = group.students
        line = f"{finding.assignment}: {', '.join(names)} and {last} ({_why(group)})"
        inside = [pair for pair in finding.pairs if {pair.left, pair.right} <= {*group.students}]
        found[line] = [f"{pair.left} and {pair.right} ({_like(pair)})" for pair in inside] if len(names) > 1 else []
    if (more := len(finding.groups) - most) > 0:
        found[f"{finding.assignment}: and {counted(more, 'more group')}"] = []
    return found


def _why(group: Group) -> str:
    """Return what a group's students have in common."""
    reasons = [f"the same to the letter: {', '.join(group.identical)}"] if group.identical else []
    reasons += [f"the same to the letter for some: {', '.join(group.partly)}"] if group.partly else []
    if len(group.students) == 2:
        return "; ".join(reasons) or f"{group.highest:.0f}"
    return "; ".join([counted(group.pairs, "pair"), *(reasons or [f"up to {group.highest:.0f}"])])


def _like(pair: Pair) -> str:
    """Return what the two students of a pair have in common."""
    if pair.identical:
        return f"the same to the letter: {', '.join(pair.identical)}"
    return f"{pair.score:.0f}" if pair.score >= STRIKING else f"{pair.score:.0f}, {pair.shared:.0f} % in common"


def page(findings: Iterable[Finding]) -> str:
    """The pairs side by side, as an HTML page that stands alone.  Everything in it is escaped."""
    return pages.render("similar.html", findings=list(findings), reasons=reasons, number=lambda value: f"{value:.0f}")


def write(findings: Iterable[Finding], target: Path) -> None:
    """Write the page, readable by the instructor only."""
    storage.write(target, page(findings).encode(errors="replace"), storage.PRIVATE)
