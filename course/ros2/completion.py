"""Completions for the Tab key (argcomplete): names from the live graph, types from the installed packages."""

from argparse import Namespace
from collections.abc import Callable

from course.ros import messages
from course.ros.graph import Graph
from course.ros.packages import all_packages, find_executables
from course.ros.packages import installed_packages as packages_in_index
from course.ros.parameter_services import list_parameters
from course.ros2.grammar import Completer


def quietly(completer: Callable[[Namespace], list[str]]) -> Completer:
    """Offer nothing when the graph or a type cannot be found: a completion never prints an error."""

    def safe(prefix: str, parsed_args: Namespace, **kwargs: object) -> list[str]:
        try:
            return completer(parsed_args)
        except (Exception, SystemExit):
            return []

    return safe


@quietly
def node_names(args: Namespace) -> list[str]:
    """Offer the nodes of the graph."""
    with Graph() as graph:
        graph.settle(names_only=True)
        hidden = getattr(args, "include_hidden_nodes", False)
        return sorted(node.full_name for node in graph.nodes(hidden=hidden))


@quietly
def topic_names(args: Namespace) -> list[str]:
    """Offer the topics of the graph."""
    with Graph() as graph:
        graph.settle()
        return [name for name, _ in graph.topics(hidden=getattr(args, "include_hidden_topics", False))]


@quietly
def service_names(args: Namespace) -> list[str]:
    """Offer the services of the graph."""
    with Graph() as graph:
        graph.settle()
        return [name for name, _ in graph.services(hidden=getattr(args, "include_hidden_services", False))]


@quietly
def action_names(args: Namespace) -> list[str]:
    """Offer the actions of the graph."""
    with Graph() as graph:
        graph.settle()
        return [name for name, _ in graph.actions()]


@quietly
def topic_type(args: Namespace) -> list[str]:
    """Offer the topic's type if it is known, else every message type."""
    with Graph() as graph:
        return graph.types_of(args.topic_name, lambda: graph.topics(hidden=True)) or messages.all_types("msg")


@quietly
def service_type(args: Namespace) -> list[str]:
    """Offer the service's type if it is known, else every service type."""
    with Graph() as graph:
        return graph.types_of(args.service_name, lambda: graph.services(hidden=True)) or messages.all_types("srv")


@quietly
def action_type(args: Namespace) -> list[str]:
    """Offer the action's type if it is known, else every action type."""
    with Graph() as graph:
        return graph.types_of(args.action_name, graph.actions) or messages.all_types("action")


@quietly
def service_types(args: Namespace) -> list[str]:
    """Offer every service type."""
    return messages.all_types("srv")


@quietly
def interface_types(args: Namespace) -> list[str]:
    """Offer every message, service and action type."""
    return sorted(name for kind in messages.KINDS for name in messages.all_types(kind))


@quietly
def interface_packages(args: Namespace) -> list[str]:
    """Offer the packages that have interfaces."""
    return sorted(messages.interface_packages())


@quietly
def message_prototype(args: Namespace) -> list[str]:
    """Offer a message's fields with their default values, in YAML."""
    return [messages.to_yaml(messages.get_message(args.message_type)())]


@quietly
def request_prototype(args: Namespace) -> list[str]:
    """Offer a request's fields with their default values, in YAML."""
    return [messages.to_yaml(messages.get_service(args.service_type).Request())]


@quietly
def goal_prototype(args: Namespace) -> list[str]:
    """Offer a goal's fields with their default values, in YAML."""
    return [messages.to_yaml(messages.get_action(args.action_type).Goal())]


@quietly
def parameter_names(args: Namespace) -> list[str]:
    """Offer the parameters of the node that the line names."""
    with Graph(talks=True) as graph:
        return sorted(list_parameters(graph, args.node_name))


@quietly
def packages(args: Namespace) -> list[str]:
    """Offer the packages that `ros2 run` can find."""
    return all_packages()


@quietly
def installed_packages(args: Namespace) -> list[str]:
    """Offer the installed packages."""
    return packages_in_index()


@quietly
def executables(args: Namespace) -> list[str]:
    """Offer the executables of the package that the line names."""
    return sorted(find_executables(args.package_name) or [])


@quietly
def message_types(args: Namespace) -> list[str]:
    """Offer every message type."""
    return messages.all_types("msg")
