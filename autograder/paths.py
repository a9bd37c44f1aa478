"""Where things are: in this package, wherever it is installed, and in the repository, when it runs from a checkout."""

from pathlib import Path

import course
from autograder.errors import UsageError

PACKAGE = Path(__file__).resolve().parent  # kept out of sight of students' programs
HIDDEN = PACKAGE / "hidden"
COURSE = Path(course.__file__).resolve().parent


def repository() -> Path:
    """The checkout that this package runs from, with notebooks and solutions.

    Raises UsageError for an installation without them: it can grade, but not release.
    """
    root = PACKAGE.parent
    if not (root / "notebooks").is_dir() or not (root / "solutions").is_dir():
        raise UsageError(
            f"{PACKAGE} was installed without the course's notebooks and solutions: run this from a checkout"
        )
    return root
