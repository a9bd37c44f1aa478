"""The files that a person may name for a command to write: any but those of the course and of the results."""

import contextlib
import os
from collections.abc import Iterable
from pathlib import Path

from autograder.results import output
from autograder.submissions.roster import REMEMBERED
from course.foundation import storage

GRADEBOOK, CONFIGURATION = "gradebook.db", "nbgrader_config.py"  # in nbgrader's course folder
COURSE = (GRADEBOOK, CONFIGURATION, "ends.json", "extensions.json", "members.json")
RESULTS = (output.RESULTS, output.HISTORY, output.DETAILS, output.ASKED, ".lock", ".returning", "returned.json")
NAMES = {*COURSE, *RESULTS, REMEMBERED}  # of files that no command writes where it is told to
SOURCE = "source"  # in a course folder: the notebooks to release, a folder each
STEPS = (SOURCE, "release", "submitted", "autograded", "feedback")  # nbgrader's folders in a course folder
PAGES = ("feedback", "regrade")  # in an output folder
NEEDED = "the course or its results would be damaged: name another file"


def refused(named: Path, outs: Iterable[Path] = (), submitted: Iterable[Path] = (), files: Iterable[Path] = ()) -> str:
    """Return why the file that a person has named must not be written, as a line; '' if it may.

    `outs` are output folders, `submitted` folders of submissions, and `files` further files that must stay.
    """
    if why := storage.refused(named):
        return why
    target = Path(os.path.realpath(named))
    if target.exists() and not target.is_file():  # a terminal or a pipe
        return ""
    outs, submitted = [*outs], [*submitted]
    courses = [each for folder in submitted if _is_course(each := folder.resolve().parent)]
    places = [*outs, *submitted, *courses]
    if target.name in NAMES or any(_same(target, each) for each in files):
        return NEEDED
    if any(_same(target, place / name) for place in places for name in NAMES):
        return NEEDED
    above = [*target.parents]
    ours = [folder / name for folder in outs for name in PAGES]
    ours += [folder / name for folder in courses for name in STEPS if name != "submitted"]
    if found := next((each for each in ours if any(_same(each, folder) for folder in above)), None):
        return f"it would lie in {found}, among the course's own files: name another folder"
    if any(_same(above[0], out) for out in outs):
        return ""
    for folder in submitted:
        depth = next((depth for depth, each in enumerate(above) if _same(each, folder)), None)
        if depth:  # below the folder itself, where only the roster is
            return f"it would lie among the hand-ins in {folder}: name another folder"
    return ""


def _is_course(folder: Path) -> bool:
    return any((folder / name).exists() for name in (GRADEBOOK, CONFIGURATION))


def _same(one: Path, other: Path) -> bool:
    """Return True if both exist and are the same file or folder, by whatever name."""
    with contextlib.suppress(OSError, ValueError):
        return os.path.samefile(one, other)
    return False
