"""`ros2 topic echo`: print the messages of a topic; with helpers for other verbs that subscribe to a topic."""

from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from typing import Any

from course.errors import RosError
from course.ros import messages, qos
from course.ros.elsewhere import tell_if_alone
from course.ros.graph import CERTAIN, Graph
from course.ros.messages import Message
from course.ros2 import completion, grammar, printing, qos_options

# --- a topic's type ---


def find_message_type(graph: Graph, topic: str, *, wait: bool) -> Any:
    """Return the message class of a topic; for an unknown topic None, or `wait` until it is known.

    Raises RosError for a topic with several types, or with a type that is not installed.
    """
    from rclpy.expand_topic_name import expand_topic_name
    from rclpy.validate_full_topic_name import validate_full_topic_name

    name = expand_topic_name(topic, graph.node.get_name(), graph.node.get_namespace())
    validate_full_topic_name(name)

    def look() -> list[str]:
        return dict(graph.topics(hidden=True)).get(name, [])

    types = graph.types_of(name, lambda: graph.topics(hidden=True))
    if not types:
        print(f"WARNING: topic [{topic}] does not appear to be published yet")
        grammar.tell_near(name, (known for known, _ in graph.topics(hidden=False)))
        tell_if_alone(graph)
        if not wait:
            return None
        graph.wait_until(look)
        types = look()
    if len(types) > 1:
        raise RosError(f"Cannot echo topic '{topic}', as it contains more than one type: [{', '.join(types)}]")
    try:
        return messages.get_message(types[0])
    except messages.INVALID_TYPE:
        raise RosError(f"The message type '{types[0]}' is invalid") from None


def make_filter(expression: str | None) -> Callable[[Message], Any]:
    """Return the test given by `--filter`, a Python expression of the message `m`.

    Raises RosError if it is not valid Python.
    """
    if not expression:
        return lambda m: True
    try:
        code = compile(expression, "<filter>", "eval")
    except SyntaxError as error:
        raise RosError(f"Invalid filter expression '{expression}': {error}") from None
    return lambda m: eval(code, {"m": m})


# --- echo ---


