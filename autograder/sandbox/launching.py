"""Requests of the judging process to the launcher to start programs.

The two share a socket for one grading.  The judging process may have been taken over by a program that it talks to, so
the launcher checks every request, and passes verdicts on without reading them.  The output of programs, and their ends,
go to the judging process through separate pipes.
"""

import base64
import contextlib
import json
import os
import socket
import threading
from collections.abc import Iterable, Mapping
from pathlib import PurePath
from typing import Any

from autograder.errors import SandboxError
from autograder.sandbox import networks
from autograder.sandbox.program import Program
from autograder.sandbox.sandbox import Sandbox, Started
from autograder.sandbox.supervision import WHY

LONGEST = 1 << 17  # bytes of a message
KEPT = 4 << 20  # bytes of all messages from the judging process: more than the longest verdicts on the most tests
STARTS = 100  # starts of programs in one grading, failed ones included
FILES = 16  # that may be put beside a program
NAME = 255  # bytes of a file's name
ARGUMENTS = 10_000  # bytes of all arguments of a program
START, STOP, TELL = "start", "stop", "tell"


class LaunchServer:
    """The launcher's end: starts the handed-in files in `sandbox` for the judging process."""

    def __init__(
        self,
        channel: socket.socket,
        sandbox: Sandbox,
        domains: Mapping[int, int] | None,
        refused: Mapping[str, str] | None = None,
    ):
        """Serve `channel`; `domains` are the networks (descriptors by ROS domain) that may be used, or None.

        `channel` is a socket of type SOCK_SEQPACKET.  The files in `refused` are not run, each for that reason, which
        its student is told.
        """
        self.said = bytearray()  # the messages of the judging process, one line each
        self._channel, self._sandbox, self._domains = channel, sandbox, domains
        self._started: list[Started] = []
        self._files: dict[int, set[str]] = {}  # those started, by ROS domain
        self._inside: dict[int, list[Started]] = {}
        self._in_use: set[int] = set()
        self._refused = {**(refused or {})}
        self._tries = 0

    def serve(self) -> bool:
        """Do what the next message asks; return False when the judging process is gone."""
        try:
            message = self._channel.recv(LONGEST)
        except ConnectionResetError:  # it died while an answer was on its way
            return False
        if not message:
            return False
        try:
            asked = json.loads(message)
            kind = asked["do"]
            if kind == TELL:
                self._keep(str(asked["line"]))
            elif kind == STOP:
                self._started[int(asked["program"])].process.stop(str(asked["why"])[:WHY])
            elif kind == START:
                self._start(asked)
            else:
                raise ValueError("no such request")
        except Exception as error:  # the next grading needs this process, so it must not die
            with contextlib.suppress(OSError):
                self._channel.send(f"refused: {error}".encode(errors="replace")[:1000], socket.MSG_DONTWAIT)
        return True

    def in_use(self) -> set[int]:
        """Return the ROS domains in which a program runs, or did so since the last call."""
        before = self._in_use
        self._in_use = {
            domain for domain in before if any(started.process.alive for started in self._inside.get(domain, ()))
        }
        return before

    def files(self, domains: Iterable[int]) -> list[str]:
        """Return the names of the handed-in files that were started in these ROS domains."""
        started: set[str] = set().union(*(self._files.get(domain, set()) for domain in domains))
        return sorted(started & self._sandbox.files.keys())

    def stop(self, domain: int, why: str) -> None:
        """End the programs in a ROS domain; `why` is for the student.  If they are of one file, it is not run again."""
        for started in self._inside.get(domain, ()):
            started.process.stop(why)
        if len(files := self._files.get(domain, set())) == 1:
            self._refused |= dict.fromkeys(files, f"it was not run again, because {why}")

    def finish(self) -> None:
        """Serve the requests sent before the judging process ended, and ignore any later ones."""
        self._channel.shutdown(socket.SHUT_RD)
        while self.serve():
            pass

    def _keep(self, line: str) -> None:
        if len(self.said) < KEPT:
            self.said += line.encode(errors="replace").replace(b"\n", b" ") + b"\n"

    def _start(self, asked: dict[str, Any]) -> None:
        self._tries += 1
        if self._tries > STARTS:
            raise ValueError(f"no more than {STARTS} programs can be started")
        file, args, domain = str(asked["file"]), [str(arg) for arg in asked["args"]], int(asked["domain"])
        if len(asked["files"]) > FILES:
            raise ValueError(f"no more than {FILES} files can be laid beside a program")
        files = {_plain(name): base64.b64decode(content) for name, content in asked["files"].items()}
        if file not in {*self._sandbox.files, *files}:
            raise ValueError(f"the program {file!r} cannot be started")
        if any("\0" in arg for arg in args) or sum(len(os.fsencode(arg)) + 1 for arg in args) > ARGUMENTS:
            raise ValueError("an argument has a zero byte, or all of them are too long")
        with contextlib.ExitStack() as given:
            with networks.inside(self._domains[domain]) if self._domains else contextlib.nullcontext():
                started = self._sandbox.launch(
                    file, *args, domain=domain, files=files, afresh=asked.get("afresh") is True
                )
            for descriptor in (started.output, started.end):
                given.callback(os.close, descriptor)
            self._started.append(started)
            self._files.setdefault(domain, set()).add(file)
            self._in_use.add(domain)
            self._inside.setdefault(domain, []).append(started)
            if file in self._refused:
                started.process.stop(self._refused[file])
            with contextlib.suppress(OSError):  # a judging process that does not read gets no program
                socket.send_fds(self._channel, [b"started"], [started.output, started.end], socket.MSG_DONTWAIT)


class LaunchClient:
    """The judging process's end: its access to the sandbox."""

    def __init__(self, channel: socket.socket):
        self.programs: list[Program] = []
        self._channel, self._lock = channel, threading.Lock()

    def start(
        self, file: str, *args: str, domain: int, files: Mapping[str, bytes] | None = None, afresh: bool = False
    ) -> Program:
        """Start `python FILE ARGS` in ROS domain `domain`; raises SandboxError.

        `files` are also put into its home folder, for this program only.  With `afresh` it has no modules preloaded,
        see `Sandbox.launch`.
        """
        extra = {name: base64.b64encode(content).decode() for name, content in (files or {}).items()}
        with self._lock:
            self._send({"do": START, "file": file, "args": args, "domain": domain, "files": extra, "afresh": afresh})
            answer, descriptors, _, _ = socket.recv_fds(self._channel, 1000, 2)
            number = len(self.programs)
            if len(descriptors) != 2:
                raise SandboxError(f"{file} was not started: {answer.decode() or 'the launcher is gone'}")
            output, end = descriptors
            program = Program(file, output, end, lambda why: self._stop(number, why))
            self.programs.append(program)
        return program

    def tell(self, line: str) -> None:
        """Send a line to the coordinator."""
        with self._lock:
            self._send({"do": TELL, "line": line})

    def close(self) -> None:
        """End all programs."""
        for program in self.programs:
            program.kill()

    def _stop(self, number: int, why: str) -> None:
        with self._lock:
            self._send({"do": STOP, "program": number, "why": why})

    def _send(self, message: dict[str, Any]) -> None:
        self._channel.send(json.dumps(message).encode())


def _plain(name: str) -> str:
    if name != PurePath(name).name or name in ("", ".", "..") or "\0" in name or len(os.fsencode(name)) > NAME:
        raise ValueError(f"{name!r} is not a plain file name")
    return name
