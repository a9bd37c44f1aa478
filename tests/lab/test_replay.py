"""The output of a terminal is shown again, at any width, without what bash has removed at the width of its time."""

from collections import deque
from types import SimpleNamespace

import pytest

from course.lab.server import replay

PROMPT = "\x1b[1mservices (domain 82)\x1b[0m $ "
BEGIN = "\x1b[?2004h"
NEWER = "\x1b[1mservices (domain 33)\x1b[0m $ "


@pytest.mark.parametrize(
    ("printed", "shown"),
    [
        (f"0\r\n{BEGIN}{PROMPT}", f"0\r\n{BEGIN}{PROMPT}"),
        (f"0\r\n{BEGIN}{PROMPT}\r\x1b[K\r{PROMPT}", f"0\r\n{BEGIN}{PROMPT}"),
        (f"0\r\n{BEGIN}{PROMPT}\r\x1b[K\r\x1b[A\x1b[K\r{PROMPT}", f"0\r\n{BEGIN}{PROMPT}"),
        (f"0\r\n{BEGIN}{PROMPT}ls\r\x1b[K\r\x1b[A\x1b[K\r{PROMPT}ls", f"0\r\n{BEGIN}{PROMPT}ls"),
        (f"0\r\n{BEGIN}{PROMPT[:-1]}\r\n\r \r\x1b[K\r\x1b[A\x1b[K\r{PROMPT}", f"0\r\n{BEGIN}{PROMPT}"),
        (
            f"0\r\n{BEGIN}{PROMPT}\r\n\x1b[?2004l\r\x1b[A\x1b[A\r\x1b[JMoved.\r\n{BEGIN}{NEWER}",
            f"0\r\n{BEGIN}\x1b[?2004lMoved.\r\n{BEGIN}{NEWER}",
        ),
        ("0 %\r50 %\r100 %\r\ndone\r\n", "0 %\r50 %\r100 %\r\ndone\r\n"),
        ("", ""),
    ],
)
def test_what_was_drawn_again_is_shown_once_and_nothing_above_it_is_lost(printed, shown):
    assert replay.shown(printed) == shown
    terminal = SimpleNamespace(read_buffer=deque(printed, maxlen=1000))
    for _ in range(2):
        replay.watch({"1": terminal})
    assert "".join(terminal.read_buffer) == printed
    assert terminal.read_buffer.maxlen == 1000
    terminal.read_buffer.append("!")
    assert "".join(terminal.read_buffer.copy()) == f"{shown}!"
