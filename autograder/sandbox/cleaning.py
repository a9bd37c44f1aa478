"""Removing the grader's paths and hidden inputs from a program's output before its student sees it.

A student may see the output of their program, but it can repeat inputs of the hidden tests.
"""

import re
from collections.abc import Collection

NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
LINE = re.compile(r"(line )(\d+)")  # in a traceback: kept
CONTROL = re.compile(r"\x1b\[[0-9;?]*[ -/]*[@-~]|[^\n\t\x20-\x7e\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
MISREAD = re.compile("[\u200b-\u200f\u2028-\u202e\u2060-\u2069\ufeff]")  # invisible, or reversing the direction of text
HEAD, TAIL = 600, 1400  # characters of an excerpt
LINES = 40
WIDTH = 300  # characters of a line


def without_paths(text: str) -> str:
    """Return `text` with file names instead of paths: the grader's folders are useless to the student, and private."""
    return re.sub(r"(?:/[\w.@+-]+)+/([\w.@+-]+)", r"\1", text)


def without_hidden(text: str, hidden: Collection[float | str]) -> str:
    """Return `text` with these words and numbers replaced by an ellipsis."""
    for word in (word for word in hidden if isinstance(word, str)):
        text = text.replace(word, "…")
    return NUMBER.sub(lambda found: "…" if float(found[0]) in hidden else found[0], text)


def excerpt(output: str, source: str, hidden: Collection[float | str]) -> str:
    """Return the beginning and the end of a program's output, for the student who wrote `source`.

    A number is shown only if it is in the source or is a line number of a traceback: any other may be a hidden input.
    A hidden word is shown if it is in the source: a program's own `destroy_node()`, say.
    """
    if len(output) > 1 << 15:
        output = f"{output[: 1 << 14]}\n…\n{output[-(1 << 14) :]}"
    text = MISREAD.sub("", CONTROL.sub("", output.replace("\r\n", "\n").replace("\r", "\n")))
    text = re.sub(r"\[\d{9,}\.\d+\] ", "", text)  # the time in a ROS log line
    words = {word for word in hidden if isinstance(word, str) and word not in source}
    text = without_hidden(without_paths(text), words)
    own = set(NUMBER.findall(source))
    kept = {found.start(2): found[2] for found in LINE.finditer(text)}
    text = NUMBER.sub(
        lambda found: found[0] if found[0] in own or found[0].lstrip("+-") in own or found.start() in kept else "…",
        text,
    )
    lines = [line[:WIDTH] + "…" * (len(line) > WIDTH) for line in text.strip().splitlines()]
    if len(lines) > LINES:
        lines = [*lines[: LINES // 4], "…", *lines[-3 * LINES // 4 :]]
    text = "\n".join(lines)
    if len(text) <= HEAD + TAIL:
        return text
    head, tail = text[:HEAD].rpartition("\n")[0] or text[:HEAD], text[-TAIL:].partition("\n")[2] or text[-TAIL:]
    return f"{head}\n…\n{tail}"
