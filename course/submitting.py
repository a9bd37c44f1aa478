"""Submitting to nbgrader's exchange, whole or not at all: environment/install sets it for `nbgrader submit`."""

import shutil
from pathlib import Path
from secrets import token_hex

from nbgrader.exchange.default.submit import ExchangeSubmit

from course.foundation import storage

FILES, FOLDERS = 0o644, 0o755  # modes in the exchange, as nbgrader sets them
TOP = 0o777  # an instructor can remove the folder; nobody else knows its name


class WholeSubmit(ExchangeSubmit):
    """Submits an exercise so that it is whole in the exchange and in the student's own copy, or in neither of them.

    The exchange has the hand-in, and the student's copy the secret that finds its feedback.  On a full disk nbgrader's
    own class fails between the two: what it reports as failed is collected, and its feedback never reaches the student.
    """

    def copy_files(self) -> None:
        """Write the student's copy, then the exchange's; ends with nbgrader's ExchangeError if either fails."""
        self.init_release()
        name: str = self.assignment_filename
        handed_in = Path(self.inbound_path, name)
        own = Path(self.cache_path, name.rpartition("+")[0] if self.add_random_string else name)
        self.log.info("Source: %s", self.src_path)
        self.log.info("Destination: %s", handed_in)
        self.check_filename_diff()
        secret = token_hex(64)
        self._write(own, secret)
        try:
            self._write(handed_in, secret, shared=True)
        except BaseException:
            if not handed_in.exists():
                shutil.rmtree(own, ignore_errors=True)
            raise
        submitted = f"{self.coursedir.course_id} {self.coursedir.assignment_id} {self.timestamp}"
        self.log.info("Submitted as: %s", submitted)

    def _write(self, target: Path, secret: str, shared: bool = False) -> None:
        try:
            with storage.folder(target) as draft:
                draft.rmdir()  # nbgrader makes it
                self.do_copy(self.src_path, str(draft))
                for file, text in (("timestamp.txt", self.timestamp), ("submission_secret.txt", secret)):
                    (draft / file).write_text(text)
                if shared:
                    self.set_perms(str(draft), FILES, FOLDERS)
                    draft.chmod(TOP)
        except OSError as error:
            why = storage.why(error)
            self.fail(f"nothing was handed in, because it could not be copied to {target.parent}: {why}")
