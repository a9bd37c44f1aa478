"""The facts about an exercise before anything runs: the folder `hidden/NAME` with `exercise.toml` and `suite.py`.

`exercise.toml` names the files handed in and the interface package; the suite's tests carry their points in a decorator
and their title in the docstring (`declared_tests`).  Both are read without importing the suite, so that the coordinator
knows which verdicts must come back whatever happens in the worker.  The folder is sent as bytes to a worker on another
machine.
"""

import hashlib
import math
import tempfile
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Any, TypeVar

from autograder.errors import BrokenExercise, UnknownExercise
from autograder.paths import HIDDEN, checkout
from autograder.submissions import declared_tests
from autograder.submissions.declared_tests import Test
from course.foundation import cells

Value = TypeVar("Value")


@dataclass(frozen=True)
class Exercise:
    """One exercise of the course."""

    name: str
    folder: Path  # where the suite and the reference interfaces are
    title: str
    files: tuple[str, ...]  # that students hand in
    package: str  # of the interfaces that lie beside the suite, or ""
    time_limit: float  # s, for all tests together
    early: dict[str, list[str]]  # command lines, by name, that are started before everything else
    tests: tuple[Test, ...]
    whole: bool = True  # False if it has only some of the suite's tests, see `part`

    @property
    def taken(self) -> frozenset[str]:
        """Return the names of the files taken from a hand-in: those of the exercise, and its notebook."""
        return frozenset({*self.files, f"{self.name}.ipynb"})

    @property
    def interfaces(self) -> list[Path]:
        """The reference definitions of `package`."""
        return sorted(p for p in self.folder.iterdir() if p.suffix in (".msg", ".srv", ".action"))

    @property
    def cells(self) -> dict[str, float]:
        """The notebook's grade cells, with the points of the tests that belong to each."""
        points: dict[str, float] = {}
        for test in self.tests:
            points[test.cell] = points.get(test.cell, 0) + test.points
        return points

    @property
    def max_score(self) -> float:
        """The points of all tests together."""
        return sum(test.points for test in self.tests)

    def part(self, *tests: str) -> "Exercise":
        """Return the exercise with only these hidden tests, named by their ids; raises ValueError for others.

        For the project's own tests only: `grading.single.grade` refuses a part.
        """
        if not tests or not {*tests} <= {test.id for test in self.tests}:
            raise ValueError(f"{self.name} must be judged by some of its hidden tests, not by {', '.join(tests)!r}")
        return replace(self, tests=tuple(test for test in self.tests if test.id in tests), whole=False)


def names() -> list[str]:
    """The exercises that have a hidden suite."""
    return sorted(file.parent.name for file in HIDDEN.glob("*/exercise.toml"))


@cache
def load(name: str, hidden: Path | None = None) -> Exercise:
    """Read the exercise `name` in the folder `hidden`, by default HIDDEN; raises UnknownExercise and BrokenExercise."""
    folder = (hidden or HIDDEN) / name
    if not (folder / "exercise.toml").exists() or folder.parent != (hidden or HIDDEN):
        raise UnknownExercise(f"there is no exercise '{name}'; there are: {', '.join(names())}")
    description = folder / "exercise.toml"
    try:
        said = _Description(description, tomllib.loads(description.read_text(encoding="utf-8")))
        return Exercise(
            name=name,
            folder=folder,
            title=said.get("title", _text, "a text in quotation marks"),
            files=said.get("files", _file_names, 'a list of file names, such as ["server.py", "client.py"]'),
            package=said.get("package", _text, "the name of an interface package", default=""),
            time_limit=said.get("time_limit", _seconds, "a number of seconds above 0"),
            early=said.get("early", _runs, 'a table of command lines, such as run = ["client.py", "5"]', default={}),
            tests=declared_tests.tests(folder / "suite.py"),
        )
    except ValueError as error:  # from TOML or from decoding
        raise BrokenExercise(f"the exercise {name} cannot be read: {description}: {error}") from None
    except OSError as error:
        raise BrokenExercise(f"the exercise {name} cannot be read: {error}") from None


