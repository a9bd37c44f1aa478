"""A picture of a terminal in which commands were run."""

import io
import shlex
import subprocess
from pathlib import Path

BACKGROUND, FOREGROUND, PROMPT = "#1e2430", "#e6e6e6", "#7fc8a9"
COLUMNS = 88


class Terminal:
    """What commands printed, as in a terminal; a notebook shows it as a picture."""

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

    def _repr_png_(self) -> bytes:
        from matplotlib.figure import Figure
        lines = [line[start:start + COLUMNS] for line in self.lines for start in range(0, max(len(line), 1), COLUMNS)]
        figure = Figure(figsize=(8, 0.25 * len(lines) + 0.3), facecolor=BACKGROUND)
        for number, line in enumerate(lines):
            figure.text(0.02, 1 - (number + 0.75) / (len(lines) + 0.6), line, family="monospace", fontsize=10,
                        va="center", color=PROMPT if line.startswith("$ ") else FOREGROUND, parse_math=False)
        picture = io.BytesIO()
        figure.savefig(picture, format="png", dpi=110, facecolor=BACKGROUND)
        return picture.getvalue()

    def save(self, path: str | Path) -> None:
        """Write the picture as a PNG file."""
        Path(path).write_bytes(self._repr_png_())


def terminal(*commands: str, timeout: float = 30.0) -> Terminal:
    """Run each command (no shell) for at most `timeout` s, and return the transcript."""
    runs = []
    for command in commands:
        words = shlex.split(command)
        try:
            done = subprocess.run(words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                  text=True, errors="replace", timeout=timeout)
            runs.append((command, done.stdout, done.returncode))
        except FileNotFoundError:
            runs.append((command, f"{words[0]}: command not found", 127))
        except subprocess.TimeoutExpired as expired:
            output = (expired.stdout or b"").decode(errors="replace")
            runs.append((command, f"{output}\n(stopped after {timeout:g} s)".lstrip("\n"), 124))
    return Terminal(runs)
