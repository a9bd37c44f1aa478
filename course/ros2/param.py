"""`ros2 param`: get, describe, set, save and load the parameters of a node, through its parameter services."""

import re
import sys
from argparse import ArgumentParser, Namespace
from typing import Any

from course.ros.elsewhere import tell_if_alone
from course.ros.graph import Graph
from course.ros.names import TYPE_NAMES, absolute
from course.ros.parameter_services import call, list_parameters, set_parameter
from course.ros2 import completion, grammar
from course.ros2.grammar import Verb

# The text that `get` prints before a value, and the field of rcl_interfaces/msg/ParameterValue with the value.
VALUES = (
    ("Parameter not set.", None),
    ("Boolean value is:", "bool_value"),
    ("Integer value is:", "integer_value"),
    ("Double value is:", "double_value"),
    ("String value is:", "string_value"),
    ("Byte values are:", "byte_array_value"),
    ("Boolean values are:", "bool_array_value"),
    ("Integer values are:", "integer_array_value"),
    ("Double values are:", "double_array_value"),
    ("String values are:", "string_array_value"),
)


NO_ANSWER = "Callback returned an invalid type"  # rclpy's reason for a callback that returned None or True


def report(result: Any, done: str, failed: str) -> None:
    """Print the outcome in a SetParametersResult: success to stdout, failure to stderr, each with the node's reason."""
    text = (done if result.successful else failed) + (f": {result.reason}" if result.reason else "")
    print(text, file=sys.stdout if result.successful else sys.stderr)
    if result.reason == NO_ANSWER:
        print("The node's parameter callback must return a SetParametersResult, on every path.", file=sys.stderr)


# --- grammar ---


def _add_node_argument(parser: ArgumentParser, *, optional: bool = False) -> None:
    grammar.add_strategy_arguments(parser)
    grammar.complete_with(
        parser.add_argument("node_name", help="Name of the ROS node", nargs="?" if optional else None),
        completion.node_names,
    )
    grammar.add_hidden(parser, "--include-hidden-nodes", what="nodes", verb=False)


def _add_timeout(parser: ArgumentParser) -> None:
    parser.add_argument(
        "--timeout",
        metavar="N",
        type=int,
        default=1,
        help="Wait for N seconds until node becomes available (default %(default)s sec)",
    )


def _add_name_argument(parser: ArgumentParser) -> None:
    grammar.complete_with(
        parser.add_argument("parameter_name", help="Name of the parameter"), completion.parameter_names
    )


def _found(graph: Graph, args: Namespace) -> bool:
    """Return True if the node that the command line names is there, within its timeout."""
    timeout = getattr(args, "timeout", 0)
    there = graph.find_node(args.node_name, hidden=args.include_hidden_nodes, timeout=timeout)
    if not there:
        tell_if_alone(graph)
        grammar.tell_near(absolute(args.node_name), [node.full_name for node in graph.nodes()])
    return there


# --- verbs ---


def add_list_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 param list`."""
    _add_node_argument(parser, optional=True)
    parser.add_argument(
        "--filter",
        nargs=1,
        help="Only parameters matching the regex expression will be showed. Supports `re` regex syntax.",
    )
    parser.add_argument(
        "--param-prefixes", nargs="+", default=[], help="Only list parameters with the provided prefixes"
    )
    parser.add_argument("--param-type", action="store_true", help="Print parameter types with parameter names")


def list_verb(args: Namespace) -> str | None:
    """Print the parameters of one node, or of every node."""
    try:
        pattern = re.compile(args.filter[0] if args.filter else "")
    except re.error as error:
        return f"Invalid regular expression '{args.filter[0]}': {error}"
    with Graph(args, talks=True) as graph:
        if args.node_name:
            if not _found(graph, args):
                return "Node not found"
            nodes = [absolute(args.node_name)]
        else:
            graph.settle()
            tell_if_alone(graph)
            nodes = [node.full_name for node in sorted(set(graph.nodes(hidden=args.include_hidden_nodes)))]
            served = {name for name, _ in graph.services(hidden=True)}
            nodes = [node for node in nodes if f"{node}/list_parameters" in served]
        for node in nodes:
            try:
                names = [name for name in list_parameters(graph, node, args.param_prefixes) if pattern.match(name)]
            except RuntimeError as error:
                print(error, file=sys.stderr)
                continue
            if names and not args.node_name:
                print(f"{node}:")
            kinds = {}
            if args.param_type and names:
                described = call(graph, node, "DescribeParameters", names=names).descriptors
                kinds = {each.name: f" (type: {TYPE_NAMES[each.type]})" for each in described}
            for name in names:
                print(f"  {name}{kinds.get(name, '')}")
    return None


def add_get_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 param get`."""
    _add_node_argument(parser)
    _add_name_argument(parser)
    parser.add_argument("--hide-type", action="store_true", help="Hide the type information")
    _add_timeout(parser)


def get(args: Namespace) -> str | None:
    """Print the value of a parameter."""
    with Graph(args, talks=True) as graph:
        if not _found(graph, args):
            return "Node not found"
        values = call(graph, args.node_name, "GetParameters", names=[args.parameter_name]).values
        if not values:
            grammar.tell_near(args.parameter_name, list_parameters(graph, args.node_name))
            return "Parameter not set"
    if values[0].type >= len(VALUES):
        return f"Unknown parameter type '{values[0].type}'"
    label, field = VALUES[values[0].type]
    value: Any = getattr(values[0], field) if field else None
    value = value.tolist() if hasattr(value, "tolist") else value
    if args.hide_type:
        print(value)
    else:
        print(label) if value is None else print(label, value)
    return None


def add_set_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 param set`."""
    _add_node_argument(parser)
    _add_name_argument(parser)
    parser.add_argument("value", help="Value of the parameter")
    _add_timeout(parser)


