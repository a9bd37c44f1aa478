"""The findings as text for a terminal, and as a page with the texts of each pair side by side."""

from collections.abc import Iterable
from pathlib import Path

from autograder.results import pages
from autograder.similarity.comparing import Finding
from course.foundation import storage
from course.foundation.untrusted import one_line

STRIKING = 60  # score of a pair; independent right answers stay below 30


def describe(finding: Finding) -> str:
    """The pairs for a person at a terminal."""
    head = f"{finding.assignment}: {finding.programs} submissions, {len(finding.scores)} pairs"
    if finding.scores:
        head += f"; half of them score at most {finding.below(50):.0f}, 95 of 100 at most {finding.below(95):.0f}"
    lines = [head]  # a student's name may contain anything
    for pair in finding.pairs:
        same = f", the same to the letter: {', '.join(pair.identical)}" if pair.identical else ""
        lines.append(one_line(f"{pair.score:4.0f}  {pair.left} and {pair.right} ({pair.shared:.0f} % in common{same})"))
    if finding.left_out:
        left_out = ", ".join(finding.left_out)
        lines.append(
            one_line(f"      not compared, because no program could be read, or it is far too long: {left_out}")
        )
    return "\n".join(lines)


def striking(finding: Finding) -> list[str]:
    """Return the pairs that are reported unasked: identical files, and scores far above the rest."""
    return [
        f"{finding.assignment}: {pair.left} and {pair.right}"
        + (f" (the same to the letter: {', '.join(pair.identical)})" if pair.identical else f" ({pair.score:.0f})")
        for pair in finding.pairs
        if pair.identical or pair.score >= STRIKING
    ]


def page(findings: Iterable[Finding]) -> str:
    """The pairs side by side, as an HTML page that stands alone.  Everything in it is escaped."""
    return pages.render("similar.html", findings=list(findings), number=lambda value: f"{value:.0f}")


def write(findings: Iterable[Finding], target: Path) -> None:
    """Write the page, readable by the instructor only."""
    storage.replace(target, page(findings).encode(errors="replace"), storage.PRIVATE)
