"""`ros2 topic`: list the topics, and show who publishes and subscribes.

The verbs for messages are in `topic_traffic`, `topic_statistics` and `topic_pub`.
"""

from argparse import ArgumentParser, Namespace
from typing import Any

from course.ros.elsewhere import tell_if_alone
from course.ros.graph import Graph
from course.ros2 import completion, grammar, service, topic_pub, topic_statistics, topic_traffic
from course.ros2.grammar import Verb

OF_EVERY_NODE = {"/parameter_events": ["rcl_interfaces/msg/ParameterEvent"], "/rosout": ["rcl_interfaces/msg/Log"]}


def add_hidden(parser: ArgumentParser, *, verb: bool = True) -> None:
    """Add `--include-hidden-topics`."""
    grammar.add_hidden(parser, "--include-hidden-topics", what="topics", verb=verb)


def _add_name_argument(parser: ArgumentParser, purpose: str) -> None:
    grammar.add_strategy_arguments(parser)
    grammar.complete_with(
        parser.add_argument("topic_name", help=f"Name of the ROS topic to {purpose} (e.g. '/chatter')"),
        completion.topic_names,
    )


def add_list_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 topic list`."""
    grammar.add_strategy_arguments(parser)
    parser.add_argument("-t", "--show-types", action="store_true", help="Additionally show the topic type")
    parser.add_argument(
        "-c", "--count-topics", action="store_true", help="Only display the number of topics discovered"
    )
    add_hidden(parser)
    parser.add_argument("-v", "--verbose", action="store_true", help="List full details about each topic")


def list_topics(args: Namespace) -> None:
    """Print the names of the topics, or with -v also the type, publishers and subscribers of each."""
    # Every rclpy node has these two topics, so the command's own node would show them.  It is not made unless something
    # is counted, because making it takes as long as all the rest.
    talks = args.verbose and not args.count_topics
    with Graph(args, talks=talks) as graph:
        graph.settle()
        tell_if_alone(graph)
        found = graph.topics(hidden=args.include_hidden_topics)
        if not talks:
            found = sorted({**OF_EVERY_NODE, **dict(found)}.items())
        counts = {name: graph.counts(name) for name, _ in found} if args.verbose else {}
    if not args.verbose or args.count_topics:
        service.print_names(found, count=args.count_topics, types=args.show_types)
        return
    for side, (title, word) in enumerate((("Published", "publisher"), ("Subscribed", "subscriber"))):
        print(f"{title} topics:")
        for name, types in found:
            if number := counts[name][side]:
                print(f" * {name} [{', '.join(types)}] {number} {word}{'s' if number > 1 else ''}")
        print()


def add_info_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 topic info`."""
    _add_name_argument(parser, "get info")
    parser.add_argument(
        "--verbose",
        "-v",
        action="store_true",
        help="Prints detailed information like the node name, node namespace, topic type, topic type hash, GUID, "
        "and QoS Profile of the publishers and subscribers to this topic",
    )


def info(args: Namespace) -> str | None:
    """Print the type of a topic and the number of publishers and subscriptions; with -v, every one of them."""
    with Graph(args, talks=True) as graph:
        graph.settle()
        types = dict(graph.topics(hidden=True)).get(args.topic_name)
        if not types:
            tell_if_alone(graph)
            return f"Unknown topic '{args.topic_name}'"
        counts = graph.counts(args.topic_name)
        endpoints: tuple[list[Any], list[Any]] = ([], [])
        if args.verbose:
            endpoints = (
                graph.node.get_publishers_info_by_topic(args.topic_name),
                graph.node.get_subscriptions_info_by_topic(args.topic_name),
            )
    end = "\n\n" if args.verbose else "\n"
    print(f"Type: {types[0] if len(types) == 1 else types}", end=end)
    for title, count, sides in zip(("Publisher", "Subscription"), counts, endpoints, strict=True):
        print(f"{title} count: {count}", end=end)
        for endpoint in sides:
            print(endpoint, end=end)
    return None


def add_type_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 topic type`."""
    _add_name_argument(parser, "get type")


def show_type(args: Namespace) -> int:
    """Print the type of a topic; return 1 if there is no such topic."""
    with Graph(args, talks=True) as graph:
        types = graph.types_of(args.topic_name, lambda: graph.topics(hidden=args.include_hidden_topics))
    print("\n".join(types), end="\n" if types else "")
    return 0 if types else 1


def add_find_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 topic find`."""
    grammar.add_strategy_arguments(parser)
    grammar.complete_with(
        parser.add_argument("topic_type", help="Name of the ROS topic type to filter for (e.g. 'std_msgs/msg/String')"),
        completion.message_types,
    )
    parser.add_argument(
        "-c", "--count-topics", action="store_true", help="Only display the number of topics discovered"
    )
    add_hidden(parser)


def find(args: Namespace) -> None:
    """Print the topics of a type."""
    with Graph(args, talks=True) as graph:
        graph.settle()
        found = graph.topics(hidden=args.include_hidden_topics)
    found = [(name, types) for name, types in found if args.topic_type in types]
    service.print_names(found, count=args.count_topics, types=False)


VERBS = {
    "bw": Verb("Display bandwidth used by topic", topic_statistics.add_bw_arguments, topic_statistics.bw),
    "delay": Verb(
        "Display delay of topic from timestamp in header", topic_statistics.add_delay_arguments, topic_statistics.delay
    ),
    "echo": Verb("Output messages from a topic", topic_traffic.add_echo_arguments, topic_traffic.echo),
    "find": Verb("Output a list of available topics of a given type", add_find_arguments, find),
    "hz": Verb("Print the average publishing rate to screen", topic_statistics.add_hz_arguments, topic_statistics.hz),
    "info": Verb("Print information about a topic", add_info_arguments, info),
    "list": Verb("Output a list of available topics", add_list_arguments, list_topics),
    "pub": Verb("Publish a message to a topic", topic_pub.add_arguments, topic_pub.pub),
    "type": Verb("Print a topic's type", add_type_arguments, show_type),
}


def add_arguments(parser: ArgumentParser) -> None:
    """Add the verbs of `ros2 topic`."""
    add_hidden(parser, verb=False)
    grammar.add_verbs(parser, "ros2 topic", VERBS)
