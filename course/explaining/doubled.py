"""Things that a text makes twice, of which one is lost: a class, a method, a server or a subscription of a node."""

import ast
from collections.abc import Iterator

from course.explaining.source import Function, argument, functions, functions_of, name_of
from course.foundation.syntax import walk

# By what makes it: the position and the name of the argument with its name, and what becomes of two.
MADE = {
    "create_service": (1, "srv_name", "is served twice by this node: each request is answered by only one of them"),
    "ActionServer": (2, "action_name", "has two action servers in this node: each goal reaches only one of them"),
    "create_subscription": (1, "topic", "is subscribed to twice by this node: each message is received twice"),
}


def doubled(tree: ast.Module, skipped: int) -> Iterator[tuple[int, str]]:
    """Yield the line of the second of two such, and a sentence; `skipped` lines at the top are not part of a file."""
    for cls in (node for node in walk(tree) if isinstance(node, ast.ClassDef)):
        yield from _methods(cls, skipped)
    if skipped:  # a cell of a notebook may show one class after the other
        yield from _classes(tree, skipped)
    for function in functions(tree):
        yield from _made(function, skipped)


def _classes(tree: ast.Module, skipped: int) -> Iterator[tuple[int, str]]:
    first: dict[str, int] = {}
    two = [each.name for each in tree.body if isinstance(each, ast.FunctionDef)].count("main") > 1
    for cls in (node for node in tree.body if isinstance(node, ast.ClassDef)):
        if cls.name in first and cls.name not in map(ast.unparse, cls.bases):
            text = f"the class '{cls.name}' is defined in line {first[cls.name] - skipped}, too."
            yield cls.lineno, f"{text} Keep one of the two{', and one `main()`' if two else ''}."
        first[cls.name] = cls.lineno


def _methods(cls: ast.ClassDef, skipped: int) -> Iterator[tuple[int, str]]:
    first: dict[str, int] = {}
    for method in functions_of(cls):
        if method.decorator_list:  # a property and its setter have one name
            continue
        if method.name in first:
            text = f"'{method.name}' is defined in line {first[method.name] - skipped}, too, and this one replaces it."
            yield method.lineno, f"{text} Keep one of the two."
        first[method.name] = method.lineno


def _made(function: Function, skipped: int) -> Iterator[tuple[int, str]]:
    """Yield what the statements of a function make twice under one name, each time it is called."""
    first: dict[tuple[str, ...], int] = {}
    for statement in function.body:
        call = statement.value if isinstance(statement, (ast.Assign, ast.Expr)) else None
        maker = name_of(call.func) if isinstance(call, ast.Call) else ""
        if not isinstance(call, ast.Call) or maker not in MADE:
            continue
        place, keyword, so = MADE[maker]
        named = argument(call, place, keyword)
        owner = call.func.value if isinstance(call.func, ast.Attribute) else argument(call, 0, "node")
        if not isinstance(named, ast.Constant) or not isinstance(named.value, str) or owner is None:
            continue
        taken = argument(call, 2, "callback") if maker == "create_subscription" else None
        key = maker, named.value, ast.unparse(owner), ast.unparse(taken) if taken else ""
        if key in first:
            yield call.lineno, f"{named.value} {so}, here and in line {first[key] - skipped}. Is another name meant?"
        first[key] = call.lineno
