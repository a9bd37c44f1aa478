"""A judge that was taken over by what a program has sent, against the launcher, which starts programs for it."""

import base64
import contextlib
import json
import os
import socket
import subprocess
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from autograder.errors import SandboxError
from autograder.sandbox import launching, networks, users
from autograder.sandbox.launching import LaunchClient, LaunchServer
from autograder.sandbox.sandbox import Sandbox
from autograder.sandbox.supervision import End

ENDED = 30.0  # s
PIPE_BUF = 4096  # bytes that a pipe takes at once, however small it was made (pipe(7))
PROGRAM = "program.py"
DOMAIN = 1


def start(**changed: Any) -> dict[str, Any]:
    """A right request but for what is changed."""
    return {"do": "start", "file": PROGRAM, "args": [], "domain": DOMAIN, "files": {}, "afresh": False, **changed}


def laid(name: str) -> dict[str, Any]:
    """A request that lays a file of this name beside the program."""
    return start(files={name: base64.b64encode(b"x").decode()})


# What no honest judge sends.  All of it is refused, without a trace.
MALFORMED: dict[str, Any] = {
    "a zero byte in a file's name": laid("a\0b"),
    "the folder above": laid(".."),
    "a path": laid("../x"),
    "a name that is too long": laid("x" * 256),
    "a name that is no text": laid("\ud800"),
    "thousands of files": start(files={str(number): "" for number in range(5000)}),
    "no base64": start(files={"a": 5}),
    "a list of files": start(files=[["a", "b"]]),
    "a zero byte in an argument": start(args=["\0"]),
    "an argument that is no text": start(args=["\ud800"]),
    "long arguments": start(args=["ü" * 8000]),
    "thousands of arguments": start(args=[""] * 20_000),
    "no arguments": start(args=None),
    "a file that was not handed in": start(file="-c"),
    "no file": start(file={}),
    "a domain that there is not": start(domain=0),
    "an infinite domain": start(domain=float("inf")),
    "a domain that is no number": start(domain="x"),
    "the end of nothing": {"do": "stop", "program": 0, "why": ""},
    "the end of the last of none": {"do": "stop", "program": -1, "why": ""},
    "half a request": {"do": "start"},
    "something else": {"do": ["start"]},
    "no request": [1, 2],
    "a number": 5,
}
RAW = {
    "no JSON": b"{",
    "no text": b"\xff\xfe",
    "deep": b'{"do":' + b"[" * 100_000,
    "a number without end": b'{"do": "stop", "why": "", "program": ' + b"9" * 100_000 + b"}",
    "more than a message": b"x" * (launching.LONGEST + 10),
}


class Channel:
    """The launcher's socket, as a judge that was taken over has it."""

    def __init__(self, server: LaunchServer, end: socket.socket):
        self.server, self.end = server, end

    def send(self, message: bytes) -> str:
        """The launcher's answer."""
        self.end.send(message)
        assert self.server.serve()
        self.end.settimeout(ENDED)
        answer, descriptors, _, _ = socket.recv_fds(self.end, 2000, 10)
        for descriptor in descriptors:
            os.close(descriptor)
        return answer.decode()

    def ask(self, **changed: Any) -> str:
        """The same for a start."""
        return self.send(json.dumps(start(**changed)).encode())


@pytest.fixture
def sandbox(confinement) -> Iterator[Sandbox]:
    """In which the launcher starts programs, in this process's place."""
    if confinement != "root":
        pytest.skip("only root can make networks without a user namespace")
    with Sandbox(confinement, {PROGRAM: b"print(1)"}) as sandbox:
        yield sandbox


@pytest.fixture
def channel(sandbox) -> Iterator[Channel]:
    """A launcher with one network."""
    own, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    (network,) = networks.make(1)
    with own, theirs:
        yield Channel(LaunchServer(own, sandbox, {DOMAIN: network}), theirs)
    os.close(network)


def held() -> list[int]:
    """Return what this process has open."""
    return [int(name) for name in os.listdir("/proc/self/fd") if os.path.exists(f"/proc/self/fd/{name}")]


@pytest.mark.parametrize("message", [*MALFORMED, *RAW])
def test_what_is_malformed_is_refused_and_leaves_nothing(channel, sandbox, message):
    text = RAW[message] if message in RAW else json.dumps(MALFORMED[message]).encode()
    before = {*held()}
    for _ in range(3):
        assert channel.send(text).startswith("refused: ")
    assert {*held()} <= before  # what waited for a program of the test before may have been closed meanwhile
    assert not sandbox._users and not sandbox.descriptors, "no user and no file is kept for what was not started"
    assert channel.ask() == "started", "the next request is served"


def test_tries_count_towards_the_limit(channel):
    answers = [channel.send(json.dumps(laid("a\0b")).encode()) for _ in range(launching.STARTS)]
    assert all("plain file name" in answer for answer in answers)
    assert "no more than" in channel.ask()


def fails(*_: object, **__: object) -> None:
    """As a machine that has no room for one more."""
    raise BlockingIOError("Resource temporarily unavailable")


def fails_once(real: Callable[..., Any]) -> Callable[..., Any]:
    """The same, but once."""
    failures = [RuntimeError("can't start new thread")]

    def call(*args: Any, **options: Any) -> Any:
        if failures:
            raise failures.pop()
        return real(*args, **options)

    return call


@pytest.mark.parametrize("failing", ["processes", "threads", "users"])
def test_a_start_that_fails_leaves_nothing(channel, sandbox, monkeypatch, failing):
    with monkeypatch.context() as during:
        if failing == "processes":
            during.setattr(subprocess, "Popen", fails)
        elif failing == "threads":
            during.setattr(threading.Thread, "start", fails_once(threading.Thread.start))
        else:
            during.setattr(users, "SPARE", range(0))
        before = held()
        assert channel.ask().startswith("refused: ")
    assert held() == before and not sandbox._users and not sandbox.descriptors
    assert channel.ask() == "started"


def test_what_is_sent_in_a_domain_is_counted_until_after_its_programs_end(channel):
    assert channel.ask() == "started"
    (started,) = channel.server._started
    started.process.join()
    assert channel.server.in_use() == {DOMAIN}, "it may have sent something since the last look"
    assert channel.server.in_use() == set()


def test_an_honest_judge_is_told_why(channel):
    client = LaunchClient(channel.end)
    serving = threading.Thread(target=channel.server.serve)
    serving.start()
    with pytest.raises(SandboxError, match="'other.py' cannot be started"):
        client.start("other.py", domain=DOMAIN)
    serving.join()


def test_who_was_given_the_judges_socket_does_not_hold_up_the_launcher(channel):
    """The judge can give it to a program, which is in the same network and goes on with it when the judge is dead."""
    flooded = threading.Event()

    def flood() -> None:
        with contextlib.suppress(BrokenPipeError):
            while True:
                channel.end.send(b'{"do": "tell", "line": "forged"}')
                flooded.set()

    flooding = threading.Thread(target=flood, daemon=True)
    flooding.start()
    assert flooded.wait(ENDED)
    finishing = threading.Thread(target=channel.server.finish, daemon=True)
    finishing.start()
    for thread in (finishing, flooding):
        thread.join(ENDED)
        assert not thread.is_alive()
    assert channel.server.said.startswith(b"forged\n"), "what was said before is not lost"


def test_how_a_program_ended_fits_into_a_pipe_of_any_size():
    """The judge has the other end, and can make the pipe small: the launcher must not wait for it."""
    assert len(End(128, "\U0001f600" * 5000).to_bytes()) <= PIPE_BUF
