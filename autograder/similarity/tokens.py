"""A Python program as tokens that survive disguise."""

import io
import keyword
import tokenize
from collections.abc import Iterator
from dataclasses import dataclass

MAX_RESTARTS = 100  # restarts after text in a file that Python cannot tokenize

# The kinds of tokens whose text does not count; for all others the text is the kind.
NAME, NUMBER, STRING, NEWLINE = "n", "0", "s", "\n"


@dataclass(frozen=True)
class Token:
    """A token of a program, reduced to its kind, and where it stands in the text."""

    kind: str
    start: int  # number of its first character
    end: int  # number of the character after it


def clean(text: str) -> str:
    """Return the text with Python's line ends, and without characters that stop its tokenizer."""
    return text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n").replace("\0", "\ufffd")


def tokens(text: str) -> list[Token]:
    """Return the tokens of a Python text without those that are cheap to change; skips text that is not Python."""
    starts = [0]  # of each line
    for line in text.split("\n"):
        starts.append(starts[-1] + len(line) + 1)
    found: list[Token] = []
    statement: list[Token] = []
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
            if any(part.kind != STRING for part in statement):  # a string alone is a docstring
                # `if a: return` is one line or two.
                found += statement if statement[-1].kind == ":" else [*statement, Token(NEWLINE, start, end)]
            statement = []
        elif token.type == tokenize.NAME:
            statement.append(Token(token.string if keyword.iskeyword(token.string) else NAME, start, end))
        elif token.type == tokenize.NUMBER:
            statement.append(Token(NUMBER, start, end))
        elif token.type == tokenize.OP:
            statement.append(Token(token.string, start, end))
    return found + statement


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
