"""The members of a class on one server, by user id: the owner of a hand-in is found among them.

They are in `members.json` of nbgrader's course folder, because an instructor's server, which goes on while members come
and go, knows only the users that were there when it was started.
"""

import json
from collections.abc import Mapping
from pathlib import Path

from autograder.errors import UsageError
from autograder.gradebook import shared_file
from autograder.submissions.roster import of_class

FILE = "members.json"


def read(course: Path) -> dict[int, str] | None:
    """Return the members of a course folder, None where there is no class; raises UsageError for a damaged file."""
    try:
        known = shared_file.from_json(shared_file.read(course / FILE))
        return {int(user): str(name) for user, name in known.items()}
    except FileNotFoundError:
        return None
    except (ValueError, TypeError, AttributeError) as error:
        raise UsageError(
            f"{course / FILE} cannot be read: {error}. Remove it, and give the `up` command again"
        ) from None


def in_class(course: Path, submitted: Path) -> set[str] | None:
    """Return who is in the class now; None if it is not known.

    That is the roster given last with the submissions, or else the members of the class on this server.  Raises
    UsageError.
    """
    if roster := of_class(submitted, None):
        return roster.students
    known = read(course)
    return None if known is None else set(known.values())


def write(course: Path, members: Mapping[int, str]) -> None:
    """Write down the members; raises OSError."""
    text = json.dumps({str(user): name for user, name in sorted(members.items())}, indent=1)
    shared_file.write(course / FILE, text)
