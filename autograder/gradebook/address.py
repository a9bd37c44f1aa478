"""The database URL of a SQLite file, with any path, and the file of a URL."""

from pathlib import Path

from sqlalchemy.engine import URL, make_url
from sqlalchemy.exc import ArgumentError

from autograder.errors import UsageError

SQLITE = "sqlite:///"


def url(file: Path) -> str:
    """Return the URL of a database; as plain text, `?` and `%` in a path would mean something else."""
    return URL.create("sqlite", database=str(file)).render_as_string()


def parsed(given: str) -> URL:
    """Return the parts of a URL that a person has given; raises UsageError for any other text."""
    try:
        return make_url(given)
    except ArgumentError:
        raise UsageError(f"{given} is not a database URL: one of a file is {SQLITE}PATH") from None


def file(given: str) -> Path | None:
    """Return the file of a SQLite database; None for another database."""
    parts = parsed(given)
    return Path(parts.database) if parts.get_backend_name() == "sqlite" and parts.database else None


def expect_usable(course: Path) -> None:
    """Raise UsageError for a course folder in whose path nbgrader, which takes it as plain text, finds something else.

    nbgrader would put the gradebook elsewhere, perhaps into another course.
    """
    path = str(course.resolve())
    if make_url(f"{SQLITE}{path}").database != path:
        why = "with ? or % in its path, nbgrader puts the gradebook elsewhere. Rename the folder that has such a name"
        raise UsageError(f"{path} cannot be nbgrader's course folder: {why}")
