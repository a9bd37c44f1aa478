"""The output of a terminal as it is shown to a page that is loaded again, perhaps at another width.

A prompt that is drawn again, as bash does when the width changes, is first removed: by so many rows as it had at the
width of that time.  At another width these would be rows of what stands above it.  So what was removed is left out.
"""

import re
from collections import deque
from typing import Any

# Bash's readline goes up row by row to the beginning of its line, which it then draws again.
AGAIN = re.compile(r"\r\x1b\[K(?:\r\x1b\[A\x1b\[K)*\r")
LINE = re.compile(r"\n(?!\r )")  # readline goes on like this where a row is full to its last character
IN_PLACE = re.compile(r"(?:\x1b\[A)+\r\x1b\[J")  # `_course_look` in `course/bashrc` removes the line above
MODE = re.compile(r"\x1b\[\?[\d;]+[hl]")  # stays in force although what is beside it was removed


class Replay(deque[str]):
    """The output of a terminal, in pieces; terminado makes a copy of it for a page that is loaded."""

    def copy(self) -> "Replay":
        """Return what is to be shown."""
        return Replay([shown("".join(self))])


def watch(terminals: dict[str, Any]) -> None:
    """Have what these terminals of terminado print shown again like this."""
    for terminal in terminals.values():
        printed = terminal.read_buffer
        if not isinstance(printed, Replay):
            terminal.read_buffer = Replay(printed, maxlen=printed.maxlen)


def shown(printed: str) -> str:
    """Return the output of a terminal without the lines that were removed to be drawn again."""
    lines: list[str] = []
    for line in LINE.split(printed):
        rest = _behind(IN_PLACE, lines.pop(), line) if lines and IN_PLACE.search(line) else line
        lines.append(_behind(AGAIN, "", rest))
    return "\n".join(lines)


def _behind(removes: re.Pattern[str], before: str, line: str) -> str:
    """Return what is left of `before` and `line`: what follows the last match in the latter, or all."""
    if not (found := list(removes.finditer(line))):
        return before + line
    removed = before + line[: found[-1].start()]
    return "".join(MODE.findall(removed)) + line[found[-1].end() :]
