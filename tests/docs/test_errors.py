"""Errors that a user can meet are of the trees, as CONTRIBUTING says."""

import ast
from pathlib import Path

import pytest

import autograder.errors
import course.errors

ROOT = Path(__file__).parents[2]
TREES = {
    name for tree in (autograder.errors, course.errors) for name, kind in vars(tree).items() if isinstance(kind, type)
}
CALLERS = {"TypeError", "ValueError", "OSError", "PermissionError", "ProcessLookupError"}
FRAMEWORKS = {  # which ask for them: argparse, typer, JupyterHub, traitlets, rclpy, Python itself
    "ArgumentTypeError",
    "AttributeError",
    "ImportError",
    "MemoryError",
    "NodeNameNonExistentError",
    "Exit",
    "HTTPError",
    "TraitError",
    "SystemExit",
    "KeyboardInterrupt",
    "Interrupted",  # a KeyboardInterrupt: `course/session/guards.py`
    "NotImplementedError",
    "AssertionError",
}
BASES = {"AutograderError", "CourseError"}  # which say nothing of what happened


def raised(file: Path) -> list[str]:
    """The names of the classes that a file raises, as `raise Name` or `raise Name(...)`."""
    names = []
    for node in ast.walk(ast.parse(file.read_bytes())):
        if isinstance(node, ast.Raise) and node.exc:
            kind = node.exc.func if isinstance(node.exc, ast.Call) else node.exc
            name = kind.attr if isinstance(kind, ast.Attribute) else getattr(kind, "id", "")
            if name[:1].isupper():
                names.append(name)
    return names


PARTS = [
    path
    for package in ("autograder", "course")
    for path in sorted((ROOT / package).glob("[a-z]*"))
    if path.name != "hidden" and (path.is_dir() or path.suffix == ".py")
]


@pytest.mark.parametrize("part", PARTS, ids=[f"{path.parent.name}/{path.name}" for path in PARTS])
def test_what_is_raised_is_of_the_trees_or_tells_of_a_wrong_call(part):
    files = sorted(part.rglob("*.py")) if part.is_dir() else [part]
    allowed = (TREES | CALLERS | FRAMEWORKS) - BASES
    assert [(file.name, name) for file in files for name in raised(file) if name not in allowed] == []


def test_a_wrong_raise_is_noticed(tmp_path):
    (tmp_path / "wrong.py").write_text("raise RuntimeError('full')\nraise errors.Leak\nraise error from None\n")
    assert raised(tmp_path / "wrong.py") == ["RuntimeError", "Leak"]
    assert "RuntimeError" not in TREES | CALLERS | FRAMEWORKS
