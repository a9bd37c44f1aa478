"""Hints on what a line gives to a field of a message: something else than a value, as its text shows."""

import ast
import contextlib
import re
from collections.abc import Iterator
from pathlib import Path

from course.explaining.interface_fields import fields_of
from course.explaining.missing_names import MOST
from course.explaining.mixups import assigned, line_tree, returned
from course.explaining.nothing import returned_nothing
from course.explaining.source import (
    CALLBACKS,
    Function,
    argument,
    calls,
    functions,
    name_of,
    named,
    parse,
    the_method_itself,
    undecorated,
)
from course.foundation.syntax import walk
from course.foundation.untrusted import read_regular


def no_value(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a line that gives the field `found[1]` a method, a message, a dict or nothing; else ''."""
    for given in _given(found[1], code):
        explained = (
            _none(given, found[2]),
            _tuple(given),
            _method(given, source),
            _message(given, source, code),
            _dict(given, source, code),
            _key(given, source, code),
            _converted_in_vain(given, found[2], source),
        )
        if why := next(filter(None, (*explained, returned_nothing(source, ast.unparse(given), given=True))), ""):
            return why
    return ""


def _given(field: str, code: str) -> Iterator[ast.expr]:
    """Yield what a line gives to a field: `response.message = value`, `Float64(data=value)`, `v.x, v.y = both`."""
    for node in walk(line_tree(code)):
        if isinstance(node, ast.Assign) and field in map(name_of, node.targets):
            yield node.value
        for target in (each for each in getattr(node, "targets", []) if isinstance(each, ast.Tuple)):
            names, value = [*map(name_of, target.elts)], node.value  # type: ignore[attr-defined]
            each_one = isinstance(value, ast.Tuple) and len(value.elts) == len(names)
            if field in names:
                yield value.elts[names.index(field)] if each_one else value
        if isinstance(node, ast.keyword) and node.arg == field:
            yield node.value


ZEROS = {"bool": "False", "float": "0.0", "int": "0", "str": "''"}  # what a field is that nobody sets, by its type


def _none(given: ast.expr, kind: str) -> str:
    if isinstance(given, ast.Constant) and given.value is None and kind in ZEROS:
        return f"None is not a value of a field. A field that nobody sets is `{ZEROS[kind]}`: leave this out."
    return ""


def _tuple(given: ast.expr) -> str:
    if isinstance(given, ast.Tuple) and len(given.elts) == 1:
        return f"The comma at the end makes a tuple of it: write `{ast.unparse(given.elts[0])}`, without the comma."
    if isinstance(given, ast.Tuple) and len(given.elts) > 1:
        return f"The comma makes a tuple of {len(given.elts)} values: write `{ast.unparse(given.elts[0])}` here alone."
    return ""


def _method(given: ast.expr, source: str) -> str:
    methods = undecorated(functions(parse(source)))
    if isinstance(given, ast.Attribute) and name_of(given.value) == "self" and given.attr in methods:
        return the_method_itself(ast.unparse(given))
    return ""


def _converted_in_vain(given: ast.expr, kind: str, source: str) -> str:
    """Return the hint on a conversion of what is given, whose result nothing keeps: `float(a), float(b)` alone."""
    for node in (each for each in walk(parse(source)) if isinstance(each, ast.Expr)):
        made = node.value.elts if isinstance(node.value, ast.Tuple) else [node.value]
        converted = [each.args[0] for each in made if isinstance(each, ast.Call) and _is_conversion(each, kind)]
        names = [ast.unparse(each) for each in converted]
        if isinstance(given, ast.Name) and given.id in names and len(names) == len(made):
            text = ", ".join(map(ast.unparse, made))
            return f"Nothing keeps the result of line {node.lineno}: write `{', '.join(names)} = {text}`."
    return ""


def _is_conversion(call: ast.Call, kind: str) -> bool:
    """Return True for a call of a type with a name or a field: `float(a)`."""
    plain = len(call.args) == 1 and isinstance(call.args[0], (ast.Attribute, ast.Name)) and not call.keywords
    return isinstance(call.func, ast.Name) and call.func.id == kind and plain


def _message(given: ast.expr, source: str, code: str) -> str:
    """Return the hint on the message of a subscription, or the request of a service, in the place of its field."""
    tree = parse(source)
    for maker, kind, part, place in (
        ("create_subscription", (0, "msg_type"), "", -1),
        ("create_service", (0, "srv_type"), "Request", -2),
    ):
        for call in calls(tree, maker) if isinstance(given, ast.Name) else ():
            for function in named(tree, {name_of(argument(call, *CALLBACKS[maker]))}):
                names = [each.arg for each in function.args.args if each.arg != "self"]
                stored = [
                    node
                    for node in walk(function)
                    if isinstance(node, ast.Name) and node.id in names[place:] and isinstance(node.ctx, ast.Store)
                ]
                if names[place:][:1] != [ast.unparse(given)] or stored or not _has_line(function, source, code):
                    continue
                whole = f"`{names[place]}` is the whole {'request' if part else 'message'}"
                fields = [f"`{names[place]}.{each}`" for each in fields_of(tree, argument(call, *kind), part)]
                if len(fields) == 1:
                    return f"{whole}: its value is {fields[0]}."
                return f"{whole}: write one of its fields, {' or '.join(fields)}." if fields else ""
    return ""


def _dict(given: ast.expr, source: str, code: str) -> str:
    """Return the hint on a dict in the place of one of its values."""
    values: list[ast.expr] = [given] if isinstance(given, ast.Call) else []
    if isinstance(given, ast.Name):
        around = [each for each in functions(parse(source)) if _has_line(each, source, code)]
        values = [
            value
            for line, value in assigned(given, source)
            if not around or any(each.lineno <= line <= (each.end_lineno or 0) for each in around)
        ]
    dicts = [_dict_of(value, source) for value in values]
    first = dicts[0] if dicts and all(dicts) else None
    keys = [each.value for each in first.keys if isinstance(each, ast.Constant)] if first else []
    if not keys:
        return ""
    text = ast.unparse(given)
    return f"`{text}` is a dict: write one of its values, {' or '.join(f'`{text}[{key!r}]`' for key in keys)}."


def _key(given: ast.expr, source: str, code: str) -> str:
    """Return the hint on a key of a dict in the place of its value: `linear, angular = action`."""
    around = [each for each in functions(parse(source)) if _has_line(each, source, code)]
    for node in (each for function in around for each in walk(function) if isinstance(each, ast.Assign)):
        names, whole = node.targets[0], node.value
        if not isinstance(names, ast.Tuple) or ast.unparse(given) not in map(ast.unparse, names.elts):
            continue
        values = [each for _, each in assigned(whole, source)] if isinstance(whole, ast.Name) else [whole]
        dicts = [_dict_of(each, source) for each in values]
        if dicts and dicts[0] and all(dicts):
            keys = [each.value for each in dicts[0].keys if isinstance(each, ast.Constant)]
            kept, text = isinstance(whole, ast.Name), ast.unparse(whole)
            how = " and ".join(f"`{text}[{key!r}]`" for key in keys) if kept else "those of its keys"
            what = f"`{text}`" if kept else "what it returns"
            return (
                f"Line {node.lineno}: `{ast.unparse(node)}` gives the keys, because {what} is a dict. Its values are "
                f"{how}."
            )
    return ""


def _dict_of(value: ast.expr, source: str) -> ast.Dict | None:
    """Return the dict that an expression is, or that the function it calls returns, here or in a file beside."""
    if isinstance(value, ast.Dict):
        return value
    if not isinstance(value, ast.Call):
        return None
    texts = [source]
    for node in walk(parse(source)):
        if isinstance(node, ast.ImportFrom):
            with contextlib.suppress(OSError, ValueError):  # none of the folder's
                texts.append(read_regular(Path(f"{node.module}.py"), MOST).decode(errors="replace"))
    made = [each for text in texts for _, each in returned(name_of(value.func), text)]
    return made[0] if made and all(isinstance(each, ast.Dict) for each in made) else None  # type: ignore[return-value]


def _has_line(function: Function, source: str, code: str) -> bool:
    lines = source.splitlines()[function.lineno - 1 : function.end_lineno]
    return any(line.strip() == code.strip() for line in lines)
