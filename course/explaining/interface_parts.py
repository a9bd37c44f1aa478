"""Hints on messages, requests, responses and goals: their types, their parts and their fields."""

import ast
import difflib
import importlib
import re
import sys
from typing import Any

from action_msgs.msg import GoalStatus
from rclpy.action.client import ClientGoalHandle
from rclpy.action.server import ServerGoalHandle

from course.explaining.arguments import response_first, unknown_keyword
from course.explaining.source import argument, calls, inside, name_of, named, no_result, parse, service_callbacks
from course.foundation.syntax import walk

# Python's names of a field's type, and the names in a definition file.
TYPES = {"boolean": "bool", "double": "float64", "float": "float32", "octet": "byte"}


def type_name(kind: str) -> str:
    """Return a field's type as in a definition: `float64`, where the Python class has `double`."""
    if found := re.fullmatch(r"sequence<(.*?)(?:, (\d+))?>", kind):
        return f"{type_name(found[1])}[{'<=' + found[2] if found[2] else ''}]"
    if found := re.fullmatch(r"(.*)\[(\d+)\]", kind):
        return f"{type_name(found[1])}[{found[2]}]"
    return TYPES.get(kind, kind)


def unknown_field(found: re.Match[str], source: str) -> str:
    """Return the hint on a field that a request, response, goal, result or feedback does not have."""
    message, part, name = found[1], found[2], found[3]
    fields = _fields(message, part, source)
    if part in ("Request", "Response") and name not in fields and (swapped := response_first(source)):
        return swapped
    if part == "Request" and name not in fields and name in _fields(message, "Response", source):
        tree = parse(source)
        for function in named(tree, service_callbacks(tree)):
            for node in (each for each in inside(function) if isinstance(each, ast.Assign)):
                if isinstance(node.value, ast.Call) and ast.unparse(node.value.func) == f"{message}.Request":
                    return (
                        f"`{ast.unparse(node)}` makes a request. Set the fields of the response that '{function.name}' "
                        "is given, and return that."
                    )
    if empty := _without_fields(message, part, name, source):
        return empty
    if (part, name) == ("Goal", "request") and name not in fields:
        return "A goal callback gets the goal itself, not a goal handle: its fields are read without `.request`."
    return _has_fields(f"{'A' if part == 'Request' else 'The'} {part.lower()} of {message}", fields, name)


def _without_fields(message: str, part: str, name: str, source: str) -> str:
    """Return the hint on a field of a part of an interface that has no fields, as the request of Trigger; or ''."""
    kind = _kind(message, part, source)
    if not part or kind is None or kind.get_fields_and_field_types():
        return ""
    what = f"The {part.lower()} of {message} has no fields"
    if part == "Request" and name in _fields(message, "Response", source):
        return f"{what}: `{name}` is a field of its response."
    imports = (node for node in walk(parse(source)) if isinstance(node, ast.ImportFrom))
    others = [each.name for node in imports for each in node.names if name in _fields(each.name, part, source)]
    return f"{what}. `{name}` is a field of the {part.lower()} of {others[0]}." if others else f"{what}."


def no_such_field(found: re.Match[str], source: str) -> str:
    """Return the hint on an attribute that a message, whose type the program imports, does not have."""
    message, name = found[1], found[2]
    fields = _fields(message, "", source)
    if not fields or name in fields:
        return ""
    near = [each for each in fields if each.startswith(name)]
    if len(near) == 1:
        return f"Did you mean `{near[0]}`?"
    return _has_fields(f"The message {message}", fields, name)


RANGES = ("FloatingPointRange", "IntegerRange")
LISTS = (ast.List, ast.Tuple, ast.Set, ast.ListComp)


def not_a_list(found: re.Match[str], source: str) -> str:
    """Return the hint on a field that takes a list; where the text gives it one, only on the range of a descriptor."""
    name, kind = found.groups()
    tree = parse(source)
    given = [node.value for node in walk(tree) if isinstance(node, ast.keyword) and node.arg == name]
    made = [node for node in walk(tree) if isinstance(node, ast.Assign)]
    given += [node.value for node in made if getattr(node.targets[0], "attr", "") == name]
    if not given or not all(isinstance(each, LISTS) for each in given):
        return f"The field '{name}' takes a list, even for a single value: `{name}=[...]`."
    if kind not in RANGES:
        return ""
    return f"The list holds one {kind}, with both of its ends: `{name}=[{kind}(from_value=..., to_value=...)]`."


