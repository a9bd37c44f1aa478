"""The interface packages of a folder: a package built in it can be imported by every process there.

`%%exercise Calculate.srv --package calculator_interfaces` builds a package from the definitions in a folder.  A small
file in that folder records it, so that a new kernel, a terminal and `ros2` in the same folder find the package, too. It
contains no paths, so it stays valid when the folder is copied or renamed.

The folder, and so the record, may come from somebody else, as a hand-in does.  So a process in the folder only uses
builds that are in its user's cache.  It builds a changed package again only if the record's entry has a mark that shows
that this user has built the package in this very folder.
"""

import hashlib
import hmac
import json
import re
import secrets
import sys
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from filelock import FileLock

from course.errors import InterfaceError
from course.foundation import storage
from course.foundation.untrusted import read_regular
from course.interfaces.builder import PACKAGE, Built, build, cache_folder, hides, identity

RECORD = ".interfaces.json"
LARGEST = 100_000  # bytes of a record
DEFINITION = re.compile(r"\w[\w.]*", re.ASCII)  # a name that cannot lead to another folder
BUILD = re.compile(r"[0-9a-f]{20}")
MOST_PACKAGES = 50  # of a folder; the ones that were built last
MOST_FILES = 100  # of a package
LONGEST_NAME = 100  # characters
KEY = "record.key"  # in the cache: a number known only to this user, with which entries are marked


@dataclass(frozen=True)
class Kept:
    """A package of a folder."""

    package: str
    files: tuple[str, ...]  # names of its definitions, in the folder
    prefix: Path  # of its last build
    mark: str = ""  # shows by whom, and in which folder, it was built


def record_file(folder: Path) -> Path:
    """Return the path of the file that records the packages of `folder`."""
    return folder / RECORD


def packages(folder: Path) -> list[Kept]:
    """The packages in the record of `folder`, also those that were built elsewhere.

    A package that would hide a package of ROS 2 or an installed module is left out.
    """
    try:
        found = json.loads(read_regular(record_file(folder), LARGEST))["packages"].items()
        read = [_kept(package, **each) for package, each in list(found)[-MOST_PACKAGES:]]
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return []
    return [kept for kept in read if not hides(kept.package)]


def _kept(package: str, files: list[str], build: str, mark: str = "") -> Kept:
    """Read an entry of a record, which may come from somebody else's folder; raises ValueError for an invalid name."""
    names = 0 < len(files) <= MOST_FILES and all(DEFINITION.fullmatch(name) for name in files)
    short = all(len(name) <= LONGEST_NAME for name in (package, *files))
    if not (names and short and PACKAGE.fullmatch(package) and BUILD.fullmatch(build)):
        raise ValueError
    return Kept(package, tuple(files), cache_folder() / "interfaces" / package / build, str(mark))


def keep(folder: Path, built: Built, files: Iterable[str]) -> None:
    """Record that `built` was made from these definitions of `folder`; each belongs only to its last package."""
    with FileLock(cache_folder() / "record.lock"):
        key = _key() or _new_key()
        before = packages(folder)
        moved = set(files)
        known = {kept.package: kept for kept in before}
        for kept in before:
            if moved.intersection(kept.files):
                fewer = replace(kept, files=tuple(name for name in kept.files if name not in moved), mark="")
                known[kept.package] = _marked(folder, fewer, key) if _is_from_here(folder, kept, key) else fewer
        new = _marked(folder, Kept(built.package, tuple(sorted(moved)), built.prefix), key)
        if known.get(built.package) != new:
            known.pop(built.package, None)  # the newest is the last
            known[built.package] = new
        now = [kept for kept in known.values() if kept.files]
        if now != before:
            entries = {
                kept.package: {"files": kept.files, "build": kept.prefix.name, "mark": kept.mark} for kept in now
            }
            storage.replace(record_file(folder), json.dumps({"packages": entries}).encode())


def _key() -> bytes:
    """Return this user's key; b'' if there is none yet."""
    try:
        return (cache_folder() / KEY).read_bytes()
    except OSError:
        return b""


def _new_key() -> bytes:
    key = secrets.token_hex().encode()
    storage.replace(cache_folder() / KEY, key, storage.PRIVATE)
    return key


def _marked(folder: Path, kept: Kept, key: bytes) -> Kept:
    """Return the entry with the mark that it gets from this user in this folder."""
    text = json.dumps([str(folder.resolve()), kept.package, kept.files, kept.prefix.name])
    return replace(kept, mark=hmac.new(key, text.encode(), hashlib.sha256).hexdigest())


def _is_from_here(folder: Path, kept: Kept, key: bytes) -> bool:
    """Return True if this user has built the package in this folder."""
    return bool(key) and hmac.compare_digest(_marked(folder, kept, key).mark.encode(), kept.mark.encode())


def refresh(folder: Path) -> list[str]:
    """Build changed packages again; return a line for each of them, and for each whose definitions are gone.

    Only what this user has built in this folder is built again: a line says what else is not built, or has changed.
    """
    said = []
    key = _key()
    missing = []
    for kept in packages(folder):
        here = _is_from_here(folder, kept, key)
        if not here and not kept.prefix.exists():
            missing.append(kept)
            continue
        gone = [name for name in kept.files if not (folder / name).exists()]
        if gone:
            said.append(
                f"{', '.join(gone)} is missing: {kept.package} stays as it was last built. Run the cell that writes it."
            )
            continue
        try:
            paths = [folder / name for name in kept.files]
            changed = kept.prefix.name != identity(kept.package, paths)
            if changed and not here:
                said.append(
                    f"{kept.package} stays as it was last built, and {', '.join(kept.files)} or the course has changed "
                    f"since. To build it again, run the cell {_cell(kept)}."
                )
            elif changed:
                keep(folder, build(kept.package, paths, use=False), kept.files)
                said.append(
                    f"{', '.join(kept.files)} has changed: {kept.package} was built again. "
                    "Run the cell that imports it again."
                )
            elif not kept.prefix.exists():
                build(kept.package, paths, use=False)
        except InterfaceError as error:
            said.append(f"{kept.package} was not built again: {error}")
        except (RuntimeError, OSError) as error:
            said.append(f"{kept.package} could not be built again: {str(error).splitlines()[0]}")
    if missing:
        others = f" (and {len(missing) - 1} more)" if missing[1:] else ""
        said.append(f"{missing[0].package}{others} is not built on this machine: run the cell {_cell(missing[0])}.")
    return said


def _cell(kept: Kept) -> str:
    """Return how the cell begins that builds a package."""
    return f"`%%exercise {kept.files[0]} --package {kept.package}`"


def use(folder: Path) -> None:
    """Make the last builds of the folder's packages importable in this process and its children."""
    for kept in packages(folder):
        built = Built(kept.package, kept.prefix)
        if kept.prefix.exists() and sys.path.count(str(built.site_packages)) == 0:
            built.use()
