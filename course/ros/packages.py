"""Packages and their executables: the course, the packages in the current folder, and the installed ones."""

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from course.foundation.untrusted import read_regular

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

LARGEST_MANIFEST = 1_000_000  # bytes of a package.xml
COURSE = "course"
BOOK = "my_package"  # the name of the reader's package in the book's commands
NODES = Path(__file__).parent.parent / "nodes"
# The demo packages of the beginner's tutorials whose nodes the course has: module and arguments.
DEMOS = {
    "add_two_ints_client": ("add_two_ints_client", "2", "3"),  # the numbers that the demo adds
    "add_two_ints_client_async": ("add_two_ints_client", "2", "3"),
    "add_two_ints_server": ("add_two_ints_server",),
    "introspection": ("demos.introspection",),
    "introspection_client": ("demos.introspection", "client"),
    "introspection_service": ("demos.introspection", "service"),
    "lifecycle_talker": ("demos.lifecycle_talker",),
    "listener": ("demos.listener",),
    "parameter_blackboard": ("demos.parameter_blackboard",),
    "talker": ("demos.talker",),
}
_COMMON = {"add_two_ints_client", "add_two_ints_client_async", "add_two_ints_server", "listener", "talker"}
DEMO_PACKAGES = {
    "demo_nodes_cpp": _COMMON | {"introspection_client", "introspection_service", "parameter_blackboard"},
    "demo_nodes_py": _COMMON | {"introspection"},
    "lifecycle": {"lifecycle_talker"},
    "lifecycle_py": {"lifecycle_talker"},
}
# The executables of a package by name, each with the commands that start it: several if several files have the name.
Executables = dict[str, list[list[str]]]


def own_folders() -> dict[str, Path]:
    """Return the packages in the current folder: each folder by its own name, or by the name in its package.xml.

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
    try:
        return (read_manifest(manifest).findtext("name") or "").strip() or None
    except (OSError, ValueError):
        return None


def read_manifest(manifest: Path) -> "Element":
    """Return the root of a package.xml; raises OSError, and ValueError for anything but a small file with XML."""
    from xml.etree import ElementTree

    try:
        return ElementTree.fromstring(read_regular(manifest, LARGEST_MANIFEST))
    except (ElementTree.ParseError, LookupError) as error:  # not XML, or in an unknown encoding
        raise ValueError(str(error)) from None


def own_executables(name: str, folder: Path) -> Executables:
    """Return the Python files in a package's folder, or in its subfolder of the same name."""
    found: Executables = {}
    for place in (folder / name, folder):
        for path in sorted(place.glob("*.py")):
            if path.name not in ("__init__.py", "setup.py", "conftest.py") and path.is_file():
                found.setdefault(path.stem, [[sys.executable, str(path)]])
    return found


def installed_prefix(name: str) -> Path | None:
    """Return the folder that an ament package is installed in, or None for an unknown package."""
    from ament_index_python import PackageNotFoundError, get_package_prefix

    try:
        return Path(get_package_prefix(name))
    except (PackageNotFoundError, ValueError):
        return None


def installed_paths(name: str) -> list[Path] | None:
    """Return the executables of an ament package (the files in `lib/<package>`), or None for an unknown package."""
    prefix = installed_prefix(name)
    if prefix is None:
        return None
    found = []
    for folder, folders, files in os.walk(prefix / "lib" / name):
        folders[:] = sorted(each for each in folders if not each.startswith("."))
        found += [Path(folder, file) for file in sorted(files) if os.access(Path(folder, file), os.X_OK)]
    return found


def find_executables(name: str) -> Executables | None:
    """Return the executables of an installed package, or else of one in this folder; None if there is neither.

    As long as there is no `my_package`, it stands for the Python files in this folder and the course's nodes, so that
    the book's commands work as they are printed.
    """
    installed = installed_paths(name)
    found: Executables = {}
    for path in installed or ():
        found.setdefault(path.name, []).append([str(path)])
    if name == COURSE:  # exists even if it is not registered
        for path in sorted(NODES.glob("[!_]*.py")):
            found.setdefault(path.stem, [_node(path.stem)])
    elif installed is None:
        if folder := own_folders().get(name):
            return own_executables(name, folder)
        if name in DEMO_PACKAGES:
            return {demo: [_node(*DEMOS[demo])] for demo in sorted(DEMO_PACKAGES[name])}
        return {**(find_executables(COURSE) or {}), **own_executables(name, Path.cwd())} if name == BOOK else None
    return found


def _node(name: str, *arguments: str) -> list[str]:
    """Return the command that runs a node's module; a folder called `course` is not the package (-P)."""
    return [sys.executable, "-P", "-m", f"course.nodes.{name}", *arguments]


def installed_packages() -> list[str]:
    """Return the names of the installed ament packages, sorted."""
    from ament_index_python import get_packages_with_prefixes

    return sorted(get_packages_with_prefixes())


def all_packages() -> list[str]:
    """Return the names of the packages that have something to run."""
    from ament_index_python import get_packages_with_prefixes

    installed = [name for name, prefix in get_packages_with_prefixes().items() if Path(prefix, "lib", name).is_dir()]
    own = [name for name, folder in own_folders().items() if own_executables(name, folder)]
    return sorted({COURSE, *DEMO_PACKAGES, *installed, *own})
