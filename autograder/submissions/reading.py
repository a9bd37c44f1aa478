"""Reading a submission's folder without trusting it: only regular files of the expected names and of a sane size.

Files are read once, through descriptors that never follow a link, into bytes; nothing later looks at the folder again.
A file that is missing is taken from the `%%exercise` cell of the notebook that was handed in, as text: nothing is run.
"""

import contextlib
import io
import os
import re
import stat
import tokenize
from collections.abc import Iterable, Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

from autograder.errors import RefusedFile, UnknownTime
from autograder.records import Submission
from autograder.submissions import notebook
from course.errors import UnreadableNotebook
from course.foundation.cells import STUB, Cell, exercise_file, text_of

TIMESTAMP = "timestamp.txt"  # nbgrader's file for the time of handing in
MAX_BYTES = 1_000_000  # of a file; a program of this course has some 5,000
MAX_TIME_BYTES = 200  # of TIMESTAMP; a time has some 30
A_TIME = re.compile(r"(\d{4}-\d\d-\d\d)[ T](\d\d:\d\d(?::\d\d(?:\.\d{1,6})?)?) ?(UTC|Z|[+-]\d\d:?\d\d)?", re.ASCII)
EARLIEST = datetime(2024, 5, 23, tzinfo=UTC)  # the release of ROS 2 Jazzy: an earlier time is not believed
EARLY = timedelta(days=1)  # by which a clock may be wrong: a time further in the future is not believed
# ASCII characters, and sequences of them that stand for others in some encodings of Python's.
PROBE = bytes(sorted({*range(9, 127)} - {ord("\\")}))
PROBE += rb" \n \012 \x0a \u000a \N{LINE FEED} +AAo- ~{!!~} xn--a-b " + b"\x1b$B!!\x1b(B \x0e!!\x0f"


def read(folder: Path, student: str, assignment: str, wanted: Iterable[str]) -> Submission:
    """Read the `wanted` files of `folder`; `problems` names what is missing or refused.

    `stubs` names what was missing and comes from a cell of the notebook that the student has not solved.
    """
    flags = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC
    try:
        inside = os.open(folder, flags)
    except OSError:
        why = f"'{assignment}' is not a folder: hand in a folder of that name with the files in it."
        if folder.is_symlink():
            why = f"'{folder.name}' is a link, not a folder: hand in the folder itself, with the files in it."
        return Submission(student, assignment, problems=[why])
    files: dict[str, bytes] = {}
    problems, missing, stubs = [], [], []
    try:
        with os.scandir(inside) as entries:
            present = {
                entry.name: entry.is_dir(follow_symlinks=False) for entry in sorted(entries, key=lambda e: e.name)
            }
        folders = [text_of(name) for name, is_folder in present.items() if is_folder and name[0] not in "._"]
        for name in wanted:
            try:
                content, from_cell = _file_or_cell(name, assignment, inside)
                if content is None:
                    missing.append(_missing(name, present))
                    continue
                if name.endswith(".py"):
                    _expect_readable(name, content)
                if from_cell and STUB.encode() in content:
                    stubs.append(name)
                files[name] = content
            except RefusedFile as error:
                problems.append(str(error))
            except OSError as error:
                problems.append(f"{name} cannot be read ({error.strerror}): hand it in again.")
    finally:
        os.close(inside)
    if missing:
        told = f"Missing: {', '.join(missing)}. Save each file and hand it in under exactly this name."
        if folders:
            told += f" What is in the folder {folders[0]} does not count: hand in files, not folders."
        problems.append(told)
    if problems:
        return Submission(student, assignment, problems=problems)
    return Submission(student, assignment, files, stubs=stubs)


def read_file(path: Path, limit: int = MAX_BYTES) -> bytes:
    """Return the bytes of a regular file in a handed-in folder; raises OSError, or RefusedFile for anything else."""
    inside = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC)
    try:
        return _read_file(path.name, inside, limit)
    finally:
        os.close(inside)


def regular_files(folder: Path, limit: int = MAX_BYTES) -> Iterator[tuple[Path, bytes]]:
    """Yield the readable regular files of a folder; ignores everything else."""
    for path in sorted(folder.iterdir()) if folder.is_dir() else ():
        with contextlib.suppress(OSError, RefusedFile):
            yield path, read_file(path, limit)


def has_notebook(folder: Path, assignment: str) -> bool:
    """Return True if an exercise's notebook was handed in, whatever its content."""
    return stat.S_ISREG(_kind(folder / f"{assignment}.ipynb"))


def _kind(path: Path) -> int:
    try:
        return os.lstat(path).st_mode
    except OSError:
        return 0


