"""What the Tab key offers: names from the live graph, types from the installed packages (argcomplete's completers)."""

from course.ros2.graph import Graph


def quietly(completer):
    """Offer nothing where the graph or a type cannot be had: a completion never prints an error."""

    def safe(prefix, parsed_args, **kwargs):
        try:
            return completer(parsed_args)
        except (Exception, SystemExit):
            return []

    return safe


@quietly
def node_names(args):
    """Offer the graph's nodes."""
    with Graph() as graph:
        graph.settle(names_only=True)
        hidden = getattr(args, "include_hidden_nodes", False)
        return sorted(node.full_name for node in graph.nodes(hidden=hidden))


@quietly
def topic_names(args):
    """Offer the graph's topics."""
    with Graph() as graph:
        graph.settle()
        return [name for name, _ in graph.topics(hidden=getattr(args, "include_hidden_topics", False))]


@quietly
def service_names(args):
    """Offer the graph's services."""
    with Graph() as graph:
        graph.settle()
        return [name for name, _ in graph.services(hidden=getattr(args, "include_hidden_services", False))]


@quietly
def action_names(args):
    """Offer the graph's actions."""
    with Graph() as graph:
        graph.settle()
        return [name for name, _ in graph.actions()]


@quietly
def topic_type(args):
    """Offer the topic's own type, else every message type."""
    from course.ros2 import messages

    with Graph() as graph:
        return graph.types_of(args.topic_name, lambda: graph.topics(hidden=True)) or messages.all_types("msg")


@quietly
def service_type(args):
    """Offer the service's own type, else every service type."""
    from course.ros2 import messages

    with Graph() as graph:
        return graph.types_of(args.service_name, lambda: graph.services(hidden=True)) or messages.all_types("srv")


@quietly
def action_type(args):
    """Offer the action's own type, else every action type."""
    from course.ros2 import messages

    with Graph() as graph:
        return graph.types_of(args.action_name, graph.actions) or messages.all_types("action")


@quietly
def service_types(args):
    """Offer every service type."""
    from course.ros2 import messages

    return messages.all_types("srv")


@quietly
def interface_types(args):
    """Offer every interface."""
    from course.ros2 import messages

    return sorted(name for kind in messages.KINDS for name in messages.all_types(kind))


@quietly
def interface_packages(args):
    """Offer the packages that have interfaces."""
    from course.ros2 import messages

    return sorted(messages.interface_packages())


@quietly
def message_prototype(args):
    """Offer a message's fields with their default values, in YAML."""
    from course.ros2 import messages

    return [messages.to_yaml(messages.get_message(args.message_type)())]


@quietly
def request_prototype(args):
    """Offer a request's fields with their default values, in YAML."""
    from course.ros2 import messages

    return [messages.to_yaml(messages.get_service(args.service_type).Request())]


@quietly
def goal_prototype(args):
    """Offer a goal's fields with their default values, in YAML."""
    from course.ros2 import messages

    return [messages.to_yaml(messages.get_action(args.action_type).Goal())]


@quietly
def parameter_names(args):
    """Offer the parameters of the node named before."""
    from course.ros2 import parameters

    with Graph(talks=True) as graph:
        return sorted(parameters.list_parameters(graph, args.node_name))


@quietly
def packages(args):
    """Offer the packages that `ros2 run` knows."""
    from course.ros2 import packages as known

    return known.all_packages()


@quietly
def executables(args):
    """Offer the executables of the package named before."""
    from course.ros2 import packages as known

    return sorted(known.find_executables(args.package_name) or [])


@quietly
def message_types(args):
    """Offer every message type."""
    from course.ros2 import messages

    return messages.all_types("msg")
