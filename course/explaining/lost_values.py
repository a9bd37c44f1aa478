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
    last_parameter,
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
    yield from sent_before_filled(tree, skipped)
    yield from _hides_what_has_come(tree, skipped)


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
    made = (
        argument(call, *CALLBACKS[maker])
        for maker in ("create_subscription", "create_timer")
        for call in calls(tree, maker)
    )
    for function in named(tree, {*map(name_of, made)} - {""}):
        nodes = [*inside(function)]
        loops = [each for node in nodes if isinstance(node, (ast.For, ast.While)) for each in walk(node)]
        kept = [
            node
            for node in nodes
            if isinstance(node, ast.Assign)
            and any(isinstance(each, (ast.Attribute, ast.Subscript)) for each in node.targets)
        ]
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
                same = (
                    {}
                    if called
                    else {
                        each: (value, line)
                        for each, (value, line) in same.items()
                        if each not in gone and value not in gone and value.partition(".")[0] not in gone
                    }
                )
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


def sent_before_filled(tree: ast.AST, skipped: int = 0) -> Iterator[tuple[int, str]]:
    """Yield messages that are sent as they were made, before the lines that set their fields."""
    for function in functions(tree):
        nodes = [*inside(function)]
        loops = [[*walk(node)] for node in nodes if isinstance(node, (ast.For, ast.While))]
        if any(isinstance(node, (ast.Global, ast.Nonlocal)) for node in nodes):
            continue
        for made in (node for node in nodes if isinstance(node, ast.Assign) and _is_new(node.value)):
            target = made.targets[0]
            used = [node for node in walk(function) if isinstance(node, ast.Name) and node.id == ast.unparse(target)]
            sent_by = [node for node in nodes if isinstance(node, ast.Call) and name_of(node.func) in SENDS]
            sends = [call for call in sent_by if call.args and call.args[0] in used]
            stored = [node for node in nodes if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store)]
            fields = [node for node in stored if _root(node) in used]
            again = any(send in loop and made not in loop for loop in loops for send in sends)
            known = {target, *(call.args[0] for call in sends), *map(_root, fields)}
            if sends and fields and not again and known.issuperset(used):
                sent, filled = [send.lineno for send in sends], min(node.lineno for node in fields)
                if made.lineno < min(sent) and max(sent) < filled:
                    how = f"Send it below the lines that set its fields, the first of which is line {filled - skipped}."
                    yield min(sent), f"This sends `{ast.unparse(target)}` while it is empty. {how}"


SENDS = ("publish", "publish_feedback")


def _is_new(value: ast.expr) -> bool:
    """Return True for an object of a class that is made without values: `Twist()`, `Lift.Feedback()`."""
    return isinstance(value, ast.Call) and name_of(value.func)[:1].isupper() and not value.args and not value.keywords


def _hides_what_has_come(tree: ast.Module, skipped: int) -> Iterator[tuple[int, str]]:
    """Yield new messages in the place of the one that a callback is given, if the next line with them reads a field."""
    heard = {name_of(argument(call, *CALLBACKS["create_subscription"])) for call in calls(tree, "create_subscription")}
    for function in named(tree, heard - {""}):
        given, nodes = last_parameter(function), [*walk(function)]
        used = [node for node in nodes if isinstance(node, ast.Name) and node.id == given]
        for made in (node for node in function.body if isinstance(node, ast.Assign) and _is_new(node.value)):
            later = [node.lineno for node in used if node.lineno > made.lineno]
            if made.targets[0] not in used or len(later) < len(used) - 1:  # the one that has come is used before
                continue
            for node in (each for each in _numbers_read(nodes, made) if later and each.lineno == min(later)):
                read = f"`{ast.unparse(node)}` in line {node.lineno - skipped} is that of the new, empty one"
                yield made.lineno, f"This hides the `{given}` that has come: {read}. Give the new one another name."
                break


VALUES = (ast.Assign, ast.Call, ast.Tuple, ast.keyword)


def _numbers_read(nodes: list[ast.AST], made: ast.Assign) -> Iterator[ast.Attribute]:
    """Yield where a field of a new message is read, and nothing can fill it there: a part of a sum, or `data`."""
    is_array = name_of(getattr(made.value, "func", None)).endswith("Array")
    for node in nodes:
        in_a_sum = isinstance(node, (ast.BinOp, ast.Compare))
        for part in ast.iter_child_nodes(node) if in_a_sum or isinstance(node, VALUES) else ():
            if not isinstance(part, ast.Attribute) or not isinstance(part.ctx, ast.Load):
                continue
            is_number = in_a_sum or (part.attr == "data" and not is_array)
            if is_number and ast.unparse(_root(part)) == ast.unparse(made.targets[0]):
                yield part
