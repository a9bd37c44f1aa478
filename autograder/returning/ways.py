"""The file names of returned pages, by which they reach their student.

Each is returned the way its submission came: in an archive for the learning platform (`platforms`), or, for an archive
of `course hand-in`, as a page named after the student.
"""

import os
from dataclasses import dataclass
from pathlib import Path

from autograder.errors import Unplaced
from autograder.platforms import FILES, PLATFORMS
from autograder.submissions import provenance
from autograder.submissions.provenance import Source
from course.foundation import storage

LONGEST_NAME = 255  # bytes of a file's name


@dataclass(frozen=True)
class Way:
    """The way in which one page is returned."""

    form: str  # a platform's form, or FILES
    name: str  # of the page: in the archive, or in the folder


def way(student: str, assignment: str, came: list[Source], form: str | None) -> Way:
    """Return how the page of a submission is returned: in `form`, or else the way that it came.

    `came` has the origins of its hand-ins, the graded one last.  Raises Unplaced, which says why there is no way.
    """
    page = f"{assignment}-feedback.html"
    known = [source for source in came if source.platform in PLATFORMS]
    if form == FILES or (form is None and not known):
        name = f"{student}-{page}"
        if len(os.fsencode(storage.draft_of(Path(name)).name)) > LONGEST_NAME:
            raise Unplaced("its page's name would be too long for a file: give the student's folder a shorter name")
        return Way(FILES, name)
    if not known or form not in (None, PLATFORMS[known[-1].platform].form):
        raise Unplaced(f"it did not come from {str(form).capitalize()}: use --for files")
    last = known[-1]
    people = provenance.people(known)
    if len(people) > 1:
        raise Unplaced(
            f"it was handed in by {' and '.join(people)} of {last.platform}: return this page by hand, with --for files"
        )
    platform, late = PLATFORMS[last.platform], "LATE_" if last.late else ""
    name = platform.page.format(name=last.name, late=late, user=last.user, upload=last.upload, page=page)
    return Way(platform.form, name)
