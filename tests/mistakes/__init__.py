"""Mistakes that students really make in the five exercises, each a short file: what is run, and what must be shown.

A file `tests/mistakes/EXERCISE/NAME.md` reads like a page:

    # The callback does not return the response          (the title)

    Two or three sentences: what went wrong, and what to do.

    ```replace calculator_server.py                       (the reference answer with this replaced, as its %%exercise
            return response                                cell; further blocks of the same file add up)
    ---
            pass
    ```                                                    (an empty block: the file as in the reference answer)

    ```python                                             (any other cell)
    ros.call("/calculator", Calculate, a=1, b=2, operation="add")
    ```

    ```shown within 5 s                                   (what the cells since the last such block must show, line by
    ... does not answer.                                   line and in this order; `...` stands for anything; the time
                                                           is a limit)
    ```

The cells of a file run in the order in which they stand, in a kernel with a session and the exercise's files as in the
reference answer.  Two words may follow `python`, and the file's name after `replace`:

- `in a new kernel`: without a session, as after Kernel, Restart;
- `interrupted`: it would not end by itself.  The runner presses ■ when everything is there that must be shown, and the
  cell must end within `INTERRUPT` s.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

FOLDER = Path(__file__).parent
SOLUTIONS = FOLDER.parents[1] / "solutions"
INTERRUPT = 5.0  # s that a cell may take to end after ■
NEW_KERNEL, INTERRUPTED = " in a new kernel", " interrupted"
BLOCK = re.compile(r"^```([^\n`]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PACKAGES = {"calculator": "calculator_interfaces"}


@dataclass
class Step:
    """A cell, and what it must show within `limit` s."""

    cell: str
    file: str = ""  # that the cell writes, with what was replaced in it
    replaced: list[tuple[str, str]] = field(default_factory=list)
    shown: list[str] = field(default_factory=list)
    limit: float = 30.0
    new_kernel: bool = False
    interrupted: bool = False

    def differs(self, output: str) -> str:
        """Return the first line that must be shown in this order and is not; '' when all are."""
        lines = output.splitlines()
        for wanted in self.shown:
            # From Python 3.12 on, some errors end with a suggestion.
            pattern = re.compile(".*".join(map(re.escape, wanted.split("..."))) + r"(\. Did you mean: '\w+'\?)?")
            while lines and not pattern.fullmatch(lines[0].rstrip()):
                lines.pop(0)
            if not lines:
                return wanted
            lines.pop(0)
        return ""


@dataclass
class Mistake:
    """One file of the collection."""

    exercise: str
    name: str
    title: str
    text: str  # what went wrong, and what to do
    steps: list[Step]


def collection() -> Iterator[Mistake]:
    """Yield all mistakes, by exercise and name."""
    for path in sorted(FOLDER.glob("*/*.md")):
        yield read(path)


def read(path: Path) -> Mistake:
    """Return one mistake; raises ValueError, naming the file, for a block that cannot be read."""
    text = path.read_text(encoding="utf-8")
    title, _, rest = text.partition("\n")
    exercise = path.parent.name
    steps: list[Step] = []
    for found in BLOCK.finditer(rest):
        kind, body = found[1].strip(), found[2]
        new_kernel, interrupted = NEW_KERNEL in kind, INTERRUPTED in kind
        word, _, argument = kind.replace(NEW_KERNEL, "").replace(INTERRUPTED, "").partition(" ")
        if word == "replace":
            old, separator, new = body.rpartition("---\n")
            if body and not separator:
                raise ValueError(f"{path}: a replace block has a line '---' between old and new")
            if not (steps and steps[-1].file == argument and not steps[-1].shown):
                steps.append(Step("", argument, new_kernel=new_kernel, interrupted=interrupted))
            steps[-1].replaced += [(old, new)] if body else []
        elif word == "python" and not argument:
            steps.append(Step(body, new_kernel=new_kernel, interrupted=interrupted))
        elif word == "shown" and steps:
            limit = re.fullmatch(r"within ([\d.]+) s", argument)
            steps[-1].shown = body.splitlines()
            steps[-1].limit = float(limit[1]) if limit else steps[-1].limit
        else:
            raise ValueError(
                f"{path}: a block is `replace FILE`, `python`, or, after one of them, `shown`; not `{kind}`"
            )
    for step in steps:
        if step.file:
            step.cell = exercise_cell(exercise, step.file, step.replaced)
    return Mistake(exercise, path.stem, title.lstrip("# "), BLOCK.sub("", rest).strip(), steps)


def exercise_cell(exercise: str, file: str, replaced: list[tuple[str, str]] | None = None) -> str:
    """Return the `%%exercise` cell of a file of the reference answer, with some of its text replaced."""
    content = (SOLUTIONS / exercise / file).read_text(encoding="utf-8")
    for old, new in replaced or []:
        if content.count(old) != 1:
            raise ValueError(f"{exercise}/{file} has {content.count(old)} times: {old!r}")
        content = content.replace(old, new)
    options = {".srv": f" --package {PACKAGES.get(exercise, 'my_package')}"}.get(Path(file).suffix, "")
    if "client" in file:
        options = " --no-start"
    return f"%%exercise {file}{options}\n{content}"
