"""What is known of an exercise before anything runs: the folder `hidden/NAME` with `exercise.toml` and `suite.py`.

`exercise.toml` names the files handed in and the interface package; the suite's test functions carry their points in
a decorator and their title in the docstring.  Both are read here without importing the suite, so that the coordinator
knows which verdicts must come back whatever happens in the worker.  To a worker on another machine the folder travels
as bytes.
"""

import ast
import hashlib
import re
import tempfile
import tomllib
from collections import Counter
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

from autograder.errors import BrokenExercise, UnknownExercise
from autograder.paths import HIDDEN
from course.notebook import cells


@dataclass(frozen=True)
class Test:
    """A hidden test as the student may know it."""

    __test__ = False  # not one of pytest's own
    id: str
    title: str
    points: float
    cell: str  # the notebook's grade cell that the points belong to


@dataclass(frozen=True)
class Exercise:
    """One exercise of the course."""

    name: str
    folder: Path  # where the suite and the reference interfaces are
    title: str
    files: tuple[str, ...]  # handed in
    package: str  # of the interfaces that lie beside the suite, or ""
    time_limit: float  # s, for all tests together
    early: dict[str, list[str]]  # runs to begin before all else
    tests: tuple[Test, ...]

    @property
    def interfaces(self) -> list[Path]:
        """The reference definitions of `package`."""
        return sorted(p for p in self.folder.iterdir() if p.suffix in (".msg", ".srv", ".action"))

    @property
    def cells(self) -> dict[str, float]:
        """The notebook's grade cells, with the points of the tests that belong to each."""
        points: Counter[str] = Counter()
        for test in self.tests:
            points[test.cell] += test.points
        return dict(points)

    @property
    def max_score(self) -> float:
        """The points of all tests together."""
        return sum(test.points for test in self.tests)


def names() -> list[str]:
    """The exercises that have a hidden suite."""
    return sorted(file.parent.name for file in HIDDEN.glob("*/exercise.toml"))


@cache
def load(name: str, hidden: Path | None = None) -> Exercise:
    """Read the exercise `name` in the folder `hidden`, by default HIDDEN; raises UnknownExercise and BrokenExercise."""
    folder = (hidden or HIDDEN) / name
    if not (folder / "exercise.toml").exists() or folder.parent != (hidden or HIDDEN):
        raise UnknownExercise(f"there is no exercise '{name}'; there are: {', '.join(names())}")
    try:
        description = tomllib.loads((folder / "exercise.toml").read_text(encoding="utf-8"))
        return Exercise(
            name=name,
            folder=folder,
            title=description["title"],
            files=tuple(description["files"]),
            package=description.get("package", ""),
            time_limit=float(description["time_limit"]),
            early=description.get("early", {}),
            tests=tuple(_tests(folder / "suite.py")),
        )
    except KeyError as error:
        raise BrokenExercise(f"{folder / 'exercise.toml'} has no {error}") from None
    except SyntaxError as error:
        raise BrokenExercise(f"{folder / 'suite.py'}, line {error.lineno}: {error.msg}") from None
    except (ValueError, TypeError, OSError) as error:  # TOML's are ValueErrors
        raise BrokenExercise(f"the exercise {name} cannot be read: {error}") from None


def difference(name: str, notebook: Path) -> str:
    """How the points of the notebook's grade cells differ from those of the suite; empty when they do not."""
    hidden = load(name).cells
    shown = {
        cell.name: cell.mark["points"] for cell in cells.read(notebook) if cell.mark.get("grade") and not cell.solution
    }
    return "; ".join(
        f"cell {cell} has {shown.get(cell, 'no')} points in the notebook, {hidden.get(cell, 'no')} in the suite"
        for cell in sorted({*hidden, *shown})
        if hidden.get(cell) != shown.get(cell)
    )


@dataclass(frozen=True)
class Packed:
    """An exercise's folder, and what all suites share, as bytes by path below `hidden`."""

    name: str
    files: dict[str, bytes]

    @cached_property
    def digest(self) -> str:
        """Tells one content from another."""
        parts = (part for path, content in sorted(self.files.items()) for part in (path.encode(), content))
        return hashlib.sha256(b"".join(b"%d:%s" % (len(part), part) for part in parts)).hexdigest()


@cache
def pack(name: str) -> Packed:
    """The exercise `name`, to be sent; raises UnknownExercise."""
    paths = [*HIDDEN.glob("*.*"), *load(name).folder.rglob("*")]
    return Packed(
        name,
        {
            str(path.relative_to(HIDDEN)): path.read_bytes()
            for path in paths
            if path.is_file() and "__pycache__" not in path.parts
        },
    )


_unpacked: dict[str, tempfile.TemporaryDirectory] = {}


def unpack(packed: Packed) -> Exercise:
    """The exercise as it was sent, in a folder of this user's alone that is gone when the process ends."""
    if packed.digest not in _unpacked:
        folder = tempfile.TemporaryDirectory(prefix="autograder-")
        for path, content in packed.files.items():
            target = Path(folder.name, path)
            target.parent.mkdir(exist_ok=True)
            target.write_bytes(content)
        _unpacked[packed.digest] = folder
    return load(packed.name, Path(_unpacked[packed.digest].name))


def _tests(suite: Path) -> list[Test]:
    """The test functions of `suite`, in order, with the points and cell of their `@points` and their docstring's title."""
    found = []
    for function in ast.parse(suite.read_text(encoding="utf-8")).body:
        if not isinstance(function, ast.FunctionDef) or not function.name.startswith("test_"):
            continue
        points = [
            decorator
            for decorator in function.decorator_list
            if isinstance(decorator, ast.Call) and getattr(decorator.func, "id", "") == "points"
        ]
        title = re.sub(r"\s+", " ", ast.get_docstring(function) or "").rstrip(".")
        if len(points) != 1 or not title:
            raise ValueError(
                f"{suite}: {function.name} needs one @points(NUMBER, cell=NAME) and a docstring, its title"
            )
        found.append(Test(function.name, title, points[0].args[0].value, points[0].keywords[0].value.value))
    return found
