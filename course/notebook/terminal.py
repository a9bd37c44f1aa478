"""Commands run side by side, each as in a terminal of its own, and what they printed."""

import shlex
import subprocess
from concurrent.futures import ThreadPoolExecutor
from html import escape

STYLE = (
    "background: #1e2430; color: #e6e6e6; padding: .8em 1em; border-radius: 4px; font-size: 13px; line-height: 1.45; "
    "white-space: pre-wrap; overflow-wrap: anywhere;"
)
PROMPT = "color: #7fc8a9;"


class Terminal:
    """What commands printed: `runs` holds each command, its output and its exit status."""

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


def terminal(*commands: str, timeout: float = 30.0) -> Terminal:
    """Run the commands at the same time (no shell), each for at most `timeout` s, and return the transcript."""
    with ThreadPoolExecutor(len(commands)) as pool:
        return Terminal([*pool.map(lambda command: _run(command, timeout), commands)])


def _run(command: str, timeout: float) -> tuple[str, str, int]:
    words = shlex.split(command)
    try:
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
