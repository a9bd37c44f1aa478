"""Values that a function of a text computes, and that nothing uses: a `return` or a `name = ...` is forgotten."""

import ast
from collections.abc import Iterator

from course.explaining.source import Function, calls, functions, inside, name_of
from course.foundation.syntax import walk

PURE = {"abs", "bool", "isinstance", "len", "max", "min", "repr", "round", "sorted", "str", "sum"}  # without any effect
OF_NUMPY = {
    "abs",
    "absolute",
    "arange",
    "array",
    "clip",
    "concatenate",
    "deg2rad",
    "degrees",
    "isfinite",
    "isinf",
    "isnan",
    "max",
    "maximum",
    "min",
    "minimum",
    "mod",
    "rad2deg",
    "radians",
    "where",
}
READS = {
    "endswith",
    "get_clock",
    "get_parameter",
    "lower",
    "now",
    "startswith",
    "strip",
    "upper",
}  # methods without one
CONVERTS = {"float", "int"}
OTHER_NUMBERS = {"Decimal", "Fraction", "eval", "float32", "float64", "literal_eval", *CONVERTS}  # which make a number
IN_PLACE = {"append", "clear", "extend", "insert", "remove", "reverse", "sort"}  # methods of a list that return None
EXPECTS = {"raises", "suppress"}  # of a `with` block in which a line may only be tried
ENDINGS = {"BaseException", "ExternalShutdownException", "KeyboardInterrupt", "SystemExit"}  # how a program is stopped
EFFECTS = (ast.Await, ast.Lambda, ast.NamedExpr, ast.Starred, ast.Yield, ast.YieldFrom)
COMPUTED = (
    ast.BinOp,
    ast.BoolOp,
    ast.Call,
    ast.Dict,
    ast.IfExp,
    ast.JoinedStr,
    ast.List,
    ast.Set,
    ast.Tuple,
    ast.UnaryOp,
)
LONG = 60  # characters of an expression that are shown