def handed_in_at(folder: Path) -> datetime | None:
    """Return when a submission was handed in, as naive UTC like nbgrader's times; None if it is not recorded.

    Raises UnknownTime unless the recorded time has the form of nbgrader and `autograder collect` (UTC, or with an
    offset) and is not in the future.
    """
    try:
        text = read_file(folder / TIMESTAMP, MAX_TIME_BYTES).decode(errors="replace").strip()
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise UnknownTime(f"{TIMESTAMP} cannot be read ({error.strerror})") from None
    except RefusedFile as error:
        raise UnknownTime(str(error)) from None
    if not text:
        return None
    parts = A_TIME.fullmatch(text)
    if not parts:
        raise UnknownTime(f"{TIMESTAMP} is not a time such as 2026-05-08 23:59:00 UTC")
    zone = "+00:00" if parts[3] in (None, "UTC", "Z") else parts[3]
    try:
        found = datetime.fromisoformat(f"{parts[1]}T{parts[2]}{zone}").astimezone(UTC)
    except (ValueError, OverflowError) as error:  # an invalid day, or the first or last possible one
        raise UnknownTime(f"{TIMESTAMP} is not a time ({error})") from None
    if found > datetime.now(UTC) + EARLY:
        raise UnknownTime(f"{TIMESTAMP} lies in the future")
    if found < EARLIEST:
        raise UnknownTime(f"{TIMESTAMP} lies before {EARLIEST:%Y}")
    return found.replace(tzinfo=None)


def read_notebook(path: Path) -> list[Cell]:
    """The cells of a notebook that was handed in; raises UnreadableNotebook."""
    try:
        return notebook.parse(read_file(path, notebook.MAX_BYTES))
    except UnreadableNotebook:
        raise
    except (OSError, ValueError) as error:
        raise UnreadableNotebook(str(error)) from None


def _cells(name: str, inside: int) -> list[Cell]:
    """Return the cells of the notebook `name`; none if it cannot be read."""
    try:
        return notebook.parse(_read_file(name, inside, notebook.MAX_BYTES))
    except (OSError, ValueError):
        return []


def _file_or_cell(name: str, assignment: str, inside: int) -> tuple[bytes | None, bool]:
    """Return the content of a file, or else of its cell, None if there is neither; and whether it is from the cell."""
    try:
        return _read_file(name, inside), False
    except FileNotFoundError:
        content = exercise_file(_cells(f"{assignment}.ipynb", inside), name)
        return (None if content is None or len(content) > MAX_BYTES else content), True


def _read_file(name: str, inside: int, limit: int = MAX_BYTES) -> bytes:
    """Return the bytes of the regular file `name`; raises RefusedFile, in words for the student, for anything else."""
    kind = os.stat(name, dir_fd=inside, follow_symlinks=False).st_mode
    if stat.S_ISLNK(kind):
        raise RefusedFile(f"{name} is a link: hand in the file itself.")
    if stat.S_ISDIR(kind):
        raise RefusedFile(f"{name} is a folder: hand in a file of that name.")
    if not stat.S_ISREG(kind):
        raise RefusedFile(f"{name} is not an ordinary file: hand in the file itself.")
    # O_NONBLOCK: if the file is swapped for a FIFO now, opening it must not wait for a writer.
    descriptor = os.open(name, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, dir_fd=inside)
    with open(descriptor, "rb") as file:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise RefusedFile(f"{name} is not an ordinary file: hand in the file itself.")
        content = file.read(limit + 1)
    if len(content) > limit:
        raise RefusedFile(f"{name} is larger than {limit / 1e6:.0f} MB: hand in only the program's text.")
    return content


def _expect_readable(name: str, content: bytes) -> None:
    """Raise RefusedFile for a program in an encoding where ASCII characters stand for others.

    In raw_unicode_escape, a comment can hold statements: what a person or another tool reads is not what runs.
    """
    try:
        encoding, _ = tokenize.detect_encoding(io.BytesIO(content).readline)  # PEP 263
        same = PROBE.decode(encoding) == PROBE.decode()
    except UnicodeError:
        same = False
    except (SyntaxError, LookupError):
        return  # Python does not read it either
    if not same:
        raise RefusedFile(
            f"{name} is in the encoding {encoding}, in which Python reads other text than is shown: remove its "
            "`coding` line and save it as UTF-8."
        )


def _missing(name: str, present: Iterable[str]) -> str:
    """Return the name of a missing file, and that of a present one that may be meant."""
    stem, suffix = os.path.splitext(name)
    copy = re.compile(rf"{re.escape(stem)} ?\(\d{{1,3}}\){re.escape(suffix)}", re.IGNORECASE)  # a browser's copy
    for other in present:
        if other != name and other.lower() == name.lower():
            return f"{name} (there is {text_of(other)}: capital and small letters count)"
        if copy.fullmatch(other):
            return f"{name} (there is {text_of(other)}: rename it)"
    return name
