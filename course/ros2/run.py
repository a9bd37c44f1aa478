"""`ros2 run`: start a node of the course, of the reader's own folder, or of any installed ament package."""

import argparse
import os
import shlex
import signal
import subprocess

from course.ros2 import completion
from course.ros2.packages import COURSE, find_executables, own_folders

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
