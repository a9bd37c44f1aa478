"""A Python program as tokens that survive disguise."""

import io
import keyword
import tokenize
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

MAX_RESTARTS = 100  # restarts after text in a file that Python cannot tokenize

OPENING, CLOSING = ("(", "[", "{"), (")", "]", "}")
CONDITIONS = {"if", "elif", "while"}
BLOCKS = CONDITIONS | {"else", "for", "with", "try", "except", "finally", "async", "def", "class"}
COMPUTING = {"abs", "bool", "dict", "float", "int", "len", "list", "max", "min", "range", "round", "set", "str", "sum"}

UNREAD = {tokenize.COMMENT, tokenize.NL, tokenize.INDENT, tokenize.DEDENT}

# The kinds of tokens whose text does not count; for all others the text is the kind.
NAME, NUMBER, STRING, NEWLINE = "n", "0", "s", "\n"

# With what a statement begins that only computes.
HARMLESS = {NAME, NUMBER, STRING, *OPENING, "-", "+", "~", "not", "True", "False", "None", "assert", "pass", "..."}
COMPARING = {"==", "!=", "<=", ">="}
NAMING = {"global", "nonlocal", "import", "from", "lambda"}  # does nothing without what follows


@dataclass(frozen=True)
class Token:
    """A token of a program, reduced to its kind, and where it stands in the text."""

    kind: str
    start: int  # number of its first character
    end: int  # number of the character after it


def clean(text: str) -> str:
    """Return the text with Python's line ends, and without characters that stop its tokenizer."""
    return text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n").replace("\0", "\ufffd")


def is_longer(text: str, most: int) -> bool:
    """Return True if a Python text has more than `most` characters without comments, blank lines and indentation.

    Several blanks in a row count as one.
    """
    if len(text) <= most:
        return False
    left, before = most, (0, 0)
    for token in _raw(text):
        if token.type not in UNREAD:
            left -= len(token.string) + (token.start[0] == before[0] and token.start[1] > before[1])
            before = token.end
        if left < 0:
            return True
    return False


def tokens(text: str) -> list[Token]:
    """Return the tokens of a Python text without those that are cheap to change; skips text that is not Python."""
    starts = [0]  # of each line
    for line in text.split("\n"):
        starts.append(starts[-1] + len(line) + 1)
    found: list[Token] = []
    statement: list[Token] = []
    depth = 0  # of brackets

    def end_statement(*last: Token) -> None:
        nonlocal depth
        plain = without_annotations(statement, text)
        if does_something(plain, text):
            found.extend([*plain, *last])
        statement.clear()
        depth = 0

    nested = 0  # in f-strings, which are several tokens from Python 3.12 on
    for token in _raw(text):
        start, end = (starts[line - 1] + column for line, column in (token.start, token.end))
        name = tokenize.tok_name[token.type]
        nested += (name == "FSTRING_START") - (name == "FSTRING_END")
        if name in ("STRING", "FSTRING_END") or nested:
            if statement and statement[-1].kind == STRING:  # 'a' 'b' is one string
                start = statement.pop().start
            statement.append(Token(STRING, start, end))
        elif token.type == tokenize.NEWLINE or token.string == ";":
            end_statement(Token(NEWLINE, start, end))
        elif token.type == tokenize.NAME:
            statement.append(Token(token.string if keyword.iskeyword(token.string) else NAME, start, end))
        elif token.type == tokenize.NUMBER:
            statement.append(Token(NUMBER, start, end))
        elif token.type == tokenize.OP:
            statement.append(Token(token.string, start, end))
            depth += (token.string in OPENING) - (token.string in CLOSING)
            if token.string == ":" and not depth and statement[0].kind in BLOCKS:
                end_statement()  # `if a: return` is one line or two
    end_statement()
    return found


def without_annotations(statement: list[Token], text: str) -> list[Token]:
    """Return a statement without the types of its variable, parameters and result; nothing if it only names a type."""
    defines = "def" in [token.kind for token in statement[:2]]
    if not (defines or names_type(statement, text)):
        return statement
    kept: list[Token] = []
    depth = inside = 0
    ends: tuple[str, ...] = ()  # with what the type ends that is being read
    for token in statement[:-1]:
        if ends:
            ends = () if token.kind in ends and depth == inside else ends
        elif token.kind == "->" or (token.kind == ":" and depth == defines):
            inside = depth
            ends = (":",) if token.kind == "->" else (",", "=", ")") if defines else ("=",)
        if not ends:
            kept.append(token)
        depth += (token.kind in OPENING) - (token.kind in CLOSING)
    return [*kept, statement[-1]] if defines or "=" in [token.kind for token in kept] else []


def names_type(statement: list[Token], text: str) -> bool:
    """Return True for `x: int`, `self.x: int = 0` and the like."""
    depth = 0
    for at, token in enumerate(statement[:-1]):
        if token.kind == ":" and not depth:
            return at == 1 or text[statement[0].start : statement[0].end] != "case"  # `case [a, b]: ...`
        if not depth and token.kind not in (NAME, ".", *OPENING, *CLOSING):
            return False
        depth += (token.kind in OPENING) - (token.kind in CLOSING)
    return False


def does_something(statement: list[Token], text: str) -> bool:
    """Return False for a statement that anybody can add anywhere, and nothing changes: `x = 0`, a docstring, `pass`.

    It only computes, by names and literals, and gives the results a name at most if there is no attribute among them.
    """
    if not statement:
        return False
    kinds = [token.kind for token in statement]
    if kinds[0] in NAMING:
        return False
    for before, token in pairwise(statement):
        called = token.kind == "(" and before.kind in (NAME, ")", "]")
        if token.kind == "[" and before.kind in (NAME, ")", "]"):
            return True
        if called and text[before.start : before.end] not in COMPUTING:
            return True
    if kinds[-1] == ":":
        return kinds[0] not in CONDITIONS or NAME in kinds
    if "." in kinds:  # read alone, as in `request.a`, an attribute does nothing
        return kinds[0] not in HARMLESS or any(each.endswith("=") and each not in COMPARING for each in kinds)
    return kinds[0] not in HARMLESS


def _raw(text: str) -> Iterator[tokenize.TokenInfo]:
    """Yield Python's own tokens; after an error, those from the next line on."""
    lines = text.encode(errors="replace").decode().split("\n")  # a lone surrogate cannot be encoded
    done = 0  # lines
    for _ in range(MAX_RESTARTS):
        reached = 0
        try:
            for token in tokenize.generate_tokens(io.StringIO("\n".join(lines[done:]) + "\n").readline):
                reached = token.end[0]
                if reached + done <= len(lines):
                    (first, left), (last, right) = token.start, token.end
                    yield token._replace(start=(first + done, left), end=(last + done, right))
            return
        except (tokenize.TokenError, SyntaxError):
            done += max(1, reached)
        if done >= len(lines):
            return