def set_verb(args: Namespace) -> str | None:
    """Set a parameter to a value written in YAML; a refusal goes to stderr, with exit status 0 as in ros2cli."""
    import yaml
    from rclpy.parameter import get_parameter_value

    with Graph(args, talks=True) as graph:
        if not _found(graph, args):
            return "Node not found"
        try:
            value = get_parameter_value(args.value)
        except (yaml.YAMLError, AssertionError, OverflowError) as error:
            return f"Setting parameter failed: {error}"
        result = set_parameter(graph, args.node_name, args.parameter_name, value)
        report(result, "Set parameter successful", "Setting parameter failed")
        if not result.successful:
            known = list_parameters(graph, args.node_name)
            if args.parameter_name not in known:
                grammar.tell_near(args.parameter_name, known)
            elif re.fullmatch(r"[-+]?\d+,\d+", args.value) and "STRING" in result.reason.upper():
                print(f"A number has a decimal point: {args.value.replace(',', '.')}", file=sys.stderr)
    return None


def add_delete_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 param delete`."""
    _add_node_argument(parser)
    _add_name_argument(parser)
    _add_timeout(parser)


def delete(args: Namespace) -> str | None:
    """Undeclare a parameter."""
    from rcl_interfaces.msg import ParameterValue

    with Graph(args, talks=True) as graph:
        if not _found(graph, args):
            return "Node not found"
        result = set_parameter(graph, args.node_name, args.parameter_name, ParameterValue())
        report(result, "Deleted parameter successfully", "Deleting parameter failed")
    return None


def add_describe_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 param describe`."""
    _add_node_argument(parser)
    grammar.complete_with(
        parser.add_argument("parameter_names", nargs="+", help="Names of the parameters"), completion.parameter_names
    )
    _add_timeout(parser)


def describe(args: Namespace) -> str | None:
    """Print the types, descriptions and constraints of parameters."""
    with Graph(args, talks=True) as graph:
        if not _found(graph, args):
            return "Node not found"
        described = call(graph, args.node_name, "DescribeParameters", names=args.parameter_names).descriptors
    for each in described:
        print("Parameter name:", each.name)
        print("  Type:", TYPE_NAMES[each.type])
        if each.description:
            print("  Description:", each.description)
        print("  Constraints:")
        if each.read_only:
            print("    Read only: true")
        for bounds in (*each.floating_point_range, *each.integer_range):
            print("    Min value:", bounds.from_value)
            print("    Max value:", bounds.to_value)
            if bounds.step:
                print("    Step:", bounds.step)
        if each.additional_constraints:
            print("    Additional constraints:", each.additional_constraints)
    return None


def add_dump_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 param dump`."""
    _add_node_argument(parser)
    _add_timeout(parser)


def dump(args: Namespace) -> str | None:
    """Print the parameters of a node in YAML, as `load` and `--params-file` read it."""
    import yaml
    from rclpy.parameter import PARAMETER_SEPARATOR_STRING, parameter_value_to_python

    with Graph(args, talks=True) as graph:
        if not _found(graph, args):
            return "Node not found"
        names = list_parameters(graph, args.node_name)
        values = call(graph, args.node_name, "GetParameters", names=names).values if names else []
    tree: dict[str, Any] = {}
    for name, value in zip(names, values, strict=False):
        *groups, last = name.split(PARAMETER_SEPARATOR_STRING)
        branch = tree
        for group in groups:
            branch = branch.setdefault(group, {})
        branch[last] = parameter_value_to_python(value)
    print(yaml.dump({absolute(args.node_name): {"ros__parameters": tree}}, default_flow_style=False))
    return None


def add_load_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 param load`."""
    _add_node_argument(parser)
    parser.add_argument("parameter_file", help="Parameter file")
    parser.add_argument(
        "--no-use-wildcard", action="store_true", help="Do not load parameters in the '/**' namespace into the node"
    )
    _add_timeout(parser)


def load(args: Namespace) -> str | None:
    """Set the parameters of a node from a YAML file."""
    import yaml
    from rclpy.parameter import parameter_dict_from_yaml_file

    with Graph(args, talks=True) as graph:
        if not _found(graph, args):
            return "Node not found"
        try:
            parameters = list(parameter_dict_from_yaml_file(args.parameter_file, not args.no_use_wildcard).values())
        except OSError as error:
            return f"{error.strerror}: '{args.parameter_file}'"
        except (yaml.YAMLError, AttributeError, TypeError) as error:
            return f"YAML file is not a valid ROS parameter file: {error}"
        results = call(graph, args.node_name, "SetParameters", parameters=parameters).results
        for parameter, result in zip(parameters, results, strict=True):
            report(result, f"Set parameter {parameter.name} successful", f"Set parameter {parameter.name} failed")
    return None


VERBS = {
    "delete": Verb("Delete parameter", add_delete_arguments, delete),
    "describe": Verb("Show descriptive information about declared parameters", add_describe_arguments, describe),
    "dump": Verb("Show all of the parameters of a node in a YAML file format", add_dump_arguments, dump),
    "get": Verb("Get parameter", add_get_arguments, get),
    "list": Verb("Output a list of available parameters", add_list_arguments, list_verb),
    "load": Verb("Load parameter file for a node", add_load_arguments, load),
    "set": Verb("Set parameter", add_set_arguments, set_verb),
}


def add_arguments(parser: ArgumentParser) -> None:
    """Add the verbs of `ros2 param`."""
    grammar.add_verbs(parser, "ros2 param", VERBS)
