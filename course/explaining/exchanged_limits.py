"""Lower and upper limits that a text exchanges: `min(output_min, effort)`, `if effort > high: effort = low`."""

import ast
import re
from collections.abc import Iterator

from course.explaining.source import assigned, calls, functions, inside, name_of, signed_number
from course.foundation.syntax import walk

LIMIT = re.compile(r"\boutput_(min|max)\b")
LIMITED = re.compile(r"angular|effort|output|speed|turn")  # names of values that go no way around
OTHER = {"min": "max", "max": "min"}
HOW = "`max(output_min, ...)` keeps an effort from being too small, `min(output_max, ...)` from being too large."


def exchanged_limits(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield each such place as its line and a sentence."""
    for scope in (tree, *functions(tree)):
        known = {} if scope is tree else _named_limits(scope)
        yield from _by_the_wrong_function(scope, known)
        for node in walk(scope):
            if isinstance(node, ast.If) and len(node.body) == 1:
                yield from _set_to_the_other(node.test, node.body[0], known)
    for call in (each for name in OTHER for each in calls(tree, name)):
        yield from _always_one_number(call)


def _named_limits(function: ast.AST) -> dict[str, set[str]]:
    """Return the limits that variables of a function hold, and nothing else: `low = self.value('output_min')`."""
    nodes = [*inside(function)]
    found: dict[str, list[set[str]]] = {}
    for node in (each for each in nodes if isinstance(each, ast.Assign)):
        for name, value in assigned(node):
            found.setdefault(ast.unparse(name), []).append(_limits(value, {}))
    stored = [node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)]
    held = {name: kinds[0] for name, kinds in found.items() if stored.count(name) == len(kinds)}
    return {name: one for name, one in held.items() if len(one) == 1 and all(each == one for each in found[name])}


def _limits(value: ast.expr, known: dict[str, set[str]]) -> set[str]:
    """Return the limits that a value is, as text; none of what is computed of them, such as `-output_max`."""
    nested = any(
        isinstance(node, (ast.UnaryOp, ast.BinOp)) or (isinstance(node, ast.Call) and name_of(node.func) in OTHER)
        for node in walk(value)
    )
    if isinstance(value, ast.Name) and value.id in known:
        return known[value.id]
    return set() if nested else {*LIMIT.findall(ast.unparse(value))}


def _by_the_wrong_function(scope: ast.AST, known: dict[str, set[str]]) -> Iterator[tuple[int, str]]:
    """Yield `min` with the lower limit, and `max` with the upper one; of two in one another, the outer one."""
    found = {}
    for limit, other in OTHER.items():
        for call in (each for each in calls(scope, limit) if isinstance(each.func, ast.Name) and len(each.args) == 2):
            kinds = [_limits(each, known) for each in call.args]
            if {limit} in kinds and {other} not in kinds:
                side = "above the lower" if limit == "min" else "below the upper"
                found[call] = f"`{ast.unparse(call)}` is never {side} limit. {HOW}"
    inner = {each for call in found for each in walk(call) if each is not call}
    yield from ((call.lineno, why) for call, why in found.items() if call not in inner)


def _set_to_the_other(test: ast.expr, body: ast.stmt, known: dict[str, set[str]]) -> Iterator[tuple[int, str]]:
    """Yield a value that is set to the lower limit where it is above the upper one, or the other way round."""
    if not (isinstance(test, ast.Compare) and len(test.ops) == 1 and isinstance(body, ast.Assign)):
        return
    above, below = (isinstance(test.ops[0], kinds) for kinds in ((ast.Gt, ast.GtE), (ast.Lt, ast.LtE)))
    target = ast.unparse(body.targets[0])
    for value, limit, is_above, is_below in (
        (test.left, test.comparators[0], above, below),
        (test.comparators[0], test.left, below, above),
    ):
        if ast.unparse(value) != target or not (is_above or is_below) or len(body.targets) > 1:
            continue
        number, new = signed_number(limit), signed_number(body.value)
        if number is not None and new is not None:
            mirrored = new == -number and (new < number if is_above else new > number)
            exchanged = mirrored and LIMITED.search(target.lower()) is not None
        else:
            kind = "max" if is_above else "min"
            given = [_limits(each, known) for each in (value, limit, body.value)]
            exchanged = given == [set(), {kind}, {OTHER[kind]}]
        if exchanged:
            one, another = ("above the upper", "lower") if is_above else ("below the lower", "upper")
            text = f"a value {one} limit is set to the {another} one here: the two are exchanged. Write"
            yield body.lineno, f"{text} `{target} = {ast.unparse(limit)}`."


def _always_one_number(call: ast.Call) -> Iterator[tuple[int, str]]:
    """Yield `min(-0.5, max(0.5, ...))`, which is always -0.5."""
    outer, inner = name_of(call.func), next((each for each in call.args if isinstance(each, ast.Call)), None)
    if inner is None or name_of(inner.func) != OTHER[outer] or len(call.args) != 2 or len(inner.args) != 2:
        return
    numbers = [
        next((each for each in map(signed_number, node.args) if each is not None), None) for node in (call, inner)
    ]
    first, second = numbers
    if first is None or second is None or not (first < second if outer == "min" else first > second):
        return
    low, high = sorted((first, second))
    free = next((ast.unparse(each) for each in inner.args if signed_number(each) is None), "...")
    text = f"`{ast.unparse(call)}` is always {first:g}: the two limits are exchanged. Write"
    yield call.lineno, f"{text} `max({low:g}, min({high:g}, {free}))`."
