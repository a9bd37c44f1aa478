"""Handing in: writes an exercise's files as one archive with a receipt, after checking them.

`course hand-in` and the button in the notebook's toolbar (`course/lab/server`) both use it.
"""

import contextlib
import hashlib
import io
import json
import os
import platform
import re
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from getpass import getuser
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import typer
from rich.console import Console

from course.environment import KERNEL
from course.errors import HandInError, UnreadableNotebook
from course.foundation import cells
from course.foundation.times import MINUTES
from course.foundation.untrusted import read_regular
from course.notebook.file_differences import differences, written_by
from course.notebook.file_record import digest, note_checked
from course.notebook.progress import unanswered

RECEIPT = "receipt.json"
NOTED, DUE, UNTIL = "course", "due", "until"  # keys in a released notebook's metadata; times in ISO 8601
HOUR, DAY = 3600, 86_400  # s
FORMAT = 1  # of the receipt
DATES = "COURSE_DATES"  # set on a class's server: a file with the student's dates, by exercise
MOST_DATES = 1_000_000  # bytes of that file
EXCHANGE = "COURSE_EXCHANGE"  # set on a class's server: nbgrader's name for the course
COPIED = re.compile(r"([-_ ]?copy ?\d*|[-_ ]?\(\d+\)|[-_ ](final|new|old|v?\d+))+$", re.IGNORECASE)  # in a file's name
MOST = 50_000_000  # bytes of a file; collecting takes no more
PACKAGES = ("ros2-course", "ros-jazzy-rclpy", "nbgrader")


