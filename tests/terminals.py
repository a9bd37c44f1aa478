"""A terminal of the course for the tests."""

import fcntl
import os
import re
import select
import signal
import struct
import termios
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

WIDTH = 250  # characters in a line, more than a test types
SHELL = Path(__file__).parents[1] / "environment" / "shell"


class Terminal:
    """A shell on a pseudo-terminal, typed into as a person does."""

    def __init__(self, folder: Path, environment: dict[str, str], *words: str):
        self.pid, self.descriptor = os.forkpty()
        if not self.pid:
            signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as below a server that `nohup` has started
            os.chdir(folder)
            os.execve(SHELL, [str(SHELL), *words], environment | {"TERM": "xterm", "HOME": str(folder)})
        os.set_inheritable(self.descriptor, False)  # another terminal's shell would keep this one from being closed
        self.resize(WIDTH)
        self.text = ""

    def resize(self, width: int) -> None:
        """Give each line so many characters."""
        fcntl.ioctl(self.descriptor, termios.TIOCSWINSZ, struct.pack("HHHH", 50, width, 0, 0))

    def read_until(self, pattern: str | re.Pattern, timeout: float = 30.0, seen: Callable[[str], str] = str) -> str:
        """Return what came since the last look, up to and with the first match of `pattern` in what is `seen` of it."""
        found = self._wait(lambda: re.search(pattern, seen(self.text)), pattern, timeout)
        text = seen(self.text)
        self.text = text[found.end() :]
        return text[: found.end()]

    def wait_for(self, text: str, timeout: float = 30.0, seen: Callable[[str], str] = str) -> None:
        """Wait until `text` is in what came since the last look, which goes on."""
        self._wait(lambda: text in seen(self.text), text, timeout)

    def _wait(self, found: Callable[[], Any], what: object, timeout: float) -> Any:
        end = time.monotonic() + timeout
        while not (result := found()):
            left = end - time.monotonic()
            assert left > 0, f"no {what!r} in {self.text!r}"
            if select.select([self.descriptor], [], [], left)[0]:
                self.text += os.read(self.descriptor, 65536).decode(errors="replace")
        return result

    def type(self, keys: str) -> None:
        os.write(self.descriptor, keys.encode())

    def close(self) -> None:
        os.kill(self.pid, signal.SIGHUP)
        os.close(self.descriptor)
        os.waitpid(self.pid, 0)
