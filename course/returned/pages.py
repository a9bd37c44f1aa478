"""Feedback pages as files: read, kept in the exercise's folder, and found there again."""

import contextlib
import io
import re
from collections.abc import Iterator
from pathlib import Path

from course.errors import BadArchive, FeedbackError
from course.foundation import storage
from course.foundation.untrusted import Allowance, Archive, read_regular
from course.returned.made import check
from course.returned.record import Feedback, read

FOLDER = "feedback"  # in the exercise's folder; nbgrader puts pages there too
LARGEST = 5_000_000  # bytes of a page
LARGEST_ARCHIVE = 50_000_000  # bytes
MOST = 100  # files of an archive that are read
ZIP = b"PK"  # the beginning of a zip archive


def take(file: Path) -> tuple[Feedback, bytes]:
    """Return the page in `file`, which may be an archive; raises FeedbackError, also for one not of the grader's."""
    try:
        content = read_regular(file, LARGEST_ARCHIVE)
    except OSError as error:
        raise FeedbackError(f"{file} cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise FeedbackError(f"{file} is not a feedback page: {error}") from None
    found = []
    if content.startswith(ZIP):
        for page in _pages_in(file, content):
            with contextlib.suppress(FeedbackError):
                found.append((read(page[:LARGEST]), page))
        if len(found) != 1:
            what = f"{len(found)} pages" if found else "no page"
            raise FeedbackError(f"{file} contains {what} of feedback: name the page that you want to read")
    try:
        feedback, page = found[0] if found else (read(content[:LARGEST]), content)
        check(page)
    except FeedbackError as error:
        raise FeedbackError(f"{file}: {error}") from None
    return feedback, page


def keep(page: bytes, feedback: Feedback, folder: Path) -> Path:
    """Write a page into the exercise's folder; an earlier one is kept, too.  Raises FeedbackError."""
    target = folder / FOLDER
    try:
        target.mkdir(exist_ok=True)
        for number in range(1, 1000):
            path = target / f"{feedback.assignment}{f'-{number}' if number > 1 else ''}.html"
            if not path.exists():
                storage.replace(path, page)
                return path
            if holds(path, page):
                path.touch()  # it is the newest again
                return path
    except OSError as error:
        raise FeedbackError(f"the page could not be kept in {target}: {error.strerror}") from None
    raise FeedbackError(f"there are too many pages in {target}")


def holds(path: Path, page: bytes) -> bool:
    """Return True if a file holds this page; a pipe, a device or a huge file is not read."""
    try:
        return read_regular(path, len(page)) == page
    except (OSError, ValueError):
        return False


def newest(folder: Path, assignment: str = "") -> tuple[Path, Feedback] | None:
    """Return the newest page in an exercise's folder about `assignment`, or about any exercise; None without one."""
    found = []
    for path in (folder / FOLDER).rglob("*.html"):
        with contextlib.suppress(OSError):
            found.append((path.stat().st_mtime_ns, path))
    for _, path in sorted(found, reverse=True):
        with contextlib.suppress(FeedbackError):
            feedback, _ = take(path)
            if assignment in ("", feedback.assignment):
                return path, feedback
    return None


def place_of(feedback: Feedback, start: Path) -> Path:
    """Return the exercise's folder: `start` or one in it; raises FeedbackError."""
    name = feedback.assignment
    if re.fullmatch(r"\w{1,60}", name):  # a page may contain anything, also a name that no folder can have
        for folder in (start, start / name, start / "notebooks" / name, start.parent / name):
            if (folder / f"{name}.ipynb").exists():
                return folder
    raise FeedbackError(f"it is feedback on {name!r}, but that notebook is not here: go to the exercise's folder first")


def _pages_in(file: Path, content: bytes) -> Iterator[bytes]:
    """Yield the pages of an archive, limited in number and size."""
    try:
        archive, allowance = Archive(io.BytesIO(content)), Allowance(LARGEST_ARCHIVE)
        for info in archive.files[:MOST]:
            if info.filename.lower().endswith((".html", ".htm")):
                yield archive.read(info, allowance)
    except BadArchive as error:
        raise FeedbackError(f"{file} cannot be unpacked: {error}") from None
