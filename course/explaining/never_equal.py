"""Comparisons that always have one outcome, because the two sides are of different types."""

import ast
from collections.abc import Iterator

from course.explaining.interface_fields import fields_of
from course.explaining.source import (
    argument,
    assigned,
    calls,
    functions,
    last_parameter,
    name_of,
    named,
    outcome,
    parameter_callbacks,
)
from course.foundation.syntax import walk


def never_equal(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield comparisons of a Parameter or a truth value with a text, and of an option's truth value with None."""
    yield from _parameters(tree)
    yield from _responses(tree)
    yield from _options(tree)


def _parameters(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield comparisons of a Parameter with a text in a parameter callback: `if param == 'output_min':`."""
    for function in named(tree, parameter_callbacks(tree)):
        nodes, given = [*walk(function)], last_parameter(function)
        stored = [node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)]
        loops = (node for node in nodes if isinstance(node, (ast.For, ast.comprehension)))
        over = {name_of(each.target) for each in loops if ast.unparse(each.iter) == given and given not in stored}
        for node, one, other in _compared(nodes):
            if isinstance(one, ast.Name) and one.id in over and stored.count(one.id) == 1 and _is_text(other):
                why = f"`{ast.unparse(node)}` is always {outcome(node)}: `{one.id}` is a Parameter."
                yield node.lineno, f"{why} Its name is `{one.id}.name`, and its value `{one.id}.value`."


def _responses(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield comparisons of a truth value in a client's response with a text: `if response.success != 'True':`."""
    kinds = [argument(call, 0, "srv_type") for call in calls(tree, "create_client")]
    responses = [fields_of(tree, kind, "Response") for kind in kinds]
    for function in functions(tree) if all(responses) else ():
        nodes = [*walk(function)]
        made = [node for node in nodes if isinstance(node, ast.Assign) and _is_response(node.value)]
        names = {each.id for node in made for each in node.targets if isinstance(each, ast.Name)}
        for node, one, other in _compared(nodes):
            of_a_response = isinstance(one, ast.Attribute) and (_is_response(one.value) or name_of(one.value) in names)
            if of_a_response and _is_text(other) and {each.get(name_of(one)) for each in responses} == {"boolean"}:
                text = ast.unparse(one)
                why = f"`{ast.unparse(node)}` is always {outcome(node)}: the field is True or False, not a text."
                yield node.lineno, f"{why} Use `{text}` alone, or `not {text}`."


def _is_response(node: ast.expr) -> bool:
    """Return True for `future.result()`, `client.call(request)` and `await client.call_async(request)`."""
    methods = ("call_async",) if isinstance(node, ast.Await) else ("call", "result")
    asked = node.value if isinstance(node, ast.Await) else node
    return isinstance(asked, ast.Call) and isinstance(asked.func, ast.Attribute) and asked.func.attr in methods


def _options(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield comparisons with None of an option that argparse makes True or False: `action='store_true'`."""
    nodes = [*walk(tree)]
    for call in calls(tree, "add_argument"):
        words = {each.arg: getattr(each.value, "value", None) for each in call.keywords}
        options = [str(getattr(each, "value", "")) for each in call.args]
        changed = {"default", "dest"} & {*words} or [*calls(tree, "set_defaults")]
        if words.get("action") != "store_true" or changed:
            continue
        option = next((each for each in options if each.startswith("--")), "")
        name = option.lstrip("-").replace("-", "_")
        if not name or any(_is_set_otherwise(node, name) for node in nodes):
            continue
        for node in (each for each in nodes if isinstance(each, ast.Compare) and len(each.ops) == 1):
            always = outcome(node) if isinstance(node.ops[0], (ast.Is, ast.IsNot)) else ""
            if always and name_of(node.left) == name and getattr(node.comparators[0], "value", "") is None:
                why = f"`{ast.unparse(node)}` is always {always}: with `action='store_true'`, `{option}` is True or"
                yield node.lineno, f"{why} False, never None. An option with a number has `type=int` in its place."


def _is_set_otherwise(node: ast.AST, name: str) -> bool:
    """Return True for a statement that gives `name` something else than the option's value."""
    pairs = assigned(node) if isinstance(node, ast.Assign) else ()
    return any(name_of(target) == name != name_of(value) for target, value in pairs)


def _is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def _compared(nodes: list[ast.AST]) -> Iterator[tuple[ast.Compare, ast.expr, ast.expr]]:
    """Yield the comparisons for equality, each with its two sides in both orders."""
    for node in nodes:
        if isinstance(node, ast.Compare) and outcome(node) and isinstance(node.ops[0], (ast.Eq, ast.NotEq)):
            left, right = node.left, node.comparators[0]
            yield from ((node, left, right), (node, right, left))
