"""Hints on what is there in another form than it is used: brackets after a value, a name without its owner, a list for
an array.
"""

import ast
import builtins
import importlib
import re
import sys
from collections.abc import Callable
from typing import Any

import rclpy

from course.explaining.interface_fields import fields_of
from course.explaining.mixups import line_tree
from course.explaining.overwritten import called
from course.explaining.source import (
    CALLBACKS,
    argument,
    calls,
    covers,
    functions,
    hidden_method,
    last_parameter,
    name_of,
    named,
    parse,
)
from course.explaining.whole_values import given_to_callbacks
from course.foundation.syntax import walk

Hint = Callable[[re.Match[str], str, str], str]
PARTS = ("Request", "Response", "Goal", "Result", "Feedback")
MESSAGES = ("sensor_msgs.msg", "geometry_msgs.msg", "std_msgs.msg")
OF_A_HANDLE = ("is_cancel_requested", "is_active", "publish_feedback", "succeed", "canceled", "abort", "request")
OF_A_CLIENT = ("call", "call_async", "wait_for_service", "service_is_ready")


def _says(text: str) -> Hint:
    """Return a hint with a fixed text."""
    return lambda found, source, code: text


def _brackets(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on brackets after a lock, a message or an array: `with self.cabin():`."""
    names = [
        name
        for name in dict.fromkeys(map(ast.unparse, called(code)))
        if "(" not in name and not hasattr(builtins, name)
    ]
    if found[1].endswith(("ock", "Condition")):
        names = [name for name in names if f"with {name}()" in code]
        return f"`{names[0]}` is a lock already: leave out the brackets, `with {names[0]}:`." if names else ""
    kind = "an array" if found[1].endswith("array") else "a message"
    plain = [name for name in names if "." in name and re.search(rf"{re.escape(name)}\(\)", code)]
    return f"`{plain[0]}` is {kind}, not a function: leave out the brackets after it." if len(plain) == 1 else ""


def _client_called(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on brackets after a client: `self.client(request)`."""
    makers = {
        "Client": ("create_client", "call_async", "request"),
        "ActionClient": ("ActionClient", "send_goal_async", "goal"),
    }
    maker, method, what = makers[found[1]]
    tree, named_so = parse(source), {*map(ast.unparse, called(code))}
    for node in (each for each in walk(tree) if isinstance(each, ast.Assign)):
        if name_of(getattr(node.value, "func", None)) == maker:
            for client in named_so & {*map(ast.unparse, node.targets)}:
                if not hidden_method(source, client.rpartition(".")[2]):
                    return f"`{client}` is a client, not a function: `{client}.{method}({what})` sends a {what}."
    return ""


def _result_awaited(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on `await client.call_async(request).result()`."""
    for node in walk(line_tree(code)):
        asked = node.value.func if isinstance(node, ast.Await) and isinstance(node.value, ast.Call) else None
        future = asked.value if isinstance(asked, ast.Attribute) and asked.attr == "result" else None
        if isinstance(future, ast.Call) and name_of(future.func).endswith("_async"):
            return "`await` itself gives the result of a future, which has none when it is new: leave out `.result()`."
    return ""


SECTORS = {"front", "left", "right"}


def _keys_unpacked(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on `front, right = distances`, which takes the keys of the dict of an agent."""
    for node in walk(parse(source)):
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], (ast.List, ast.Tuple)):
            names = [name_of(each) for each in node.targets[0].elts]
            if isinstance(node.value, ast.Name) and SECTORS.issuperset(names):
                values = ", ".join(f"{node.value.id}['{name}']" for name in names)
                return f"`{ast.unparse(node)}` takes the keys of a dict, which are texts. Its values are `{values}`."
    return ""


