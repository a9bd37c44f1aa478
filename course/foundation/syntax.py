"""Syntax trees of Python programs."""

import ast
import contextlib
import threading

TRIES = 5
_one_at_a_time = threading.RLock()  # a finalizer that runs meanwhile may make a tree, too


def syntax_tree(text: str) -> ast.Module:
    """Return the syntax tree of a program, in any thread; raises SyntaxError and ValueError as `ast.parse` does.

    Python 3.11 before 3.11.5 counts the depth of the trees of all threads in one variable, and raises SystemError where
    two of them meet, as when a finalizer lets another thread run (CPython issue 106905).  The lock keeps those of the
    course apart; IPython's parsing of a cell can still meet one of them.
    """
    with _one_at_a_time:
        for _ in range(TRIES - 1):
            with contextlib.suppress(SystemError):
                return ast.parse(text)
        return ast.parse(text)
