"""The hidden tests that a suite declares, read from its text without importing it.

A test is a function `test_...` with `@points(NUMBER, cell="NAME")` and a docstring, its title.  Number and name must
stand there as literals.
"""

import ast
import math
import re
from dataclasses import dataclass
from pathlib import Path

from autograder.errors import BrokenExercise

FORM = '@points(NUMBER, cell="NAME")'


@dataclass(frozen=True)
class Test:
    """The public part of a hidden test."""

    __test__ = False  # tells pytest that this is not a test class
    id: str
    title: str
    points: float
    cell: str  # the notebook's grade cell that the points belong to


def tests(suite: Path) -> tuple[Test, ...]:
    """The tests of the file `suite`, in order; raises BrokenExercise, whose message names the line, and OSError."""
    try:
        functions = [part for part in ast.parse(suite.read_bytes()).body if isinstance(part, ast.FunctionDef)]
    except SyntaxError as error:
        where = f"{suite}, line {error.lineno}" if error.lineno else f"{suite}"  # none for a null byte, in Python 3.12
        raise BrokenExercise(f"{where}: {error.msg}") from None
    except ValueError as error:  # a null byte
        raise BrokenExercise(f"{suite}: {error}") from None
    found: dict[str, Test] = {}
    for function in functions:
        name = function.name
        if not name.startswith("test_"):
            continue
        where = f"{suite}, line {function.lineno}: {name}"
        if name in found:
            raise BrokenExercise(f"{where} is defined twice; give each test its own name")
        title = re.sub(r"\s+", " ", ast.get_docstring(function) or "").rstrip(".")
        marks = [decorator for decorator in map(_points, function.decorator_list) if decorator]
        if len(marks) != 1 or not title:
            raise BrokenExercise(f"{where} needs one {FORM} and a docstring, its title")
        try:
            points, cell = _literals(marks[0])
        except ValueError as error:
            raise BrokenExercise(f"{where} needs {FORM}; {error}") from None
        found[name] = Test(name, title, points, cell)
    if not found:
        raise BrokenExercise(f"{suite} has no test: no function with {FORM} is called test_...")
    return tuple(found.values())


def _points(decorator: ast.expr) -> ast.Call | None:
    """Return the decorator if it is a call of `points`, or else None."""
    called = decorator.func if isinstance(decorator, ast.Call) else None
    return decorator if isinstance(decorator, ast.Call) and getattr(called, "id", "") == "points" else None


def _literals(call: ast.Call) -> tuple[float, str]:
    """The number and the cell's name in a call of `points`; raises ValueError, which says what is wrong."""
    if len(call.args) != 1 or [keyword.arg for keyword in call.keywords] != ["cell"]:
        raise ValueError(f"it is {ast.unparse(call)}")
    number, cell = _literal(call.args[0]), _literal(call.keywords[0].value)
    if isinstance(number, bool) or not isinstance(number, (int, float)):
        raise ValueError(f"{ast.unparse(call.args[0])} is not a number")
    if not 0 <= number < math.inf:
        raise ValueError(f"{ast.unparse(call.args[0])} is not a number of points")
    if not isinstance(cell, str) or not cell:
        raise ValueError(f"{ast.unparse(call.keywords[0].value)} is not a cell's name in quotation marks")
    return number, cell


def _literal(expression: ast.expr) -> object:
    """The value that stands there, or None when it would have to be computed."""
    try:
        return ast.literal_eval(expression)
    except (ValueError, TypeError, SyntaxError):
        return None
