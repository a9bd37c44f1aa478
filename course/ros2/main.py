"""The `ros2` command: hand over to a real `ros2` if there is one, else parse the command line and run the verb."""

import argparse
import importlib
import os
import shlex
import shutil
import signal
import sys
import warnings

from course.environment import prepare
from course.foundation.untrusted import guard_terminal
from course.ros2 import grammar

# Each command is the module of this package with its name, or with that in ALIASES.
COMMANDS = {
    "action": "Various action related sub-commands",
    "daemon": "Various daemon related sub-commands",
    "doctor": "Check ROS setup and other potential issues",
    "interface": "Show information about ROS interfaces",
    "lifecycle": "Various lifecycle related sub-commands",
    "node": "Various node related sub-commands",
    "param": "Various param related sub-commands",
    "pkg": "Various package related sub-commands",
    "run": "Run a package specific executable",
    "service": "Various service related sub-commands",
    "topic": "Various topic related sub-commands",
    "wtf": "Use `wtf` as alias to `doctor`",
}
ALIASES = {"wtf": "doctor"}
# Commands of ros2cli, launch and rosbag2 that this one does not have.
ELSEWHERE = (
    "bag", "control", "extension_points", "extensions", "launch", "plugin", "security", "test", "trace",
)  # fmt: skip
# Commands that make no sense here, with an explanation and what to use instead.
INSTEAD = {
    "component": "loads C++ nodes into a running process. The nodes here are programs in Python: start each with "
    "`ros2 run PACKAGE EXECUTABLE`; in a notebook, ros.start(NodeClass) runs several in one process",
    "multicast": "tests whether computers in a network reach each other. The nodes of this course are on this computer "
    "alone, and find each other without multicast: `ros2 doctor` checks what they need",
}


def find_real() -> str | None:
    """Return the first `ros2` on PATH that is not this command, installed here or in another environment."""
    for folder in os.environ.get("PATH", "").split(os.pathsep):
        path = shutil.which("ros2", path=folder) if folder else None
        if path is None:
            continue
        with open(path, "rb") as file:
            if b"course.ros2.main" not in file.read(4096):
                return path
    return None


def hand_over(path: str) -> None:
    """Replace this process by the real `ros2`, whose Python must not load this environment's libraries."""
    libraries = os.environ.get("LD_LIBRARY_PATH", "").split(os.pathsep)
    kept = [folder for folder in libraries if folder and not folder.startswith(sys.prefix + os.sep)]
    os.environ.pop("LD_LIBRARY_PATH", None)
    os.environ.pop("_ROS_WHEELS_BOOTSTRAP_COMPLETE", None)
    if kept:
        os.environ["LD_LIBRARY_PATH"] = os.pathsep.join(kept)
    os.execv(path, [path, *sys.argv[1:]])


def selected_command(words: list[str]) -> str | None:
    """Return the command among the words of a command line: the first that is not an option."""
    return next((word for word in words if not word.startswith("-")), None)


def make_parser(words: list[str]) -> argparse.ArgumentParser:
    """Return the parser for `words`: it knows the names of all commands, and the arguments of the one in `words`."""
    parser = argparse.ArgumentParser(
        prog="ros2",
        description="ros2 is an extensible command-line tool for ROS 2.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--use-python-default-buffering",
        action="store_true",
        help="Do not force line buffering in stdout and instead use the python default buffering, "
        "which might be affected by PYTHONUNBUFFERED/-u and depends on whatever stdout is interactive or not",
    )
    parser.set_defaults(main=lambda args: parser.print_help())
    parsers = grammar.add_subparsers(parser, "ros2", COMMANDS)
    selected = selected_command(words)
    if selected in COMMANDS:
        importlib.import_module(f"course.ros2.{ALIASES.get(selected, selected)}").add_arguments(parsers[selected])
    return parser


def complete(parser: argparse.ArgumentParser) -> None:
    """If the shell asks for completions, print them and exit."""
    if "_ARGCOMPLETE" in os.environ:
        import argcomplete

        argcomplete.autocomplete(parser, exclude=["-h", "--help"])


def words_to_complete() -> list[str]:
    """Return the words typed so far when the shell asks for completions; an open quote is taken as part of a word."""
    line = os.environ.get("COMP_LINE", "")
    try:
        return shlex.split(line)[1:]
    except ValueError:
        return line.split()[1:]


def main() -> int | str | None:
    """Run the command line; return its exit status, or a message for stderr, which means exit status 1."""
    prepare()
    real = find_real()
    if real:
        hand_over(real)
    parser = make_parser(words_to_complete() if "_ARGCOMPLETE" in os.environ else sys.argv[1:])
    complete(parser)
    selected = selected_command(sys.argv[1:])
    if selected in ELSEWHERE:
        return (
            f"ros2 {selected} needs a full installation of ROS 2 (https://docs.ros.org/en/jazzy/Installation.html): "
            f"this ros2 has {', '.join(COMMANDS)}"
        )
    if selected in INSTEAD:
        return f"ros2 {selected} {INSTEAD[selected]}."
    guard_terminal()  # names, logs, parameters and messages can come from any program
    try:
        args = parser.parse_args()
    except SystemExit:
        if any(word.startswith("{") and word.count("{") > word.count("}") for word in sys.argv[1:]):
            print(
                'Put quotation marks around the values: "{...}". Without them each blank ends a word.', file=sys.stderr
            )
        raise
    if not args.use_python_default_buffering:
        sys.stdout.reconfigure(line_buffering=True)  # type: ignore[union-attr]  # a TextIOWrapper unless replaced
    # After rejecting a name, rclpy warns about its own incomplete cleaning up.
    warnings.simplefilter("ignore", RuntimeWarning)
    # When Ctrl-C comes while rclpy makes an executor, its __del__ complains about attributes that it does not have.
    sys.unraisablehook = lambda unraisable: None
    try:
        return args.main(args)
    except KeyboardInterrupt:
        return signal.SIGINT
    except (RuntimeError, ValueError) as error:
        return str(error)
    except BrokenPipeError:
        # Nobody reads the output any more (`ros2 topic echo /x | head`).
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except Exception as error:
        # rclpy's errors about the name of a node, topic or service say what is wrong, and where.
        if type(error).__module__ == "rclpy.exceptions":
            return str(error)
        raise


if __name__ == "__main__":
    sys.exit(main())
