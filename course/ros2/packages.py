"""Packages and their executables: the course, the packages in the current folder, and the installed ones."""

import os
import sys
from pathlib import Path

COURSE = "course"
NODES = Path(__file__).parent.parent / "nodes"


def own_folders() -> dict[str, Path]:
    """Return the packages in the current folder: each folder under its own name, or under that in its package.xml.

    A package.xml is looked for in the current folder and up to two folders below (`src/my_package/package.xml`).
    """
    here = Path.cwd()
    folders = {path.name: path for path in sorted(here.iterdir()) if path.is_dir() and path.name[0] not in "._"}
    for manifest in sorted((*here.glob("package.xml"), *here.glob("*/package.xml"), *here.glob("*/*/package.xml"))):
        if name := package_name(manifest):
            folders[name] = manifest.parent
    return folders


def package_name(manifest: Path) -> str | None:
    """Return the package's name in a package.xml, or None if it cannot be read."""
    from xml.etree import ElementTree

    try:
        return (ElementTree.parse(manifest).getroot().findtext("name") or "").strip() or None
    except (OSError, ElementTree.ParseError):
        return None


def own_executables(name: str, folder: Path) -> dict[str, list[str]]:
    """Return the command that runs each Python file in a package's folder, or in the folder of its name in there."""
    found: dict[str, list[str]] = {}
    for place in (folder / name, folder):
        for path in sorted(place.glob("*.py")):
            if path.name not in ("__init__.py", "setup.py", "conftest.py"):
                found.setdefault(path.stem, [sys.executable, str(path)])
    return found


def installed_executables(name: str) -> dict[str, list[str]] | None:
    """Return the command of each executable of an ament package (`lib/<package>`), or None for an unknown package.

    Raises RuntimeError if two files have the same name.
    """
    from ament_index_python import PackageNotFoundError, get_package_prefix

    try:
        base = Path(get_package_prefix(name), "lib", name)
    except (PackageNotFoundError, ValueError):
        return None
    found: dict[str, list[str]] = {}
    for folder, folders, files in os.walk(base):
        folders[:] = sorted(each for each in folders if not each.startswith("."))
        for path in (Path(folder, file) for file in sorted(files)):
            if os.access(path, os.X_OK):
                found.setdefault(path.name, []).append(str(path))
    for paths in found.values():
        if len(paths) > 1:
            raise RuntimeError("\n- ".join(["Multiple executables found:", *paths]))
    return found


def find_executables(name: str) -> dict[str, list[str]] | None:
    """Return the command that starts each executable of a package, or None if there is no such package."""
    installed = installed_executables(name)
    folder = own_folders().get(name)
    own = own_executables(name, folder) if folder else None
    if name == COURSE:
        modules = (path.stem for path in sorted(NODES.glob("*.py")) if path.stem != "__init__")
        own = {module: [sys.executable, "-m", f"course.nodes.{module}"] for module in modules}
    if installed is None and own is None:
        return None
    return {**(installed or {}), **(own or {})}


def all_packages() -> list[str]:
    """Return the names of the packages that have something to run."""
    from ament_index_python import get_packages_with_prefixes

    installed = [name for name, prefix in get_packages_with_prefixes().items() if Path(prefix, "lib", name).is_dir()]
    own = [name for name, folder in own_folders().items() if own_executables(name, folder)]
    return sorted({COURSE, *installed, *own})
