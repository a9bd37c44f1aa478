"""Has the terminals draw their prompt again when the notebook in front, or its ROS domain, changes."""

import os
from collections import deque
from pathlib import Path
from typing import Any

from jupyter_server.serverapp import ServerApp
from tornado.ioloop import PeriodicCallback

from course import registry
from course.lab.server import replay

PERIOD = 500  # ms
AGAIN = "\x1b[20;5~"  # the key on which the prompt of `course/bashrc` is drawn again
ENDS = "\x1b[0m $ "  # the end of that prompt, while nothing has been typed after it


class Prompts:
    """The terminals of a server; `look` is called repeatedly."""

    def __init__(self, server: ServerApp):
        self._settings = server.web_app.settings
        self._seen = self._state()
        self._due: set[str] = set()  # the names of terminals in which the key is still to be pressed
        PeriodicCallback(self.look, PERIOD).start()

    def look(self) -> None:
        """Press the key in each terminal that waits at an empty prompt, if something has changed."""
        terminals = getattr(self._settings.get("terminal_manager"), "terminals", {})
        if not terminals:
            return
        replay.watch(terminals)
        if (state := self._state()) != self._seen:
            self._seen, self._due = state, set(terminals)
        for name in self._due & terminals.keys():
            # In a single row, as that of a terminal folded to its tab, the old prompt scrolls away: not yet.
            if terminals[name].ptyproc.getwinsize()[0] > 1:
                self._due.remove(name)
                if waits(terminals[name]):
                    terminals[name].ptyproc.write(AGAIN)

    @staticmethod
    def _state() -> tuple[str, ...]:
        try:
            return _text(registry.changes()), _text(registry.front(os.getpid()))
        except OSError:  # there is no folder for them
            return ()


def waits(terminal: Any) -> bool:
    """Return True if a terminal of terminado shows the course's prompt, with nothing typed and no program running.

    Otherwise its shell looks for itself when it draws the next prompt, or runs the next command.
    """
    process, printed = terminal.ptyproc, terminal.read_buffer
    try:
        return _end(printed).endswith(ENDS) and os.tcgetpgrp(process.fd) == process.pid
    except (OSError, ValueError):  # it has ended
        return False


def _end(printed: deque[str]) -> str:
    """Return the last characters of what a terminal has printed, without bells, as of a key that has no effect."""
    end = ""
    for number in range(len(printed) - 1, -1, -1):
        end = (printed[number] + end).rstrip("\a")
        if len(end) >= len(ENDS):
            break
    return end


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, ValueError):
        return ""
