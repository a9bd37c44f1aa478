"""Remarks on a line at which a callback waits for a lock, or a flag, that stays set, by the program's text."""

import ast
import re
from collections.abc import Sequence

from course.explaining.doubts import never_released
from course.explaining.failure_report import Frame
from course.explaining.source import Function, covers, functions, name_of, parse
from course.foundation.syntax import walk

AT_A_LOCK = re.compile(r"^with ([\w.]+)(?: as \w+)?:|^([\w.]+)\.acquire\(\s*\)$")


def locked(frames: Sequence[Frame], source: str, *, alone: bool) -> list[str]:
    """Return a line on why a lock at which a program waits stays locked; [] if that is not certain.

    `frames` are those of the waiting thread, the line at the lock last; `alone`: no other thread runs callbacks.
    """
    found = AT_A_LOCK.match(frames[-1].code) if frames else None
    if found is None:
        return []
    lock, tree = found[1] or found[2], parse(source)
    blocks = [node for node in walk(tree) if isinstance(node, ast.With) and lock in map(_text, node.items)]
    kinds = {
        name_of(node.value.func)
        for node in walk(tree)
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Call) and lock in map(ast.unparse, node.targets)
    }
    for frame in frames[:-1]:
        for block in blocks if kinds == {"Lock"} else ():
            if any(covers(each, frame.line) for each in block.body):
                return [
                    (
                        f"Line {block.lineno} has locked `{lock}` already, in the same thread, and a Lock cannot be "
                        "locked twice: lock it in one of the two places only, or use `threading.RLock()`."
                    )
                ]
    for block in blocks if alone else ():
        waits = next((node for each in block.body for node in walk(each) if isinstance(node, ast.Await)), None)
        if waits is not None:
            return [
                (
                    f"While line {waits.lineno} awaits, `{lock}` of line {block.lineno} stays locked, and this line "
                    "stops the only thread, so no answer can come: do not hold a lock over an `await`."
                )
            ]
    taken = f"`{lock}.acquire()`"
    return [why for _, why in never_released(tree) if why.startswith(taken)][:1]


def still_set(frames: Sequence[Frame], source: str) -> list[str]:
    """Return a line on a `return` that leaves a flag set, on which the loop where the program is waits; else []."""
    tree = parse(source)
    loops = [node for node in walk(tree) if isinstance(node, ast.While) and frames and covers(node, frames[-1].line)]
    flags = {ast.unparse(node) for loop in loops for node in walk(loop.test) if isinstance(node, ast.Attribute)}
    for flag in sorted(flags):
        for function in functions(tree):
            if left := _leaves_set(function, flag):
                line, end = left
                return [
                    (
                        f"Line {line} returns while `{flag}` is True, before line {end} sets it to False again, and "
                        "this line then waits for ever: set it to False in a `finally`."
                    )
                ]
    return []


def _leaves_set(function: Function, flag: str) -> tuple[int, int] | None:
    """Return the line of a `return` between those that set a flag to True and to False, and the latter's; or None."""
    nodes = list(walk(function))
    stored = [node for node in nodes if isinstance(node, ast.Assign) and flag in map(ast.unparse, node.targets)]
    begins, ends = ([node for node in stored if getattr(node.value, "value", None) is value] for value in (True, False))
    finals = [each for node in nodes if isinstance(node, ast.Try) for each in node.finalbody]
    if not begins or not ends or any(end in walk(each) for each in finals for end in ends):
        return None
    for node in nodes:
        for part in (getattr(node, "body", None), getattr(node, "orelse", None)):
            block = part if isinstance(part, list) else []
            leaves = [each.lineno for each in block if isinstance(each, ast.Return)]
            if leaves and begins[0].lineno < leaves[0] < ends[-1].lineno and not any(end in block for end in ends):
                return leaves[0], ends[-1].lineno
    return None


def _text(item: ast.withitem) -> str:
    return ast.unparse(item.context_expr)
