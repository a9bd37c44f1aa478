"""`rosdep` in the course's terminals: lists the packages that a workspace needs and that are missing.

rosdep itself installs such packages with apt.  Here there is no source to install them from, but a Python package can
be put into the workspace and built there.
"""

import argparse
import importlib.util
import sys
from pathlib import Path

from course.environment import prepare
from course.ros.packages import installed_packages, read_manifest
from course.workspace.package_files import LIBRARIES

# The dependencies of a package's programs; test dependencies are left out, because tests say what they miss.
NEEDS = ("depend", "build_depend", "build_export_depend", "buildtool_depend", "exec_depend")
MODULES = {key: module for module, key in LIBRARIES.items()}
ALL_THERE = "#All required rosdeps installed successfully"
NOTHING_TO_DO = (
    "rosdep installs what a package depends on. Here only `rosdep install` is needed, which says what is missing."
)


def missing(folders: list[Path]) -> dict[str, list[str]]:
    """Return the missing dependencies of the packages below the folders, each with the packages that need it."""
    needs: dict[str, list[str]] = {}
    here = set(installed_packages())
    for manifest in sorted(path for folder in folders for path in folder.rglob("package.xml")):
        try:
            root = read_manifest(manifest)
        except (OSError, ValueError):
            continue  # colcon reports what is wrong with it
        name = (root.findtext("name") or "").strip()
        here.add(name)
        for each in (child for child in root if child.tag in NEEDS):
            needs.setdefault((each.text or "").strip(), []).append(name)
    return {need: by for need, by in sorted(needs.items()) if need not in here and not _is_library(need)}


def _is_library(key: str) -> bool:
    """Return True for rosdep's name of an installed Python library."""
    module = MODULES.get(key) or key.removeprefix("python3-").replace("-", "_")
    return key.startswith("python3-") and importlib.util.find_spec(module) is not None


def _advice(need: str) -> str:
    if need.startswith("python3-"):
        return f"If it is on PyPI: uv pip install {need.removeprefix('python3-')}"
    return (
        "If it is written in Python, put its source into src, and colcon builds it with the rest: "
        f"https://index.ros.org/p/{need}"
    )


def main(words: list[str]) -> int:
    """Run the command; return 1 if something is missing."""
    if words[:1] != ["install"]:
        print(NOTHING_TO_DO)
        return 0
    parser = argparse.ArgumentParser(prog="rosdep install", add_help=False, allow_abbrev=True)
    parser.add_argument("--from-paths", nargs="+", type=Path, default=[])  # tutorials write --from-path, too
    folders = parser.parse_known_args(words[1:])[0].from_paths
    if absent := [str(folder) for folder in folders if not folder.is_dir()]:
        print(f"rosdep: there is no folder {absent[0]}: go to the workspace's root first", file=sys.stderr)
        return 1
    prepare()
    gaps = missing(folders)
    for need, by in gaps.items():
        print(
            f"{need} is not installed here, but {', '.join(sorted(set(by)))} needs it. {_advice(need)}", file=sys.stderr
        )
    if not gaps:
        print(ALL_THERE)
    return 1 if gaps else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
