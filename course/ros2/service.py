"""`ros2 service`: list the services, show their types, and call one."""

import time
from argparse import ArgumentParser, Namespace
from collections.abc import Collection
from typing import Any

from course.errors import RosError
from course.ros import messages
from course.ros.elsewhere import tell_if_alone
from course.ros.graph import COMMAND_PREFIX, Graph
from course.ros.messages import Stamp
from course.ros.server_status import ServerStatus, wait_for_answer, wait_for_server
from course.ros2 import completion, grammar, printing
from course.ros2.grammar import Verb


def print_names(found: Collection[tuple[str, list[str]]], *, count: bool, types: bool) -> None:
    """Print the names, with `types` also their types, or with `count` only how many there are."""
    if count:
        print(len(found))
        return
    for name, its_types in found:
        print(f"{name} [{', '.join(its_types)}]" if types else name)


def add_hidden(parser: ArgumentParser, *, verb: bool = True) -> None:
    """Add `--include-hidden-services`."""
    grammar.add_hidden(parser, "--include-hidden-services", what="services", verb=verb)


def add_list_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 service list`."""
    grammar.add_strategy_arguments(parser)
    parser.add_argument("-t", "--show-types", action="store_true", help="Additionally show the service type")
    parser.add_argument(
        "-c", "--count-services", action="store_true", help="Only display the number of services discovered"
    )
    add_hidden(parser)


def list_services(args: Namespace) -> None:
    """Print the names of the services."""
    with Graph(args) as graph:
        graph.settle()
        tell_if_alone(graph)
        found = graph.services(hidden=args.include_hidden_services)
    print_names(found, count=args.count_services, types=args.show_types)


def add_type_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 service type`."""
    grammar.add_strategy_arguments(parser)
    grammar.complete_with(
        parser.add_argument(
            "service_name", help="Name of the ROS service to get type (e.g. '/talker/list_parameters')"
        ),
        completion.service_names,
    )


def show_type(args: Namespace) -> int:
    """Print the type of a service; return 1 if there is no such service."""
    with Graph(args) as graph:
        types = graph.types_of(args.service_name, lambda: graph.services(hidden=args.include_hidden_services))
    print("\n".join(types), end="\n" if types else "")
    return 0 if types else 1


def add_find_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 service find`."""
    grammar.add_strategy_arguments(parser)
    grammar.complete_with(
        parser.add_argument(
            "service_type", help="Name of the ROS service type to filter for (e.g. 'rcl_interfaces/srv/ListParameters')"
        ),
        completion.service_types,
    )
    parser.add_argument(
        "-c", "--count-services", action="store_true", help="Only display the number of services discovered"
    )
    add_hidden(parser)


def find(args: Namespace) -> None:
    """Print the services of a type."""
    with Graph(args) as graph:
        graph.settle()
        found = graph.services(hidden=args.include_hidden_services)
    found = [(name, types) for name, types in found if args.service_type in types]
    print_names(found, count=args.count_services, types=False)


