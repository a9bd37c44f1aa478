"""`ros2 run`: start a node of the course, of a package in the current folder, or of an installed ament package."""

import contextlib
import os
import shlex
import signal
import subprocess
import sys
from argparse import REMAINDER, ArgumentParser, Namespace

from course.environment import KERNEL
from course.errors import RosError
from course.foundation.processes import sleeping
from course.ros.packages import COURSE, find_executables, installed_paths, own_folders
from course.ros2 import completion, grammar

PREFIX = "[ros2run]:"
TELLING = 5  # s after which the reader is told that a program holds a notebook's cell
AGAIN = 2  # s after which a program that still runs gets SIGTERM again


def add_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 run`."""
    parser.add_argument(
        "--prefix",
        help="Prefix command, which should go before the executable. Command must be wrapped in quotes if it contains "
        "spaces (e.g. --prefix 'gdb -ex run --args').",
    )
    grammar.complete_with(parser.add_argument("package_name", help="Name of the ROS package"), completion.packages)
    grammar.complete_with(parser.add_argument("executable_name", help="Name of the executable"), completion.executables)
    parser.add_argument("argv", nargs=REMAINDER, help="Pass arbitrary arguments to the executable")
    parser.set_defaults(main=main)


def main(args: Namespace) -> int | str:
    """Start the executable, wait until it ends and return its exit status; Ctrl-C is left to the executable."""
    executables = find_executables(args.package_name)
    if executables is None:
        raise RosError(f"Package '{args.package_name}' not found")
    name = args.executable_name
    commands = executables.get(name) or executables.get(name.removesuffix(".py"))
    if not commands:
        grammar.tell_near(name, executables)
        return "No executable found"
    if len(commands) > 1:
        raise RosError("\n- ".join(["Multiple executables found:", *(command[-1] for command in commands)]))
    (command,) = commands
    prefix = shlex.split(args.prefix) if args.prefix else []
    try:
        child = subprocess.Popen([*prefix, *command, *args.argv], env=child_environment(args.package_name))
    except OSError as error:
        return f"{error.strerror}: '{error.filename}'"
    _pass_on_termination(child)
    if KERNEL in os.environ and sys.stdin.isatty():  # run by `!`
        _tell_of_the_held_cell(child)
    while child.returncode is None:
        with contextlib.suppress(KeyboardInterrupt):  # the child receives Ctrl-C, too: keep waiting until it ends
            child.wait()
    if child.returncode < 0:
        print(PREFIX, signal.strsignal(-child.returncode))
    elif child.returncode > 0:
        print(PREFIX, f"Process exited with failure {child.returncode}")
    return child.returncode


def _tell_of_the_held_cell(child: subprocess.Popen[bytes]) -> None:
    """Tell the reader that the cell lasts as long as the program, if that sleeps after `TELLING` s."""
    with contextlib.suppress(KeyboardInterrupt, subprocess.TimeoutExpired):
        child.wait(TELLING)
    if child.returncode is None and sleeping(child.pid):
        words = shlex.join(["ros2", *sys.argv[1:]])
        print(
            f"This cell lasts as long as the program, and is ended by the ■ button. To have a node run beside your "
            f"cells, type `{words}` in a terminal (File, New, Terminal).",
            file=sys.stderr,
            flush=True,
        )


def _pass_on_termination(child: subprocess.Popen[bytes]) -> None:
    """Pass SIGTERM on to the child, repeatedly while it runs.

    One in a hundred programs in `rclpy.spin` misses the first SIGTERM: rclpy 7.1.6 wakes the executor before it shuts
    the context down (`signal_handler.cpp`), and an executor that checks the context in between goes on waiting.
    """

    def end(number: int, frame: object) -> None:
        child.terminate()
        signal.alarm(AGAIN)

    signal.signal(signal.SIGTERM, end)
    signal.signal(signal.SIGALRM, end)


def child_environment(name: str) -> dict[str, str]:
    """Return the child's environment, in which a package of the current folder is importable by name."""
    environment = dict(os.environ)
    if name == COURSE or installed_paths(name) is not None:
        return environment
    if folder := own_folders().get(name):
        importable = folder if (folder / name / "__init__.py").exists() else folder.parent
        known = environment.get("PYTHONPATH")
        environment["PYTHONPATH"] = os.pathsep.join([str(importable), *([known] if known else [])])
    return environment
