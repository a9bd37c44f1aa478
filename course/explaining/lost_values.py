"""Values in the text of a cell that are lost, or that are compared with themselves: `last = error`, `error - last`."""

import ast
from collections.abc import Iterator

from course.explaining.source import (
    CALLBACKS,
    argument,
    calls,
    functions,
    functions_of,
    inside,
    name_of,
    named,
    undecorated,
)
from course.foundation.syntax import walk

SIMPLE = (ast.Assign, ast.AnnAssign, ast.AugAssign, ast.Expr, ast.Return)
BLOCKS = ("body", "orelse", "finalbody")


def lost_values(tree: ast.Module, skipped: int) -> Iterator[tuple[int, str]]:
    """Yield each such place as its line and a sentence; `skipped` lines are not part of the file."""
    yield from _read_from_a_new_request(tree)
    yield from _gathered_in_vain(tree)
    yield from _differences_of_one_value(tree, skipped)
    yield from _methods_shown(tree)
    yield from _filled_in_vain(tree, skipped)


def _bodies(function: ast.AST) -> Iterator[list[ast.stmt]]:
    for node in (function, *inside(function)):
        yield from (body for part in BLOCKS if isinstance(body := getattr(node, part, None), list))


def _stores(statement: ast.stmt) -> set[str]:
    nodes = (node for node in walk(statement) if isinstance(getattr(node, "ctx", None), (ast.Store, ast.Del)))
    return {ast.unparse(node) for node in nodes}


def _read_from_a_new_request(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield fields of a request that is just made, and still empty, that are read: `a = request.a`."""
    for function in functions(tree):
        for body in _bodies(function):
            empty = ""
            for statement in body:
                target = statement.targets[0] if isinstance(statement, ast.Assign) else None
                value = statement.value if isinstance(statement, ast.Assign) else None
                if isinstance(target, ast.Name) and isinstance(value, ast.Call):
                    is_new = name_of(value.func) in ("Request", "Goal") and not value.args and not value.keywords
                    empty = target.id if is_new else "" if _uses(statement, empty) else empty
                elif isinstance(target, ast.Name) and isinstance(value, ast.Attribute) and empty:
                    if name_of(value.value) == empty and isinstance(value.value, ast.Name) and value.attr == target.id:
                        text, field = ast.unparse(statement), ast.unparse(value)
                        yield (
                            statement.lineno,
                            f"`{text}` reads a field of the new `{empty}`. To set it, write `{field} = {target.id}`.",
                        )
                elif _uses(statement, empty):
                    empty = ""


def _uses(statement: ast.stmt, name: str) -> bool:
    return any(isinstance(node, ast.Name) and node.id == name for node in walk(statement))


def _gathered_in_vain(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield an integral that a callback begins at a number each time: `integral = 0.0`, `integral += error * step`."""
    made = (argument(call, *CALLBACKS[maker]) for maker in ("create_subscription", "create_timer")
            for call in calls(tree, maker))  # fmt: skip
    for function in named(tree, {*map(name_of, made)} - {""}):
        nodes = [*inside(function)]
        loops = [each for node in nodes if isinstance(node, (ast.For, ast.While)) for each in walk(node)]
        kept = [node for node in nodes if isinstance(node, ast.Assign)
                and any(isinstance(each, (ast.Attribute, ast.Subscript)) for each in node.targets)]  # fmt: skip
        for node in (each for each in function.body if isinstance(each, ast.Assign)):
            name = node.targets[0].id if isinstance(node.targets[0], ast.Name) else ""
            adds = [each for each in nodes if isinstance(each, ast.AugAssign) and name_of(each.target) == name]
            if (
                "integral" in name.lower()
                and isinstance(node.value, ast.Constant)
                and any(isinstance(each.target, ast.Name) and each not in loops for each in adds)
                and not any(_uses(each, name) for each in kept)
            ):
                yield (
                    node.lineno,
                    (
                        f"`{name}` begins at {ast.unparse(node.value)} each time that '{function.name}' is called, and "
                        f"what it gathers is lost. Keep it in `self.{name}`, which `__init__` sets."
                    ),
                )


def _differences_of_one_value(tree: ast.Module, skipped: int) -> Iterator[tuple[int, str]]:
    """Yield differences of a value and an attribute that a line just above has set to it."""
    for function in functions(tree):
        for body in _bodies(function):
            same: dict[str, tuple[str, int]] = {}  # an attribute, the value that it has, and the line
            for statement in body:
                for node in walk(statement) if isinstance(statement, SIMPLE) else ():
                    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Sub):
                        one, other = ast.unparse(node.left), ast.unparse(node.right)
                        value, line = same.get(other, ("", 0))
                        if value == one:
                            yield (
                                statement.lineno,
                                (
                                    f"`{one} - {other}` is always 0: line {line - skipped} has just set `{other}` to "
                                    f"`{one}`. Set it below this line."
                                ),
                            )
                gone = _stores(statement)
                called = not isinstance(statement, SIMPLE) or any(map(_of_self, walk(statement)))
                same = {} if called else {
                    each: (value, line) for each, (value, line) in same.items()
                    if each not in gone and value not in gone and value.partition(".")[0] not in gone
                }  # fmt: skip
                if isinstance(statement, ast.Assign) and isinstance(statement.value, (ast.Name, ast.Attribute)):
                    target = statement.targets[0]
                    if isinstance(target, ast.Attribute) and name_of(target.value) == "self":
                        same[ast.unparse(target)] = ast.unparse(statement.value), statement.lineno


