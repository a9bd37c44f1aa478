"""`ros2 run`: start a node of the course, of the reader's own folder, or of any installed ament package."""

import argparse
import os
import shlex
import signal
import subprocess
import sys
from pathlib import Path

from course.ros2 import completion

COURSE = "course"
NODES = Path(__file__).parent.parent / "nodes"
PREFIX = "[ros2run]:"


def add_arguments(parser) -> None:
    """Add the arguments of `ros2 run`."""
    parser.add_argument(
        "--prefix",
        help="Prefix command, which should go before the executable. Command must be wrapped in quotes if it contains "
        "spaces (e.g. --prefix 'gdb -ex run --args').",
    )
    parser.add_argument("package_name", help="Name of the ROS package").completer = completion.packages
    parser.add_argument("executable_name", help="Name of the executable").completer = completion.executables
    parser.add_argument("argv", nargs=argparse.REMAINDER, help="Pass arbitrary arguments to the executable")
    parser.set_defaults(main=main)


# --- packages ---


def own_folders() -> dict[str, Path]:
    """Return the packages of the current folder: each folder, under its name, and each that has a package.xml.

    A package.xml counts in the current folder and one or two below it (`src/my_package/package.xml`).
    """
    here = Path.cwd()
    folders = {path.name: path for path in sorted(here.iterdir()) if path.is_dir() and path.name[0] not in "._"}
    for manifest in sorted((*here.glob("package.xml"), *here.glob("*/package.xml"), *here.glob("*/*/package.xml"))):
        if name := package_name(manifest):
            folders[name] = manifest.parent
    return folders


def package_name(manifest: Path) -> str | None:
    """Return the name that a package.xml gives, or None if it cannot be read."""
    from xml.etree import ElementTree

    try:
        return (ElementTree.parse(manifest).getroot().findtext("name") or "").strip() or None
    except (OSError, ElementTree.ParseError):
        return None


def own_executables(name: str, folder: Path) -> dict[str, list[str]]:
    """Return the command of each Python file of a package's folder, and of its folder of the same name."""
    found = {}
    for place in (folder / name, folder):
        for path in sorted(place.glob("*.py")):
            if path.name not in ("__init__.py", "setup.py", "conftest.py"):
                found.setdefault(path.stem, [sys.executable, str(path)])
    return found


def installed_executables(name: str) -> dict[str, list[str]] | None:
    """Return the command of each executable of an ament package (`lib/<package>`), or None for an unknown package.

    Raises RuntimeError if two files have one name.
    """
    from ament_index_python import PackageNotFoundError, get_package_prefix

    try:
        base = Path(get_package_prefix(name), "lib", name)
    except (PackageNotFoundError, ValueError):
        return None
    found = {}
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
    """Return the names that `ros2 run` completes: packages that have something to run."""
    from ament_index_python import get_packages_with_prefixes

    installed = [name for name, prefix in get_packages_with_prefixes().items() if Path(prefix, "lib", name).is_dir()]
    own = [name for name, folder in own_folders().items() if own_executables(name, folder)]
    return sorted({COURSE, *installed, *own})


# --- the child ---


def main(args) -> int | str:
    """Start the executable and return its exit status once it has ended; Ctrl-C is left to the child."""
    executables = find_executables(args.package_name)
    if executables is None:
        raise RuntimeError(f"Package '{args.package_name}' not found")
    command = executables.get(args.executable_name) or executables.get(args.executable_name.removesuffix(".py"))
    if command is None:
        return "No executable found"
    prefix = shlex.split(args.prefix) if args.prefix else []
    try:
        child = subprocess.Popen([*prefix, *command, *args.argv], env=child_environment(args.package_name))
    except OSError as error:
        return f"{error.strerror}: '{error.filename}'"
    signal.signal(signal.SIGTERM, lambda number, frame: child.terminate())
    while child.returncode is None:
        try:
            child.wait()
        except KeyboardInterrupt:
            pass  # the child has been sent it too, and is waited for
    if child.returncode < 0:
        print(PREFIX, signal.strsignal(-child.returncode))
    elif child.returncode > 0:
        print(PREFIX, f"Process exited with failure {child.returncode}")
    return child.returncode


def child_environment(name: str) -> dict[str, str]:
    """Return the child's environment: a package of the reader's own can be imported by its name."""
    folder = own_folders().get(name)
    environment = dict(os.environ)
    if name != COURSE and folder:
        importable = folder if (folder / name / "__init__.py").exists() else folder.parent
        known = environment.get("PYTHONPATH")
        environment["PYTHONPATH"] = os.pathsep.join([str(importable), *([known] if known else [])])
    return environment
