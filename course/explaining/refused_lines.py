"""Hints on a line that Python refuses, from the text around it."""

import io
import re
import tokenize

BEGINS = re.compile(r"([ \t]*)(?:async )?def \w+\(\s*self\b")  # of a method


def refused(text: str, error: SyntaxError) -> str:
    """Return the hint on the line of a text that Python refuses with this error; '' if none is certain."""
    lines, number = text.splitlines(), error.lineno or 0
    line = lines[number - 1] if 0 < number <= len(lines) else error.text or ""
    found = (why(line) for why in (else_if, decimal_comma, unquoted_command, of_another_language))
    if UNCLOSED in (error.msg or ""):
        return unclosed(text)
    return next(filter(None, found), "") or (moved_def(lines, number) if UNLIKE in (error.msg or "") else "")


def else_if(line: str) -> str:
    """Return the hint on `else if`, or `elseif`, in a line that Python refuses; '' for another one."""
    found = re.match(r"\s*(else +if|elseif|elsif)\b", line)
    if not found:
        return ""
    return "In Python, `else if` is one word: `elif`." if " " in found[1] else f"In Python, `{found[1]}` is `elif`."


WITH_A_COMMA = (  # in a dict, in a condition, and as an argument with a name
    re.compile(r":\s*(-?\d+),(\d+)\s*[,}]"),
    re.compile(r"(?:[<>]=?|[=!]=)\s*(-?\d+),(\d+)\s*(?::|and\b|or\b)"),
    re.compile(r"[(,]\s*[A-Za-z_]\w*\s*=\s*(-?\d+),(\d+)\s*[,)]"),
)


def decimal_comma(line: str) -> str:
    """Return the hint on a number with a comma in a line that Python refuses: `'angular': 0,5}`; '' for another one."""
    found = next(filter(None, (pattern.search(line) for pattern in WITH_A_COMMA)), None)
    return f"A number has a decimal point: `{found[1]}.{found[2]}`." if found else ""


def unquoted_command(line: str) -> str:
    """Return the hint on a command for `terminal` without quotation marks; '' if there is none."""
    if not re.search(r"\bterminal\(\s*(?:python3?|ros2)\s", line):
        return ""
    return "A command is a text: in quotation marks, as in `terminal('python3 my_file.py')`."


TEXT_OR_COMMENT = re.compile(r"""(["'])(?:\\.|(?!\1).)*\1|#.*""")
OF_OTHERS = (  # what C, Java or JavaScript write, and Python refuses; how Python writes it
    (re.compile(r"&&"), "`&&` is `and`"),
    (re.compile(r"\|\|"), "`||` is `or`"),
    (re.compile(r"(?:[=(,:]|\b(?:and|elif|if|in|or|return|while))\s*!(?=\s*[\w(])"), "`!` is `not`"),
    (re.compile(r"[\w\])]\+\+\s*;?\s*$"), "`x++` is `x += 1`"),
    (re.compile(r"[\w\])]--\s*;?\s*$"), "`x--` is `x -= 1`"),
    (re.compile(r"=<"), "`=<` is `<=`"),
    (re.compile(r"\b(?:if|while)\b.*=>"), "`=>` is `>=`"),
    (re.compile(r"\bnew\s+[A-Za-z_][\w.]*\s*\("), "an object is made without `new`"),
)


def of_another_language(line: str) -> str:
    """Return the hint on what another language writes, in a line that Python refuses: `&&`, `x++`; '' without it."""
    code = TEXT_OR_COMMENT.sub("''", line)
    found = [how for pattern, how in OF_OTHERS if pattern.search(code)]
    return f"In Python, {', and '.join(found)}." if found else ""


UNCLOSED = "unterminated triple-quoted string literal"
OPERATORS = {"and", "else", "for", "if", "in", "is", "not", "or"}  # words of Python that may follow a text


def unclosed(text: str) -> str:
    """Return the hint on a text of several lines that only the quotation marks of another one end; '' without one.

    A name follows it in its last line: those quotation marks are meant to begin a text.
    """
    before = None
    try:
        for token in tokenize.generate_tokens(io.StringIO(text).readline):
            follows = token.type == tokenize.NAME and token.string not in OPERATORS
            if before and follows and before.start[0] < before.end[0] == token.start[0]:
                return (
                    f"The text that begins in line {before.start[0]} lacks its end: the quotation marks of line "
                    f"{token.start[0]}, which should begin another one, close it. Write `{before.string[-3:]}` where "
                    "it should end."
                )
            before = token if token.type == tokenize.STRING and token.string[-3:] in ('"""', "'''") else None
    except (tokenize.TokenError, SyntaxError):
        return ""
    return ""


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
