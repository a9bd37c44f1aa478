"""Hints on calls of rclpy with too few, too many, wrong or misplaced arguments."""

import ast
import difflib
import inspect
import re
import sys
from collections.abc import Iterator
from typing import Any

import rclpy.action
import rclpy.client
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node

from course.explaining.mixups import line_tree
from course.explaining.source import (
    Function,
    argument,
    assigned,
    calls,
    functions,
    inside,
    name_of,
    named,
    parse,
    service_callbacks,
    without_self,
)
from course.foundation.syntax import walk

# The methods that make a node's endpoints, the position of the name among the arguments, and a correct call.
MAKERS = {
    "create_service": (1, "create_service(TheType, '/name', self.callback)"),
    "create_client": (1, "create_client(TheType, '/name')"),
    "create_publisher": (1, "create_publisher(TheType, 'topic', 10)"),
    "create_subscription": (1, "create_subscription(TheType, 'topic', self.callback, 10)"),
    "ActionServer": (2, "ActionServer(self, TheType, '/name', self.execute)"),
    "ActionClient": (2, "ActionClient(self, TheType, '/name')"),
}

NO_NODE = "type object '{}' has no attribute 'default_callback_group'"  # a type in the place of the node


def order_of_arguments(found: re.Match[str], source: str) -> str:
    """Return the hint on a call with a type in quotation marks, a misplaced name, or a wrong last argument."""
    tree = parse(source)
    for maker, (place, usual) in MAKERS.items():
        for call in calls(tree, maker):
            if exchanged := _exchanged(call):
                return exchanged
            names = [at for at, each in enumerate(call.args) if isinstance(getattr(each, "value", None), str)]
            if place - 1 in names and place in names:
                text = ast.unparse(call.args[place - 1])
                return f"The type is not a text: write it without quotation marks, `{text[1:-1]}`, and import it."
            last = call.args[-1] if len(call.args) == 4 and maker == "create_subscription" else None
            no_node = call.args and NO_NODE.format(name_of(call.args[0])) in found.string
            if no_node or (names and names[0] != place) or isinstance(last, ast.Attribute):
                in_a_cell = "ros.node" in map(ast.unparse, call.args)
                right = usual.replace("(self,", "(ros.node,") if in_a_cell else usual
                return f"The arguments of `{maker}` are in the wrong order: write `{right}`."
    return ""


def _exchanged(call: ast.Call) -> str:
    """Return the hint on a type and a name that are given by each other's keyword; '' for another call."""
    given = {each.arg: each.value for each in call.keywords}
    for kind, name in (("srv_type", "srv_name"), ("msg_type", "topic"), ("action_type", "action_name")):
        text, other = given.get(kind), given.get(name)
        if (
            isinstance(text, ast.Constant)
            and isinstance(text.value, str)
            and isinstance(other, (ast.Name, ast.Attribute))
        ):
            right = f"{kind}={ast.unparse(other)}, {name}={ast.unparse(text)}"
            return f"`{kind}` is the type and `{name}` the text: write `{right}`."
    return ""


def response_first(source: str) -> str:
    """Return the hint on a service callback that names its response before its request; '' without one."""
    tree = parse(source)
    for function in named(tree, service_callbacks(tree)):
        names = [each.arg for each in function.args.args]
        if names[-2:] == ["response", "request"]:
            right = ", ".join([*names[:-2], "request", "response"])
            return f"A service callback gets the request first, then the response: `def {function.name}({right})`."
    return ""


NO_CALLBACK = "A publisher has no callback: `create_publisher(TheType, 'topic', 10)`."
OF_RCLPY = {
    "ActionClient": rclpy.action.ActionClient,
    "ActionServer": rclpy.action.ActionServer,
    "Client": rclpy.client.Client,
    "Node": Node,
}


def unknown_keyword(found: re.Match[str], source: str) -> str:
    """Return the hint on an argument that a function of rclpy does not take by this name."""
    owner, method, name = found.groups()
    function = getattr(OF_RCLPY.get(owner), method, None)
    if method == "declare_parameter" and name in ParameterDescriptor.get_fields_and_field_types():
        return f"`{name}` is a field of the descriptor, the third argument: `ParameterDescriptor({name}=...)`."
    if method == "create_publisher" and name == "callback":
        return NO_CALLBACK
    if function is None or "Did you mean" in found.string:
        return ""
    takes = [each for each in inspect.signature(function).parameters if each != "self"]
    near = difflib.get_close_matches(name, takes, 1)
    return f"Did you mean `{near[0]}=`?" if near else ""


