"""`ros2 interface`: list the installed messages, services and actions, and show their definitions."""

import re
import sys
from argparse import Action, ArgumentParser, Namespace
from collections.abc import Iterator
from typing import Any

from course.ros import messages
from course.ros2 import completion, grammar
from course.ros2.grammar import Verb

TITLES = {"msg": "Messages", "srv": "Services", "action": "Actions"}
# rosidl's primitive types: the field types that are not messages themselves.
PRIMITIVES = {
    "bool", "byte", "char", "float32", "float64", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64",
    "uint64", "string", "wstring",
}  # fmt: skip
# The part of a line before its comment; a quoted string may contain a hash sign.
BEFORE_COMMENT = re.compile(r"""(?:[^#"']|"(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*'|["'])*""")
# A field: its type without array and string bounds, then its name; a constant has `=` after the name.
FIELD = re.compile(r"^(?P<type>[\w/]+)(?:<=\d+)?(?:\[[^\]]*\])?\s+\w+\s*(?!\s*=)(?:\s|$)")


def _add_kind_arguments(parser: ArgumentParser) -> None:
    for option, kind, word in (("-m", "msgs", "message"), ("-s", "srvs", "service"), ("-a", "actions", "action")):
        parser.add_argument(option, f"--only-{kind}", action="store_true", help=f"Print out only the {word} types")


def _kinds(args: Namespace) -> list[str]:
    chosen = {"msg": args.only_msgs, "srv": args.only_srvs, "action": args.only_actions}
    return [kind for kind in messages.KINDS if chosen[kind] or not any(chosen.values())]


def list_interfaces(args: Namespace) -> None:
    """Print all interfaces, by kind."""
    for kind in _kinds(args):
        print(f"{TITLES[kind]}:")
        for name in messages.all_types(kind):
            print(f"    {name}")


def add_package_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 interface package`."""
    _add_kind_arguments(parser)
    grammar.complete_with(
        parser.add_argument("package_name", help="Name of the ROS package (e.g. 'example_interfaces')"),
        completion.interface_packages,
    )


def package(args: Namespace) -> None:
    """Print the interfaces of a package."""
    for name in messages.interfaces_of(args.package_name):
        if name.split("/")[0] in _kinds(args):
            print(f"{args.package_name}/{name}")


def add_packages_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 interface packages`."""
    for option, kind, word in (("-m", "msgs", "messages"), ("-s", "srvs", "services"), ("-a", "actions", "actions")):
        parser.add_argument(option, f"--only-{kind}", action="count", help=f"Only list packages that generate {word}")


def packages(args: Namespace) -> None:
    """Print the packages that have interfaces, or interfaces of one kind."""
    chosen = {"msg": args.only_msgs, "srv": args.only_srvs, "action": args.only_actions}
    kind = next((kind for kind in messages.KINDS if chosen[kind]), "")
    for name in sorted(messages.interface_packages()):
        if any(each.startswith(kind) for each in messages.interfaces_of(name)) or not kind:
            print(name)


def add_proto_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 interface proto`."""
    grammar.complete_with(
        parser.add_argument("type", help="Show an interface definition (e.g. 'example_interfaces/msg/String')"),
        completion.interface_types,
    )
    parser.add_argument("--no-quotes", action="store_true", help="if true output has no outer quotes.")


def proto(args: Namespace) -> str | None:
    """Print a message, a request or a goal with its default values in YAML, to be copied and changed."""
    try:
        text = messages.to_yaml(messages.get_prototype(args.type))
    except messages.INVALID_TYPE as error:
        return str(error)
    print(text if args.no_quotes else f'"{text}"')
    return None


class _ReadStdinPipe(Action):
    """Read the type from a pipe when it is given as `-`."""

    def __call__(
        self, parser: ArgumentParser, namespace: Namespace, values: Any, option_string: str | None = None
    ) -> None:
        if values == "-":
            if sys.stdin.isatty():
                parser.error("expected stdin pipe")
            values = sys.stdin.readline().strip()
        if not values:
            parser.error("the passed value is empty")
        setattr(namespace, self.dest, values)


def add_show_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 interface show`."""
    group = parser.add_mutually_exclusive_group()
    group.add_argument(
        "--all-comments", action="store_true", help="Show all comments, including for nested interface definitions"
    )
    group.add_argument("--no-comments", action="store_true", help="Show no comments or whitespace")
    grammar.complete_with(
        parser.add_argument(
            "type",
            action=_ReadStdinPipe,
            help="Show an interface definition (e.g. 'example_interfaces/msg/String'). Passing '-' reads the argument "
            "from stdin (e.g. 'ros2 topic type /chatter | ros2 interface show -').",
        ),
        completion.interface_types,
    )


def show(args: Namespace) -> None:
    """Print a definition; below each field that is a message, that message's definition, indented by tabs."""
    for line in definition(args.type, not args.no_comments, args.all_comments):
        print(line)


def definition(
    identifier: str, comments: bool = True, nested_comments: bool = False, indent: str = ""
) -> Iterator[str]:
    """Yield the lines of an interface's definition; raises the errors of `messages.definition_path`."""
    path = messages.definition_path(identifier)
    for line in map(str.rstrip, path.read_text(encoding="utf-8").splitlines()):
        before = BEFORE_COMMENT.match(line)
        code = before.group().rstrip() if before else ""
        shown = line if comments else code
        if shown:
            yield indent + shown
        elif comments:
            yield ""
        field = FIELD.match(code) if path.suffix != ".idl" else None
        if field and field["type"] not in PRIMITIVES:
            *package_name, name = field["type"].split("/")
            nested = f"{package_name[0] if package_name else identifier.split('/')[0]}/msg/{name}"
            yield from definition(nested, nested_comments, nested_comments, indent + "\t")


VERBS = {
    "list": Verb("List all interface types available", _add_kind_arguments, list_interfaces),
    "package": Verb("Output a list of available interface types within one package", add_package_arguments, package),
    "packages": Verb("Output a list of packages that provide interfaces", add_packages_arguments, packages),
    "proto": Verb("Output an interface prototype", add_proto_arguments, proto),
    "show": Verb("Output the interface definition", add_show_arguments, show),
}


def add_arguments(parser: ArgumentParser) -> None:
    """Add the verbs of `ros2 interface`."""
    grammar.add_verbs(parser, "ros2 interface", VERBS)
