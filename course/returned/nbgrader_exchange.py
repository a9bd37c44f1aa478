"""Finding feedback in nbgrader's exchange, on a class's server.

nbgrader takes a second to load, so it is loaded only if this student has handed in something by an exchange.
"""

import logging
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from course.errors import FeedbackError


@dataclass(frozen=True)
class Released:
    """A feedback page that the instructor has released."""

    handed_in: str  # the time in nbgrader's form: later ones sort last
    path: Path


def folder() -> Path | None:
    """Return the exchange's folder, as configured or nbgrader's default; None if it cannot be used."""
    root = Path(_fetcher("", "").root)
    return root if os.access(root, os.W_OK | os.X_OK) else None  # nbgrader requires both


def released(assignment: str) -> list[Released]:
    """Return the pages released to this student, the newest hand-in last; raises FeedbackError if unreadable."""
    found = []
    for course in _courses(assignment):
        root = "of nbgrader"
        try:
            fetcher = _fetcher(course, assignment)
            root = fetcher.root
            if not Path(fetcher.root, course, "feedback").is_dir():
                continue  # nothing has been released yet
            fetcher.init_src()
            for notebook, handed_in, path in fetcher.feedback_files:
                if notebook == assignment:
                    found.append(Released(handed_in, Path(path)))
        except Exception as error:  # errors of nbgrader and of the system
            why = error.strerror if isinstance(error, OSError) else str(error)
            raise FeedbackError(f"the exchange {root} cannot be read: {why}") from None
    return sorted(found, key=lambda each: each.handed_in)


def handed_in(assignment: str) -> bool:
    """Return whether this student has handed in an assignment through an exchange."""
    return bool(_courses(assignment))


def _courses(assignment: str) -> list[str]:
    """Return the courses to which this student has handed in an assignment: nbgrader keeps a copy of each hand-in."""
    from jupyter_core.paths import jupyter_data_dir

    cache = Path(jupyter_data_dir(), "nbgrader_cache")
    try:
        return sorted({path.parent.name for path in cache.glob(f"*/*+{assignment}+*")})
    except OSError:
        return []


def _fetcher(course: str, assignment: str) -> Any:
    """Return nbgrader's own fetcher of feedback, without its messages."""
    from nbgrader.apps import NbGrader
    from nbgrader.coursedir import CourseDirectory
    from nbgrader.exchange import ExchangeFactory

    app = NbGrader()
    app.log = logging.getLogger(__name__)
    app.log.setLevel(logging.CRITICAL + 1)
    app.load_config_file()
    directory = CourseDirectory(config=app.config)
    directory.course_id, directory.assignment_id = course, assignment
    return ExchangeFactory(config=app.config).FetchFeedback(
        coursedir=directory, config=app.config, log=app.log, authenticator=None
    )
