"""`ros2 lifecycle`: list the nodes with a lifecycle, show their states and transitions, and request a transition."""

import sys
from argparse import ArgumentParser, Namespace
from typing import Any

from course.errors import RosError
from course.ros.elsewhere import tell_if_alone
from course.ros.graph import Graph
from course.ros.names import absolute
from course.ros.parameter_services import SERVICE_TIMEOUT
from course.ros.server_status import ServerStatus
from course.ros2 import completion, grammar
from course.ros2.grammar import Verb

MARK = "lifecycle_msgs/srv/GetState"  # the type of a service that only nodes with a lifecycle have


def _lifecycle_nodes(graph: Graph, *, hidden: bool) -> list[str]:
    """Return the full names of the nodes with a lifecycle, sorted."""
    graph.settle()
    tell_if_alone(graph)
    nodes = (node.full_name for node in graph.nodes(hidden=hidden))
    return sorted(
        name for name in nodes if any(MARK in types for _, types in graph.of_node("service", name, hidden=True))
    )


def _call(graph: Graph, node: str, word: str, service: Any, **fields: Any) -> Any:
    """Call the service `word` of a node; raises RosError when it is not available within 5 s, or the node dies."""
    name = f"{node}/{word}"
    client, status = graph.node.create_client(service, name), ServerStatus(name)
    if not graph.wait_until(client.service_is_ready, SERVICE_TIMEOUT):
        raise RosError(f"The service {name} is not available")
    future = client.call_async(service.Request(**fields))
    graph.spin(lambda: future.done() or status.report())
    if not future.done():
        raise RosError(f"The node does not answer.\n{status.report()}")
    if future.result() is None:
        raise RosError(f"Exception while calling service of node '{node}': {future.exception()}")
    return future.result()


def _add_node_argument(parser: ArgumentParser, *, optional: bool = False) -> None:
    grammar.add_hidden(parser, "--include-hidden-nodes", what="nodes", verb=False)
    grammar.complete_with(
        parser.add_argument("node_name", help="Name of the ROS node", nargs="?" if optional else None),
        completion.node_names,
    )


def add_nodes_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 lifecycle nodes`."""
    grammar.add_strategy_arguments(parser)
    parser.add_argument("-a", "--all", action="store_true", help="Display all nodes even hidden ones")
    parser.add_argument("-c", "--count-nodes", action="store_true", help="Only display the number of nodes discovered")


def nodes(args: Namespace) -> None:
    """Print the full names of the nodes with a lifecycle."""
    with Graph(args) as graph:
        names = _lifecycle_nodes(graph, hidden=args.all)
    if args.count_nodes:
        print(len(names))
        return
    for name in names:
        print(name)


def add_get_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 lifecycle get`."""
    grammar.add_strategy_arguments(parser)
    _add_node_argument(parser, optional=True)


def get(args: Namespace) -> str | None:
    """Print the state of a node, or of every node with a lifecycle."""
    from lifecycle_msgs.srv import GetState

    with Graph(args, talks=True) as graph:
        names = _lifecycle_nodes(graph, hidden=args.include_hidden_nodes)
        wanted = absolute(args.node_name) if args.node_name else None
        if wanted and wanted not in names:
            return "Node not found"
        for name in [wanted] if wanted else names:
            state = _call(graph, name, "get_state", GetState).current_state
            print(f"{state.label} [{state.id}]" if wanted else f"{name}: {state.label} [{state.id}]")
    return None


def add_list_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 lifecycle list`."""
    grammar.add_strategy_arguments(parser)
    _add_node_argument(parser)
    parser.add_argument("-a", "--all", action="store_true", help="Display all existing transitions")


def list_transitions(args: Namespace) -> str | None:
    """Print the transitions that a node can make from its state, or with -a from any."""
    from lifecycle_msgs.srv import GetAvailableTransitions

    with Graph(args, talks=True) as graph:
        name = absolute(args.node_name)
        if name not in _lifecycle_nodes(graph, hidden=args.include_hidden_nodes):
            return "Node not found"
        word = "get_transition_graph" if args.all else "get_available_transitions"
        found = _call(graph, name, word, GetAvailableTransitions).available_transitions
    for each in found:
        print(f"- {each.transition.label} [{each.transition.id}]")
        print(f"\tStart: {each.start_state.label}\n\tGoal: {each.goal_state.label}")
    return None


def add_set_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 lifecycle set`."""
    grammar.add_strategy_arguments(parser)
    _add_node_argument(parser)
    parser.add_argument("transition", help="The lifecycle transition")


def set_state(args: Namespace) -> str | None:
    """Request a transition by its label or number, and print how it ended."""
    from lifecycle_msgs.srv import ChangeState, GetAvailableTransitions

    with Graph(args, talks=True) as graph:
        name = absolute(args.node_name)
        if name not in _lifecycle_nodes(graph, hidden=args.include_hidden_nodes):
            return "Node not found"
        available = _call(graph, name, "get_available_transitions", GetAvailableTransitions).available_transitions
        known = [each.transition for each in available]
        asked = [each for each in known if each.label == args.transition]
        asked += [each for each in known if str(each.id) == args.transition]
        if not asked:
            listed = "".join(f"\n- {each.label} [{each.id}]" for each in known)
            return f"Unknown transition requested, available ones are:{listed}"
        if _call(graph, name, "change_state", ChangeState, transition=asked[0]).success:
            print("Transitioning successful")
        else:
            print("Transitioning failed", file=sys.stderr)
    return None


VERBS = {
    "get": Verb("Get lifecycle state for one or more nodes", add_get_arguments, get),
    "list": Verb("Output a list of available transitions", add_list_arguments, list_transitions),
    "nodes": Verb("Output a list of nodes with lifecycle", add_nodes_arguments, nodes),
    "set": Verb("Trigger lifecycle state transition", add_set_arguments, set_state),
}


def add_arguments(parser: ArgumentParser) -> None:
    """Add the verbs of `ros2 lifecycle`."""
    grammar.add_verbs(parser, "ros2 lifecycle", VERBS)
