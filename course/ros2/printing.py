"""The options of `topic`, `service` and `action echo` for the amount and form of printed messages."""

from argparse import ArgumentParser, Namespace

from course.ros import messages
from course.ros.messages import Limits, Message
from course.ros2 import grammar

TRUNCATE_LENGTH = 128


def add_length_arguments(parser: ArgumentParser) -> None:
    """Add the options about long arrays and strings."""
    parser.add_argument(
        "--full-length",
        "-f",
        action="store_true",
        help="Output all elements for arrays, bytes, and string with a length > '--truncate-length', by default they "
        "are truncated after '--truncate-length' elements with '...''",
    )
    parser.add_argument(
        "--truncate-length",
        "-l",
        type=grammar.unsigned_int,
        default=TRUNCATE_LENGTH,
        help=f"The length to truncate arrays, bytes, and string to (default: {TRUNCATE_LENGTH})",
    )
    parser.add_argument("--no-arr", action="store_true", help="Don't print array fields of messages")
    parser.add_argument("--no-str", action="store_true", help="Don't print string fields of messages")
    parser.add_argument(
        "--flow-style", action="store_true", help="Print collections in the block style (not available with csv format)"
    )


def add_event_arguments(parser: ArgumentParser) -> None:
    """Add the options of `service echo` and `action echo`."""
    parser.add_argument(
        "--csv", action="store_true", help="Output all recursive fields separated by commas (e.g. for plotting)."
    )
    add_length_arguments(parser)


def limits(args: Namespace) -> Limits:
    """Return the limits that the options set."""
    return Limits(None if args.full_length else args.truncate_length, args.no_arr, args.no_str)


def event_text(message: Message, args: Namespace) -> str:
    """Return the text of a message for `service echo` and `action echo`, with an event's kind by name."""
    if args.csv:
        return messages.to_csv(message, limits(args))
    plain = messages.to_plain(message, limits(args))
    if "event_type" in plain.get("info", {}):
        plain["info"]["event_type"] = _event_names()[plain["info"]["event_type"]]
    return messages.plain_to_yaml(plain, flow_style=args.flow_style) + "---"


def _event_names() -> dict[int, str]:
    from service_msgs.msg import ServiceEventInfo

    names = ("REQUEST_SENT", "REQUEST_RECEIVED", "RESPONSE_SENT", "RESPONSE_RECEIVED")
    return {getattr(ServiceEventInfo, name): name for name in names}