@dataclass(frozen=True)
class _Description:
    """The content of an `exercise.toml`, checked when it is asked for."""

    file: Path
    said: dict[str, Any]

    def get(self, key: str, check: Callable[[object], Value | None], form: str, default: Value | None = None) -> Value:
        """Return `check` of the key's value; raises BrokenExercise when that is None, or the key is missing.

        `form` tells the instructor the expected form.
        """
        if key not in self.said:
            if default is None:
                raise BrokenExercise(f"{self.file} has no '{key}': it must be {form}")
            return default
        value = check(self.said[key])
        if value is None:
            raise BrokenExercise(f"{self.file}: {key} must be {form}, not {self.said[key]!r}")
        return value


def difference(name: str, notebook: Path) -> str:
    """Return how the points of the notebook's grade cells differ from those of the suite; empty when they agree."""
    hidden = load(name).cells
    shown = {
        cell.name: cell.mark.get("points", 0)
        for cell in cells.read(notebook)
        if cell.mark.get("grade") and not cell.solution
    }

    def points(cells: Mapping[str, float], cell: str) -> str:
        return f"{cells[cell]:g}" if cell in cells else "no"

    return "; ".join(
        f"cell {cell} has {points(shown, cell)} points in the notebook, {points(hidden, cell)} in the suite"
        for cell in sorted({*hidden, *shown})
        if hidden.get(cell) != shown.get(cell)
    )


@cache
def points_by_hand(name: str) -> float:
    """Return the points of the notebook's questions that are marked by hand; 0 where there are no notebooks."""
    root = checkout()
    notebook = root / "notebooks" / name / f"{name}.ipynb" if root else None
    if not notebook or not notebook.is_file():
        return 0.0
    graded = [cell for cell in cells.read(notebook) if cell.mark.get("grade") or cell.mark.get("task")]
    tested = load(name).cells
    return float(sum(cell.mark.get("points", 0) for cell in graded if cell.name not in tested))


@dataclass(frozen=True)
class Packed:
    """An exercise's folder, and the files that all suites share: content by path below `hidden`."""

    name: str
    files: dict[str, bytes]

    @cached_property
    def digest(self) -> str:
        """Return a hash of the names and contents."""
        parts = (part for path, content in sorted(self.files.items()) for part in (path.encode(), content))
        return hashlib.sha256(b"".join(b"%d:%s" % (len(part), part) for part in parts)).hexdigest()


@cache
def pack(name: str) -> Packed:
    """The exercise `name`, ready to be sent to a worker; raises UnknownExercise and BrokenExercise."""
    return Packed(name, contents(load(name)))


def contents(exercise: Exercise) -> dict[str, bytes]:
    """Return the files of an exercise's folder, and those that all suites share, by path below their common folder."""
    hidden = exercise.folder.parent
    return {
        str(path.relative_to(hidden)): path.read_bytes()
        for path in (*hidden.glob("*.*"), *exercise.folder.rglob("*"))
        if path.is_file() and "__pycache__" not in path.parts
    }


_unpacked: dict[str, tempfile.TemporaryDirectory] = {}


def unpack(packed: Packed) -> Exercise:
    """The exercise as it was sent, in a private folder that is removed when the process ends."""
    if packed.digest not in _unpacked:
        folder = tempfile.TemporaryDirectory(prefix="autograder-")
        for path, content in packed.files.items():
            target = Path(folder.name, path)
            target.parent.mkdir(exist_ok=True)
            target.write_bytes(content)
        _unpacked[packed.digest] = folder
    return load(packed.name, Path(_unpacked[packed.digest].name))


def _text(value: object) -> str | None:
    return value if isinstance(value, str) and value else None


def _file_names(value: object) -> tuple[str, ...] | None:
    """Return the value if it is a list of plain, distinct file names, at least one; otherwise None."""
    names = value if isinstance(value, list) else []
    right = all(isinstance(name, str) and name == Path(name).name != ".." for name in names)
    return tuple(names) if names and right and len(names) == len(set(names)) else None


def _seconds(value: object) -> float | None:
    if isinstance(value, (int, float)) and not isinstance(value, bool) and 0 < value < math.inf:
        return float(value)
    return None


def _runs(value: object) -> dict[str, list[str]] | None:
    """Return the value if it is a dict of command lines (lists of words) by name; otherwise None."""
    if not isinstance(value, dict):
        return None
    right = all(isinstance(run, list) and run and all(isinstance(word, str) for word in run) for run in value.values())
    return value if right else None