def wrapped(found: re.Match[str], source: str) -> str:
    """Return the hint on a missing attribute of a goal's response or a feedback message, which wraps the one meant."""
    part, name = found[2], found[3]
    if part == "FeedbackMessage":
        return f"A feedback callback gets a message that contains the feedback: write `.feedback.{name}`."
    if name in OF_A_GOAL_HANDLE:
        sends = next(calls(parse(source), "send_goal"), None)
        return (
            "`send_goal` waits for the goal to end and returns its result, not the goal handle: use `send_goal_async`."
            if sends
            else f"This is the response of `get_result_async`, with `status` and `result`. `{name}` belongs to the "
            "goal handle, which you get from `send_goal_async`."
        )
    fields = _fields(found[1], "Result", source)
    if name not in fields and (near := difflib.get_close_matches(name, ("status", "result"), 1)):
        return f"The response has a `status` and a `result`. Did you mean `{near[0]}`?"
    if fields and name not in fields:
        return _has_fields(f"The response has a `status` and a `result`, and the result of {found[1]}", fields, name)
    return f"The response has a `status` and a `result`, and the fields are in that `result`: write `.result.{name}`."


OF_A_GOAL_HANDLE = (
    "accepted",
    "cancel_goal",
    "cancel_goal_async",
    "get_result",
    "get_result_async",
    "goal_id",
    "stamp",
)


def _has_fields(what: str, fields: list[str], name: str) -> str:
    if not fields:
        return f"{what} has no field '{name}': compare the spelling with the definition."
    near = difflib.get_close_matches(name, fields, 1)
    meant = f" Did you mean `{near[0]}`?" if near else ""
    listed = f"fields {', '.join(fields)}" if len(fields) > 1 else f"one field {fields[0]}"
    return f"{what} has the {listed}.{meant}"