def _of_self(node: ast.AST) -> bool:
    """Return True for a call of a method of the object, which may change its attributes."""
    called = node.func if isinstance(node, ast.Call) else None
    return isinstance(called, ast.Attribute) and name_of(called.value) == "self" and called.attr != "get_parameter"


def _methods_shown(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield methods in an f-string that are not called: `f'Motors {self.state}'`."""
    for cls in (node for node in walk(tree) if isinstance(node, ast.ClassDef)):
        nodes = [*walk(cls)]
        stored = {node.attr for node in nodes if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store)}
        own = undecorated(functions_of(cls)) - stored
        for shown in (node.value for node in nodes if isinstance(node, ast.FormattedValue)):
            if isinstance(shown, ast.Attribute) and name_of(shown.value) == "self" and shown.attr in own:
                text = ast.unparse(shown)
                yield shown.lineno, f"`{{{text}}}` shows the method itself. Call it: `{{{text}()}}`."


def _filled_in_vain(tree: ast.Module, skipped: int) -> Iterator[tuple[int, str]]:
    """Yield empty messages that are published, where one of the same type is filled and nothing uses it."""
    for function in functions(tree):
        nodes = [*walk(function)]
        filled = _only_filled(nodes)
        for call in calls(function, "publish"):
            empty = call.args[0] if len(call.args) == 1 else None
            if not isinstance(empty, ast.Call) or empty.args or empty.keywords:
                continue
            made = ast.unparse(empty)
            for node in (each for each in nodes if isinstance(each, ast.Assign) and ast.unparse(each.value) == made):
                if (name := name_of(node.targets[0])) in filled:
                    why = f"`{made}` makes a new, empty message here, and nothing uses `{name}`"
                    how = f"{ast.unparse(call.func)}({name})"
                    yield call.lineno, f"{why}, which is filled below line {node.lineno - skipped}. Write `{how}`."


def _only_filled(nodes: list[ast.AST]) -> set[str]:
    """Return the local names that are used for nothing but setting fields of what they name."""
    stored = [node.value for node in nodes if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store)]
    roots = {node for node in map(_root, stored) if isinstance(node, ast.Name)}
    read = [node for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)]
    kept = {node.id for node in read if node not in roots}
    kept |= {name for node in nodes if isinstance(node, (ast.Global, ast.Nonlocal)) for name in node.names}
    return {node.id for node in roots} - kept


def _root(node: ast.expr) -> ast.expr:
    """Return what an attribute of an attribute, and so on, belongs to: `command` of `command.linear.x`."""
    while isinstance(node, ast.Attribute):
        node = node.value
    return node
