"""Finding feedback in nbgrader's exchange, on a class's server.

nbgrader takes seconds to load, so it is loaded only if this student has handed in something by an exchange, or if the
place of the exchange is configured.
"""

import contextlib
import logging
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from course.errors import FeedbackError

ROOT = Path("/usr/local/share/nbgrader/exchange")  # nbgrader's default
CONFIGURED_IN = [f"{name}.{kind}" for name in ("jupyter_config", "nbgrader_config") for kind in ("json", "py")]
# Either may lead to a root, other than the class that submits, which every installation sets.
CONFIGURED_BY = re.compile(r"Exchange(?!Factory\.submit\b)|load_subconfig")


@dataclass(frozen=True)
class Released:
    """A feedback page that the instructor has released."""

    handed_in: str  # the time in nbgrader's form: later ones sort last
    path: Path


def folder() -> Path | None:
    """Return the exchange's folder, as configured or nbgrader's default; None if it cannot be used."""
    root = Path(_fetcher("", "").root) if _may_be_configured() else ROOT
    return root if os.access(root, os.W_OK | os.X_OK) else None  # nbgrader requires both


def _may_be_configured() -> bool:
    """Return True if one of the files that `_fetcher` reads may say where the exchange is."""
    from jupyter_core.paths import jupyter_config_path

    for path in (Path(place, name) for place in jupyter_config_path() for name in CONFIGURED_IN):
        with contextlib.suppress(OSError):
            if CONFIGURED_BY.search(path.read_text(encoding="utf-8", errors="replace")):
                return True
    return False


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
    """Return nbgrader's own fetcher of feedback, without its messages.

    It is configured as this user and this machine are; a folder, which may be somebody else's, is not asked.
    """
    from nbgrader.apps import NbGrader
    from nbgrader.coursedir import CourseDirectory
    from nbgrader.exchange import ExchangeFactory

    app = NbGrader()
    app.log = logging.getLogger(__name__)
    app.log.setLevel(logging.CRITICAL + 1)
    app.load_cwd_config = False
    app.load_config_file()
    directory = CourseDirectory(config=app.config)
    directory.course_id, directory.assignment_id = course, assignment
    return ExchangeFactory(config=app.config).FetchFeedback(
        coursedir=directory, config=app.config, log=app.log, authenticator=None
    )
