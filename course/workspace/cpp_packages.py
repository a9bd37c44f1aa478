"""Has colcon skip a workspace's C++ packages, which cannot be built here, and build the rest.

colcon stops at the first package that fails, and the repositories that tutorials clone hold packages in C++ beside
those in Python. The wheels have no rclcpp, ROS 2's library for C++; where a ROS 2 installation has it, all are built.
"""

import argparse
import sys
from typing import Any

from colcon_core.package_selection import PackageSelectionExtensionPoint

from course.ros.packages import installed_packages

LIBRARY = "rclcpp"
VERBS = ("build", "test")  # other verbs build nothing


class CppPackageSelection(PackageSelectionExtensionPoint):
    """colcon's extension: deselects packages that need rclcpp, where it is neither installed nor in the workspace."""

    def select_packages(self, *, args: argparse.Namespace, decorators: list[Any]) -> None:
        """Deselect packages that need rclcpp, and those that need such a package; say so on stderr."""
        if args.verb_name not in VERBS:
            return
        there = {*installed_packages(), *(each.descriptor.name for each in decorators)}
        impossible: set[str] = set()
        left_out = []
        for each in decorators:  # in order of their dependencies
            needs = {str(need) for need in each.descriptor.get_dependencies(categories=("build", "run"))}
            if needs & impossible or any(_is_of_library(need) and need not in there for need in needs):
                impossible.add(each.descriptor.name)
                left_out += [each.descriptor.name] if each.selected else []
                each.selected = False
        if left_out:
            many = f"{len(left_out)} packages" if len(left_out) > 1 else "one package"
            print(
                f"colcon: leaving out {many} in C++, because {LIBRARY}, the ROS 2 library for C++, is not installed "
                f"here: {', '.join(left_out)}",
                file=sys.stderr,
            )


def _is_of_library(package: str) -> bool:
    return package == LIBRARY or package.startswith(f"{LIBRARY}_")
