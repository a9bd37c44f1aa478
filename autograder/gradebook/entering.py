"""Entering grading results into a course: the scores in its gradebook, and the files that Formgrader shows."""

from pathlib import Path
from types import TracebackType
from typing import Self

from autograder.gradebook import address, late
from autograder.gradebook.book import Scores, default_url
from autograder.records import INFRASTRUCTURE_ERROR, Report
from autograder.submissions.roster import Roster


class Entering:
    """An open gradebook; if it is that of the submissions' course, also the folder `autograded` beside it.

    See `book.Scores` for `unanswered_is_zero`.
    """

    def __init__(
        self,
        url: str | None,
        submitted: Path,
        out: Path,
        roster: Roster | None = None,
        unanswered_is_zero: bool = False,
    ):
        own = default_url(submitted, out)
        self._url, self._submitted = url or own, submitted
        same = address.parsed(self._url) == address.parsed(own)
        self._config = late.course_config(submitted) if same else None
        self._scores = Scores(self._url, submitted, unanswered_is_zero)
        if roster:
            self._scores.enrol(roster)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._scores.__exit__(kind, error, trace)

    @property
    def unanswered(self) -> dict[str, list[str]]:
        """Return, by exercise, the students whose questions wait for a mark although there is no notebook."""
        return self._scores.unanswered

    @property
    def rewritten(self) -> dict[str, list[str]]:
        """Return, by exercise, the students whose answers have changed since they were marked."""
        return self._scores.rewritten

    @property
    def withdrawn(self) -> dict[str, list[str]]:
        """Return, by exercise, the students who have points by hand for answers that are no longer handed in."""
        return self._scores.withdrawn

    def write(self, report: Report) -> None:
        """Enter a report; a report of an infrastructure error changes nothing."""
        if report.status == INFRASTRUCTURE_ERROR:
            return
        self._scores.write(report)
        if self._config is not None:
            from autograder.gradebook import autograded  # loads nbconvert, which takes long

            autograded.lay_out(self._config, self._url, self._submitted, report)
