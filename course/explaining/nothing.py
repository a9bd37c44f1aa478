"""Hints on None where a value is needed: a function without a `return`, or a response that is not there yet."""

import ast
import inspect
import itertools
import re
import sys
import textwrap
from collections.abc import Callable

from course.explaining.mixups import assigned, line_tree, outside_of_functions, returned
from course.explaining.source import (
    Function,
    functions,
    functions_of,
    may_return_nothing,
    name_of,
    named,
    parse,
    service_callbacks,
)
from course.foundation.syntax import walk

NOT_YET = (
    "The response is not there yet: `future.result()` and `client.call(..., timeout_sec=...)` are None until it comes."
)
NOT_DONE = "The future is not done yet, so its result is None. `ros.wait(future)` waits for it and returns its result."


def attribute_of_nothing(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on an attribute of None, if the text shows where the None comes from; else ''."""
    if outside_of_functions(code, source) and re.search(r"\.result\(\)\.\w", code):
        return NOT_DONE
    for used in walk(line_tree(code)):
        if not (isinstance(used, ast.Attribute) and used.attr == found[1]):
            continue
        values = _values(used.value, source, code)
        if values and all(_is_awaited(value, source) for value in values):
            return _replaced(values[0], source) or NOT_YET
        for value in values:
            if text := _ends_without_value(value, used.value, source, silent=len(values) > 1):
                return text
    return ""


def awaited_nothing(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on `ros.wait(future)` with what a method that ends without a `return` gave; else ''."""
    for call in (node for node in walk(line_tree(code)) if isinstance(node, ast.Call)):
        for given in call.args[:1] if name_of(call.func) == "wait" else ():
            for value in [given, *(each for _, each in assigned(given, source))]:
                name = name_of(value.func) if isinstance(value, ast.Call) else ""
                for function in named(parse(source), {name}):
                    if _is_silent(function) and not isinstance(function, ast.AsyncFunctionDef):
                        return (
                            f"`{name}` returns nothing, so `{ast.unparse(given)}` is None. End `{name}` with a "
                            "`return` of the future."
                        )
    return ""


def returned_nothing(source: str, code: str, *, given: bool = False) -> str:
    """Return the hint on something in a line that holds what a function without a `return` gave, or ''.

    With `given`, the line is a value alone, which is None.
    """
    for used in walk(line_tree(code)):
        whole = used.value if given and isinstance(used, ast.Expr) else None
        if whole and (text := _ends_without_value(whole, whole, source, silent=True)):
            return text
        if isinstance(used, (ast.BinOp, ast.Compare, ast.Subscript)):
            for value in (each for each in ast.iter_child_nodes(used) if isinstance(each, ast.expr)):
                if text := _ends_without_value(value, value, source, silent=True):
                    return text
        if isinstance(used, (ast.Attribute, ast.Name)):
            for _, value in assigned(used, source):
                if text := _ends_without_value(value, used, source, silent=True):
                    return text
    return ""


def silent_helper(source: str) -> tuple[str, int, str] | None:
    """Return a function that may return nothing, its line, and the service callback that hands it on; else None."""
    tree = parse(source)
    names = service_callbacks(tree)
    for function in named(tree, names):
        for node in walk(function):
            if not (isinstance(node, ast.Return) and node.value):
                continue
            value = _without_await(node.value)
            made = _called(value, source) if isinstance(value, ast.Call) else []
            waits = value is not node.value
            if len(made) == 1 and may_return_nothing(made[0]) and waits == isinstance(made[0], ast.AsyncFunctionDef):
                return made[0].name, made[0].lineno, function.name
    return None


def gave_nothing(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a function of the notebook that the line calls and that may return nothing, or ''."""
    for call in (node for node in walk(line_tree(code)) if isinstance(node, ast.Call)):
        made = _of_the_notebook(call)
        if made is not None and may_return_nothing(made):
            return _gave_none(made.name)
    return ""


def _gave_none(name: str) -> str:
    return (
        f"`{name}(...)` returned None: `{name}` ends without a `return`. It must return a value on every path through "
        "it."
    )


def _values(given: ast.expr, source: str, code: str) -> list[ast.expr]:
    """Return what an expression in a line may be: itself, or all that is assigned to it in the functions around."""
    given = _without_await(given)
    if isinstance(given, ast.Call):
        return [given]
    values = list(assigned(given, source))
    if isinstance(given, ast.Attribute) and (last := _set_just_before(given, source, code)):
        return [_without_await(last)]
    if isinstance(given, ast.Name):
        lines = source.splitlines()
        around = [
            range(each.lineno, (each.end_lineno or each.lineno) + 1)
            for each in functions(parse(source))
            if any(line.strip() == code for line in lines[each.lineno - 1 : each.end_lineno])
        ]
        values = [each for each in values if not around or any(each[0] in part for part in around)]
    return [_without_await(value) for _, value in values]


def _set_just_before(given: ast.Attribute, source: str, code: str) -> ast.expr | None:
    """Return what the statement before a line assigns to `self.handle`, which the line then uses; None for another."""
    for node in walk(parse(source)):
        body = getattr(node, "body", [])
        for before, after in itertools.pairwise(body if isinstance(body, list) else []):
            line = source.splitlines()[after.lineno - 1].strip()
            if (
                line == code
                and isinstance(before, ast.Assign)
                and ast.unparse(given) in map(ast.unparse, before.targets)
            ):
                return before.value
    return None


def _without_await(value: ast.expr) -> ast.expr:
    return value.value if isinstance(value, ast.Await) else value


def _is_awaited(value: ast.expr, source: str, *, deep: bool = True) -> bool:
    """Return True for an expression that is None until a response comes."""
    if not isinstance(value, ast.Call):
        return False
    owner = value.func.value if isinstance(value.func, ast.Attribute) else None
    if owner is not None and value.func.attr == "result" and not value.args:  # type: ignore[attr-defined]
        values = [owner, *(each for _, each in assigned(owner, source))]
        made = [each for each in values if isinstance(each, ast.Call)]
        given = [each for call in made for _, each in returned(name_of(call.func), source)]
        made += [each for each in given if isinstance(each, ast.Call)]
        return not made or any(name_of(each.func).endswith("_async") for each in made)
    limited = any(each.arg == "timeout_sec" for each in value.keywords)
    if owner is not None and name_of(value.func) == "call" and limited:
        return True
    made_here = _called(value, source) if deep else []
    results = [each for function in made_here for _, each in returned(function.name, source)]
    ends = any(map(may_return_nothing, made_here))
    return bool(results) and not ends and all(_is_awaited(each, source, deep=False) for each in results)


def _replaced(value: ast.expr, source: str) -> str:
    """Return the hint on the result of an attribute of the node that was awaited, `self.future`, or ''."""
    future = value.func.value if isinstance(value, ast.Call) and isinstance(value.func, ast.Attribute) else None
    awaited = {ast.unparse(node.value) for node in walk(parse(source)) if isinstance(node, ast.Await)}
    if not isinstance(future, ast.Attribute) or (text := ast.unparse(future)) not in awaited:
        return ""
    return (
        f"`{text}` is the future of the newest call: while one call awaits, the next stores its own there. Keep it in "
        "a local variable, or write `response = await self.client.call_async(request)`."
    )


def _ends_without_value(value: ast.expr, used: ast.expr, source: str, *, silent: bool = False) -> str:
    """Return the hint on a call of a function of the program that returns nothing (or, unless `silent`, may do so)."""
    value = _without_await(value)
    made = _called(value, source) if isinstance(value, ast.Call) else []
    if not made:
        return ""
    name = made[0].name
    if all(map(_is_silent, made)):
        what = ast.unparse(_without_await(used))
        where = "" if value is _without_await(used) else f"Line {value.lineno}: "
        return f"{where}`{name}` returns nothing, so `{what}` is None. End `{name}` with a `return`."
    return _gave_none(name) if not silent and all(map(may_return_nothing, made)) else ""


def _is_silent(function: Function) -> bool:
    return not any(isinstance(node, ast.Return) and node.value is not None for node in walk(function))


def _called(call: ast.Call, source: str) -> list[Function]:
    """Return the functions of a program, or of the notebook, that a call may mean; [] if it may mean another one."""
    tree, name = parse(source), name_of(call.func)
    classes = [node for node in walk(tree) if isinstance(node, ast.ClassDef)]
    of_classes = {id(each): node.name for node in classes for each in functions_of(node)}
    named = [each for each in functions(tree) if each.name == name]
    if isinstance(call.func, ast.Attribute):
        owner = call.func.value
        kinds = {name_of(each.func) for _, each in assigned(owner, source) if isinstance(each, ast.Call)}
        own = isinstance(owner, ast.Name) and owner.id == "self"
        made = [each for each in named if id(each) in of_classes and (own or of_classes[id(each)] in kinds)]
    else:
        made = [each for each in named if id(each) not in of_classes]
        if not made and (other := _of_the_notebook(call)):
            made = [other]
    inside = [node for each in made for node in walk(each)]
    return [] if any(isinstance(node, (ast.Yield, ast.YieldFrom)) for node in inside) else made


def _of_the_notebook(call: ast.Call) -> Function | None:
    """Return the text of a function of the notebook that a line calls by its name; None for another one."""
    main = vars(sys.modules["__main__"]) if "__main__" in sys.modules else {}
    function: Callable[..., object] | None = main.get(name_of(call.func)) if isinstance(call.func, ast.Name) else None
    if not inspect.isfunction(function):
        return None
    try:
        return next(functions(parse(textwrap.dedent(inspect.getsource(function)))), None)
    except (OSError, TypeError):
        return None
