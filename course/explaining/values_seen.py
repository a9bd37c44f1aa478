"""Values in a cell that are not what they look like: an array or messages beside a list, a method for its result."""

import ast
from array import array
from collections.abc import Iterator, Mapping
from inspect import getattr_static
from types import FunctionType, ModuleType
from typing import Any

from course.explaining.source import parse, the_method_itself

INNER = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.Lambda, ast.GeneratorExp)
SCOPES = (*INNER, ast.ListComp, ast.SetComp, ast.DictComp)  # which may have names of their own
UNKNOWN = object()


def misread(cell: str, names: Mapping[str, Any]) -> list[str]:
    """Return a note for each comparison with a list that only a type keeps from being true, and each method printed.

    `names` are the kernel's.  Nothing is run but the reading of messages' fields, and of what the course has recorded.
    """
    found = []
    for node in _outside_of_scopes(parse(cell) if not cell.lstrip().startswith("%%") else ast.Module([], [])):
        if isinstance(node, ast.Compare) and len(node.ops) == 1 and isinstance(node.ops[0], (ast.Eq, ast.NotEq)):
            for one, other in ((node.left, node.comparators[0]), (node.comparators[0], node.left)):
                if isinstance(other, ast.List) and (why := _why(one, other, names)):
                    found.append(f"note: line {node.lineno}: {why}")
        found += [
            f"note: line {each.lineno}: {the_method_itself(ast.unparse(each))}"
            for each in _read(node)
            if _is_method(each, names)
        ]
    return list(dict.fromkeys(found))


def _read(node: ast.AST) -> list[ast.expr]:
    """Return the expressions that a node prints or compares, which makes no sense for a method."""
    if isinstance(node, ast.Compare) and isinstance(node.ops[0], (ast.Eq, ast.NotEq, ast.Lt, ast.Gt, ast.LtE, ast.GtE)):
        return [node.left, *node.comparators]
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "print":
        return node.args
    return [node.value] if isinstance(node, ast.FormattedValue) else []


def _is_method(given: ast.expr, names: Mapping[str, Any]) -> bool:
    """Return True for a method of an object, found without reading the attribute."""
    owner = _value(given.value, names) if isinstance(given, ast.Attribute) else UNKNOWN
    if owner is UNKNOWN or isinstance(owner, (type, ModuleType)) or given.attr in getattr(owner, "__dict__", ()):  # type: ignore[attr-defined]
        return False
    return isinstance(getattr_static(type(owner), given.attr, None), FunctionType)  # type: ignore[attr-defined]


def _outside_of_scopes(node: ast.AST) -> Iterator[ast.AST]:
    yield node
    for inner in ast.iter_child_nodes(node):
        if not isinstance(inner, SCOPES):
            yield from _outside_of_scopes(inner)


def _why(given: ast.expr, wanted: ast.List, names: Mapping[str, Any]) -> str:
    value, text = _value(given, names), ast.unparse(given)
    try:
        listed = ast.literal_eval(wanted)
    except (ValueError, TypeError, SyntaxError, MemoryError, RecursionError):
        return ""
    if isinstance(value, array) and list(value) == listed:
        return (
            f"`{text}` has the same numbers, but it is an array, and an array is never equal to a list: write "
            f"`list({text})`."
        )
    if isinstance(value, list) and value and listed and all(hasattr(each, FIELDS) for each in value):
        lists = [name for name in getattr(value[0], FIELDS)() if isinstance(getattr(value[0], name), (array, list))]
        field = f"list(each.{lists[0]})" if lists else f"each.{next(iter(getattr(value[0], FIELDS)()), 'field')}"
        return (
            f"`{text}` is a list of messages, and a message is never equal to a list or a number: compare their "
            f"fields, as in `[{field} for each in {text}]`."
        )
    return ""


FIELDS = "get_fields_and_field_types"  # which every message has


def _value(given: ast.expr, names: Mapping[str, Any]) -> Any:
    """Return the value of a name, a message's field or an attribute of an object of the course; else UNKNOWN."""
    if isinstance(given, ast.Name):
        return names.get(given.id, UNKNOWN)
    if not isinstance(given, ast.Attribute):
        return UNKNOWN
    owner = _value(given.value, names)
    if hasattr(type(owner), FIELDS) or type(owner).__module__ == "course.recorders":
        return getattr(owner, given.attr, UNKNOWN)
    return UNKNOWN
