"""Hints for students on the causes of exceptions that do not explain themselves."""

import re
from typing import Protocol

# The text of an exception, and the hint.
KNOWN = [
    (
        r"'(?:method|function)' object does not support the context manager protocol|has no attribute 'pointer'",
        "a method or an attribute of the node is called handle, which hides rclpy's own Node.handle: rename it",
    ),
    (
        r"property '(\w+)' of '\w+' object has no setter|can't set attribute '(\w+)'",
        "rclpy's Node has a property of that name already: choose another name for the attribute",
    ),
    (
        r"'\w+' object has no attribute '_(?:Node__\w+|default_callback_group|parameters|context|logger)'",
        "call super().__init__ first in __init__: until then there is no node",
    ),
    (
        r"^TypeError(?: \(|$)",  # rclpy's exception about what is sent as the response
        "a callback returned nothing, or something else than the response: end it with return response",
    ),
    (r"field must be of type 'float'", "float(...) makes a float of any other number"),
]


# Exceptions that come of the text of a program.  None where something else was expected may be an answer that was late.
OF_TEXT = re.compile(
    r"(?:Syntax|Indentation|Tab|Name|Import|ModuleNotFound|Attribute|Type|Recursion)Error\b(?!.*NoneType)"
)


class EndedProgram(Protocol):
    """The interface of a program that has ended."""

    @property
    def raised(self) -> bool:
        """Return True if it died of a Python exception, which it has printed."""

    def last_words(self) -> str:
        """Return why it ended, in a line for the student."""


def is_of_text(program: EndedProgram) -> bool:
    """Return True if a program died of an exception that comes of its text, and not of a busy machine."""
    return program.raised and bool(OF_TEXT.match(program.last_words()))


def last_words(program: EndedProgram) -> str:
    """Return why a program ended, in a line for the student, with the cause where it is known."""
    words = program.last_words()
    found = next((text for pattern, text in KNOWN if re.search(pattern, words)), "")
    return f"{words} ({found})" if found else words
