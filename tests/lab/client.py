"""A page, as the kernel's socket sees it."""

import json
import socket
from pathlib import Path
from typing import Any

from course.lab import protocol
from tests.kernels import Kernel

WAIT = 60.0  # s for whatever must come, on a busy machine


class Client:
    """A connection to a socket at `path`, and what has come by it."""

    def __init__(self, path: Path):
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._socket.settimeout(WAIT)
        with protocol.address(path) as name:
            self._socket.connect(name)
        self._lines = self._socket.makefile("rb")
        self._next = 1
        self.events: list[dict[str, Any]] = []

    def send(self, **message: Any) -> None:
        self.send_line(protocol.encoded(message))

    def send_line(self, line: bytes) -> None:
        self._socket.sendall(line)

    def begin(self, method: str, **params: Any) -> int:
        self._next += 1
        self.send(id=self._next, method=method, params=params)
        return self._next

    def subscribe(self, topic: str, **options: Any) -> int:
        number = self.begin("subscribe", topic=topic, options=options)
        assert self.answer(number) == {"id": number, "result": None}
        return number

    def read(self) -> dict[str, Any]:
        line = self._lines.readline()
        assert line, "the kernel has closed the connection"
        return json.loads(line)

    def answer(self, number: int) -> dict[str, Any]:
        """The answer to a request; events before it are kept."""
        while "topic" in (message := self.read()) or message["id"] != number:
            self.events.append(message)
        return message

    def ask(self, method: str, **params: Any) -> dict[str, Any]:
        return self.answer(self.begin(method, **params))

    def event(self, *, ack: bool = True) -> dict[str, Any]:
        """The next event."""
        message = self.events.pop(0) if self.events else self.read()
        assert "data" in message or "error" in message, message
        if ack:
            self.send(ack=message["id"])
        return message

    def ended(self) -> bool:
        """Return True if the other side has closed the connection."""
        return self._lines.readline() == b""

    def close(self) -> None:
        self._lines.close()
        self._socket.close()


def socket_of(kernel: Kernel) -> Path:
    """Return where a kernel listens to pages."""
    return protocol.socket_path(Path(kernel.manager.connection_file).stem.removeprefix("kernel-"))


def page_of(kernel: Kernel) -> Client:
    """A page that is connected to a kernel."""
    return Client(socket_of(kernel))
