"""Commands run side by side, each as in a terminal of its own, and what they printed."""

import contextlib
import os
import shlex
import signal
import subprocess
import threading
from concurrent.futures import ThreadPoolExecutor
from html import escape

STYLE = (
    "background: #1e2430; color: #e6e6e6; padding: .8em 1em; border-radius: 4px; font-size: 13px; line-height: 1.45; "
    "white-space: pre-wrap; overflow-wrap: anywhere;"
)
PROMPT = "color: #7fc8a9;"
GRACE = 10.0  # s for a program to end after Ctrl-C


class Terminal:
    """The output of commands: `runs` holds each command, its output and its exit status."""

    def __init__(self, runs: list[tuple[str, str, int]]):
        self.runs = runs

    @property
    def lines(self) -> list[str]:
        """The transcript: each command behind a `$`, its output, and its exit status if that was not 0."""
        lines = []
        for command, output, status in self.runs:
            lines += [f"$ {command}", *output.rstrip("\n").splitlines()]
            if status:
                lines.append(f"[exit status {status}]")
        return lines

    def __repr__(self) -> str:
        return "\n".join(self.lines)

    def _repr_html_(self) -> str:
        commands = {f"$ {command}" for command, _, _ in self.runs}
        lines = (f'<b style="{PROMPT}">{escape(line)}</b>' if line in commands else escape(line) for line in self.lines)
        return f'<pre style="{STYLE}">{chr(10).join(lines)}</pre>'


def terminal(*commands: str, timeout: float = 30.0, until: str = "") -> Terminal:
    """Run the commands at the same time (no shell), each for at most `timeout` s, and return the transcript.

    With `until`, a command that runs on is ended with Ctrl-C once it has printed a line with that text; the transcript
    leaves out what it prints afterwards.
    """
    with ThreadPoolExecutor(len(commands)) as pool:
        return Terminal([*pool.map(lambda command: _run(command, timeout, until), commands)])


def _run(command: str, timeout: float, until: str) -> tuple[str, str, int]:
    words = shlex.split(command)
    try:
        if until:
            return command, *_run_until(words, timeout, until)
        done = subprocess.run(
            words,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            timeout=timeout,
        )
        return command, done.stdout, done.returncode
    except FileNotFoundError:
        return command, f"{words[0]}: command not found", 127
    except subprocess.TimeoutExpired as expired:
        output = (expired.stdout or b"").decode(errors="replace")
        return command, f"{output}\n(stopped after {timeout:g} s)".lstrip("\n"), 124


def _run_until(words: list[str], timeout: float, until: str) -> tuple[str, int]:
    """Return what a command prints up to a line with `until`, or to its end, and its exit status."""
    program = subprocess.Popen(
        words,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
        start_new_session=True,  # a process group of its own, as for a terminal's Ctrl-C
    )
    assert program.stdout is not None
    late = threading.Event()

    def end() -> None:
        late.set()
        _signal(program, signal.SIGKILL)

    alarm = threading.Timer(timeout, end)
    alarm.start()
    printed = ""
    try:
        for line in program.stdout:
            printed += line
            if until in line:
                return f"{printed}^C", 0
        status = program.wait()
        return (f"{printed}(stopped after {timeout:g} s)", 124) if late.is_set() else (printed, status)
    finally:
        alarm.cancel()
        _end(program)


def _end(program: subprocess.Popen[str]) -> None:
    """End a program as Ctrl-C in its terminal does, and by force when it takes no notice."""
    try:
        _signal(program, signal.SIGINT)
        program.communicate(timeout=GRACE)
    except subprocess.TimeoutExpired:
        _signal(program, signal.SIGKILL)
        program.communicate()


def _signal(program: subprocess.Popen[str], number: int) -> None:
    """Send a signal to a program and to those that it has started."""
    with contextlib.suppress(ProcessLookupError):  # they have ended by themselves
        os.killpg(program.pid, number)