def thrown_away(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield each such place as its line and a sentence."""
    own = {each.name for each in functions(tree)} | {node.name for node in tree.body if isinstance(node, ast.ClassDef)}
    own |= {node.id for node in walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    for function in functions(tree):
        tried = {id(each) for node in inside(function) if _may_only_try(node) for each in walk(node)}
        for block, loops in _blocks(function):
            for statement in block:
                value = statement.value if isinstance(statement, ast.Expr) else None
                if value is not None and id(statement) not in tried and _is_lost(value, function, own, block):
                    at_the_end = statement is block[-1] and not loops and _may_return(function, statement)
                    how = "check" if function.name.startswith("test") else "return" if at_the_end else "keep"
                    yield statement.lineno, _continued(value, how) or _told(ast.unparse(value), how)
        yield from _converted(tree, function)
        yield from _changed_in_place(function, own)


def _told(text: str, how: str) -> str:
    text = text if len(text) <= LONG else f"{text[: LONG - 3]}..."
    line = {"check": f"assert {text}", "return": f"return {text}", "keep": f"name = {text}"}[how]
    return f"nothing uses the value of `{text}`. To {how} it, write `{line}`."


def _continued(value: ast.expr, how: str) -> str:
    """Return a sentence on a line that goes on with the one above, or that changes a variable without `=`; or ''."""
    first = value
    while isinstance(first, ast.BinOp):
        first = first.left
    if isinstance(first, ast.UnaryOp) and isinstance(first.op, (ast.UAdd, ast.USub)):
        return "this line is a statement of its own. To continue the line above, put the whole expression in brackets."
    sign = SIGNS.get(type(value.op), "") if isinstance(value, ast.BinOp) else ""
    if isinstance(value, ast.BinOp) and sign and how == "keep" and isinstance(value.left, (ast.Attribute, ast.Name)):
        left, right = ast.unparse(value.left), ast.unparse(value.right)
        return f"`{left} {sign} {right}` changes nothing. To change `{left}`, write `{left} {sign}= {right}`."
    return ""


SIGNS: dict[type[ast.operator], str] = {ast.Add: "+", ast.Sub: "-"}


def _may_only_try(node: ast.AST) -> bool:
    """Return True for a block in which a line may stand only to see whether it raises an exception."""
    if isinstance(node, (ast.With, ast.AsyncWith)):
        return any(name_of(getattr(each.context_expr, "func", None)) in EXPECTS for each in node.items)
    if not isinstance(node, ast.Try):
        return False
    caught = [each for handler in node.handlers for each in (getattr(handler.type, "elts", None) or [handler.type])]
    return not {*map(name_of, caught)} <= ENDINGS


def _blocks(function: Function) -> Iterator[tuple[list[ast.stmt], bool]]:
    """Yield the blocks of a function, with True for those in a loop; without those of functions and classes in it."""
    todo: list[tuple[ast.AST, bool]] = [(function, False)]
    for node, loops in todo:  # which grows meanwhile
        for part in ("body", "orelse", "finalbody", "handlers", "cases"):
            found = getattr(node, part, None)
            block = [each for each in found if isinstance(each, ast.stmt)] if isinstance(found, list) else []
            again = loops or (isinstance(node, (ast.For, ast.AsyncFor, ast.While)) and part == "body")
            if block:
                yield block, again
            for each in found if isinstance(found, list) else ():
                if not isinstance(each, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
                    todo.append((each, again))


def _is_lost(value: ast.expr, function: Function, own: set[str], block: list[ast.stmt]) -> bool:
    """Return True if an expression that is a statement can have no purpose but its value."""
    if isinstance(value, ast.Compare):  # `name == value` is told of elsewhere
        told = (
            len(value.ops) == 1
            and isinstance(value.ops[0], ast.Eq)
            and isinstance(value.left, (ast.Attribute, ast.Name))
        )
        return not told and not any(isinstance(node, EFFECTS) for node in walk(value))
    if isinstance(value, ast.Name):
        return _is_kept(value.id, function)
    if isinstance(value, ast.Constant):
        return _is_answer(value, function, block)
    if not isinstance(value, COMPUTED) or (isinstance(value, (ast.Dict, ast.List, ast.Tuple)) and not _parts(value)):
        return False
    return all(_has_no_effect(node, own) for node in walk(value))


def _parts(value: ast.Dict | ast.List | ast.Tuple) -> list[ast.expr]:
    return value.values if isinstance(value, ast.Dict) else value.elts


def _is_kept(name: str, function: Function) -> bool:
    """Return True for a variable that a function itself has set: a parameter alone may only satisfy a linter."""
    made = [node for node in inside(function) if isinstance(node, (ast.Assign, ast.AugAssign, ast.AnnAssign))]
    targets = [target for node in made for target in (node.targets if isinstance(node, ast.Assign) else [node.target])]
    return not name.startswith("_") and any(isinstance(each, ast.Name) and each.id == name for each in targets)


def _is_answer(value: ast.Constant, function: Function, block: list[ast.stmt]) -> bool:
    """Return True for a word or a number that ends a branch of a function whose other branches return the like."""
    of_a_branch = block is not function.body and getattr(block[-1], "value", None) is value
    returned = [node.value for node in inside(function) if isinstance(node, ast.Return) and node.value]
    kinds = {type(node.value) for each in returned for node in walk(each) if isinstance(node, ast.Constant)}
    plain = not isinstance(value.value, str) or (bool(value.value.strip()) and len(value.value.split()) == 1)
    return of_a_branch and plain and value.value not in (None, ...) and type(value.value) in kinds


def _has_no_effect(node: ast.AST, own: set[str]) -> bool:
    if not isinstance(node, ast.Call):
        return not isinstance(node, EFFECTS)
    name, called = name_of(node.func), node.func
    if any(each.arg in ("key", "out", None) for each in node.keywords):
        return False
    if isinstance(called, ast.Name):
        return name in PURE - own
    of = ast.unparse(called.value) if isinstance(called, ast.Attribute) else ""
    return of == "math" or (of in ("np", "numpy") and name in OF_NUMPY) or name in READS - own


def _may_return(function: Function, statement: ast.stmt) -> bool:
    """Return True if `return` may be forgotten in a statement that ends its block."""
    others = any(isinstance(node, ast.Return) and node.value is not None for node in inside(function))
    return function.name != "__init__" and (others or statement is function.body[-1])


def _converted(tree: ast.Module, function: Function) -> Iterator[tuple[int, str]]:
    """Yield the conversions of arguments that nothing keeps, where a request needs them: `float(a), float(b)`."""
    for node in (each for each in inside(function) if isinstance(each, ast.Expr)):
        value = node.value
        each_call = value.elts if isinstance(value, ast.Tuple) else [value]
        given = [
            each.args[0]
            for each in each_call
            if isinstance(each, ast.Call)
            and name_of(each.func) in CONVERTS
            and len(each.args) == 1
            and isinstance(each.args[0], ast.Name)
        ]
        if not given or len(given) < len(each_call):
            continue
        others = [each for each in walk(tree) if name_of(each) in OTHER_NUMBERS]
        made = [(each.targets[0], each.value) for each in walk(tree) if isinstance(each, ast.Assign)]
        sent = {name_of(kept) for target, kept in made if name_of(getattr(target, "value", None)) not in ("", "self")}
        for call in (*calls(tree, "Request"), *calls(tree, "Goal")):
            sent |= {name_of(each.value) for each in call.keywords}
        names = [ast.unparse(each) for each in given]
        later = {
            each.id
            for each in inside(function)
            if isinstance(each, ast.Name) and each.lineno >= node.lineno and isinstance(each.ctx, ast.Store)
        }
        if len(others) == len(given) and sent.issuperset(names) and not later.intersection(names):
            text = ", ".join(map(ast.unparse, each_call))
            how = f"{', '.join(names)} = {text}"
            yield node.lineno, f"`{text}` converts, and nothing keeps the result. Write `{how}`."


def _changed_in_place(function: Function, own: set[str]) -> Iterator[tuple[int, str]]:
    """Yield lists that are set to what a method returns that changes them, None: `stops = stops.append(floor)`."""
    for node in inside(function):
        called = node.value.func if isinstance(node, ast.Assign) and isinstance(node.value, ast.Call) else None
        if isinstance(node, ast.Assign) and isinstance(called, ast.Attribute) and called.attr in IN_PLACE - own:
            target = ast.unparse(called.value)
            if [ast.unparse(each) for each in node.targets] == [target]:
                why = f"`{called.attr}` changes the list itself and returns None, so `{target}` is None then."
                yield node.lineno, f"{why} Write `{ast.unparse(node.value)}` alone."