def _function_indexed(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on square brackets after a function that was not called, here or where an attribute keeps it."""
    tree = parse(source)
    own = {each.name for each in functions(tree)}
    nodes = [*walk(line_tree(code))]
    read = [node for node in nodes if isinstance(node, (ast.Attribute, ast.Name))]
    indexed = [node.value for node in nodes if isinstance(node, ast.Subscript)]
    for node in (each for each in read if isinstance(each, ast.Name) or name_of(each.value) == "self"):
        text, made = ast.unparse(node), _set_to(tree, node)
        kept = [each for each in made if ast.unparse(each.value).removeprefix("self.") in own]
        if isinstance(node, ast.Attribute) and node in indexed and (hidden := hidden_method(source, node.attr)):
            return f"`{text} = ...` in line {hidden[1]} replaces the method `{node.attr}`: rename one of the two."
        if kept and all(each in kept or getattr(each.value, "value", 0) is None for each in made):
            function = ast.unparse(kept[0].value)
            return (
                f"Line {kept[0].lineno}, `{ast.unparse(kept[0])}`, keeps the function itself: call it, "
                f"`{function}(...)`."
            )
        if not made and node in indexed and name_of(node) in own:
            return f"`{text}` is a function here: call it, `{text}(...)`."
    return ""


def _set_to(tree: ast.AST, node: ast.expr) -> list[ast.Assign]:
    """Return the statements that set a variable or an attribute; those that set it among others are left out."""
    found = (each for each in walk(tree) if isinstance(each, ast.Assign))
    return [each for each in found if ast.unparse(node) in map(ast.unparse, each.targets)]


def _option(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on an option of the command line that is read with its hyphen: `given.cancel-after`."""
    for call in calls(parse(source), "add_argument"):
        for option in (str(getattr(each, "value", "")) for each in call.args):
            first, *others = option.lstrip("-").split("-")
            written = r"\s*-\s*".join(map(re.escape, [first, *others]))
            read = re.search(rf"(\w+)\.{written}\b", code)
            if read and others and first == found[1]:
                name = "_".join([first, *others])
                return f"A hyphen subtracts. The value of `{option}` is `{read[1]}.{name}`, with an underscore."
    return ""


def _of_the_handle(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on an attribute of a goal's handle that is asked of the node."""
    tree = parse(source)
    callbacks = {name_of(argument(call, *CALLBACKS["ActionServer"])) for call in calls(tree, "ActionServer")}
    for function in named(tree, callbacks - {""}):
        given = last_parameter(function)
        if found[2] in OF_A_HANDLE and f"self.{found[2]}" in code and given not in ("", "self"):
            return f"`{found[2]}` belongs to the handle of the goal, not to the node: `{given}.{found[2]}`."
    return ""


def _of_the_client(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a method of a service's client that is called on the node, or on a server."""
    if found[2] not in OF_A_CLIENT:
        return ""
    tree = parse(source)
    if found[1] == "Service":
        made = next(calls(tree, "create_service"), None)
        where = f" in line {made.lineno}" if made else ""
        return f"This is a server: `create_service`{where} makes it. A client is made by `create_client`."
    for node in walk(tree):
        if isinstance(node, ast.Assign) and name_of(getattr(node.value, "func", None)) == "create_client":
            client = ast.unparse(node.targets[0])
            if f"self.{found[2]}(" in code and client.startswith("self."):
                return f"`{found[2]}` is a method of the client, not of the node: `{client}.{found[2]}(...)`."
    return ""


def _of_what_is_given(name: str, source: str, code: str) -> str:
    """Return the hint on a field that a callback reads without what it belongs to: `a` for `request.a`."""
    for function, given, part, fields in given_to_callbacks(parse(source)):
        if name in fields and code in (ast.get_source_segment(source, function) or ""):
            return f"`{name}` is a field of the {part.lower() or 'message'}: write `{given}.{name}`."
    return ""


def _of_the_topic(name: str, source: str, code: str) -> str:
    """Return the hint on the name of a topic in its callback, which gets a message with one field: `error`."""
    tree = parse(source)
    for call in calls(tree, "create_subscription"):
        topic = str(getattr(argument(call, 1, "topic"), "value", "")).rpartition("/")[2]
        fields = [*fields_of(tree, argument(call, 0, "msg_type"))]
        for function in named(tree, {name_of(argument(call, *CALLBACKS["create_subscription"]))}):
            inside = code in (ast.get_source_segment(source, function) or "")
            if topic == name and inside and len(fields) == 1 and not _times_set(name, tree):
                return f"The value on the topic '{name}' is in its message: `{last_parameter(function)}.{fields[0]}`."
    return ""


def _attribute_of_a_node(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a field of what a callback is given, or a parameter, taken for an attribute of the node."""
    name = found[2]
    if re.search(rf"\bself\.{name}\s*=[^=]", source):
        return ""
    if re.search(rf"\bself\.{name}\b(?!\s*\()", code) and (field := _of_what_is_given(name, source, code)):
        return field
    declared = [argument(call, 0, "name") for call in calls(parse(source), "declare_parameter")]
    known = any(isinstance(each, ast.Constant) and each.value == name for each in declared)
    if known and f"self.{name}" in code:
        return f"'{name}' is a parameter: its value is `self.get_parameter('{name}').value`."
    return ""


def _is_message(name: str) -> bool:
    kinds = (getattr(importlib.import_module(module), name, None) for module in MESSAGES)
    return any(hasattr(kind, "get_fields_and_field_types") for kind in kinds)


def _whole_message(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on square brackets after a message, where a dict or a list is expected."""
    if not _is_message(found[1]):
        return ""
    return (
        f"This is a whole message, a {found[1]}, not a dict or a list: check what is passed here. The fields of a "
        "message are attributes."
    )


def _name(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a name without its owner, or without quotation marks: `LOOKING`, `b`, `inf`, `== add`."""
    name, tree = found[1], parse(source)
    for cls in (node for node in tree.body if isinstance(node, ast.ClassDef)):
        kept = {ast.unparse(target) for each in cls.body if isinstance(each, ast.Assign) for target in each.targets}
        if name in kept and any("Enum" in ast.unparse(base) or "Flag" in ast.unparse(base) for base in cls.bases):
            return f"`{name}` is a member of {cls.name}: write `{cls.name}.{name}`."
    if _is_text(name, code, tree):
        return f"Text is written in quotation marks: `'{name}'`."
    if text := _without_quotes(found, source, code):
        return text
    if name == "node" and _is_in_a_method(source):
        return "In a method the node is `self`."
    if field := _of_what_is_given(name, source, code):
        return field
    if not re.search(rf"\bself\.{name}\b", source) and (value := _of_the_topic(name, source, code)):
        return value
    for module, short in (("math", "math"), ("numpy", "np")):
        here = re.search(rf"^import {module}(?: as {short})?$", source, re.MULTILINE)
        if name in OF_MATH and here:
            return f"`{name}` is in the module {module}: write `{short}.{name}`."
        if name == short and f"{name}." in code:
            how = f"import {module}" + (f" as {short}" if short != module else "")
            return f"`{how}` is missing at the beginning."
    return _module(name, source, code)


def _module(name: str, source: str, code: str) -> str:
    """Return the hint on a module that a text uses, and from which it imports names alone, or nothing."""
    known = name in sys.stdlib_module_names or name == rclpy.__name__
    parts = [part for part in re.findall(rf"(?<![\w.]){name}\.(\w+)", code) if hasattr(sys.modules.get(name), part)]
    if not known or not parts:
        return ""
    nodes = [node for node in walk(parse(source)) if isinstance(node, ast.ImportFrom) and node.module == name]
    own = [node for node in nodes if parts[0] in {each.asname or each.name for each in node.names}]
    if own:
        return f"`{ast.unparse(own[0])}` imports the name without its module: write `{parts[0]}`, without `{name}.`."
    return f"`import {name}` is missing at the beginning."


def _is_in_a_method(source: str) -> bool:
    """Return True if only methods of a node use a name `node` that they have not set."""
    using = []
    for function in functions(parse(source)):
        used = any(isinstance(each, ast.Name) and each.id == "node" for each in walk(function))
        known = _times_set("node", function) or "node" in {each.arg for each in function.args.args}
        using += [function] * (used and not known)
    return bool(using) and all(each.args.args and each.args.args[0].arg == "self" for each in using)


OF_MATH = ("inf", "nan", "pi", "degrees", "radians", "isinf", "isnan", "sqrt", "sin", "cos")


OF_PARAMETERS = ("declare_parameter", "get_parameter", "get_parameter_or", "has_parameter", "undeclare_parameter")
SHORT = 2  # letters of a name that may well be an index: `ranges[i]`


def _node_to_spin(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a client that is spun in the place of its node."""
    spun = (node for node in walk(line_tree(code)) if isinstance(node, ast.Call) and "spin" in name_of(node.func))
    return next(
        (f"The first argument of `{name_of(call.func)}` is the node, in its methods `self`." for call in spun), ""
    )


def _no_arguments(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on the arguments of main(), which are None where it is called without any."""
    for main in (each for each in functions(parse(source)) if each.name == "main"):
        for given in main.args.args if code in (ast.get_source_segment(source, main) or "") else ():
            used = re.search(rf"\blen\({given.arg}\)|(?<![\w.]){given.arg}\[|(?:=|\bin) {given.arg}(?![\w.(])", code)
            if used and not _times_set(given.arg, main):
                return (
                    f"`{given.arg}` is None, because main() is called without arguments. The words of the command line "
                    "are in `sys.argv`."
                )
    return ""


def _without_quotes(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on the name of a parameter, or a key of a dict, without its quotation marks."""
    name, line = found[1], line_tree(code)
    for maker in OF_PARAMETERS:
        for call in calls(line, maker):
            given = argument(call, 0, "name")
            if isinstance(given, ast.Name) and given.id == name:
                return f"The name of a parameter is a text: `{maker}('{name}')`."
    if len(name) <= SHORT or _times_set(name, parse(source)) != _times_set(name, line):
        return ""  # an index, or a variable of the text
    for node in walk(line):
        if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Name) and node.slice.id == name:
            return f"A key that is a text stands in quotation marks: `{ast.unparse(node.value)}['{name}']`."
    return ""


def _times_set(name: str, tree: ast.AST) -> int:
    return sum(
        isinstance(each, ast.Name) and each.id == name and isinstance(each.ctx, ast.Store) for each in walk(tree)
    )


def value_for_a_name(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a parameter that is asked for by its value: `self.get_parameter(self.ki)`."""
    for maker in OF_PARAMETERS[1:]:
        for call in calls(line_tree(code), maker):
            given = argument(call, 0, "name")
            if given is not None and not isinstance(given, ast.Constant):
                return (
                    f"`{maker}` takes the name of a parameter, a text, and `{ast.unparse(given)}` is {found[1]} here: "
                    f"write `{maker}('{name_of(given) or 'ki'}')`."
                )
    return ""


def _is_text(name: str, code: str, tree: ast.Module) -> bool:
    """Return True if a line compares this name with what another line compares with a text, or gives it to a text."""
    for call in calls(line_tree(code), "declare_parameter"):
        named_so = str(getattr(argument(call, 0, "name"), "value", "")).endswith("name")  # `joint_name`
        if named_so and isinstance(value := argument(call, 1, "value"), ast.Name) and value.id == name:
            return True
    for node in walk(line_tree(code)):
        if isinstance(node, ast.Compare) and name in map(name_of, node.comparators):
            left = ast.unparse(node.left)
            for other in (each for each in walk(tree) if isinstance(each, ast.Compare)):
                text = getattr(other.comparators[0], "value", None)
                if ast.unparse(other.left) == left and isinstance(text, str):
                    return True
        if isinstance(node, ast.Call):
            keys = {each.arg for each in node.keywords if isinstance(each.value, ast.Name) and each.value.id == name}
            main = sys.modules.get("__main__")
            for given in (each for each in [*node.args, node.func] if keys):
                kind = given.value if isinstance(given, ast.Attribute) else given
                fields = fields_of(tree, kind, "Request") or _of_the_notebook(getattr(main, name_of(kind), None))
                if any(fields.get(str(key)) == "string" for key in keys):
                    return True
    return False


def _of_the_notebook(kind: object) -> dict[str, str]:
    request: Any = getattr(kind, "Request", None)
    return request.get_fields_and_field_types() if hasattr(request, "get_fields_and_field_types") else {}


def _feedback(found: re.Match[str], source: str, code: str) -> str:
    tree = parse(source)
    kind = next((argument(call, 1, "action_type") for call in calls(tree, "ActionServer")), None)
    name = name_of(kind) or "TheType"
    fields = ", ".join(f"{each}=..." for each in fields_of(tree, kind, "Feedback"))
    return f"`publish_feedback` takes one message, with the values in its fields: `{name}.Feedback({fields or '...'})`."


def _first_the_node(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on an action's server or client that is not given its node."""
    maker = found[1]
    for call in calls(parse(source), maker):
        first = call.args[0] if call.args else None
        if isinstance(first, ast.Name) and first.id[:1].isupper():
            given = ", ".join(map(ast.unparse, call.args))
            node = "self" if "class " in source else "ros.node"
            return f"The node comes first: `{maker}({node}, {given}{', ...' if call.keywords else ''})`."
    return ""


def _no_base(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a class that is meant to be a node, and names no base."""
    for cls in (node for node in walk(parse(source)) if isinstance(node, ast.ClassDef) and not node.bases):
        if any(
            covers(cls, call.lineno) and "super().__init__(" in ast.unparse(call) for call in calls(cls, "__init__")
        ):
            return f"The class {cls.name} has no base class, so it is not a node: write `class {cls.name}(Node):`."
    return ""


def part_for_type(line: int, source: str) -> str:
    """Return the hint on a line that gives an action's server or client a part of its type: `Lift.Goal`."""
    tree = parse(source)
    for maker in ("ActionServer", "ActionClient"):
        for call in (each for each in calls(tree, maker) if covers(each, line)):
            given = argument(call, 1, "action_type")
            if isinstance(given, ast.Attribute) and given.attr in PARTS:
                whole = ast.unparse(given.value)
                return (
                    f"`{ast.unparse(given)}` is only the class of a {given.attr.lower()}. This takes the type of the "
                    f"action: `{whole}`."
                )
    return ""


BY_NAME = "A Duration takes its value by name: `Duration(seconds=0.5)`."
OF_THESE = rf"(_thread\.R?[Ll]ock|Condition|array\.array|numpy\.ndarray|\w+_(?:{'|'.join(PARTS)}))"
TABLE: tuple[tuple[str, Hint], ...] = (
    (rf"'{OF_THESE}' object is not callable", _brackets),
    (r"'(Client|ActionClient)' object is not callable", _client_called),
    (r"NoneType.* (?:used in 'await' expression|be awaited)", _result_awaited),
    (r"'(?:function|method)' object is not subscriptable", _function_indexed),
    (r"'Namespace' object has no attribute '(\w+)'", _option),
    (r"'[<>]=?' not supported between instances of 'str' and '(?:float|int)'", _keys_unpacked),
    (r"publish_feedback\(\) takes 2 positional arguments", _feedback),
    (
        r"ActionServer\.__init__\(\) takes 5 positional arguments",
        _says(
            "The first four arguments of an `ActionServer` are the node, the type, the name and the execute callback. "
            "The others have names: `goal_callback=...`, `handle_accepted_callback=...`, `cancel_callback=...`."
        ),
    ),
    (r"'(?:Action)?Client' object has no attribute 'subscriptions'", _node_to_spin),
    (r"'NoneType' (?:has no len\(\)|object is not (?:subscriptable|iterable))|non-iterable NoneType", _no_arguments),
    (r"(Action(?:Server|Client))\.__init__\(\) missing \d required positional argument", _first_the_node),
    (r"^TypeError: Duration\.__init__\(\) takes 1 positional", _says(BY_NAME)),
    (r"object\.__init__\(\) takes exactly one argument", _no_base),
    (
        r"between instances of 'array\.array'|'array\.array' and 'array\.array'|operand type.*'array\.array'",
        _says("The list in a message is not a NumPy array: convert it first, as in `np.array(scan.ranges)`."),
    ),
    (
        r"only integer scalar arrays can be converted to a scalar index|array indices must be integers",
        _says(
            "Only a NumPy array can be indexed with conditions or an array. Make one from the list in the message: "
            "`np.array(scan.ranges)`, for example."
        ),
    ),
    (
        r"unsupported operand type\(s\) for .*'range'",
        _says("A `range` is not an array: to compute with its numbers, write `np.arange(...)`."),
    ),
    (
        r"'\w+_(?:Request|Response|Goal|Result|Feedback)' object does not support item assignment",
        _says("The fields of a message are attributes: write `response.result = ...`, not `response['result'] = ...`."),
    ),
    (r"'(\w+)' object is not subscriptable", _whole_message),
    (r"'(\w+)' object has no attribute '(\w+)'", _of_the_handle),
    (r"'(\w+)' object has no attribute '(\w+)'", _of_the_client),
    (r"'(\w+)' object has no attribute '(\w+)'", _attribute_of_a_node),
    (r"^NameError: name '(\w+)' is not defined", _name),
    (r"^UnboundLocalError: .*local variable '(\w+)'", _without_quotes),
)
