"""The content of a feedback page, as data embedded in the page.

The grader writes it, and students' machines read it.  A page may come from anywhere, so the data is checked, cut to a
sane length, and consists only of text and numbers.
"""

import json
import math
import re
from dataclasses import asdict, dataclass, field
from html import unescape
from typing import Any

from course.errors import FeedbackError

META = "course-feedback"  # the name of the page's <meta> element that holds it
RECORD = re.compile(rf'<meta name="{META}" content="([^"]*)"')  # a crafted page could keep a parser busy
FORMAT = 1
LONGEST = 5000  # characters of a text
MOST = 500  # tests, or marks
PASSED = "passed"


@dataclass(frozen=True)
class Test:
    """The public part of a hidden test's result."""

    __test__ = False  # tells pytest that this is not a test class
    title: str
    outcome: str  # passed, failed, crashed, timed_out or not_run
    points: float
    max_points: float
    message: str = ""  # what to correct
    cell: str = ""  # the notebook's cell that the points belong to


@dataclass(frozen=True)
class Mark:
    """The instructor's comment on a cell."""

    cell: str
    points: float | None  # None: only a comment, or still to be marked
    max_points: float  # 0 for a cell that only takes points off
    comment: str = ""
    waiting: bool = False  # still to be marked


@dataclass(frozen=True)
class Feedback:
    """The feedback on one submission."""

    student: str
    assignment: str
    title: str
    status: str  # graded, invalid_submission or infrastructure_error
    points: float
    max_points: float
    tests: list[Test] = field(default_factory=list)
    marks: list[Mark] = field(default_factory=list)

    @property
    def causes(self) -> dict[str, list[Test]]:
        """Return each message about a mistake once, with the tests that failed for it."""
        found: dict[str, list[Test]] = {}
        for test in self.tests:
            if test.message:
                found.setdefault(test.message, []).append(test)
        return found

    @property
    def waiting(self) -> bool:
        """Return True if a cell is still to be marked by hand."""
        return any(mark.waiting for mark in self.marks)

    @property
    def cells(self) -> dict[str, tuple[float, float]]:
        """Return the points of each cell and their maximum; a cell marked by hand counts with its mark."""
        found: dict[str, tuple[float, float]] = {}
        for test in self.tests:
            points, most = found.get(test.cell, (0.0, 0.0))
            found[test.cell] = (points + test.points, most + test.max_points)
        marked = {mark.cell: (mark.points, mark.max_points) for mark in self.marks if mark.points is not None}
        return found | {cell: (points or 0.0, most) for cell, (points, most) in marked.items()}

    def to_text(self) -> str:
        """The record as JSON in one line."""
        return json.dumps({"format": FORMAT, **asdict(self)})

    @classmethod
    def from_text(cls, text: str) -> "Feedback":
        """The record that `to_text` wrote; raises FeedbackError for anything else."""
        try:
            said = json.loads(text)
            if said["format"] != FORMAT:
                raise FeedbackError("it was made by a newer version of the course: update yours")
            tests, marks = said["tests"][:MOST], said["marks"][:MOST]
            return cls(
                _text(said["student"]),
                _text(said["assignment"]),
                _text(said["title"]),
                _text(said["status"]),
                points=_number(said["points"]),
                max_points=_number(said["max_points"]),
                tests=[
                    Test(
                        _text(test["title"]),
                        _text(test["outcome"]),
                        _number(test["points"]),
                        _number(test["max_points"]),
                        _text(test["message"]),
                        _text(test["cell"]),
                    )
                    for test in tests
                ],
                marks=[
                    Mark(
                        _text(mark["cell"]),
                        None if mark["points"] is None else _number(mark["points"]),
                        _number(mark["max_points"]),
                        _text(mark["comment"]),
                        mark["waiting"] is True,
                    )
                    for mark in marks
                ],
            )
        except (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError):
            raise FeedbackError("it is not a feedback page from this course, or it is damaged") from None


def read(page: bytes) -> Feedback:
    """Return the record in a page; raises FeedbackError.  Reads nothing else of the page, and runs nothing."""
    found = RECORD.search(page.decode(errors="replace"))
    if not found:
        raise FeedbackError("it is not a feedback page from this course, or it is too old: open it in a browser")
    return Feedback.from_text(unescape(found[1]))


def _text(value: Any) -> str:
    """Return a text without control characters, which could move a cursor; raises TypeError for other types."""
    if not isinstance(value, str):
        raise TypeError
    return "".join(c if c == "\n" or c.isprintable() else " " for c in value[:LONGEST])


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value) or abs(value) > 1e6:
        raise TypeError
    return float(value)
