"""Conditions on a whole request or message in the place of its field, and on another field than `success`."""

import ast
from collections.abc import Iterator

from course.explaining.conditions import asked_by
from course.explaining.interface_fields import fields_of
from course.explaining.source import Function, argument, calls, name_of, named, outcome
from course.foundation.syntax import walk

# What makes a callback; the place and name of its type, the part that the callback gets, and as which argument.
GIVEN = (
    ("create_service", (0, "srv_type"), (2, "callback"), "Request", -2),
    ("create_subscription", (0, "msg_type"), (2, "callback"), "", -1),
    ("ActionServer", (1, "action_type"), (9, "goal_callback"), "Goal", -1),
)
Given = tuple[Function, str, str, dict[str, str]]


def given_to_callbacks(tree: ast.AST) -> Iterator[Given]:
    """Yield each callback with the argument by which it gets a request, a message or a goal, the part, and its fields.

    Those whose fields are not known are left out.
    """
    for maker, kind, callback, part, place in GIVEN:
        for call in calls(tree, maker):
            fields, name = fields_of(tree, argument(call, *kind), part), name_of(argument(call, *callback))
            for function in named(tree, {name}) if fields else ():
                if len(function.args.args) >= -place:
                    yield function, function.args.args[place].arg, part, fields


def whole_values(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield conditions that are a whole request, or compare it with a constant: `if request == True:`."""
    for function, given, part, fields in given_to_callbacks(tree):
        nodes = [*walk(function)]
        if any(isinstance(node, ast.Name) and node.id == given and isinstance(node.ctx, ast.Store) for node in nodes):
            continue
        what = f"the whole {part.lower() or 'message'}"
        values = " or ".join(f"`{given}.{field}`" for field in fields)
        how = f"its value is {values}" if len(fields) == 1 else f"ask for one of its fields, {values}"
        for node in nodes:
            for asked in asked_by(node):
                if isinstance(asked, ast.Name) and asked.id == given:
                    yield asked.lineno, f"`{given}` is {what}, which is always true: {how}."
            if not isinstance(node, ast.Compare) or not outcome(node) or not _is_constant(node.comparators[0]):
                continue
            if isinstance(node.left, ast.Name) and node.left.id == given:
                why = f"`{ast.unparse(node)}` is always {outcome(node)}, because `{given}` is {what}"
                yield node.lineno, f"{why}: {how}."


def _is_constant(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and node.value is not None


def _compared_with_nothing(node: ast.AST) -> list[ast.expr]:
    """Return what a node compares with 0, an empty text or None."""
    same = isinstance(node, ast.Compare) and isinstance(node.ops[0], (ast.Eq, ast.NotEq, ast.Is, ast.IsNot))
    return [node.left] if same and not getattr(node.comparators[0], "value", 1) else []  # type: ignore[attr-defined]


def other_than_success(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield conditions of a client on a field of the response where nothing reads its `success`."""
    nodes = [*walk(tree)]
    words = {node.value if isinstance(node, ast.Constant) else name_of(node) for node in nodes}
    if {"success", "getattr", "vars", "get_fields_and_field_types"} & words:
        return
    for call in calls(tree, "create_client"):
        kind = argument(call, 0, "srv_type")
        response, request = (fields_of(tree, kind, part) for part in ("Response", "Request"))
        others = {field for field in response if field not in request} if "success" in response else set()
        for node in nodes:
            conditions = [] if isinstance(node, ast.BoolOp) else asked_by(node)  # `message or 'no reason'` is a value
            for each in [*conditions, *_compared_with_nothing(node)]:
                if isinstance(each, ast.Attribute) and each.attr in others and name_of(each.value) != "self":
                    text, owner = ast.unparse(each), ast.unparse(each.value)
                    may = "have a text in a success, too" if response[each.attr] == "string" else "be 0 in a success"
                    how = f"`{owner}.success` says whether the request was refused, and nothing in the file reads it."
                    yield each.lineno, f"`{text}` may {may}. {how}"
