"""Code of a cell that runs without what it is meant to do: a coroutine that nobody awaits, another unit."""

import ast
from collections.abc import Iterator

from course.session.source import functions, inside, name_of, named

MILLISECONDS = 1e6  # nanoseconds in one
NOW = {"now", "monotonic", "time", "perf_counter"}


def unmeant(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield each such place as its line and a sentence."""
    yield from _not_awaited(tree)
    yield from _milliseconds(tree)
    yield from _negative_ages(tree)


def _not_awaited(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield calls of the text's own `async def` as statements, without `await`."""
    own = {each.name for each in functions(tree) if isinstance(each, ast.AsyncFunctionDef)}
    coroutines = {each.name for each in named(tree, own)}
    for function in functions(tree):
        for node in inside(function):
            call = node.value if isinstance(node, ast.Expr) else None
            if not isinstance(call, ast.Call) or name_of(call.func) not in coroutines:
                continue
            if isinstance(call.func, ast.Name) or name_of(call.func.value) == "self":  # type: ignore[attr-defined]
                what = ast.unparse(call.func)
                here = "" if isinstance(function, ast.AsyncFunctionDef) else f", and `async def {function.name}`"
                yield (
                    call.lineno,
                    (
                        f"`{what}(...)` alone runs nothing, because `{name_of(call.func)}` is an `async def`: write "
                        f"`await {what}(...)`{here}."
                    ),
                )


def _milliseconds(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield comparisons of a time in milliseconds with a number that is meant in seconds: `.nanoseconds / 1e6 < 1`."""
    for node in ast.walk(tree):
        if not (isinstance(node, ast.Compare) and len(node.ops) == 1):
            continue
        for one, other in ((node.left, node.comparators[0]), (node.comparators[0], node.left)):
            limit = getattr(other, "value", None)
            if (
                isinstance(one, ast.BinOp)
                and isinstance(one.op, ast.Div)
                and name_of(one.left) == "nanoseconds"
                and getattr(one.right, "value", None) == MILLISECONDS
                and isinstance(limit, (int, float))
                and 0 < limit <= 1
            ):
                yield (
                    node.lineno,
                    (
                        f"`.nanoseconds / 1e6` is in milliseconds, so {limit:g} means "
                        f"{limit:g} ms. Seconds are `.nanoseconds / 1e9`."
                    ),
                )


def _negative_ages(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield ages with their times swapped: `self.came - self.get_clock().now() < limit`."""
    for cls in (node for node in ast.walk(tree) if isinstance(node, ast.ClassDef)):
        stored: dict[str, list[ast.AST]] = {}
        for node in (each for each in ast.walk(cls) if isinstance(each, (ast.Assign, ast.AugAssign))):
            for target, value in _pairs(node) if isinstance(node, ast.Assign) else [(node.target, node)]:
                stored.setdefault(ast.unparse(target), []).append(value)
        past = {name for name, values in stored.items() if name.startswith("self.") and _are_of_the_past(values)}
        for asked in (each for each in ast.walk(cls) if isinstance(each, ast.Compare)):
            age, below = asked.left, isinstance(asked.ops[0], (ast.Lt, ast.LtE))
            if isinstance(age, ast.BinOp) and isinstance(age.op, ast.Sub) and below and len(asked.ops) == 1:
                then, now = ast.unparse(age.left), ast.unparse(age.right)
                if then in past and _is_now(age.right):
                    yield (
                        asked.lineno,
                        f"`{then} - {now}` is below 0, since now is the later of the two: write `{now} - {then}`.",
                    )


def _pairs(node: ast.Assign) -> Iterator[tuple[ast.expr, ast.expr]]:
    """Yield each target of an assignment with its value, also those of `a, b = 1, 2`."""
    for target in node.targets:
        if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
            yield from zip(target.elts, node.value.elts, strict=False)
        else:
            yield from ((each, node.value) for each in getattr(target, "elts", [target]))


def _is_now(value: ast.AST) -> bool:
    return isinstance(value, ast.Call) and name_of(value.func) in NOW and not value.args


def _are_of_the_past(values: list[ast.AST]) -> bool:
    """Return True if some of these values are the time of their line, and the others None."""
    others = [each for each in values if not _is_now(each)]
    return len(others) < len(values) and all(isinstance(each, ast.Constant) and each.value is None for each in others)
