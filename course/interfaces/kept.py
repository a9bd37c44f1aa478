"""The interface packages that belong to a folder: what was built in it once can be imported there by every process.

`%%exercise Calculate.srv --package calculator_interfaces` builds a package from the definitions in a folder.  A small
file in the cache remembers it, so that a new kernel, a terminal and `ros2` in the same folder find the package too.
"""

import hashlib
import json
import os
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from filelock import FileLock

from course.errors import InterfaceError
from course.interfaces.builder import Built, build, cache_folder, identity


@dataclass(frozen=True)
class Kept:
    """A package of a folder."""

    package: str
    files: tuple[str, ...]  # names of its definitions, in the folder
    prefix: Path  # of its last build


def record_file(folder: Path) -> Path:
    """Where the packages of `folder` are remembered."""
    name = hashlib.sha256(os.fsencode(folder.resolve())).hexdigest()[:16]
    return cache_folder() / "folders" / f"{name}.json"


def packages(folder: Path) -> list[Kept]:
    """The packages that were built in `folder`."""
    try:
        found = json.loads(record_file(folder).read_text(encoding="utf-8"))["packages"]
        return [Kept(name, tuple(each["files"]), Path(each["prefix"])) for name, each in found.items()]
    except (OSError, ValueError, KeyError, TypeError):
        return []


def keep(folder: Path, built: Built, files: Iterable[str]) -> None:
    """Remember that `built` is made of these definitions of `folder`."""
    path = record_file(folder)
    path.parent.mkdir(parents=True, exist_ok=True)
    with FileLock(path.with_suffix(".lock")):
        known = {kept.package: {"files": kept.files, "prefix": str(kept.prefix)} for kept in packages(folder)}
        new = {"files": sorted(files), "prefix": str(built.prefix)}
        if known.get(built.package) == {"files": tuple(new["files"]), "prefix": new["prefix"]}:
            return
        known[built.package] = new
        draft = path.with_suffix(".part")
        draft.write_text(json.dumps({"folder": str(folder.resolve()), "packages": known}), encoding="utf-8")
        draft.replace(path)


def refresh(folder: Path) -> list[str]:
    """Build again what has changed on the disk since, and tell of it, a line each; of what has gone, too."""
    said = []
    for kept in packages(folder):
        gone = [name for name in kept.files if not (folder / name).exists()]
        if gone:
            said.append(f"{', '.join(gone)} is not there any more: {kept.package} stays as it was built. Run its cell.")
            continue
        try:
            paths = [folder / name for name in kept.files]
            if kept.prefix.name != identity(kept.package, paths) or not kept.prefix.exists():
                keep(folder, build(kept.package, paths, use=False), kept.files)
                said.append(
                    f"{', '.join(kept.files)} has changed: {kept.package} was built again. "
                    "Run the cell that imports it again."
                )
        except InterfaceError as error:
            said.append(f"{kept.package} was not built again: {error}")
        except (RuntimeError, OSError) as error:
            said.append(f"{kept.package} could not be built again: {str(error).splitlines()[0]}")
    return said


def use(folder: Path) -> None:
    """Make the folder's packages importable in this process and its children, as they were built last."""
    for kept in packages(folder):
        built = Built(kept.package, kept.prefix)
        if kept.prefix.exists() and sys.path.count(str(built.site_packages)) == 0:
            built.use()
