"""Conditions in a text that are always true, or always false, whatever the values are."""

import ast
import re
from collections.abc import Iterable, Iterator

from course.explaining.source import calls, inside, name_of, outcome, the_method_itself
from course.foundation.syntax import walk

OF_RCLPY = {"server_is_ready", "service_is_ready", "wait_for_server", "wait_for_service"}  # methods of its clients


def always(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield the conditions of a text that cannot be meant, each as its line and a sentence."""
    nodes = [*walk(tree)]
    own = {node.name for node in nodes if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))}
    own |= {name_of(node) for node in nodes if isinstance(getattr(node, "ctx", None), ast.Store)}
    sent = {
        ast.unparse(target)
        for node in nodes
        if isinstance(node, ast.Assign) and name_of(getattr(node.value, "func", None)).endswith("_async")
        for target in node.targets
    }
    conditions = [asked for node in nodes for asked in asked_by(node)]
    yield from _texts_for_bools(nodes, {*map(ast.unparse, conditions)})
    yield from _durations(nodes, {name_of(asked.func) for asked in conditions if isinstance(asked, ast.Call)})
    for node in nodes:
        for asked in asked_by(node):
            text = ast.unparse(asked)
            if isinstance(asked, ast.GeneratorExp):
                yield (
                    asked.lineno,
                    f"`{text}` is a generator, which is always true. Write `all{text}`, or `any{text}`.",
                )
            of_rclpy = isinstance(asked, ast.Attribute) and asked.attr in OF_RCLPY - own
            of_a_future = isinstance(asked, ast.Attribute) and asked.attr == "done" and ast.unparse(asked.value) in sent
            if text == "rclpy.ok" or of_rclpy or of_a_future:
                yield asked.lineno, the_method_itself(text, ", which is always true")
        if isinstance(node, (ast.If, ast.While, ast.IfExp)):
            yield from _texts_alone(node.test)
        if isinstance(node, ast.Compare) and len(node.ops) == 1:
            yield from _never_equal(node, own, of_goals="get_result_async" in map(name_of, nodes))
    yield from _bare_texts(nodes)
    yield from compared_with_nan(nodes)
    yield from _radians_with_degrees(nodes)


def _texts_for_bools(nodes: list[ast.AST], conditions: set[str]) -> Iterator[tuple[int, str]]:
    """Yield what is set to a text for a bool, and is a condition elsewhere: `self.stopped = 'False'`."""
    for node in (each for each in nodes if isinstance(each, ast.Assign)):
        word = getattr(node.value, "value", None)
        if word in ("True", "False") and conditions.intersection(map(ast.unparse, node.targets)):
            yield node.lineno, f"`{word!r}` is a text, and each text but the empty one is true: write `{word}`."


def _durations(nodes: list[ast.AST], asked: set[str]) -> Iterator[tuple[int, str]]:
    """Yield the times since a moment that a function returns, if its name is among those `asked` as conditions."""
    for function in (each for each in nodes if isinstance(each, ast.FunctionDef) and each.name in asked):
        for value in (each.value for each in inside(function) if isinstance(each, ast.Return)):
            last = value.values[-1] if isinstance(value, ast.BoolOp) else value
            if not isinstance(last, ast.BinOp) or not isinstance(last.op, ast.Sub):
                continue
            if ast.unparse(last.left).endswith(".get_clock().now()"):
                text = f"`{ast.unparse(last)}` is a Duration, which is always true:"
                yield last.lineno, f"{text} compare it with another one, such as `Duration(seconds=0.5)`."


TEXT_METHODS = {"capitalize", "casefold", "lower", "strip", "title", "upper"}
OUTCOMES = {"SUCCEEDED", "CANCELED", "CANCELLED", "ABORTED", "REJECTED"}


def _never_equal(node: ast.Compare, own: set[str], *, of_goals: bool) -> Iterator[tuple[int, str]]:
    """Yield comparisons of a text with a method (`word.lower == 'add'`), or with the status of a goal, a number."""
    for one, other in ((node.left, node.comparators[0]), (node.comparators[0], node.left)):
        word, text = getattr(other, "value", None), ast.unparse(one)
        if not isinstance(one, ast.Attribute) or not isinstance(word, str) or one.attr in own:
            continue
        if one.attr in TEXT_METHODS:
            yield node.lineno, the_method_itself(text, ", which is never equal to a text")
        if (
            of_goals
            and one.attr == "status"
            and word.upper() in OUTCOMES
            and isinstance(node.ops[0], (ast.Eq, ast.NotEq))
        ):
            constant = f"GoalStatus.STATUS_{word.upper().replace('CANCELLED', 'CANCELED')}"
            yield (
                node.lineno,
                (
                    f"`{ast.unparse(node)}` compares a number with a text. Write `{text} == {constant}` (from "
                    "action_msgs.msg)."
                ),
            )


def compared_with_nan(nodes: Iterable[ast.AST]) -> Iterator[tuple[int, str]]:
    """Yield comparisons with NaN, to which nothing is equal: `reading == math.nan`."""
    for node in (each for each in nodes if isinstance(each, ast.Compare) and outcome(each)):
        for one, other in ((node.left, node.comparators[0]), (node.comparators[0], node.left)):
            if ast.unparse(other) in NOT_A_NUMBER:
                why = f"`{ast.unparse(node)}` is always {outcome(node)}"
                why += ", because NaN is equal to nothing, not even to NaN."
                yield node.lineno, f"{why} Ask `np.isnan({ast.unparse(one)})`."


NOT_A_NUMBER = {"math.nan", "np.nan", "numpy.nan", "nan", "float('nan')", "float('NaN')"}


def _bare_texts(nodes: list[ast.AST]) -> Iterator[tuple[int, str]]:
    """Yield conditions that are a text alone: `elif 'multiply':`."""
    before = {id(node.orelse[0]): node for node in nodes if isinstance(node, ast.If) and len(node.orelse) == 1}
    for node in (each for each in nodes if isinstance(each, ast.If)):
        if isinstance(node.test, ast.Constant) and isinstance(node.test.value, str) and node.test.value:
            above = before[id(node)].test if id(node) in before else None
            like = isinstance(above, ast.Compare) and len(above.ops) == 1 and isinstance(above.ops[0], ast.Eq)
            meant = ast.unparse(_compared(node.test, above)) if like and isinstance(above, ast.Compare) else ""
            how = f"Write `{meant}`." if meant else "Compare something with it."
            yield node.test.lineno, f"`{ast.unparse(node.test)}` is always true on its own. {how}"


DEGREES = 20.0  # least number that is no angle in radians
CONVERTS = re.compile(r"degrees|radians|rad2deg|deg2rad|3\.14|6\.28|\b57\b|0\.017|deg=")
IN_RADIANS = "compares radians with degrees: the angles of a scan are in radians, and `np.degrees(...)` converts them."
SCALES = (ast.Div, ast.FloorDiv, ast.Mult, ast.MatMult, ast.Pow)
KEEPS_RADIANS = {"abs", "absolute", "arange", "array", "enumerate", "fabs", "float", "len", "mod", "range"}


def _radians_with_degrees(nodes: list[ast.AST]) -> Iterator[tuple[int, str]]:
    """Yield the first comparison of a function that compares angles of a scan, in radians, with a number of degrees."""
    for function in (each for each in nodes if isinstance(each, (ast.FunctionDef, ast.AsyncFunctionDef))):
        inner = [*walk(function)]
        code = [each for each in inner if not isinstance(getattr(each, "value", None), str)]  # without its texts
        words = [str(each.value) if isinstance(each, ast.Constant) else name_of(each) for each in code]
        words += [f"{each.arg}=" for each in inner if isinstance(each, ast.keyword)]
        if any(CONVERTS.search(word) for word in words) or any(map(_scales_by_pi, inner)):
            continue
        stored = [each.id for each in inner if isinstance(each, ast.Name) and isinstance(each.ctx, ast.Store)]
        made = [each for each in inner if isinstance(each, ast.Assign) and _is_angle(each.value, set(), function)]
        names = {name_of(target) for each in made for target in each.targets if isinstance(target, ast.Name)}
        angles = {name for name in names if stored.count(name) == 1}
        for node in (each for each in inner if isinstance(each, ast.Compare)):
            sides = [node.left, *node.comparators]
            seen = [side for side in sides if _is_angle(side, angles, function)]
            others = [side for side in sides if side not in seen]
            plain = all(
                isinstance(each.operand if isinstance(each, ast.UnaryOp) else each, ast.Constant) for each in others
            )
            shifted = [each for each in seen if "angle_increment" not in ast.unparse(each)]  # such as `angles - 180`
            if len(seen) == 1 and plain and any(map(_has_degrees, (*others, *shifted))):
                yield node.lineno, f"`{ast.unparse(node)}` {IN_RADIANS}"
                break


def _scales_by_pi(node: ast.AST) -> bool:
    """Return True for a product or a quotient with pi, other than a few times pi itself."""
    if not isinstance(node, ast.BinOp) or not isinstance(node.op, (ast.Div, ast.FloorDiv, ast.Mult)):
        return False
    parts = [name_of(each) in ("pi", "tau") for each in (node.left, node.right)]
    few = isinstance(node.op, ast.Mult) and any(isinstance(each, ast.Constant) for each in (node.left, node.right))
    return any(name_of(each) in ("pi", "tau") for each in walk(node)) and not (
        few and any(parts) and not _has_degrees(node)
    )


def _is_angle(value: ast.expr, angles: set[str], function: ast.AST) -> bool:
    """Return True if an expression of a function is the angle of a beam, or has one of these variables, unscaled."""
    nodes = [*walk(value)]
    counted = {id(each) for call in calls(value, "len") for each in walk(call)}  # `len(angles)` is a number
    seen = [node for node in nodes if id(node) not in counted]
    found = any(isinstance(node, ast.Attribute) and node.attr == "angle_increment" for node in seen)
    found = found or any(isinstance(node, ast.Name) and node.id in angles for node in seen)
    called = {name_of(node.func) for node in nodes if isinstance(node, ast.Call)}
    products = [
        node
        for node in nodes
        if isinstance(node, ast.BinOp)
        and isinstance(node.op, SCALES)
        and not {"pi", "tau"} & {*map(name_of, walk(node))}
    ]
    scaled = not all(_of_a_beam(node, function) for node in products)
    other = any(isinstance(node, (ast.Compare, ast.Subscript, ast.Lambda)) for node in nodes)
    return found and called <= KEEPS_RADIANS and not scaled and not other


def _of_a_beam(product: ast.BinOp, function: ast.AST) -> bool:
    """Return True for the increment of a scan's angles times the number of a beam."""
    factors = (product.left, product.right)
    if not isinstance(product.op, ast.Mult) or not any(name_of(each) == "angle_increment" for each in factors):
        return False
    number = next((each for each in factors if name_of(each) != "angle_increment"), product.left)
    loops = [node.target for node in walk(function) if isinstance(node, (ast.For, ast.comprehension))]
    counting = {each.id for target in loops for each in walk(target) if isinstance(each, ast.Name)}
    made = [
        node
        for node in walk(function)
        if isinstance(node, ast.Assign) and name_of(getattr(node.value, "func", None)) == "arange"
    ]
    counting |= {name_of(target) for node in made for target in node.targets}
    return name_of(getattr(number, "func", None)) == "arange" or (
        isinstance(number, ast.Name) and number.id in counting
    )


def _has_degrees(value: ast.expr) -> bool:
    numbers = [node.value for node in walk(value) if isinstance(node, ast.Constant)]
    return any(isinstance(number, (int, float)) and number >= DEGREES for number in numbers)


def asked_by(node: ast.AST) -> list[ast.expr]:
    """Return the expressions that a node uses as conditions; of `a or b` alone, only the first is one."""
    if isinstance(node, (ast.If, ast.While, ast.IfExp)):
        return _conditions(node.test)
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        return _conditions(node.operand)
    return [each for value in node.values[:-1] for each in _conditions(value)] if isinstance(node, ast.BoolOp) else []


def _conditions(test: ast.expr) -> list[ast.expr]:
    if isinstance(test, ast.BoolOp):
        return [each for value in test.values for each in _conditions(value)]
    return [test]


def _texts_alone(test: ast.expr) -> Iterator[tuple[int, str]]:
    """Yield texts and numbers beside a comparison in a condition: `operation == 'add' or 'plus'`."""
    if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
        yield from _texts_alone(test.operand)
    if not isinstance(test, ast.BoolOp):
        return
    for value in test.values:
        yield from _texts_alone(value)
    alone = [each for each in test.values if _is_true(each)]
    compared = [each for each in test.values if isinstance(each, ast.Compare) and len(each.ops) == 1]
    if not alone or not isinstance(test.op, ast.Or):
        return
    if not compared:
        if isinstance(getattr(alone[0], "value", None), str):
            text = f"`{ast.unparse(alone[0])}` is always true on its own."
            yield alone[0].lineno, f"{text} Compare something with it, or leave it out."
        return
    each = compared[0]
    meant = [ast.unparse(_compared(value, each) if value in alone else value) for value in test.values]
    joined = " and " if isinstance(each.ops[0], (ast.NotEq, ast.NotIn)) else " or "
    yield (alone[0].lineno, f"`{ast.unparse(alone[0])}` is always true on its own. Write `{joined.join(meant)}`.")


def _is_true(value: ast.expr) -> bool:
    known = isinstance(value, ast.Constant) and isinstance(value.value, (str, int, float))
    return known and not isinstance(value.value, bool) and bool(value.value)  # type: ignore[attr-defined]


def _compared(value: ast.expr, like: ast.Compare) -> ast.Compare:
    """Return a comparison like another one, with this value in place of its constant."""
    if isinstance(like.left, ast.Constant):
        return ast.Compare(value, like.ops, like.comparators)
    return ast.Compare(like.left, like.ops, [value])
