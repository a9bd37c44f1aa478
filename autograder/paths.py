"""Paths of the project's files: in the installed package, and in the checkout, when it runs from one."""

from pathlib import Path

import course
from autograder.errors import UsageError

PACKAGE = Path(__file__).parent.resolve()  # not of the file, which may be a link into an installer's cache
HIDDEN = PACKAGE / "hidden"
COURSE = Path(course.__file__).parent.resolve()


def checkout() -> Path | None:
    """Return the checkout that this package runs from, with notebooks and solutions; None for an installed package."""
    root = PACKAGE.parent
    return root if (root / "notebooks").is_dir() and (root / "solutions").is_dir() else None


def repository() -> Path:
    """The checkout that this package runs from.

    Raises UsageError for an installed package: without notebooks and solutions it can grade, but not release.
    """
    root = checkout()
    if root is None:
        raise UsageError(
            f"{PACKAGE} was installed without the course's notebooks and solutions; run this command from a checkout"
        )
    return root


def private() -> list[Path]:
    """Return the folders hidden from students' programs: the grader, and the checkout with tests and solutions."""
    return [folder for folder in (checkout(), PACKAGE) if folder]
