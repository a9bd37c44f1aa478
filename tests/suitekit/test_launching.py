"""The launcher's end of the socket that it shares with the process that judges."""

import json
import socket

from autograder.sandbox.launching import START, TELL, LaunchServer
from autograder.sandbox.sandbox import Sandbox


def pair() -> tuple[socket.socket, socket.socket]:
    return socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)


def test_a_judge_that_dies_with_an_answer_on_its_way_has_gone():
    ours, theirs = pair()
    server = LaunchServer(ours, Sandbox("root", {}), None)
    theirs.send(json.dumps({"do": START, "file": "x.py", "args": [], "domain": 1, "files": {}}).encode())
    assert server.serve()  # refused: there is no such file; the answer lies in the socket
    theirs.close()
    assert not server.serve()


def test_what_is_not_understood_starts_nothing():
    ours, theirs = pair()
    server = LaunchServer(ours, Sandbox("root", {"a.py": b""}), {})
    for asked in (
        [],
        {"do": START},
        {"do": START, "file": "b.py", "args": [], "domain": 1, "files": {}},
        {"do": START, "file": "a.py", "args": ["\0"], "domain": 1, "files": {}},
        {"do": START, "file": "a.py", "args": [], "domain": 1, "files": {"../a.py": ""}},
        {"do": START, "file": "a.py", "args": [], "domain": 1, "files": []},
        {"do": "stop", "program": 0, "why": ""},
        {"do": "stop", "program": float("inf"), "why": ""},
        {"do": TELL},
    ):
        theirs.send(json.dumps(asked).encode())
        assert server.serve()
        assert theirs.recv(2000).startswith(b"refused: ")
    theirs.send(b"[" * 100_000)
    assert server.serve()
    assert theirs.recv(2000).startswith(b"refused: ")
    theirs.send(json.dumps({"do": TELL, "line": "one\ntwo"}).encode())
    assert server.serve() and server.said == b"one two\n"
