"""Remarks on a line at which a callback waits for a lock that nothing will release, by the program's text."""

import ast
import re
from collections.abc import Sequence

from course.explaining.doubts import never_released
from course.explaining.failure_report import Frame
from course.explaining.source import covers, name_of, parse
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
    kinds = {name_of(node.value.func) for node in walk(tree) if isinstance(node, ast.Assign)
             and isinstance(node.value, ast.Call) and lock in map(ast.unparse, node.targets)}  # fmt: skip
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


def _text(item: ast.withitem) -> str:
    return ast.unparse(item.context_expr)
