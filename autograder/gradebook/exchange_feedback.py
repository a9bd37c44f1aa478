"""Releasing feedback through nbgrader's exchange, where not every hand-in has come from."""

import contextlib
import glob
import os
from pathlib import Path

from nbgrader.exchange.default.release_feedback import ExchangeReleaseFeedback
from nbgrader.utils import notebook_hash

from autograder.gradebook.exchange_collect import SECRETS, TIMESTAMP, shown
from course.foundation import storage


class ReleaseFeedback(ExchangeReleaseFeedback):
    """Releases the pages of hand-ins that came through the exchange, and names the others.

    A student finds a page in the exchange by the secret that was handed in with it.  What `autograder collect` has laid
    out has no secret, and perhaps no known time: nbgrader's own class would stop there, and release no later page.
    """

    def copy_files(self) -> None:
        """Release each student's pages; one that cannot be released is named, and the next ones are released.

        Ends with nbgrader's ExchangeError if a page could not be written, as on a full disk.
        """
        pattern: str = self.src_path  # type: ignore[has-type]
        failed: dict[str, str] = {}  # why, by the folder of the page
        for folder in sorted(glob.glob(pattern)):
            named = shown(os.path.relpath(folder, self.coursedir.root))
            missing = [name for name in (SECRETS, TIMESTAMP) if not os.path.isfile(os.path.join(folder, name))]
            if missing and glob.glob(os.path.join(glob.escape(folder), "*.html")):
                self.log.warning(
                    "%s was not released, because the hand-in did not come through the exchange (without %s): give the "
                    "page in it to the student yourself, or with `autograder return`",
                    named,
                    " and ".join(missing),
                )
                continue
            self.src_path = glob.escape(folder)
            try:
                super().copy_files()
            except OSError as error:
                self._remove_parts(Path(folder))
                failed[named] = storage.why(error)
        self.src_path = pattern
        if failed:
            self.fail(
                f"not released: {', '.join(failed)} ({' and '.join(sorted(set(failed.values())))}); a page that was "
                f"released from there before is unchanged. Correct that in {self.dest_path}, and release again"
            )

    def _remove_parts(self, folder: Path) -> None:
        """Remove what was written of pages that are not released: it takes room on a full disk."""
        with contextlib.suppress(OSError):
            secret = (folder / SECRETS).read_text()
            for page in folder.glob("*.html"):
                Path(self.dest_path, f"{notebook_hash(secret=secret, notebook_id=page.stem)}-tmp.html").unlink(True)
