"""Releasing an exercise into nbgrader's exchange, where whatever bears its name is taken for released."""

from pathlib import Path

from nbgrader.exchange.default.release_assignment import ExchangeReleaseAssignment

from autograder.gradebook.exchange_collect import shown
from course.foundation import storage


class WholeRelease(ExchangeReleaseAssignment):
    """Releases an exercise whole or not at all.

    nbgrader's own class leaves a part of it on a full disk, which it takes for a released exercise afterwards.
    """

    def do_copy(self, src: str, dest: str, log: object = None) -> None:
        """Copy the folder; ends with nbgrader's ExchangeError, and one line, when it cannot be written."""
        try:
            with storage.folder(Path(dest)) as draft:
                draft.rmdir()  # nbgrader makes it
                super().do_copy(src, str(draft))
        except OSError as error:
            self.fail(f"{shown(dest)} could not be written, so nothing is released: {storage.why(error)}")
