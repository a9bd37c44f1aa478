"""Hints on names that the reader's own code has overwritten: Python's own functions, and methods of an object."""

import ast
import builtins
import re
import sys
from collections.abc import Iterator

from course.explaining.mixups import line_tree
from course.explaining.source import cells_run, functions, hidden_method, name_of, parse
from course.foundation.syntax import walk

VALUES = ("bool", "str", "int", "float", "NoneType", "list", "dict", "tuple", "set")
NO_TYPE = r"is(?:instance|subclass)\(\) arg 2 must be a (?:type|class)"
NOT_CALLABLE = rf"'({'|'.join(VALUES)})' object is not callable"


def of_its_part(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a module whose name an import gives to a part of it, `from time import time`, or ''."""
    for node in (each for each in walk(parse(source)) if isinstance(each, ast.ImportFrom)):
        for each in node.names:
            name = each.asname or each.name
            if name == each.name == node.module and re.search(rf"\b{name}\.{found[2]}\b", code):
                there = (
                    f"Line {node.lineno}, `from {name} import {name}`, gives the name `{name}` to a part of the module"
                )
                return f"{there}: keep `import {name}` alone, and write `{name}.{name}` for that part."
    return ""


def overwritten(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a name in the reader's line `code` that was a function until it was assigned to, or ''."""
    main = vars(sys.modules["__main__"]) if "__main__" in sys.modules else {}
    cells = cells_run()
    names = [node for node in walk(line_tree(code)) if isinstance(node, ast.Name)]
    for function in names if "arg 2 must be" in found[0] else called(code):
        name = ast.unparse(function)
        if isinstance(function, ast.Name) and callable(getattr(builtins, name, None)):
            if source not in cells and (set_here := _assigned(name, source, everywhere=True)):
                return (
                    f"Line {set_here[0]}, `{set_here[1]}`, overwrites `{name}`, a function of Python itself: choose "
                    "another name there."
                )
            if name in main and not callable(main[name]):
                return f"`{name}` is a function of Python itself, and {_where(name, main[name], cells)}"
        elif isinstance(function, ast.Attribute) and isinstance(function.value, ast.Name):
            owner = main.get(function.value.id)
            if function.attr in getattr(owner, "__dict__", {}) and callable(getattr(type(owner), function.attr, None)):
                return f"`{name}` is a method, and {_where(name, getattr(owner, function.attr), cells)}"
    return ""


def hidden_here(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a method that a line calls, and that an attribute of its name hides; '' for another line."""
    for function in called(code):
        if isinstance(function, ast.Attribute) and (hidden := hidden_method(source, function.attr)):
            name, line = hidden
            return f"`self.{name} = ...` in line {line} replaces the method `{name}`: rename one of the two."
    return ""


def called(code: str) -> list[ast.expr]:
    """Return what a line calls, from left to right."""
    calls = [node for node in walk(line_tree(code)) if isinstance(node, ast.Call)]
    return [node.func for node in sorted(calls, key=lambda node: (node.lineno, node.col_offset))]


def with_article(kind: str) -> str:
    """Return the name of a type with its article: `an int`."""
    return "None" if kind == "NoneType" else f"{'an' if kind[:1] in 'aeiou' else 'a'} {kind}"


def _where(name: str, value: object, cells: list[str]) -> str:
    """Return the rest of a sentence, which says where `name` got its `value`, and what to do."""
    made = next(filter(None, (_assigned(name, cell) for cell in cells)), None)
    place = f"line {made[0]} of a cell, `{made[1]}`, has overwritten it" if made else "it is overwritten here"
    return (
        f"{place}: it is {with_article(type(value).__name__)} now. Run `del {name}` in a cell, and choose another name "
        "there."
    )


def _assigned(name: str, source: str, *, everywhere: bool = False) -> tuple[int, str] | None:
    """Return the last line that sets `name` outside of functions, or `everywhere`, and its text; None without one."""
    tree = parse(source)
    inside = {id(node) for function in functions(tree) for node in walk(function) if node is not function}
    lines = source.splitlines()
    found = [
        node.lineno for node in _stored(tree) if ast.unparse(node) == name and (everywhere or id(node) not in inside)
    ]
    return (max(found), lines[max(found) - 1].strip()) if found else None


def _stored(tree: ast.AST) -> Iterator[ast.Name | ast.Attribute]:
    for node in walk(tree):
        if isinstance(node, (ast.Name, ast.Attribute)) and isinstance(node.ctx, ast.Store) and name_of(node):
            yield node
