"""The interface packages of a folder: a package built in it can be imported by every process there.

`%%exercise Calculate.srv --package calculator_interfaces` builds a package from the definitions in a folder.  A small
file in that folder records it, so that a new kernel, a terminal and `ros2` in the same folder find the package, too. It
contains no paths, so it stays valid when the folder is copied or renamed.
"""

import json
import re
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from filelock import FileLock

from course.errors import InterfaceError
from course.foundation import storage
from course.interfaces.builder import Built, build, cache_folder, identity

RECORD = ".interfaces.json"
PLAIN = re.compile(r"\w[\w.]*", re.ASCII)  # a name that cannot lead to another folder


@dataclass(frozen=True)
class Kept:
    """A package of a folder."""

    package: str
    files: tuple[str, ...]  # names of its definitions, in the folder
    prefix: Path  # of its last build


def record_file(folder: Path) -> Path:
    """Return the path of the file that records the packages of `folder`."""
    return folder / RECORD


def packages(folder: Path) -> list[Kept]:
    """The packages that were built in `folder`."""
    try:
        found = json.loads(record_file(folder).read_text(encoding="utf-8"))["packages"].items()
        return [_kept(package, tuple(each["files"]), each["build"]) for package, each in found]
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return []


def _kept(package: str, files: tuple[str, ...], name: str) -> Kept:
    """Read an entry of a record, which may come from somebody else's folder; raises ValueError for an invalid name."""
    if not all(PLAIN.fullmatch(part) for part in (package, name, *files)):
        raise ValueError
    return Kept(package, files, cache_folder() / "interfaces" / package / name)


def keep(folder: Path, built: Built, files: Iterable[str]) -> None:
    """Record that `built` was made from these definitions of `folder`; each belongs only to its last package."""
    path = record_file(folder)
    with FileLock(cache_folder() / "record.lock"):
        before = {kept.package: {"files": list(kept.files), "build": kept.prefix.name} for kept in packages(folder)}
        moved = set(files)
        known = {
            package: {**each, "files": left}
            for package, each in before.items()
            if (left := [name for name in each["files"] if name not in moved])
        }
        known[built.package] = {"files": sorted(moved), "build": built.prefix.name}
        if known != before:
            storage.replace(path, json.dumps({"packages": known}).encode())


def refresh(folder: Path) -> list[str]:
    """Build changed packages again; return a line for each of them, and for each whose definitions are gone."""
    said = []
    for kept in packages(folder):
        gone = [name for name in kept.files if not (folder / name).exists()]
        if gone:
            said.append(
                f"{', '.join(gone)} is missing: {kept.package} stays as it was last built. Run the cell that writes it."
            )
            continue
        try:
            paths = [folder / name for name in kept.files]
            if kept.prefix.name != identity(kept.package, paths):
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
    return said


def use(folder: Path) -> None:
    """Make the last builds of the folder's packages importable in this process and its children."""
    for kept in packages(folder):
        built = Built(kept.package, kept.prefix)
        if kept.prefix.exists() and sys.path.count(str(built.site_packages)) == 0:
            built.use()
