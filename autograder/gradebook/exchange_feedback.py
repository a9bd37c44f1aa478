"""Releasing feedback through nbgrader's exchange, where not every hand-in has come from."""

import glob
import os

from nbgrader.exchange.default.release_feedback import ExchangeReleaseFeedback

from autograder.gradebook.exchange_collect import SECRETS, TIMESTAMP, shown


class ReleaseFeedback(ExchangeReleaseFeedback):
    """Releases the pages of hand-ins that came through the exchange, and names the others.

    A student finds a page in the exchange by the secret that was handed in with it.  What `autograder collect` has laid
    out has no secret, and perhaps no known time: nbgrader's own class would stop there, and release no later page.
    """

    def copy_files(self) -> None:
        """Release each student's pages; one that cannot be released is named, and the next ones are released."""
        pattern: str = self.src_path  # type: ignore[has-type]
        for folder in sorted(glob.glob(pattern)):
            missing = [name for name in (SECRETS, TIMESTAMP) if not os.path.isfile(os.path.join(folder, name))]
            if missing and glob.glob(os.path.join(glob.escape(folder), "*.html")):
                self.log.warning(
                    "%s was not released, because the hand-in did not come through the exchange (without %s): give the "
                    "page in it to the student yourself, or with `autograder return`",
                    shown(os.path.relpath(folder, self.coursedir.root)),
                    " and ".join(missing),
                )
                continue
            self.src_path = glob.escape(folder)
            super().copy_files()
        self.src_path = pattern