def add_info_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 service info`."""
    grammar.add_strategy_arguments(parser)
    grammar.complete_with(
        parser.add_argument("service_name", help="Name of the ROS service to get info (e.g. '/add_two_ints')"),
        completion.service_names,
    )


def info(args: Namespace) -> str | None:
    """Print the type of a service, and how many clients and servers it has."""
    with Graph(args) as graph:
        graph.settle()
        types = dict(graph.services(hidden=args.include_hidden_services)).get(args.service_name)
        if not types:
            tell_if_alone(graph)
            return f"Unknown service '{args.service_name}'"
        clients, servers = graph.service_counts(args.service_name)
    print(f"Type: {types[0] if len(types) == 1 else types}")
    print(f"Clients count: {clients}")
    print(f"Services count: {servers}")
    return None


def add_call_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 service call`."""
    grammar.complete_with(
        parser.add_argument("service_name", help="Name of the ROS service to call to (e.g. '/add_two_ints')"),
        completion.service_names,
    )
    grammar.complete_with(
        parser.add_argument("service_type", help="Type of the ROS service (e.g. 'std_srvs/srv/Empty')"),
        completion.service_type,
    )
    group = parser.add_mutually_exclusive_group()
    grammar.complete_with(
        group.add_argument(
            "values",
            nargs="?",
            default="{}",
            help="Values to fill the service request with in YAML format (e.g. '{a: 1, b: 2}'), "
            "otherwise the service request will be published with default values",
        ),
        completion.request_prototype,
    )
    group.add_argument("--stdin", action="store_true", help="Read values from standard input")
    parser.add_argument("-r", "--rate", metavar="N", type=float, help="Repeat the call at a specific rate in Hz")


def call(args: Namespace) -> str | None:
    """Wait for the service, call it once or at a rate, and print requests and responses."""
    import yaml

    if args.rate is not None and args.rate <= 0:
        raise RosError("rate must be greater than zero")
    try:
        service = messages.get_service(args.service_type)
    except messages.INVALID_TYPE:
        grammar.tell_near(args.service_type, messages.all_types("srv"))
        raise RosError("The passed service type is invalid") from None
    request = service.Request()
    stamps: list[Stamp] = []
    try:
        messages.fill(request, yaml.safe_load(grammar.read_stdin() if args.stdin else args.values), stamps)
    except Exception as error:
        return f"Failed to populate field: {error}"
    words = args.service_type.split("/")
    with Graph(talks=True, node_name=f"{COMMAND_PREFIX}_requester_{words[0]}_{words[-1]}") as graph:
        client = graph.node.create_client(service, args.service_name)
        ready = client.service_is_ready
        status = ServerStatus(args.service_name)
        # ros2cli prints this line if its first look, before discovery, finds nothing; here it means that the command
        # waits.
        if not graph.settle(ready):
            print("waiting for service to become available...")
            if report := wait_for_server(graph, status, ready, graph.services, "service", args.service_type):
                return report
        while True:
            for stamp in stamps:
                stamp(graph.node.get_clock().now().to_msg())
            print(f"requester: making request: {request!r}\n")
            began = time.monotonic()
            future = client.call_async(request)
            wait_for_answer(graph, lambda future=future: future.done() or status.report())  # type: ignore[misc]
            if not future.done():
                return f"The service does not answer.\n{status.report()}"
            if future.result() is None:
                raise RosError(f"Exception while calling service: {future.exception()!r}")
            print(f"response:\n{future.result()!r}\n")
            if args.rate is None:
                return None
            time.sleep(max(0.0, began + 1.0 / args.rate - time.monotonic()))  # keeps the rate


def add_echo_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 service echo`."""
    grammar.complete_with(
        parser.add_argument("service_name", help="Name of the ROS service to echo (e.g. '/add_two_ints')"),
        completion.service_names,
    )
    grammar.complete_with(
        parser.add_argument(
            "service_type", nargs="?", help="Type of the ROS service (e.g. 'example_interfaces/srv/AddTwoInts')"
        ),
        completion.service_type,
    )
    printing.add_event_arguments(parser)


def _find_type(graph: Graph, name: str) -> Any:
    """Return the class of a service; raises RosError if it is not there, has several types, or cannot be loaded."""
    types = graph.types_of(name, lambda: graph.services(hidden=True))
    if not types:
        raise RosError(f"Cannot find type for '{name}'")
    if len(types) > 1:
        raise RosError(f"More than one type associated with service '{name}'")
    try:
        return messages.get_service(types[0])
    except messages.INVALID_TYPE:
        raise RosError(f"The service type '{types[0]}' is invalid") from None


def echo(args: Namespace) -> None:
    """Print the requests and responses of a service with introspection, until Ctrl-C."""
    from rclpy.qos import qos_profile_services_default

    with Graph(talks=True) as graph:
        if args.service_type is None:
            service = _find_type(graph, args.service_name)
        else:
            try:
                service = messages.get_service(args.service_type)
            except (RuntimeError, *messages.INVALID_TYPE):
                raise RosError(f"The service type '{args.service_type}' is invalid") from None
        topic = f"{args.service_name}/_service_event"
        graph.node.create_subscription(
            service.Event, topic, lambda event: print(printing.event_text(event, args)), qos_profile_services_default
        )
        graph.settle(lambda: graph.counts(topic)[0])
        if not graph.counts(topic)[0]:
            print(f"No publishers on topic '{topic}'; is service introspection on the client or server enabled?")
        graph.spin()


VERBS = {
    "call": Verb("Call a service", add_call_arguments, call),
    "echo": Verb("Echo a service", add_echo_arguments, echo),
    "find": Verb("Output a list of available services of a given type", add_find_arguments, find),
    "info": Verb("Print information about a service", add_info_arguments, info),
    "list": Verb("Output a list of available services", add_list_arguments, list_services),
    "type": Verb("Output a service's type", add_type_arguments, show_type),
}


def add_arguments(parser: ArgumentParser) -> None:
    """Add the verbs of `ros2 service`."""
    add_hidden(parser, verb=False)
    grammar.add_verbs(parser, "ros2 service", VERBS)
