"""`ros2 topic pub`: publish messages to a topic."""

from __future__ import annotations

import math
import time
from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING

from course.errors import RosError
from course.ros import messages
from course.ros.graph import Graph
from course.ros.messages import Stamp
from course.ros2 import completion, grammar, qos_options

if TYPE_CHECKING:  # loaded when the verb runs, but not for its help
    from rclpy.publisher import Publisher


def add_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 topic pub`."""
    add = parser.add_argument
    grammar.complete_with(
        add("topic_name", help="Name of the ROS topic to publish to (e.g. '/chatter')"), completion.topic_names
    )
    grammar.complete_with(
        add("message_type", help="Type of the ROS message (e.g. 'std_msgs/String')"), completion.topic_type
    )
    group = parser.add_mutually_exclusive_group()
    grammar.complete_with(
        group.add_argument(
            "values",
            nargs="?",
            default="{}",
            help="Values to fill the message with in YAML format (e.g. 'data: Hello World'), otherwise the message "
            "will be published with default values",
        ),
        completion.message_prototype,
    )
    group.add_argument("--stdin", action="store_true", help="Read values from standard input")
    add(
        "-r", "--rate", metavar="N", type=grammar.positive_float, default=1.0, help="Publishing rate in Hz (default: 1)"
    )
    add("-p", "--print", metavar="N", type=int, default=1, help="Only print every N-th published message (default: 1)")
    group = parser.add_mutually_exclusive_group()
    group.add_argument("-1", "--once", action="store_true", help="Publish one message and exit")
    group.add_argument(
        "-t", "--times", type=grammar.nonnegative_int, default=0, help="Publish this number of times and then exit"
    )
    add(
        "-w",
        "--wait-matching-subscriptions",
        type=grammar.nonnegative_int,
        help="Wait until finding the specified number of matching subscriptions. Defaults to 1 when using "
        '"-1"/"--once"/"--times", otherwise defaults to 0.',
    )
    add(
        "--max-wait-time-secs",
        type=grammar.positive_float,
        help="This sets the maximum wait time in seconds if --wait-until-matching-subscriptions is set. By default, "
        "this flag is not set meaning the subscriber will wait endlessly.",
    )
    add(
        "--keep-alive",
        metavar="N",
        type=grammar.positive_float,
        default=0.1,
        help="Keep publishing node alive for N seconds after the last msg (default: 0.1)",
    )
    add("-n", "--node-name", help="Name of the created publishing node")
    qos_options.add_arguments(parser, "publish", "default")
    grammar.add_direct_arguments(parser)


def pub(args: Namespace) -> str | None:
    """Publish a message once, several times, or at a rate until Ctrl-C."""
    import yaml

    times = 1 if args.once else args.times
    wanted = args.wait_matching_subscriptions
    wanted = int(times != 0) if wanted is None else wanted
    if wanted == 0 and args.max_wait_time_secs is not None:
        return "--max-wait-time-secs option is only effective with --wait-matching-subscriptions, --once or --times"
    try:
        message = messages.get_message(args.message_type)()
    except messages.INVALID_TYPE:
        grammar.tell_near(args.message_type, messages.all_types("msg"))
        raise RosError("The passed message type is invalid") from None
    try:
        values = yaml.safe_load(grammar.read_stdin() if args.stdin else args.values)
    except yaml.YAMLError:
        values = None
    if not isinstance(values, dict):
        return "The passed value needs to be a dictionary in YAML format"
    stamps: list[Stamp] = []
    try:
        messages.fill(message, values, stamps)
    except Exception as error:
        return f"Failed to populate field: {error}"
    profile, _ = qos_options.chosen_profile(args)
    with Graph(args, talks=True, node_name=args.node_name) as graph:
        publisher = graph.node.create_publisher(type(message), args.topic_name, profile)
        if not _matched(graph, publisher, wanted, args.max_wait_time_secs):
            return (
                f"Timed out waiting for subscribers: Expected {wanted} subcribers "
                f"but only got {publisher.get_subscription_count()} subscribers"
            )
        print("publisher: beginning loop")
        count = 0

        def publish() -> None:
            nonlocal count
            now = graph.node.get_clock().now().to_msg()
            for stamp in stamps:
                stamp(now)
            count += 1
            if args.print and count % args.print == 0:
                print(f"publishing #{count}: {message!r}\n")
            publisher.publish(message)

        publish()
        if times != 1:
            graph.node.create_timer(1.0 / args.rate, publish)
            graph.spin(lambda: times and count >= times)
        time.sleep(args.keep_alive)  # until the last message has been sent
    return None


def _matched(graph: Graph, publisher: Publisher, wanted: int, limit: float | None) -> bool:
    """Wait for `wanted` subscriptions, at most `limit` s if given, with a line each second; False after that."""
    left = math.inf if limit is None else limit
    while publisher.get_subscription_count() < wanted:
        print(f"Waiting for at least {wanted} matching subscription(s)...")
        if left <= 0.0:
            return False
        step = min(1.0, left)
        left -= step
        if not graph.wait_until(lambda: publisher.get_subscription_count() >= wanted, step) and step < 1.0:
            return False
    return True
