"""Docstrings say what a thing is or does, as PEP 257 asks: "Return ...", "Start ...", or a noun phrase."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
QUESTION = re.compile(r"(What|Who|Whose|Whether|Which|When|How|Where|Why)\b")
SUITE = re.compile(r"autograder/hidden/\w+/suite\.py")
DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


def questions(text: str, titles: bool = False) -> list[str]:
    """Return the first lines of the docstrings in a module's text that begin like a question.

    With `titles`, not of functions called `test_...`: these docstrings are titles, and may begin with "When ...".
    """
    nodes = (node for node in ast.walk(ast.parse(text)) if isinstance(node, DOCUMENTED))
    found = (ast.get_docstring(node) or "" for node in nodes if not (titles and _name(node).startswith("test_")))
    return [docstring.partition("\n")[0] for docstring in found if QUESTION.match(docstring)]


def _name(node: ast.AST) -> str:
    return str(getattr(node, "name", ""))


def test_docstrings_that_begin_like_a_question_are_found():
    text = '"""What it is."""\nclass A:\n    """A class."""\n    def is_b(self):\n        """Whether it is b."""\n'
    assert questions(text) == ["What it is.", "Whether it is b."]


def test_titles_of_hidden_tests_may_begin_like_a_question():
    text = '"""Tests."""\ndef test_a():\n    """When it is a."""\ndef b():\n    """When it is b."""\n'
    assert questions(text) == ["When it is a.", "When it is b."]
    assert questions(text, titles=True) == ["When it is b."]


@pytest.mark.parametrize("package", ["course", "autograder", "tests"])
def test_no_docstring_begins_like_a_question(package: str):
    modules = {path.relative_to(ROOT).as_posix(): path for path in sorted((ROOT / package).rglob("*.py"))}
    read = {name: questions(path.read_text(), bool(SUITE.fullmatch(name))) for name, path in modules.items()}
    assert read
    found = {name: lines for name, lines in read.items() if lines}
    assert not found, "write 'Return ...', 'Start ...' or a noun phrase"