@dataclass(frozen=True)
class HandIn:
    """The contents of an exercise's folder."""

    assignment: str
    cells: list[cells.Cell]
    files: dict[str, bytes]  # the files to hand in, notebook included, by name
    doubts: dict[str, str]  # what may be wrong with a file, by name

    @property
    def missing(self) -> list[str]:
        """Return the exercise's files that do not exist."""
        wanted = [written_by(cell) for cell in self.cells if cell.solution and written_by(cell)]
        return [name for name in wanted if name not in self.files]

    @property
    def digests(self) -> dict[str, dict[str, Any]]:
        """Return the size and the digest of each file, by name."""
        return {
            name: {"bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}
            for name, content in self.files.items()
        }

    @property
    def unanswered(self) -> str:
        """Return a sentence that names the questions in words that have no answer, with their points; '' for none."""
        open_ones = [f"{name} ({points:g} points)" for name, points in unanswered(self.cells).items()]
        return f"Not answered: {' and '.join(open_ones)}." if open_ones else ""

    @property
    def dates(self) -> dict[str, datetime]:
        """Return the due date and the end of the exercise, by DUE and UNTIL, as far as they are known.

        They come from the class's server, with the student's extension; otherwise from the released notebook.
        """
        return _times(self._noted) | _times(self._told)

    def _noted(self) -> Any:
        return json.loads(self.files[f"{self.assignment}.ipynb"])["metadata"][NOTED]

    def _told(self) -> Any:
        return json.loads(read_regular(Path(os.environ[DATES]), MOST_DATES))[self.assignment]

    def is_over(self, now: datetime) -> bool:
        """Return True if hand-ins end before `now`."""
        return UNTIL in self.dates and now > self.dates[UNTIL]

    def lateness(self, now: datetime) -> str:
        """Return a sentence that says whether a hand-in now is in time; '' if there is no date."""
        dates = self.dates
        if self.is_over(now):
            told = "It will not be collected" if known() else "Ask your instructor whether it counts"
            return f"This is too late: hand-ins ended on {dates[UNTIL]:{MINUTES} UTC}. {told}."
        if DUE not in dates:
            return ""
        if now <= dates[DUE]:
            return f"This is in time: it is due on {dates[DUE]:{MINUTES} UTC}. Your instructor's clock decides."
        late = (now - dates[DUE]).total_seconds()
        by = f"{late / DAY:.1f} days" if late >= DAY else f"{late / HOUR:.1f} h" if late >= HOUR else "less than 1 h"
        return f"This is late by {by}: it was due on {dates[DUE]:{MINUTES} UTC}."


@dataclass(frozen=True)
class Checked:
    """The public checks, as run on what is to be handed in."""

    outcomes: dict[str, str] = field(default_factory=dict)  # by the check's name; empty if they were not run
    unchecked: str = ""  # why they could not be run

    @property
    def failed(self) -> dict[str, str]:
        """Return the first line of each outcome other than "passed", by the check's name.

        A check that had too little time is left out: it says nothing about the program.
        """
        others = (cells.PASSED, cells.UNFINISHED)
        return {name: said.partition("\n")[0] for name, said in self.outcomes.items() if not said.startswith(others)}

    @property
    def sentence(self) -> str:
        """Return a sentence that names the checks that have failed."""
        one = len(self.failed) == 1
        return f"the public check{'' if one else 's'} {' and '.join(self.failed)} {'has' if one else 'have'} failed."


@dataclass(frozen=True)
class HandedIn:
    """A submission that was handed in."""

    archive: Path
    files: list[str]
    checks: dict[str, str]  # the outcome of each public check, by name; empty if they were not run
    unchecked: str = ""  # why the checks could not be run
    lateness: str = ""  # a sentence that says whether it is in time
    over: bool = False  # whether hand-ins have ended
    missing: tuple[str, ...] = ()  # the exercise's files that were not there
    unanswered: str = ""  # a sentence that names the questions in words that have no answer

    @property
    def summary(self) -> str:
        """Return a sentence on the checks, passed or not run, and on missing files; '' if none was requested."""
        if not self.checks:
            return self.unchecked
        passed = sum(outcome == cells.PASSED for outcome in self.checks.values())
        files = " and ".join(self.missing)
        gone = f"; {files} {'was' if len(self.missing) == 1 else 'were'} not handed in" if files else ""
        return f"{passed} of {len(self.checks)} public checks passed{gone}."

    @property
    def kept(self) -> str:
        """Return the message to the student about the archive."""
        receipt = "Keep the archive: it is your receipt."
        if self.over:
            return receipt
        sent = "It is in the exchange of your class." if known() else "Now give the archive to your instructor."
        return f"{sent} {receipt} You can hand in again; the newest counts."


def _times(read: Callable[[], Any]) -> dict[str, datetime]:
    """Return the dates that `read` finds; empty if there are none or they are invalid."""
    try:
        said = read()
        found = {key: datetime.fromisoformat(said[key]) for key in (DUE, UNTIL) if said.get(key)}
        return {key: time.astimezone(UTC) for key, time in found.items()}
    except (OSError, KeyError, TypeError, ValueError, AttributeError, RecursionError, OverflowError):
        return {}


def student() -> str:
    """Return the student's name on the course: $COURSE_STUDENT, or the login name."""
    return os.environ.get("COURSE_STUDENT") or getuser()


def known() -> bool:
    """Return True on a class's server, where the log-in is the student's name."""
    return bool(os.environ.get(EXCHANGE))


def hand_in(folder: Path, name: str, *, yes: bool, check: bool) -> int:
    """Hand in the exercise in `folder` for the student `name`; return the exit status.

    Asks for confirmation if a file differs from its cell or is missing; `yes` confirms in advance.  The public checks
    are run first, and their outcomes go into the receipt.  If one has failed, asks where somebody can answer; otherwise
    that does not prevent handing in.
    """
    answered = sys.stdin.isatty() and KERNEL not in os.environ  # nobody can answer in a notebook's cell
    console = Console(highlight=False, width=None if sys.stdout.isatty() else 120, soft_wrap=True)
    found = read(folder)
    for why in found.doubts.values():
        print(f"Careful: {why}", file=sys.stderr)
    if found.doubts and not yes:
        if not answered:
            raise HandInError("nothing was handed in: correct the problems above, or hand it in as it is with --yes")
        if not _confirmed():
            return 1
    checked = Checked()
    if check:
        with console.status("Running the public checks ...") as status:
            checked = run_checks(found, lambda ran, of: status.update(f"Running the public checks ... {ran} of {of}"))
    if checked.unchecked:
        console.print(checked.unchecked, markup=False)
    for each, outcome in checked.outcomes.items():
        console.print(f"{each}: {outcome}", markup=False)
    if checked.failed and answered and not yes:
        print(f"Careful: {checked.sentence}", file=sys.stderr)
        if not _confirmed():
            return 1
    done = deliver(found, folder, name, checked)
    console.print(f"[bold]{done.archive.name}[/bold]: {', '.join(done.files)}")
    if done.checks:
        console.print(done.summary)
    for said in filter(None, (done.unanswered, done.lateness)):
        console.print(said, markup=False)
    console.print(done.kept)
    return 0


def _confirmed() -> bool:
    if typer.confirm("Hand it in as it is?"):
        return True
    print("Nothing was handed in.")
    return False


def run_checks(found: HandIn, tell: Callable[[int, int], None]) -> Checked:
    """Run the public checks on the files of `found`.

    `tell` is called with the number of checks done and their total after each check.
    """
    from course.notebook.runs import outcomes

    try:
        with tempfile.TemporaryDirectory(prefix="hand-in-") as empty:
            return Checked(outcomes(found.cells, found.files, Path(empty), tell))
    except OSError as error:  # a full disk
        return Checked(unchecked=f"The public checks could not be run: {error.strerror}")


def deliver(found: HandIn, folder: Path, name: str, checked: Checked) -> HandedIn:
    """Write the archive of `found` into `folder`, and note which checks have passed; raises HandInError."""
    now = datetime.now(UTC)
    written = write(found, folder, name, checked.outcomes, now)
    for at, cell in enumerate(found.cells):
        if cell.public_check and checked.outcomes.get(cell.name) == cells.PASSED:
            names = filter(None, map(written_by, found.cells[:at]))
            digests = {each: digest(found.files[each]) if each in found.files else "" for each in names}
            note_checked(folder, cell.name, digests, passed=True)
    over = found.is_over(now)
    told = checked.unchecked, found.lateness(now), over, tuple(found.missing), found.unanswered
    return HandedIn(written, list(found.files), checked.outcomes, *told)


def read(folder: Path) -> HandIn:
    """Return the contents of `folder` to hand in, as saved; raises HandInError."""
    found = {}
    for path in cells.notebooks(folder):
        try:
            known = cells.read(path)
        except UnreadableNotebook as error:
            raise HandInError(f"{path.name} cannot be read: {error}") from None
        except OSError as error:
            raise HandInError(f"{path.name} cannot be read: {error.strerror}") from None
        if any(cell.solution and written_by(cell) for cell in known):
            found[path] = known
    if not found:
        where = _below(folder) or ["notebooks/calculator"]
        raise HandInError(
            f"there is no notebook with an exercise in {folder.absolute()}: go to the exercise's folder, or name it: "
            + " or ".join(f"`course hand-in {each}`" for each in where)
        )
    if len(found) > 1:
        names = " and ".join(path.name for path in found)
        raise HandInError(
            f"{names} both contain an exercise, and only one can be handed in: move the copy to another folder."
        )
    notebook, known = next(iter(found.items()))
    wanted = [written_by(cell) for cell in known if cell.solution and written_by(cell)]
    files = {}
    for name in [*wanted, notebook.name]:
        with contextlib.suppress(OSError, ValueError):  # reported as a doubt
            files[name] = read_regular(folder / name, MOST)
    if files.keys() == {notebook.name}:
        raise HandInError(f"none of the exercise's files exists: run the cells that write {', '.join(wanted)}")
    doubts = {name: f"{name} still has a line `# {cells.STUB}`: fill it in, or delete the line if you have."
              for name, content in files.items() if name != notebook.name and _unfilled(content)}  # fmt: skip
    doubts |= {name: why for name, why in differences(folder).items() if name in wanted}
    doubts |= {
        name: f"{name} is a link to {real}, which would be handed in." for name, real in _elsewhere(folder, files)
    }
    if another := _another_name(notebook.stem, folder.absolute().name):
        doubts = {notebook.name: another, **doubts}
    return HandIn(notebook.stem, known, files, doubts)


def _elsewhere(folder: Path, names: Iterable[str]) -> Iterator[tuple[str, Path]]:
    """Yield the files that are links to others outside of the exercise's folder, and those others."""
    for name in names:
        real = (folder / name).resolve()
        if not real.is_relative_to(folder.resolve()):
            yield name, real


def _unfilled(content: bytes) -> bool:
    """Return True if a file still has the line that a release leaves where a solution was."""
    return any(line.strip() == f"# {cells.STUB}".encode() for line in content.splitlines())


def _below(folder: Path) -> list[str]:
    """Return the folders of exercises in `folder`, or in a folder `notebooks` there."""
    found = (path for place in ("*", "notebooks/*") for path in sorted(folder.glob(f"{place}/*.ipynb")))
    return [str(path.parent) for path in found if path.stem == path.parent.name]


def _another_name(name: str, folder: str) -> str:
    """Return a doubt about a notebook that looks like a renamed copy of an exercise; '' for none."""
    inside = re.search(rf"(?<![A-Za-z]){re.escape(folder)}(?![A-Za-z])", name) if folder else None
    meant = folder if inside else COPIED.sub("", name)
    if meant in ("", name):
        return ""
    return (
        f"the notebook is called {name}.ipynb, so it would be handed in as the exercise '{name}'. If it is the "
        f"exercise {meant}, rename it to {meant}.ipynb."
    )


def write(found: HandIn, folder: Path, name: str, checks: dict[str, str], now: datetime | None = None) -> Path:
    """Write the archive `NAME-ASSIGNMENT-UTC TIME.zip` into `folder`, whole or not at all; raises HandInError.

    On a class's server, also submits to nbgrader's exchange.
    """
    now = now or datetime.now(UTC)
    name = re.sub(r"[^\w.]+", "_", name).strip("._") or "student"
    stem = f"{name}-{found.assignment}-{now:%Y%m%dT%H%M%SZ}"
    content = _archive(found, name, checks, now)
    try:
        for number in range(1, 100):
            path = folder / f"{stem}{f'-{number}' if number > 1 else ''}.zip"
            with contextlib.suppress(FileExistsError):
                _written(path, content)
                submit(found, path)
                return path
    except OSError as error:
        raise HandInError(f"{path.name} could not be written: {error.strerror}; nothing was handed in") from None
    raise HandInError(f"there are 99 archives {stem}*.zip already")


def submit(found: HandIn, archive: Path) -> None:
    """Submit the files to nbgrader's exchange, if $COURSE_EXCHANGE names the course there; raises HandInError."""
    course_id = os.environ.get(EXCHANGE)
    if not course_id:
        return
    try:
        with tempfile.TemporaryDirectory(prefix="hand-in-") as place:
            folder = Path(place, found.assignment)  # whatever the name of the student's folder
            folder.mkdir()
            for each, content in found.files.items():
                (folder / each).write_bytes(content)
            nbgrader = [sys.executable, "-P", "-m", "course.notebook.own_path", "nbgrader"]
            command = [*nbgrader, "submit", found.assignment, "--course", course_id]
            done = subprocess.run([*command, f"--Exchange.assignment_dir={place}"], capture_output=True, text=True)
    except OSError as error:
        raise HandInError(f"{archive.name} is written, but could not be handed in: {error.strerror}") from None
    if done.returncode:
        said = [line for line in done.stderr.splitlines() if "ERROR" in line or "CRITICAL" in line]
        why = said[0].partition("] ")[2] if said else f"exit status {done.returncode}"
        raise HandInError(f"{archive.name} is written, but the exchange of your class refused it: {why}")


def receipt(found: HandIn, name: str, checks: dict[str, str], now: datetime) -> dict[str, Any]:
    """Return the receipt: student, exercise and time, each file's size and digest, checks, doubts, versions."""
    return {
        "format": FORMAT,
        "student": name,
        "assignment": found.assignment,
        "handed_in": now.isoformat(timespec="seconds"),
        "files": found.digests,
        "checks": checks,
        "doubts": found.doubts,
        "versions": {"python": platform.python_version(), **{each: _version(each) for each in PACKAGES}},
    }


def _archive(found: HandIn, name: str, checks: dict[str, str], now: datetime) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        text = json.dumps(receipt(found, name, checks, now), indent=1, ensure_ascii=False)
        for each, content in {RECEIPT: text.encode(), **found.files}.items():
            archive.writestr(zipfile.ZipInfo(each), content, zipfile.ZIP_DEFLATED)  # with a fixed date
    return buffer.getvalue()


def _written(path: Path, content: bytes) -> Path:
    with path.open("xb") as file:
        try:
            file.write(content)
            file.flush()
        except OSError:
            path.unlink(missing_ok=True)
            raise
    return path


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:  # a sourced ROS 2
        return ""
