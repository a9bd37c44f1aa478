"""Hints on a line that Python refuses, from the text around it."""

import re

from course.explaining.slips import else_if
from course.explaining.wrong_forms import decimal_comma, unquoted_command

BEGINS = re.compile(r"([ \t]*)(?:async )?def \w+\(\s*self\b")  # of a method


def refused(text: str, error: SyntaxError) -> str:
    """Return the hint on the line of a text that Python refuses with this error; '' if none is certain."""
    lines, number = text.splitlines(), error.lineno or 0
    line = lines[number - 1] if 0 < number <= len(lines) else error.text or ""
    found = (why(line) for why in (else_if, decimal_comma, unquoted_command))
    return next(filter(None, found), "") or (moved_def(lines, number) if UNLIKE in (error.msg or "") else "")


UNLIKE = "unindent does not match any outer indentation level"


def moved_def(lines: list[str], number: int) -> str:
    """Return the hint on a method further left than the `def` of this line and of a method above; '' without one.

    Python refuses this line, whose indentation is right, because the other method has ended the class.
    """
    right = BEGINS.match(lines[number - 1]) if 0 < number <= len(lines) else None
    for above in reversed(range(number - 1)) if right else ():
        found = BEGINS.match(lines[above])
        before = [each[1] for each in map(BEGINS.match, lines[:above]) if each]
        if right and found and len(found[1]) < len(right[1]):
            if not before or before[-1] != right[1]:
                return ""
            return (
                f"Line {number} is right, line {above + 1} is not: `{lines[above].strip()}` begins further left than "
                f"the methods around it. Indent it like them."
            )
    return ""
