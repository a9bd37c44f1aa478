"""Numbers with a decimal comma in a call, of which Python makes two arguments: `max(-0,5, x)`."""

import ast
from collections.abc import Iterator
from itertools import pairwise

from course.explaining.source import name_of
from course.foundation.syntax import walk

PLACES = {"create_timer": 0, "declare_parameter": 1}  # the place of a number that no other one may follow
LEAST = {"clip": 4, "max": 3, "min": 3}  # arguments of a call in which two numbers may be meant as one


def decimal_commas(tree: ast.Module, cell: str) -> Iterator[tuple[int, str]]:
    """Yield each such number as its line and a sentence.

    In a call that may have any numbers, only those that a bare comma joins where blanks follow other commas.
    """
    lines = [line.encode() for line in cell.splitlines()]  # as `parse` does
    for call in (node for node in walk(tree) if isinstance(node, ast.Call)):
        name, pairs = name_of(call.func), [*pairwise(call.args)]
        bare = [_between(lines, *pair) == b"," for pair in pairs]
        for place, (before, after) in enumerate(pairs):
            whole = _is_whole(before) and _is_digits(_first(after))
            joined = bare[place] and not all(bare) and len(call.args) >= LEAST.get(name, len(call.args) + 1)
            alone = _first(after) is after and PLACES.get(name) == place
            if whole and (joined or alone):
                written = f"{ast.unparse(before)},{ast.unparse(_first(after))}"
                point = written.replace(",", ".")
                yield (
                    before.lineno,
                    f"Python takes `{written}` for two arguments: a number has a decimal point, `{point}`.",
                )


def _first(value: ast.expr) -> ast.expr:
    """Return what an expression begins with: the 5 of `5 * (0.6 - right)`."""
    return _first(value.left) if isinstance(value, ast.BinOp) else value


def _is_whole(value: ast.expr) -> bool:
    return _is_digits(value.operand if isinstance(value, ast.UnaryOp) and isinstance(value.op, ast.USub) else value)


def _is_digits(value: ast.expr) -> bool:
    return isinstance(value, ast.Constant) and type(value.value) is int


def _between(lines: list[bytes], before: ast.expr, after: ast.expr) -> bytes:
    """Return what stands between two arguments in one line; nothing if they stand in two."""
    same = before.end_lineno == after.lineno
    return lines[after.lineno - 1][before.end_col_offset : after.col_offset] if same else b""
