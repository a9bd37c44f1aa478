"""`autograder export`: runs the exporters of this package without nbgrader's command line."""

import logging
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from nbgrader.api import Gradebook
from traitlets.config import Config

from autograder import platforms
from autograder.errors import CannotExport
from autograder.gradebook import late
from autograder.gradebook.book import Scores
from autograder.gradebook.canvas_export import CanvasExporter
from autograder.gradebook.csv_export import CsvExporter
from autograder.gradebook.exporter import Exporter
from autograder.gradebook.moodle_export import MoodleExporter
from autograder.submissions.roster import Roster

EXPORTERS: dict[str, Callable[..., Exporter]] = {
    platforms.CANVAS.form: CanvasExporter,
    platforms.MOODLE.form: MoodleExporter,
    platforms.TABLE: CsvExporter,
}
# The options of `autograder export` that messages name.
OPTIONS = {"automatic": "--automatic", "roster": "--from-canvas FILE"}


@dataclass(frozen=True)
class Wish:
    """The options of one export."""

    form: str  # a key of EXPORTERS
    to: Path
    automatic: bool = False  # the points of the tests, without waiting for manual marks
    missing_is_zero: bool = False
    canvas: Path | None = None  # the gradebook file that Canvas exports
    user: str | None = None  # the column that Moodle finds students by
    assignments: list[str] = field(default_factory=list)
    students: list[str] = field(default_factory=list)
    replaced: list[tuple[str, str]] = field(default_factory=list)  # what has other files now than were graded


def export(wish: Wish, url: str, submitted: Path | None, roster: Roster | None = None) -> None:
    """Write the file from the gradebook at `url`; prints what it contains and what is missing.  Raises CannotExport."""
    config = (late.course_config(submitted) if submitted else None) or Config()
    if submitted:  # where the roster is
        config.CourseDirectory.root = str(submitted.resolve().parent)
        config.CourseDirectory.submitted_directory = submitted.resolve().name
    if roster:
        with Scores(url) as scores:
            scores.enrol(roster)
    exporter = EXPORTERS[wish.form](config=config, log=_printing())
    exporter.options = OPTIONS
    exporter.to, exporter.automatic = str(wish.to), wish.automatic
    exporter.not_handed_in = "0" if wish.missing_is_zero else ""
    exporter.replaced = wish.replaced
    exporter.assignment, exporter.student = wish.assignments, wish.students
    if isinstance(exporter, CanvasExporter) and wish.canvas:
        exporter.roster = str(wish.canvas)
    if isinstance(exporter, MoodleExporter) and wish.user:
        exporter.user = wish.user
    with Gradebook(url) as book:
        try:
            exporter.export(book)
        except SystemExit as error:  # nbgrader's way to fail
            raise CannotExport(str(error).removeprefix("autograder: ")) from None


def _printing() -> logging.Logger:
    """Return a logger whose messages are the command's output."""
    log = logging.getLogger(f"{__name__}.said")
    log.handlers, log.propagate = [logging.StreamHandler(sys.stdout)], False
    log.setLevel(logging.INFO)
    return log
