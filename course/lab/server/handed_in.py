"""The last hand-in from a folder, by the receipts there and by what this server does or has done."""

import json
import re
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import lru_cache
from pathlib import Path
from typing import Any

from course import hand_in
from course.errors import BadArchive, HandInError
from course.foundation import cells
from course.foundation.times import MINUTES
from course.foundation.untrusted import Allowance, Archive
from course.notebook import file_record
from course.notebook.progress import Ran

ARCHIVE = r"-{assignment}-(\d{{8}}T\d{{6}}Z)(?:-(\d+))?\.zip$"  # the end of a name, as `hand_in.write` makes it
MOST = 1_000_000  # bytes of a receipt


@dataclass
class HandingIn:
    """A hand-in by this server."""

    ran: int = 0  # public checks
    of: int = 0
    over: datetime | None = None  # time of its end
    sent: str = ""  # the name of the archive that is in the exchange of the class
    failed: str = ""  # why nothing was handed in
    before: "HandingIn | None" = None  # the last one before it, until its end

    @property
    def progress(self) -> str:
        """Return a sentence that says how far it is."""
        checks = f": {self.ran} of {self.of} public checks have run" if self.of else ""
        return f"A hand-in is under way{checks}."

    def end(self, *, sent: str = "", failed: str = "") -> None:
        """End it, for the first time."""
        if self.over is None:
            self.over, self.sent, self.failed, self.before = datetime.now(UTC), sent, failed, None


@dataclass(frozen=True)
class Receipt:
    """The content of the receipt in an archive."""

    time: datetime
    files: dict[str, str]  # the digest of each, by its name
    outcomes: dict[str, str]  # of the public checks, by name

    def __str__(self) -> str:
        passed = [*self.outcomes.values()].count(cells.PASSED)
        checks = f" {passed} of {len(self.outcomes)} public checks passed." if self.outcomes else ""
        return f"{self.time:{MINUTES} UTC}: {', '.join(self.files)}.{checks}"


_latest: dict[Path, HandingIn] = {}  # by folder


def expect_none(folder: Path) -> None:
    """Raise HandInError while a hand-in from this folder is under way, as from another tab of the browser."""
    known = _latest.get(folder.resolve())
    if known and known.over is None:
        raise HandInError(f"{known.progress} Wait until it has finished: the Exercise panel shows the result.")


def begin(folder: Path) -> HandingIn:
    """Return a hand-in from this folder that begins now; raises HandInError while another one is under way."""
    expect_none(folder)
    place = folder.resolve()
    made = _latest[place] = HandingIn(before=_latest.get(place))
    return made


def withdraw(folder: Path, under_way: HandingIn) -> None:
    """Forget a hand-in under way: the student is asked before anything is handed in."""
    place = folder.resolve()
    if _latest.get(place) is under_way:
        if under_way.before:
            _latest[place] = under_way.before
        else:
            del _latest[place]


def told(folder: Path, assignment: str) -> dict[str, str] | None:
    """Return {"text": what was handed in last, or how far it is, "archive": the archive's name}; None for nothing."""
    known = _latest.get(folder.resolve())
    if known and known.over is None:
        return {"text": known.progress, "archive": ""}
    name, receipt = _newest(folder, assignment)
    if known and known.over and known.failed and not (receipt and receipt.time > known.over):
        return {"text": f"The hand-in of {known.over:{MINUTES} UTC} failed: {known.failed}", "archive": ""}
    if receipt is None:
        return None
    if hand_in.known():
        done, then = "Handed in" if known and known.sent == name else "Packed", ""
    else:
        done, then = "Packed", " Give the archive to your instructor; the newest counts."
    return {"text": f"{done} on {receipt}{then}{_since(folder, receipt)}", "archive": name}


def last_run(folder: Path, assignment: str) -> Ran | None:
    """Return the run of the public checks for the last hand-in from a folder; None without one."""
    _, receipt = _newest(folder, assignment)
    return Ran(receipt.files, receipt.outcomes) if receipt else None


def _since(folder: Path, receipt: Receipt) -> str:
    """Return a sentence on the files of a hand-in that are different now, or ''.

    Not on the notebook, which changes whenever a cell is run.
    """
    now = {name: file_record.digest_of(folder / name) for name in receipt.files if not name.endswith(".ipynb")}
    different = [f"{name} {'changed' if it else 'gone'}" for name, it in now.items() if it != receipt.files[name]]
    if not different:
        return ""
    return f" Since then: {', '.join(different)}. The archive keeps what you handed in: to replace it, hand in again."


def _newest(folder: Path, assignment: str) -> tuple[str, Receipt | None]:
    """Return the newest archive of the exercise in a folder, by the time in its name, and its receipt; '' for none."""
    end = re.compile(ARCHIVE.format(assignment=re.escape(assignment)))
    found = [(match[1], int(match[2] or 1), path) for path in folder.glob("*.zip") if (match := end.search(path.name))]
    for _, _, path in sorted(found, reverse=True):
        try:
            receipt = _receipt(path, assignment, path.stat().st_mtime_ns) if path.is_file() else None
        except OSError:  # it has just been removed
            continue
        if receipt:
            return path.name, receipt
    return "", None


@lru_cache(maxsize=100)
def _receipt(path: Path, assignment: str, _changed: int) -> Receipt | None:
    """Return the receipt in an archive, None if it has none for this exercise; raises OSError."""
    try:
        with path.open("rb") as file:
            archive = Archive(file)
            (entry,) = (each for each in archive.files if each.filename == hand_in.RECEIPT)
            said: Any = json.loads(archive.read(entry, Allowance(MOST)))
        outcomes = {name: str(outcome) for name, outcome in said["checks"].items()}
        time = datetime.fromisoformat(said["handed_in"]).astimezone(UTC)
        files = {name: str(known["sha256"]) for name, known in said["files"].items()}
        receipt = Receipt(time, files, outcomes)
        return receipt if said["assignment"] == assignment else None
    except (BadArchive, KeyError, TypeError, ValueError, AttributeError, RecursionError, OverflowError):
        return None
