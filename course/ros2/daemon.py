"""`ros2 daemon`: ros2cli's daemon watches the graph to make later commands faster; here there is none."""

from argparse import ArgumentParser, Namespace

from course.ros2 import grammar
from course.ros2.grammar import Verb


def _add_no_arguments(parser: ArgumentParser) -> None:
    pass


def _add_start_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("--debug", "-d", action="store_true", help="Print debug messages")


def tell(args: Namespace) -> None:
    """Say that there is no daemon; the exit status is 0, so that scripts for any ROS 2 go on."""
    print("There is no daemon: this ros2 does not use one, and each command queries the graph itself")


VERBS = {
    "start": Verb("Start the daemon if it isn't running", _add_start_arguments, tell),
    "status": Verb("Output the status of the daemon", _add_no_arguments, tell),
    "stop": Verb("Stop the daemon if it is running", _add_no_arguments, tell),
}


def add_arguments(parser: ArgumentParser) -> None:
    """Add the verbs of `ros2 daemon`."""
    grammar.add_verbs(parser, "ros2 daemon", VERBS)
