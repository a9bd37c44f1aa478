"""`ros2 node`: list the nodes, and show the topics, services and actions of one."""

import sys
from argparse import ArgumentParser, Namespace

from course.ros.elsewhere import tell_if_alone
from course.ros.graph import Graph
from course.ros2 import completion, grammar
from course.ros2.grammar import Verb

SHARED_NAME = (
    "WARNING: Be aware that there are nodes in the graph that share an exact name, "
    "which can have unintended side effects."
)
# The sections of `info` in ros2cli's order, each with its kind as `Graph.of_node` takes it.
SECTIONS = (
    ("Subscribers", "subscriber"),
    ("Publishers", "publisher"),
    ("Service Servers", "service"),
    ("Service Clients", "client"),
    ("Action Servers", "action_server"),
    ("Action Clients", "action_client"),
)


def add_list_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 node list`."""
    grammar.add_strategy_arguments(parser)
    parser.add_argument("-a", "--all", action="store_true", help="Display all nodes even hidden ones")
    parser.add_argument("-c", "--count-nodes", action="store_true", help="Only display the number of nodes discovered")


def list_nodes(args: Namespace) -> None:
    """Print the full names of the nodes, sorted; warn if two nodes share one."""
    with Graph(args) as graph:
        graph.settle(names_only=True)
        names = sorted(node.full_name for node in graph.nodes(hidden=args.all))
        tell_if_alone(graph)
    if args.count_nodes:
        print(len(names))
        return
    if len(set(names)) < len(names):
        print(SHARED_NAME, file=sys.stderr)
    for name in names:
        print(name)


def add_info_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 node info`."""
    grammar.add_strategy_arguments(parser)
    grammar.complete_with(
        parser.add_argument("node_name", help="Fully qualified node name to request information"), completion.node_names
    )
    parser.add_argument(
        "--include-hidden", action="store_true", help="Display hidden topics, services, and actions as well"
    )


def info(args: Namespace) -> str | None:
    """Print the topics, services and actions of a node."""
    with Graph(args) as graph:
        graph.settle()
        names = [node.full_name for node in graph.nodes(hidden=args.include_hidden)]
        count = names.count(args.node_name)
        if count == 0:
            tell_if_alone(graph)
            grammar.tell_near(args.node_name, names)
            return f"Unable to find node '{args.node_name}'"
        if count > 1:
            print(
                f'There are {count} nodes in the graph with the exact name "{args.node_name}". '
                "You are seeing information about only one of them.",
                file=sys.stderr,
            )
        print(args.node_name)
        for title, kind in SECTIONS:
            print(f"  {title}:")
            found = graph.of_node(kind, args.node_name, hidden=args.include_hidden)
            print("\n".join(f"    {name}: {', '.join(types)}" for name, types in found))
    return None


VERBS = {
    "info": Verb("Output information about a node", add_info_arguments, info),
    "list": Verb("Output a list of available nodes", add_list_arguments, list_nodes),
}


def add_arguments(parser: ArgumentParser) -> None:
    """Add the verbs of `ros2 node`."""
    grammar.add_verbs(parser, "ros2 node", VERBS)
