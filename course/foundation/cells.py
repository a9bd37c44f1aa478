"""Reading notebook files: their cells, nbgrader's metadata, and the files that `%%exercise` cells write.

It runs nothing and accepts any file, so that handed-in notebooks can be read, too.
"""

import json
import re
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from course.errors import UnreadableNotebook
from course.foundation.untrusted import read_regular

# nbgrader's marks around text that is removed from the released notebook; they are not part of the exercise's file.
MARKERS = re.compile(r"^[ \t]*### (?:BEGIN|END) SOLUTION[ \t]*\n", re.MULTILINE)
STUB = "YOUR CODE HERE"  # what a release leaves where a solution was, in a comment
MOST = 100_000_000  # bytes of a notebook; one with many pictures has some 10,000,000
CAPITAL = re.compile(r"(?<=[a-z0-9])(?=[A-Z])")  # where a word begins in the name of a class
PASSED = "passed"  # the outcome of a public check
FAILED = "not yet: "  # begins each other outcome
UNFINISHED = f"{FAILED}it had not finished after "  # begins that of a check that had too little time
SOLUTION = re.compile(r"^[ \t]*### BEGIN SOLUTION[ \t]*\n(.*?)^[ \t]*### END SOLUTION", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Cell:
    """The parts of a notebook cell that the course uses."""

    kind: str  # code, markdown or raw
    source: str
    mark: dict[str, Any] = field(default_factory=dict)  # nbgrader's metadata
    count: int | None = None  # its execution count in the kernel
    outputs: list[dict] = field(default_factory=list)

    @property
    def name(self) -> str:
        """Return nbgrader's name of the cell, or ''."""
        name = self.mark.get("grade_id")
        return text_of(name) if isinstance(name, str) else ""

    @property
    def solution(self) -> bool:
        """Return True if the student writes the cell."""
        return bool(self.mark.get("solution"))

    @property
    def public_check(self) -> bool:
        """Return True if the cell is a check that students can see but not change."""
        return self.kind == "code" and bool(self.mark.get("grade")) and bool(self.mark.get("locked"))


def parse(text: bytes | str) -> list[Cell]:
    """The cells of a notebook file of format 4; raises UnreadableNotebook."""
    try:
        return [_cell(cell) for cell in json.loads(text)["cells"]]
    except (ValueError, RecursionError):
        raise UnreadableNotebook("it is not a notebook file: not JSON") from None
    except (TypeError, KeyError, AttributeError):
        raise UnreadableNotebook("it is not a notebook file of format 4") from None


def read(path: Path) -> list[Cell]:
    """The cells of the notebook at `path`; raises UnreadableNotebook and OSError."""
    try:
        content = read_regular(path, MOST)
    except ValueError as error:
        raise UnreadableNotebook(str(error)) from None
    return parse(content)


def notebooks(folder: Path) -> list[Path]:
    """Return a folder's notebooks, sorted by name.

    Hidden ones are left out: where JupyterLab could not save, on a full disk, it leaves an empty `.~NAME.ipynb`.
    """
    return sorted(path for path in folder.glob("*.ipynb") if not path.name.startswith("."))


def readable(paths: Iterable[Path]) -> Iterator[tuple[Path, list[Cell]]]:
    """Each notebook with its cells; those that cannot be read are left out."""
    for path in paths:
        try:
            known = read(path)
        except (UnreadableNotebook, OSError):
            continue
        yield path, known


def check_meant(words: Iterable[str], known: Collection[str]) -> str:
    """Return the name of the check, of those known, that one of these words stands for; '' if none does.

    The words are names of variables, files, classes or nodes: `lift_server.py` and `LiftServer` stand for lift-server.
    """
    for word in words:
        name = CAPITAL.sub("-", word.partition(".")[0]).replace("_", "-").lower()
        if found := [each for each in known if each == name or each.startswith(f"{name}-")]:
            return name if name in found else found[0]
    return ""


def text_of(value: Any) -> str:
    """The text that a notebook file holds as a string or as a list of lines."""
    text = value if isinstance(value, str) else "".join(line for line in value if isinstance(line, str))
    return text.encode(errors="replace").decode()  # a lone surrogate cannot be encoded


def content(body: str) -> str:
    """Return the text that a cell writes to its file, from the lines below `%%exercise FILE`.

    A byte order mark, which comes with a text that was copied from Windows, is left out.
    """
    return MARKERS.sub("", body.removeprefix("\ufeff"))


def exercise_file(cells: list[Cell], name: str) -> bytes | None:
    """Return the file content that the last `%%exercise NAME` cell would write, or None without such a cell."""
    for cell in reversed(cells):
        first, _, body = cell.source.lstrip("\n").partition("\n")
        if cell.kind == "code" and first.split()[:2] == ["%%exercise", name]:
            return content(body.removesuffix("\n") + "\n").encode(errors="replace")
    return None


def _cell(raw: dict) -> Cell:
    kind = raw["cell_type"] if raw["cell_type"] in ("code", "markdown") else "raw"
    mark = raw.get("metadata", {}).get("nbgrader")
    count = raw.get("execution_count")
    outputs = raw.get("outputs", []) if kind == "code" else []
    return Cell(
        kind,
        text_of(raw["source"]),
        mark if isinstance(mark, dict) else {},
        count if type(count) is int and abs(count) < 1e9 else None,
        [output for output in outputs if isinstance(output, dict)],
    )
