"""A record beside a notebook: which text its exercise cells wrote to each file, and which text a check has judged.

It outlives the kernel, and tells a file that was edited elsewhere from one that is as its cell wrote it.
"""

import contextlib
import hashlib
import json
from pathlib import Path

from course.foundation import cells, storage
from course.foundation.untrusted import read_regular

RECORD = ".exercise.json"
WRITTEN, EARLIER, JUDGED, CHECKED = "written", "earlier", "judged", "checked"
KEPT = 100  # earlier texts of a file that the record knows


def digest(content: bytes) -> str:
    """Return what the record keeps of a text."""
    return hashlib.sha256(content).hexdigest()


def digest_of(file: Path) -> str:
    """Return the digest of a file as it lies there; '' if it cannot be read."""
    with contextlib.suppress(OSError, ValueError):
        return digest(read_regular(file, cells.MOST))
    return ""


def written(folder: Path) -> dict[str, str]:
    """Return the digest of what a cell last wrote to each file of `folder`."""
    return _texts(_record(folder).get(WRITTEN))


def earlier(folder: Path, name: str) -> list[str]:
    """Return the digests of what cells wrote to a file of `folder` before they last wrote to it."""
    known = _record(folder).get(EARLIER)
    found = known.get(name) if isinstance(known, dict) else None
    return [each for each in found if isinstance(each, str)] if isinstance(found, list) else []


def judged(folder: Path, check: str) -> dict[str, str]:
    """Return the digest that each file had when the check called `check` last ran in `folder`."""
    return _of_check(folder, JUDGED, check)


def checked(folder: Path, check: str) -> dict[str, str]:
    """Return the digest that each file had when the check called `check` last passed in `folder`."""
    return _of_check(folder, CHECKED, check)


def _of_check(folder: Path, kind: str, check: str) -> dict[str, str]:
    known = _record(folder).get(kind)
    return _texts(known.get(check)) if isinstance(known, dict) else {}


def note_written(file: Path, content: bytes) -> None:
    """Note that a cell has written `content` to `file`."""
    before, now = written(file.parent).get(file.name), digest(content)
    if before and before != now:
        known = [each for each in earlier(file.parent, file.name) if each not in (before, now)]
        _note(file.parent, EARLIER, file.name, [*known, before][-KEPT:])
    _note(file.parent, WRITTEN, file.name, now)


def note_reset(file: Path, content: bytes) -> None:
    """Note that the cell of `file` was given back `content` on purpose, though it may have written it earlier."""
    known = earlier(file.parent, file.name)
    if (meant := digest(content)) in known:
        _note(file.parent, EARLIER, file.name, [each for each in known if each != meant])


def note_checked(folder: Path, check: str, digests: dict[str, str], *, passed: bool) -> None:
    """Note that the check called `check` has judged the files of `folder` with these digests, by name."""
    _note(folder, JUDGED, check, digests)
    if passed or checked(folder, check) == digests:  # the last run counts
        _note(folder, CHECKED, check, digests if passed else {})


def _note(folder: Path, kind: str, key: str, value: object) -> None:
    record = _record(folder)
    known = record.get(kind)
    record[kind] = {**(known if isinstance(known, dict) else {}), key: value}
    with contextlib.suppress(OSError):  # without the note a file counts as edited, and a copy of it is kept
        storage.replace(folder / RECORD, json.dumps(record).encode())


def _record(folder: Path) -> dict[str, object]:
    with contextlib.suppress(OSError, ValueError, RecursionError):
        found = json.loads(read_regular(folder / RECORD, cells.MOST))
        return found if isinstance(found, dict) else {}
    return {}


def _texts(found: object) -> dict[str, str]:
    return {name: text for name, text in found.items() if isinstance(text, str)} if isinstance(found, dict) else {}