def of_start(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on an argument of `ros.start` that a class is given: `ros.start(Doubler(threads=2))`."""
    for call in calls(line_tree(code), "start"):
        made = call.args[0] if call.args else None
        if ast.unparse(call.func) == "ros.start" and isinstance(made, ast.Call) and name_of(made.func) == found[1]:
            passed = ", ".join(map(ast.unparse, [made.func, *made.args, *made.keywords]))
            return f"`ros.start` takes the class, and makes the node itself: `ros.start({passed})`."
    return ""


def type_of(name: str) -> str:
    """Return the type of a service of which `name`, as `Calculate_Request`, is one half; '' for any other class."""
    whole, _, part = name.rpartition("_")
    return whole if part in ("Request", "Response") else ""


def half(name: str) -> str:
    """Return what to write for `Calculate_Request`, the class of one half of a service; '' for any other class."""
    if not (whole := type_of(name)):
        return ""
    part = name.rpartition("_")[2]
    return f"`{whole}.{part}` is only the class of a {part.lower()}. This takes the type of the service: `{whole}`."


def wrong_kind(found: re.Match[str], source: str) -> str:
    """Return the hint on an interface of the wrong kind, such as a message instead of a service."""
    wanted, package, kind, name = found.groups()
    if why := half(name):
        return why
    is_one = {"msg": "a message", "srv": "a service", "action": "an action"}.get(kind, "something else")
    wants = {"service": "a service's type, from a `.srv`", "message": "a message's type, from a `.msg`"}[wanted]
    maker = {"srv": "create_service", "action": "ActionServer", "msg": "create_publisher"}.get(kind, "")
    return f"This takes {wants}, but {package}/{kind}/{name} is {is_one}: use `{maker}` for it."


# The functions whose further arguments rclpy takes by name only, and how many it takes without.
BY_NAME = {"create_service": 3, "create_client": 2, "create_publisher": 3, "create_subscription": 4}


def _by_name(maker: str, source: str) -> str:
    """Return the hint on an argument of `maker` that must have a name."""
    tree = parse(source)
    made = [node for node in walk(tree) if isinstance(node, ast.Assign)]
    names = {ast.unparse(each) for node in made if _is_group(node.value) for each in node.targets}
    own = {each.name for each in functions(tree)}
    for call in calls(tree, maker):
        for given in call.args[BY_NAME[maker] :]:
            if ast.unparse(given) in names or _is_group(given):
                return f"`{maker}` takes a callback group by name: write `callback_group={ast.unparse(given)}`."
        if maker == "create_publisher" and any(name_of(each) in own for each in call.args[2:]):
            return NO_CALLBACK
    return f"`{maker}` takes its further arguments by name, as in `callback_group=group`."


def _is_group(node: ast.expr) -> bool:
    return isinstance(node, ast.Call) and name_of(node.func).endswith("Group")


# What rclpy calls with which values: the argument's name, or the function and its place, and what to write.
OF_LAMBDAS = {
    "create_service": (2, "callback", "request, response"),
    "create_subscription": (2, "callback", "msg"),
    "create_timer": (1, "callback", ""),
    "add_done_callback": (0, "callback", "future"),
    "add_on_set_parameters_callback": (0, "callback", "params"),
    "add_post_set_parameters_callback": (0, "callback", "params"),
}
BY_KEYWORD = {
    "execute_callback": "goal_handle",
    "goal_callback": "goal",
    "handle_accepted_callback": "goal_handle",
    "cancel_callback": "goal_handle",
    "feedback_callback": "message",
}


def lambda_arguments(found: re.Match[str], source: str) -> str:
    """Return the hint on a `lambda` that is called with more or fewer values than it takes."""
    tree = parse(source)
    given = [
        (maker, argument(call, place, name), takes)
        for maker, (place, name, takes) in OF_LAMBDAS.items()
        for call in calls(tree, maker)
    ]
    words = (node for node in walk(tree) if isinstance(node, ast.keyword) and node.arg in BY_KEYWORD)
    given += [(str(each.arg), each.value, BY_KEYWORD[str(each.arg)]) for each in words]
    for what, each, takes in given:
        plain = isinstance(each, ast.Lambda) and not (each.args.vararg or each.args.defaults or each.args.kwonlyargs)
        counts = (1, 2) if what == "create_subscription" else (len(takes.split(", ")) if takes else 0,)
        if plain and isinstance(each, ast.Lambda) and len(each.args.args) not in counts:
            return f"Line {each.lineno}: the `lambda` of `{what}` must be `lambda{' ' * bool(takes)}{takes}: ...`."
    if found[1] == "0":
        names = ", ".join(["goal_handle"] if found[2] == "1" else [*"abcdefgh"[: int(found[2])]])
        return (
            f"The `lambda` is called with {found[2]} argument{'s' * (found[2] != '1')} but takes none: write "
            f"{'a name' if found[2] == '1' else 'names'} before its colon, as in `lambda {names}: ...`."
        )
    return ""


TAKES = {  # what makes a callback, and what the callback must take
    "create_service": "(self, request, response)",
    "create_subscription": "(self, msg)",
    "create_timer": "(self)",
    "ActionServer": "(self, goal_handle)",
    "send_goal_async": "(self, message)",
    "add_done_callback": "(self, future)",
    "add_on_set_parameters_callback": "(self, params)",
}


def called_by_hand(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a line that calls a callback of ROS 2 itself, without what ROS 2 passes to it."""
    name, tree = found[1], parse(source)
    if not any(isinstance(call.func, ast.Attribute) for call in calls(line_tree(code), name)):
        return ""
    for maker, given in _given_to_makers(tree):
        if name_of(given) == name:
            passed = TAKES[maker].strip("()").removeprefix("self, ")
            return (
                f"This line calls the callback `{name}` itself. ROS 2 calls it, and passes `{passed}` to it. Put what "
                "both need into a method of its own."
            )
    return ""


def _given_to_makers(tree: ast.AST) -> Iterator[tuple[str, ast.expr]]:
    """Yield each argument of what makes a callback, with its maker."""
    for maker in TAKES:
        for call in calls(tree, maker):
            yield from ((maker, each) for each in (*call.args, *(keyword.value for keyword in call.keywords)))


def argument_count(found: re.Match[str], source: str) -> str:
    """Return the hint on a function called with the wrong number of arguments."""
    name = found[1].rpartition(".")[2]
    for function in (each for each in functions(parse(source)) if each.name == name):
        if line := next((each.lineno for each in function.decorator_list if name_of(each) == "property"), 0):
            return (
                f"`@property` in line {line} has `self.{name}` call the function at once, without arguments. A "
                "callback is a plain method: leave it out."
            )
    for maker, given in _given_to_makers(parse(source)):
        if isinstance(given, ast.Call) and name_of(given.func) == name:
            return f"This line calls `{name}()` at once. Pass the method itself, without brackets: `self.{name}`."
        if name_of(given) == name:
            return f"`{maker}` calls `{name}`, which must take {TAKES[maker]}."
    if name in BY_NAME and "positional arguments but" in found.string:
        return _by_name(name, source)
    if name in without_self(source):
        return f"The first parameter of a method is `self`: `def {name}(self, ...)`."
    return ""


LEVELS = ("debug", "info", "warn", "warning", "error", "fatal")


def self_behind_super(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on `super().__init__(self, 'my_node')`."""
    for call in (node for node in walk(line_tree(code)) if isinstance(node, ast.Call)):
        behind = isinstance(call.func, ast.Attribute) and ast.unparse(call.func.value) == "super()"
        if behind and call.args and name_of(call.args[0]) == "self" and isinstance(call.args[0], ast.Name):
            given = [ast.unparse(each) for each in (*call.args[1:], *call.keywords)]
            return f"`super()` passes `self` already: write `{ast.unparse(call.func)}({', '.join(given)})`."
    return ""


def logged(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a logger that is given something else than a text."""
    for level in LEVELS:
        for call in calls(line_tree(code), level):
            if len(call.args) == 1:
                what = ast.unparse(call.args[0])
                return f"A logger takes a text, but `{what}` is not one: write `{level}(str({what}))`."
    return ""


def node_without_quotes(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a name of a running node without its quotation marks, as an argument in a cell."""
    module: Any = sys.modules.get("course.session.live")
    session = module.current() if module else None
    if session is None or "rclpy.init(" in source or found[1] not in session.node.get_node_names():
        return ""
    given = [each for node in walk(line_tree(code)) if isinstance(node, ast.Call) for each in node.args]
    if not any(isinstance(each, ast.Name) and each.id == found[1] for each in given):
        return ""
    return f"The name of a node is a text, in quotation marks: `'{found[1]}'`."


def of_an_argument(attribute: str, kind: str, source: str) -> str:
    """Return the hint on a call of `self.look`, which is a `kind`, if only arguments of one name are stored in it."""
    stored = {(each.name, name) for each in functions(parse(source)) for name in _stored_in(attribute, each)}
    if len(stored) != 1:
        return ""
    ((function, name),) = stored
    takes = {each.arg for made in functions(parse(source)) if made.name == function for each in made.args.args}
    if name not in takes:
        return ""
    return (
        f"`{attribute}` is {kind} here, not a function. It is the argument `{name}` of `{function}`: if a function is "
        f"meant, pass the function itself there, by its name without brackets; if {kind} is meant, leave out the "
        f"brackets after `{attribute}`."
    )


def _stored_in(attribute: str, function: Function) -> Iterator[str]:
    """Yield what a function stores in an attribute: the name of a variable, or '' for anything else."""
    for node in inside(function):
        pairs = assigned(node) if isinstance(node, ast.Assign) else ()
        yield from (getattr(value, "id", "") for each, value in pairs if ast.unparse(each) == attribute)