def add_echo_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 topic echo`."""
    grammar.add_strategy_arguments(parser)
    grammar.complete_with(
        parser.add_argument("topic_name", help="Name of the ROS topic to listen to (e.g. '/chatter')"),
        completion.topic_names,
    )
    grammar.complete_with(
        parser.add_argument("message_type", nargs="?", help="Type of the ROS message (e.g. 'std_msgs/msg/String')"),
        completion.topic_type,
    )
    qos_options.add_arguments(parser, "subscribe", "sensor_data")
    add = parser.add_argument
    add(
        "--csv",
        action="store_true",
        help="Output all recursive fields separated by commas (e.g. for plotting). If --include-message-info is also "
        "passed, the following fields are prepended: source_timestamp, received_timestamp, "
        "publication_sequence_number, reception_sequence_number.",
    )
    add(
        "--field",
        help="Echo a selected field of a message. Use '.' to select sub-fields. For example, to echo the position "
        "field of a nav_msgs/msg/Odometry message: 'ros2 topic echo /odom --field pose.pose.position'",
    )
    printing.add_length_arguments(parser)
    add("--no-lost-messages", action="store_true", help="Don't report when a message is lost")
    add("--raw", action="store_true", help="Echo the raw binary representation")
    add(
        "--filter",
        dest="filter_expr",
        help="Python expression to filter messages that are printed. Expression can use Python builtins as well as m "
        "(the message).",
    )
    add("--once", action="store_true", help="Print the first message received and then exit.")
    add("--timeout", metavar="N", type=grammar.positive_float, help="Set a timeout in seconds for waiting")
    add("--include-message-info", "-i", action="store_true", help="Shows the associated message info.")


def echo(args: Namespace) -> str | None:
    """Print the messages of a topic until Ctrl-C, until the first with `--once`, or for `--timeout` s."""

    fields = [field for field in (args.field or "").split(".") if field]
    if args.field is not None and not fields:
        raise RosError(f"Invalid field value '{args.field}'")
    accepts = make_filter(args.filter_expr)
    profile, overridden = qos_options.chosen_profile(args)
    with Graph(args, talks=True) as graph:
        if args.message_type is None:
            message_type = find_message_type(graph, args.topic_name, wait=False)
            if message_type is None:
                raise RosError("Could not determine the type for the passed topic")
        else:
            try:
                message_type = messages.get_message(args.message_type)
            except messages.INVALID_TYPE:
                grammar.tell_near(args.message_type, messages.all_types("msg"))
                raise RosError("The passed message type is invalid") from None
        # The type may be known of a subscription alone, and a publisher may keep what was published before.
        graph.settle(lambda: graph.node.get_publishers_info_by_topic(args.topic_name), quiet=CERTAIN)
        if not overridden and (publishers := graph.node.get_publishers_info_by_topic(args.topic_name)):
            qos.match_publishers(profile, publishers)
        printed = False

        def show(message: Message, info: dict[str, Any]) -> None:
            nonlocal printed
            part = message
            for field in fields:
                try:
                    part = getattr(part, field)
                except AttributeError as error:
                    raise RosError(f"Invalid field '{'.'.join(fields)}': {error}") from None
            try:
                accepted = accepts(part)
            except Exception as error:
                raise RosError(f"Invalid filter expression '{args.filter_expr}': {error}") from None
            if accepted and not (args.once and printed):
                _print(part, info, args)
                printed = True

        graph.node.create_subscription(
            message_type,
            args.topic_name,
            show,  # type: ignore[arg-type]  # rclpy also passes the info to a callback of two arguments
            profile,
            event_callbacks=_events(args, graph, profile),
            raw=args.raw,
        )
        graph.spin(lambda: args.once and printed, args.timeout)
    return None


def _events(args: Namespace, graph: Graph, asked: Any) -> Any:
    """Return the event callbacks that report lost messages, and publishers incompatible with the QoS `asked`."""
    from rclpy.event_handler import SubscriptionEventCallbacks
    from rclpy.qos import QoSCompatibility, qos_check_compatible, qos_policy_name_from_kind

    def lost(status: Any) -> None:
        print(
            f"A message was lost!!!\n\ttotal count change:{status.total_count_change}"
            f"\n\ttotal count: {status.total_count}",
            end="---\n",
        )

    def unfit(status: Any) -> None:
        offers = [
            f"{each.node_name} offers {qos.words(each.qos_profile)}"
            for each in graph.node.get_publishers_info_by_topic(args.topic_name)
            if qos_check_compatible(each.qos_profile, asked)[0] == QoSCompatibility.ERROR
        ]
        graph.node.get_logger().warning(
            f"New publisher discovered on topic '{args.topic_name}', offering incompatible QoS. No messages will be "
            f"received from it. Last incompatible policy: {qos_policy_name_from_kind(status.last_policy_kind)}. "
            f"{', '.join(offers)}{', and ' if offers else ''}this command asks for {qos.words(asked)}."
        )

    return SubscriptionEventCallbacks(incompatible_qos=unfit, message_lost=None if args.no_lost_messages else lost)


def _print(part: Any, info: dict[str, Any], args: Namespace) -> None:
    """Print a message, or one of its fields, as the options ask."""
    import yaml

    limits = printing.limits(args)
    if not hasattr(part, "SLOT_TYPES"):
        if args.include_message_info:
            print(f"---Got new message, message info:---\n{info}\n---Message data:---")
        print(part, end="\n---\n")
    elif args.csv:
        prefix = ",".join(str(value) for value in info.values()) + "," if args.include_message_info else ""
        print(prefix + messages.to_csv(part, limits))
    else:
        if args.include_message_info:
            print(yaml.dump(info), end="---\n")
        print(messages.to_yaml(part, limits, flow_style=args.flow_style), end="---\n")
