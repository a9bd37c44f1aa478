"""Answers of a class's servers to the proxy, without a class."""

import asyncio
import os
import socket

import pytest
from tornado.httpserver import HTTPServer
from tornado.iostream import IOStream
from tornado.netutil import bind_unix_socket
from tornado.web import Application, RequestHandler

from autograder.classroom import serve
from tests.classroom.conftest import run_apart

REQUEST = b"POST / HTTP/1.1\r\nHost: class\r\nConnection: close\r\nContent-Length: 2\r\n\r\n{}"


class Answer(RequestHandler):
    def post(self):
        self.write("served")


@pytest.fixture
def gentle(monkeypatch):
    monkeypatch.setattr(IOStream, "close_fd", IOStream.close_fd)  # put back
    serve.close_gently()


def exchange(tmp_path, after_the_answer) -> bytes:
    """Send a request as the proxy does, and return all that comes back."""

    async def run() -> bytes:
        server = HTTPServer(Application([("/", Answer)]))
        server.add_socket(bind_unix_socket(str(tmp_path / "socket")))
        reader, writer = await asyncio.open_unix_connection(str(tmp_path / "socket"))
        writer.write(REQUEST)
        answer = await asyncio.wait_for(reader.read(), 10)  # to the end, which the server tells at once
        await after_the_answer(writer)
        writer.close()
        server.stop()
        return answer

    return run_apart(run())


@pytest.fixture
def other_end(monkeypatch):
    """The sockets that the server has closed its side of."""
    seen = []
    shutdown = socket.socket.shutdown
    monkeypatch.setattr(socket.socket, "shutdown", lambda each, how: (seen.append(each), shutdown(each, how))[1])
    return seen


def test_the_proxy_may_write_on_after_the_answer(tmp_path, gentle):
    """Else the proxy takes the answer for lost: 503."""

    async def write_on(writer):
        os.write(writer.get_extra_info("socket").fileno(), b"\r\n")  # raises BrokenPipeError where all is closed

    assert exchange(tmp_path, write_on).endswith(b"served")


def test_a_connection_is_closed_when_the_proxy_has_closed(tmp_path, gentle, other_end):
    async def close(writer):
        writer.close()
        async with asyncio.timeout(serve.LINGER / 2):
            while other_end[0].fileno() != -1:
                await asyncio.sleep(0.01)

    assert exchange(tmp_path, close).endswith(b"served")


def test_a_connection_that_the_proxy_keeps_is_closed_in_the_end(tmp_path, gentle, other_end, monkeypatch):
    monkeypatch.setattr(serve, "LINGER", 0.1)

    async def keep(writer):
        async with asyncio.timeout(10):
            while other_end[0].fileno() != -1:
                await asyncio.sleep(0.01)

    assert exchange(tmp_path, keep).endswith(b"served")


def test_a_pipe_or_gigabytes_in_place_of_the_cookie_secret_are_not_read(tmp_path):
    kept, pipe, large, linked = (tmp_path / name for name in ("kept", "pipe", "large", "linked"))
    kept.write_bytes(b"x" * 44)
    os.mkfifo(pipe)
    with large.open("wb") as file:
        file.truncate(2 << 30)
    linked.symlink_to("/dev/zero")
    for path in (kept, pipe, large, linked, tmp_path, tmp_path / "nothing"):
        serve.remove_false_secret(str(path))
    assert [path.name for path in tmp_path.iterdir()] == ["kept"] and kept.read_bytes() == b"x" * 44
