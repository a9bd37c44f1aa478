"""Syntax trees of Python programs."""

import ast
import contextlib
import re
import threading
from collections.abc import Iterator

TRIES = 5
WALKED = "walked"  # where a node keeps what is below it
WHOLE = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
MANY_DIGITS = re.compile(r"0[xob][\da-f_]{500}", re.IGNORECASE)  # perhaps too many for Python to write in decimal
_one_at_a_time = threading.RLock()  # a finalizer that runs meanwhile may make a tree, too


class LongNumber(int):
    """A whole number with more decimal digits than Python writes; its text is hexadecimal."""

    def __repr__(self) -> str:
        return hex(self)

    def __format__(self, form: str) -> str:
        return format(hex(self), form)


def walk(tree: ast.AST) -> list[ast.AST]:
    """Return what `ast.walk` yields; of a whole program, a class or a function it is kept, so the tree must not change.

    Each look for a mistake walks over the functions of a text again, and there are more than a hundred.
    """
    known: list[ast.AST] | None = vars(tree).get(WALKED)
    if known is not None:
        return known
    nodes = [tree]
    for node in nodes:  # to which it adds
        for name in node._fields:
            value = getattr(node, name, None)
            if isinstance(value, list):
                nodes.extend([each for each in value if isinstance(each, ast.AST)])
            elif isinstance(value, ast.AST):
                nodes.append(value)
    if isinstance(tree, WHOLE):
        vars(tree)[WALKED] = nodes
    return nodes


def imported(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield the line and the name, up to the first point, of each module that a program imports absolutely."""
    for node in walk(tree):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, each.name.partition(".")[0]) for each in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            yield node.lineno, node.module.partition(".")[0]


def syntax_tree(text: str) -> ast.Module:
    """Return the syntax tree of a program, in any thread; raises SyntaxError and ValueError as `ast.parse` does.

    `repr` and `ast.unparse` work for every number in it: one that they refuse with ValueError (`0x` and 4,000 digits)
    is a `LongNumber`.  `compile` does not accept such a tree.

    Python 3.11 before 3.11.5 counts the depth of the trees of all threads in one variable, and raises SystemError where
    two of them meet, as when a finalizer lets another thread run (CPython issue 106905).  The lock keeps those of the
    course apart; IPython's parsing of a cell can still meet one of them.
    """
    with _one_at_a_time:
        tree = _parsed(text)
    if MANY_DIGITS.search(text):
        for node in ast.walk(tree):
            if isinstance(node, ast.Constant):
                _make_writable(node)
    return tree


def _parsed(text: str) -> ast.Module:
    for _ in range(TRIES - 1):
        with contextlib.suppress(SystemError):
            return ast.parse(text)
    return ast.parse(text)


def _make_writable(literal: ast.Constant) -> None:
    """Replace the number of a literal if `repr` refuses it."""
    if type(literal.value) is int:
        try:
            repr(literal.value)
        except ValueError:
            literal.value = LongNumber(literal.value)
