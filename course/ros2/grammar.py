"""The grammar of the command line: sub-commands, and the options that many verbs share, laid out as in ros2cli."""

import argparse
from collections.abc import Callable, Iterable
from typing import NamedTuple

NEAR = 0.8  # least similarity of a name and the one that may be meant

Completer = Callable[..., Iterable[str]]  # called by argcomplete with prefix, action, parser and parsed_args


class Verb(NamedTuple):
    """One sub-command: its summary for `-h`, the function that adds its arguments, and the one that runs it."""

    summary: str
    add_arguments: Callable[[argparse.ArgumentParser], None]
    main: Callable[[argparse.Namespace], int | str | None]


def complete_with(argument: argparse.Action, completer: Completer) -> None:
    """Have the Tab key complete `argument` by `completer`."""
    argument.completer = completer  # type: ignore[attr-defined]  # argcomplete looks there


def add_subparsers(
    parser: argparse.ArgumentParser, prog: str, summaries: dict[str, str]
) -> dict[str, argparse.ArgumentParser]:
    """Give `parser` a sub-parser for each name; return them by name."""
    width = max(map(len, summaries))
    listing = "".join(f"{name.ljust(width)}  {summaries[name]}\n" for name in sorted(summaries))
    subparsers = parser.add_subparsers(
        title="Commands", description=listing, metavar=f"Call `{prog} <command> -h` for more detailed usage."
    )
    subparsers.required = False
    return {
        name: subparsers.add_parser(
            name, description=summaries[name], formatter_class=argparse.RawDescriptionHelpFormatter
        )
        for name in sorted(summaries)
    }


def add_verbs(parser: argparse.ArgumentParser, prog: str, verbs: dict[str, Verb]) -> None:
    """Add the verbs of a command; without a verb, the command prints its help."""
    parser.set_defaults(main=lambda args: parser.print_help())
    parsers = add_subparsers(parser, prog, {name: verb.summary for name, verb in verbs.items()})
    for name, verb in verbs.items():
        verb.add_arguments(parsers[name])
        parsers[name].set_defaults(main=verb.main)


def add_direct_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of a verb that creates a node."""
    parser.add_argument(
        "--spin-time",
        type=float,
        help="Spin time in seconds to wait for discovery (only applies when not using an already running daemon)",
    )
    parser.add_argument("-s", "--use-sim-time", action="store_true", help="Enable ROS simulation time")


def add_strategy_arguments(parser: argparse.ArgumentParser) -> None:
    """Add ros2cli's options of verbs that may ask the daemon; here there is no daemon."""
    add_direct_arguments(parser)
    parser.add_argument("--no-daemon", action="store_true", help="Do not spawn nor use an already running daemon")


def add_hidden(parser: argparse.ArgumentParser, *names: str, what: str, verb: bool = True) -> None:
    """Add `--include-hidden-...`; a verb's option does not override the same option of the command."""
    parser.add_argument(
        *names,
        action="store_true",
        default=argparse.SUPPRESS if verb else False,
        help=f"Consider hidden {what} as well",
    )


def nonnegative_int(text: str) -> int:
    """Return an integer of 0 or more; raises ValueError, which argparse reports as `invalid nonnegative_int value`."""
    value = int(text)
    if value < 0:
        raise ValueError("Value must be positive or zero")
    return value


def positive_float(text: str) -> float:
    """Return a number above 0; raises ArgumentTypeError, whose message argparse prints."""
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError("Expects a floating point number") from None
    if value <= 0.0:
        raise argparse.ArgumentTypeError("Value must be positive")
    return value


def unsigned_int(text: str) -> int:
    """Return an integer of 0 or more; raises ArgumentTypeError, whose message argparse prints."""
    if not text.isdigit():
        raise argparse.ArgumentTypeError("value must be non-negative integer")
    return int(text)


def positive_int(text: str) -> int:
    """Return an integer of 1 or more; raises ArgumentTypeError, whose message argparse prints."""
    if not text.isdigit() or int(text) == 0:
        raise argparse.ArgumentTypeError("value must be a positive integer")
    return int(text)


def read_stdin() -> str:
    """Return all of standard input, for the option `--stdin`."""
    import sys

    return sys.stdin.read()


def tell_near(name: str, known: Iterable[str]) -> None:
    """Print on stderr which known name may be meant by `name`, if one is nearly the same."""
    import difflib  # here, because most commands need none of these
    import sys

    from course.foundation.untrusted import one_line

    others = [each for each in known if each != name]
    near = difflib.get_close_matches(name, others, 1, NEAR)
    if not near and name.count("/") == 2 and not name.startswith("/"):  # a type of another package
        near = [each for each in others if each.partition("/")[2] == name.partition("/")[2]]
    if not near and "/" not in name:  # a type without its package
        near = [each for each in others if each.count("/") == 2 and each.endswith(f"/{name}")]
        near = [" or ".join(sorted(near))] if near else []
    if near:
        print(f"Did you mean {one_line(near[0])}?", file=sys.stderr)