def no_such_argument(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on an unknown field, as in `SetParametersResult(success=...)`."""
    name = found[1]
    written = rf"\b([A-Z]\w*)(?:\.([A-Z]\w*))?\((?=[^()]*\b{name}\s*=)"  # first where the field is in its own brackets
    for message, part in re.findall(written, code) or re.findall(r"\b([A-Z]\w*)(?:\.([A-Z]\w*))?\(", code):
        if package := _imported_before(message, part, name):
            return (
                f"`{message}` is still the type of the build before: import it again, "
                f"`from {package} import {message}`."
            )
        if empty := _without_fields(message, part, name, source):
            return empty
        if fields := _fields(message, part, source):
            what = f"{'A' if part == 'Request' else 'The'} {part.lower()} of {message}" if part else message
            return _has_fields(what, fields, name)
    return f"The message has no field '{name}': `ros2 interface show` shows its fields."


def _imported_before(message: str, part: str, field: str) -> str:
    """Return the package of a type of the notebook that was built again since, if the new one has `field`; else ''."""
    old = getattr(sys.modules.get("__main__"), message, None)
    package = getattr(old, "__module__", "").rpartition(".")[0]
    if not package.endswith((".action", ".msg", ".srv")):
        return ""
    try:
        new = getattr(importlib.import_module(package), message)
        fields = (getattr(new, part) if part else new).get_fields_and_field_types()
    except (ImportError, AttributeError):
        return ""
    return package if old is not new and field in fields else ""


def _kind(message: str, part: str, source: str) -> Any:
    """Return the class of a type that the program imports, or of this part of it; None if it is not known here."""
    module = re.search(rf"from ([\w.]+) import (?:\([^)]*|[^\n]*)\b{message}\b", source)
    known = getattr(sys.modules.get("__main__"), message, None)
    try:
        kind = getattr(importlib.import_module(module[1]), message) if module else known
        made = getattr(kind, part) if part else kind
    except (ImportError, AttributeError):
        return None
    return made if hasattr(made, "get_fields_and_field_types") else None


def _fields(message: str, part: str, source: str) -> list[str]:
    """Return the fields of a type that the program imports, if it is known here."""
    kind = _kind(message, part, source)
    return [*kind.get_fields_and_field_types()] if kind else []


def wrong_type(found: re.Match[str], source: str) -> str:
    """Return the hint on a value of another type than its field."""
    field, kind = found[1], found[2]
    examples = {
        "float": "a float, such as 3.0, not a text, an int, a NumPy number or None: convert a number with `float(...)`",
        "int": "a whole number: convert a number or text with `int(...)`, and count a list with `len(...)`",
        "str": "a string: use `str(...)` or an f-string",
        "bool": "True or False, without quotation marks; a comparison such as `count > 0` gives one",
    }
    return f"The field '{field}' takes {examples[kind]}."


def _class_given(given: ast.expr | None, source: str, parts: tuple[str, ...]) -> str:
    """Return the text of a class such as `Lift.Goal` that a line gives without brackets, itself or by a name; or ''."""
    made = [node for node in walk(parse(source)) if isinstance(node, ast.Assign)]
    named_so = [node.value for node in made if given and ast.unparse(given) in map(ast.unparse, node.targets)]
    for each in [given, *named_so]:
        if isinstance(each, ast.Attribute) and each.attr in parts and name_of(each.value)[:1].isupper():
            return ast.unparse(each)
    return ""


def sent(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a line in which a client sends something that is not a goal or request of its type.

    Or in which a goal's feedback is not a message of its type.
    """
    for method, part in [*((each, SENT[each][0]) for each in SENT), ("publish_feedback", "Feedback")]:
        for call in calls(parse(code), method):
            if kind := _class_given(call.args[0] if call.args else None, source, (part,)):
                return f"`{kind}` is the class itself. Create one with brackets: `{kind}(...)`."
    if "publish_feedback(" in code:
        return "`publish_feedback` takes a message, with the value in its field: `TheType.Feedback(...)`."
    for method, (part, what) in SENT.items():
        for call in calls(parse(code), method):
            made = call.args[0] if call.args else None
            if isinstance(made, ast.Call) and name_of(made.func) == part:
                kind = ast.unparse(made.func)
                return (
                    f"`{kind}` is not of this client's type: a client sends {what} of the type with which it was "
                    f"created. Compare this line, the line that creates the client, and the imports."
                )
        if re.search(rf"\b{method}\(", code):
            return f"A client sends {what} of its own type, with the values in its fields: `TheType.{part}(...)`."
    return ""


OF_AN_ACTION, OF_A_SERVICE = ("Goal", "a goal"), ("Request", "a request")


SENT = {"send_goal": OF_AN_ACTION, "send_goal_async": OF_AN_ACTION, "call": OF_A_SERVICE, "call_async": OF_A_SERVICE}
CLIENTS = {"Request": ("create_client", (0, "srv_type")), "Goal": ("ActionClient", (1, "action_type"))}


def _sent_type(name: str, part: str, source: str) -> str:
    """Return the type of the text's only client, or of one whose requests or goals have the field `name`; else ''."""
    maker, place = CLIENTS[part]
    kinds = [argument(call, *place) for call in calls(parse(source), maker)]
    fit = [kind for kind in kinds if name in _fields(name_of(kind), part, source)] if name else kinds
    texts = {ast.unparse(kind) for kind in fit if kind}
    return texts.pop() if len(texts) == 1 else ""


def sent_by_name(found: re.Match[str], source: str) -> str:
    """Return the hint on an argument that a client's method does not take by this name: `call_async(a=1, b=2)`."""
    method, name = found[2], found[3]
    part, what = SENT[method]
    own = part.lower()
    if kind := _sent_type(name, part, source):
        return f"`{method}` takes {what}, with the values in its fields: `{kind}.{part}({name}=...)`."
    if "timeout" in name and method.endswith("_async"):
        waits = "`ros.wait(future, timeout=...)`"
        if "rclpy.init(" in source:
            waits = "`rclpy.spin_until_future_complete(node, future, timeout_sec=...)`"
        how = "leave it out" if "create_service" in source else f"{waits} takes one"
        return f"`{method}` returns at once, so it takes no time limit: {how}."
    if name.endswith("callback") and "feedback" not in name:
        done = "the answer comes" if part == "Request" else "the goal is accepted or rejected"
        takes = "takes no callback" if part == "Request" else "takes one callback, `feedback_callback=`"
        return (
            f"`{method}` {takes}. What is to be called when {done} is given to the future that it returns: "
            "`future.add_done_callback(...)`."
        )
    if own in name.split("_") or own.startswith(name):
        return f"Did you mean `{own}=`?"
    return unknown_keyword(found, source) or _takes(method, source)


def nothing_sent(found: re.Match[str], source: str) -> str:
    """Return the hint on a client's method that is given no request, or no goal."""
    return _takes(found[1], source)


def _takes(method: str, source: str) -> str:
    part, what = SENT[method]
    kind = _sent_type("", part, source) or "TheType"
    return f"`{method}` takes {what}: `{kind}.{part}(...)`, with the values in its fields."


def sub_message(found: re.Match[str], source: str) -> str:
    """Return the hint on a field that holds a message."""
    if found[1] == "result" and found[2].endswith("_Result"):
        action = found[2].removesuffix("_Result")
        for node in (each for each in walk(parse(source)) if isinstance(each, ast.Return)):
            if kind := _class_given(node.value, source, ("Result",)):
                return (
                    f"Line {node.lineno}, `{ast.unparse(node)}`, returns the class itself. Create a result with "
                    f"brackets: `{kind}(...)`."
                )
        name = callback[0] if (callback := no_result(source)) else "execute"
        return f"The callback '{name}' must end with `return {action}.Result(...)`, on every path through it."
    return f"The field '{found[1]}' holds a {found[2]} message: set its fields, as in `.{found[1]}.x = 0.3`."


def not_a_message(found: re.Match[str], source: str) -> str:
    """Return the hint on what is published, sent or called with something else than its message."""
    module, name = found[1], found[2]
    try:
        fields = list(getattr(importlib.import_module(module), name).get_fields_and_field_types())
    except (ImportError, AttributeError):
        fields = []
    how = f": `{name}({fields[0]}=...)`" if len(fields) == 1 else f" with brackets, `{name}()`, and set its fields"
    given = ", and got None" if "got <class 'NoneType'>" in found.string else ""
    return f"`publish` takes a message of the topic's type{given}. Create a {name}{how}."


def type_for_goal(found: re.Match[str], source: str) -> str:
    """Return the hint on `Fibonacci(order=5)`, the type of an action or a service in place of its goal or request."""
    for part in ("Goal", "Request"):
        if found[2] in _fields(found[1], part, source):
            what = "an action, and a goal" if part == "Goal" else "a service, and a request"
            return f"`{found[1]}` is the type of {what} of it is `{found[1]}.{part}({found[2]}=...)`."
    return ""


OF_GOALS = {"ServerGoalHandle": ServerGoalHandle, "ClientGoalHandle": ClientGoalHandle, "GoalStatus": GoalStatus}


ASK_FOR_RESULT = (
    "This is a goal handle, which comes as soon as the goal is accepted; the result comes at the goal's end, and is "
    "requested separately: {}."
)
IN_A_CELL = "`ros.wait(goal_handle.get_result_async()).result`"
IN_A_PROGRAM = (
    "`future = goal_handle.get_result_async()`, and once that future is done, `future.result().result` is the result"
)
MEANT = {  # where the most similar name is not the one that is meant, or there is none
    ("ClientGoalHandle", "cancel"): "cancel_goal_async",
    ("ServerGoalHandle", "is_canceled"): "is_cancel_requested",
    ("ServerGoalHandle", "is_cancelled"): "is_cancel_requested",
    ("ServerGoalHandle", "cancelled"): "canceled",
    ("ClientGoalHandle", "canceled"): "cancel_goal_async",
    ("ClientGoalHandle", "cancelled"): "cancel_goal_async",
}


def of_a_goal_handle(found: re.Match[str], source: str) -> str:
    """Return the hint on an attribute that a goal handle, or the table of goals' states, does not have."""
    kind, name = found[1], found[2]
    if kind == "ServerGoalHandle":
        for call in calls(parse(source), "ActionServer"):
            if name in _fields(name_of(argument(call, 1, "action_type")), "Goal", source):
                return f"The fields of the goal are in its `request`: `goal_handle.request.{name}`."
    known = [each for each in dir(OF_GOALS[kind]) if not each.startswith("_")]
    near = [MEANT[kind, name]] if (kind, name) in MEANT else difflib.get_close_matches(name, known, 1, 0.7)
    if kind == "ClientGoalHandle" and (near == ["get_result"] or name in _fields_of_results(source)):
        return ASK_FOR_RESULT.format(IN_A_CELL if re.search(r"\bros\.", source) else IN_A_PROGRAM)
    return f"Did you mean `{near[0]}`?" if near else ""


def _fields_of_results(source: str) -> set[str]:
    """Return the fields of the results of the actions that a text has clients of."""
    kinds = [name_of(argument(call, 1, "action_type")) for call in calls(parse(source), "ActionClient")]
    return {field for kind in kinds for field in _fields(kind, "Result", source)}


PARTS_OF_TYPES = ("Request", "Response", "Goal", "Result", "Feedback")


def by_name(found: re.Match[str], source: str) -> str:
    """Return the hint on a message whose fields are given without their names."""
    used = getattr(sys.modules.get("__main__"), "Parameter", None)
    imported = re.search(r"from rcl_interfaces\.msg import (?:\*|.*\bParameter\b)", source)
    if found[1] == "Parameter" and (imported or getattr(used, "__module__", "").startswith("rcl_interfaces.")):
        return (
            "`Parameter` is the message of rcl_interfaces.msg here, which hides rclpy's class of that name: import "
            "from there only what you need, without `*`, and then `from rclpy.parameter import Parameter`."
        )
    if fields := _fields(found[1], "", source):
        return f"A message takes its fields by name: `{found[1]}({fields[0]}=...)`."
    message, _, part = found[1].rpartition("_")
    if message and part in PARTS_OF_TYPES:
        if fields := _fields(message, part, source)[: int(found[2]) - 1]:
            named_there = ", ".join(f"{each}=..." for each in fields)
            return f"A message takes its fields by name: `{message}.{part}({named_there})`."
        how = f"`{message}.{part}(field=...)`: `ros2 interface show` shows its fields."
        return f"A message takes its fields by name, {how}"
    return ""
