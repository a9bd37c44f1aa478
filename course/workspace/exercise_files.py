"""Reading and checking the files of an exercise, which its notebook names."""

import ast
import re
import sys
from dataclasses import dataclass
from pathlib import Path

from course.errors import UnreadableNotebook, WorkspaceError
from course.foundation import cells
from course.foundation.syntax import imported, syntax_tree
from course.foundation.untrusted import read_regular_text
from course.interfaces.definition import Definition, parse

LARGEST = 1_000_000  # bytes of a program or a definition
NOTEBOOKS = Path(__file__).parents[2] / "notebooks"


@dataclass(frozen=True)
class Program:
    """A `.py` file: its `main` becomes an executable of the ROS 2 package, or else other files import it."""

    file: str
    text: str
    imports: frozenset[str]  # top-level names, without the standard library
    runs: bool  # whether it has a main

    @property
    def name(self) -> str:
        """Return the executable's name, as in `ros2 run PACKAGE NAME`."""
        return self.file.removesuffix(".py")


@dataclass(frozen=True)
class Interface:
    """A `.msg`, `.srv` or `.action` file of the interface package `package`."""

    file: str
    text: str
    package: str
    definition: Definition


@dataclass(frozen=True)
class Exercise:
    """A student's work for the exercise `name`."""

    name: str
    programs: list[Program]
    interfaces: list[Interface]


def read(name: str, folder: Path) -> Exercise:
    """Read the files of the exercise `name` from `folder`.

    Its notebook, in `folder` or else in the course's folder `notebooks`, names them in `%%exercise` cells.  Raises
    WorkspaceError or InterfaceError, with one line that says which file is missing or cannot be used.
    """
    if not folder.is_dir():
        raise WorkspaceError(f"there is no folder {folder}")
    programs, interfaces = [], []
    for file, package in _named(_notebook(name, folder)).items():
        text = _text(folder / file, name)
        if file.endswith(".py"):
            programs.append(_program(file, text))
        else:
            interfaces.append(Interface(file, text, package, parse(text, file, package)))
    used = {module for program in programs for module in program.imports}
    for program in programs:
        if not program.runs and program.name not in used:
            raise WorkspaceError(
                f"{program.file} has no function main: `ros2 run` calls it, so write `def main(args=None):`"
            )
    if not programs and not interfaces:
        raise WorkspaceError(f"the notebook {name}.ipynb has no %%exercise cell, so there is nothing to export")
    return Exercise(name, programs, interfaces)


def _notebook(name: str, folder: Path) -> Path:
    places = [folder / f"{name}.ipynb", NOTEBOOKS / name / f"{name}.ipynb"]
    for place in places:
        if place.is_file():
            return place
    known = ", ".join(sorted(path.stem for path in NOTEBOOKS.glob("*/*.ipynb") if path.stem == path.parent.name))
    raise WorkspaceError(
        f"there is no exercise '{name}'" + (f"; there are: {known}" if known else f": {places[0]} does not exist")
    )


def _named(notebook: Path) -> dict[str, str]:
    """Return the files that the notebook's `%%exercise` cells write, each with its interface package."""
    try:
        sources = [cell.source for cell in cells.read(notebook) if cell.kind == "code"]
    except (OSError, UnreadableNotebook) as error:
        raise WorkspaceError(f"cannot read {notebook}: {error}") from None
    files = {}
    for source in sources:
        first = source.lstrip("\n").partition("\n")[0]
        if first.startswith("%%exercise "):
            line = first.removeprefix("%%exercise").partition(" -- ")[0]
            said = re.search(r"\s--package[ =]+(\S+)", line)
            line = line.replace(said[0], "") if said else line
            for file in [word for word in line.split() if not word.startswith("-")][:1]:
                files[Path(file).name] = said[1] if said else "my_package"
    return files


def _text(path: Path, exercise: str) -> str:
    try:
        return read_regular_text(path, LARGEST)
    except FileNotFoundError:
        raise WorkspaceError(
            f"{path.name} is not in {path.parent.resolve()}: run its %%exercise cell in {exercise}.ipynb, "
            "or name the folder that has it with --from"
        ) from None
    except OSError as error:
        raise WorkspaceError(f"cannot read {path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise WorkspaceError(f"{path.name} is not UTF-8 text: save it again as UTF-8") from None
    except ValueError as error:
        raise WorkspaceError(f"cannot read {path}: {error}") from None


def _program(file: str, text: str) -> Program:
    if not file.removesuffix(".py").isidentifier():
        raise WorkspaceError(f"{file} cannot be a Python module: name it with letters, digits and underscores only")
    try:
        tree = syntax_tree(text)
    except (SyntaxError, ValueError) as error:
        line = f", line {error.lineno}: {error.msg}" if isinstance(error, SyntaxError) else f": {error}"
        raise WorkspaceError(f"{file}{line}; correct it and run its cell again") from None
    runs = any(isinstance(node, ast.FunctionDef) and node.name == "main" for node in tree.body)
    if not all(_callable_without(node) for node in tree.body if isinstance(node, ast.FunctionDef)):
        raise WorkspaceError(f"{file}: `ros2 run` calls main without arguments, so write `def main(args=None):`")
    return Program(
        file, text, frozenset(name for _, name in imported(tree) if name not in sys.stdlib_module_names), runs
    )


def _callable_without(function: ast.FunctionDef) -> bool:
    """Return True if `function` is not `main`, or can be called without arguments."""
    arguments = function.args
    needed = len(arguments.posonlyargs) + len(arguments.args) - len(arguments.defaults)
    return function.name != "main" or (needed == 0 and None not in arguments.kw_defaults)
