"""Mutation testing: runs a test on versions of a program with one slip each, and finds those that pass.

A passing test says little unless one knows which mistakes it would find (DeMillo, Lipton and Sayward, "Hints on test
data selection", Computer 11(4), 1978).
"""

import ast
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from course.errors import ExerciseError
from course.explaining.failure_report import Frame
from course.explaining.source import calls
from course.foundation.syntax import syntax_tree
from course.session.domains import claim_domain
from course.session.stacks import Stacks

# Operators, and their likely slips.
SLIPS: dict[type[ast.AST], type[ast.AST]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Add,
    ast.Div: ast.Mult,
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.And: ast.Or,
    ast.Or: ast.And,
}
SIGNS = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.Div: "/",
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
    ast.And: "and",
    ast.Or: "or",
}
AT_ONCE = 2  # mutants that are tested at the same time
PYTEST = ("-m", "pytest", "-q", "-x", "--tb=line", "-rfE", "--color=no", "-p", "no:cacheprovider")
FAILED = re.compile(r"^(?:FAILED|ERROR) [^ :]+(?:::(\w+)\S*)?(?: - (.+))?", re.MULTILINE)
ERROR = re.compile(r"^E +(.+)$", re.MULTILINE)
CALLED = re.compile(r"Failed: Fixture \"(\w+)\" called dire")
USUAL = 20.0  # s for a run; more means that the tests compute for long
LOOK = 0.2  # s between two looks whether they loop
HANGS = "does not end"
IMPORT = "the import"
TESTS = "test_it.py"


class Mutant(NamedTuple):
    """A program with one slip."""

    line: int
    slip: str  # for example "> becomes >="
    source: str


class Trial(NamedTuple):
    """The mutants, each with the test that has found it, or ''."""

    found: list[tuple[Mutant, str]]

    @property
    def survivors(self) -> list[Mutant]:
        """The mutants that no test has found."""
        return [mutant for mutant, test in self.found if not test]

    def __repr__(self) -> str:
        lines = [
            f"line {mutant.line}: {mutant.slip:21} {f'found by {test}' if test else 'survives'}"
            for mutant, test in self.found
        ]
        return "\n".join([*lines, f"{len(self.found) - len(self.survivors)} of {len(self.found)} mutants found"])


def try_tests(file: str | Path, tests: str, timeout: float = USUAL) -> Trial:
    """Run `tests`, the text of a pytest file, against each mutant of the Python file.

    The tests import the file by its name.  Each run has its own folder and ROS domain, and at most `timeout` s; one
    that only computes is stopped earlier, unless `timeout` is longer than usual.  Raises ExerciseError when the tests
    fail for the unchanged file, or when one of the two is not Python.
    """
    if isinstance(file, str) and "\n" in file:
        raise ExerciseError("`try_tests` takes the name of the file first, and then the text of the tests")
    path = Path(file)
    try:
        source = path.read_text(encoding="utf-8")
        mutants, started = list(mutants_of(source)), _started_on_import(source)
    except FileNotFoundError:
        if (meant := path.with_name(f"{path.name}.py")).is_file():
            raise ExerciseError(f"there is no file {path.name}: write try_tests('{meant.name}', ...)") from None
        raise ExerciseError(f"{path.name} is missing: run the cell that writes it first") from None
    except SyntaxError as error:
        raise ExerciseError(f"{path.name}, line {error.lineno}: {error.msg}") from None
    if started:
        raise ExerciseError(
            f"{path.name}, line {started.lineno}: `{ast.unparse(started)}` runs when the tests import the file, too: "
            "put it below `if __name__ == '__main__':`"
        )
    try:
        syntax_tree(tests)
    except SyntaxError as error:
        raise ExerciseError(f"the tests, line {error.lineno}: {error.msg}") from None
    if not re.search(r"^\s*(async )?def test_", tests, re.MULTILINE):
        raise ExerciseError("there are no tests: a test is a function whose name begins with test_")
    for name in _never_run(tests):
        print(
            f"note: pytest runs only functions whose name begins with test_; '{name}' is not called, so it is not "
            "a test.",
            file=sys.stderr,
        )
    if path.stem not in tests:
        raise ExerciseError(f"the tests never import {path.stem}, so they cannot find anything: `import {path.stem}`")
    with ThreadPoolExecutor(AT_ONCE) as pool:
        first, why = pool.submit(_failing, path.name, source, tests, timeout).result()
        if first == HANGS:
            raise ExerciseError(f"the tests do not end for the unchanged {path.name}.{why}")
        if first:
            why = f" ({why})" if why else ""
            raise ExerciseError(
                f"{first} fails for the unchanged {path.name}{why}. Find out which of the two is wrong, {path.name} or "
                "the test, and correct it first"
            )
        found = pool.map(lambda each: _failing(path.name, each.source, tests, timeout)[0], mutants)
        return Trial(list(zip(mutants, found, strict=True)))


def _never_run(tests: str) -> list[str]:
    """Return the functions of a text of tests that assert something, and that nothing runs."""
    tree = syntax_tree(tests)
    nodes = [*ast.walk(tree)]
    used = {node.id for node in nodes if isinstance(node, ast.Name)} | {
        node.attr for node in nodes if isinstance(node, ast.Attribute)
    }
    used |= {node.arg for node in nodes if isinstance(node, ast.arg)}
    return [
        each.name
        for each in tree.body
        if isinstance(each, (ast.FunctionDef, ast.AsyncFunctionDef)) and not each.decorator_list
        if not each.name.startswith("test")
        and each.name not in used
        and any(isinstance(node, ast.Assert) for node in ast.walk(each))
    ]


def mutants_of(source: str) -> Iterator[Mutant]:
    """Each program that differs from `source` by one operator, truth value, sign or number, in the order of the lines.

    Raises SyntaxError if it is not Python.
    """
    changes = sorted((place, number) for number, place in enumerate(_places(_importable(source))))
    for (line, _), number in changes:
        other = _importable(source)  # no copy: IPython's tracebacks hang other programs' trees on nodes that all share
        slip = _change(list(ast.walk(other)), number)
        yield Mutant(line, slip, ast.unparse(ast.fix_missing_locations(other)) + "\n")


def _importable(source: str) -> ast.Module:
    """Return the tree of what a program runs on import."""
    tree = syntax_tree(source)
    tree.body = [each for each in tree.body if not _is_guard(each)]
    return tree


def _is_guard(statement: ast.stmt) -> bool:
    """Return True for `if __name__ == '__main__':`, whose block does not run on import."""
    return isinstance(statement, ast.If) and "__name__" in ast.unparse(statement.test)


def _places(tree: ast.AST) -> Iterator[tuple[int, int]]:
    """Yield the line and column of each possible slip, in the order of `ast.walk`."""
    for node in ast.walk(tree):
        for _ in range(_slips(node)):
            yield node.lineno, node.col_offset  # type: ignore[attr-defined]


def _slips(node: ast.AST) -> int:
    """Return the number of possible slips in a node."""
    if isinstance(node, ast.BinOp | ast.BoolOp):
        return int(type(node.op) in SLIPS)
    if isinstance(node, ast.Compare):
        return sum(type(each) in SLIPS for each in node.ops)
    if isinstance(node, ast.UnaryOp):
        return int(isinstance(node.op, ast.USub))
    return int(isinstance(node, ast.Constant) and isinstance(node.value, bool | float))


def _change(nodes: list[ast.AST], number: int) -> str:
    """Make the slip of this number, and return its description."""
    for node in nodes:
        if number < _slips(node):
            return _slip(node, number)
        number -= _slips(node)
    raise ValueError(f"there is no slip {number}")


def _slip(node: ast.AST, number: int) -> str:
    """Make one of a node's slips, and return its description."""
    said = ast.unparse(node)
    match node:
        case ast.Constant(value=bool() as value):
            node.value = not value
        case ast.Constant(value=value):
            node.value = float(not value)
        case ast.UnaryOp():
            node.op = ast.UAdd()
            return f"{said} becomes {ast.unparse(node.operand)}"
        case ast.Compare(ops=ops):
            at = [index for index, each in enumerate(ops) if type(each) in SLIPS][number]
            ops[at], words = _other(ops[at])
            return words
        case ast.BinOp(op=op) | ast.BoolOp(op=op):
            node.op, words = _other(op)
            return words
    return f"{said} becomes {ast.unparse(node)}"


def _other(operator: ast.AST) -> tuple[Any, str]:
    """Return the operator that replaces another one, and a description."""
    other = SLIPS[type(operator)]
    return other(), f"{SIGNS[type(operator)]} becomes {SIGNS[other]}"


def _failing(name: str, source: str, tests: str, timeout: float) -> tuple[str, str]:
    """Return the first test that fails for a program, or HANGS or IMPORT, and the error or place; '' if all pass."""
    claim, domain = claim_domain()
    with tempfile.TemporaryDirectory() as folder, claim:
        (Path(folder) / name).write_text(source, encoding="utf-8")
        (Path(folder) / TESTS).write_text(tests, encoding="utf-8")
        # A kernel asks programs for colours, and pytest colours parts of its output in spite of --color=no.
        plain = {name: value for name, value in os.environ.items() if name not in ("FORCE_COLOR", "CLICOLOR_FORCE")}
        environment = plain | {
            "ROS_DOMAIN_ID": str(domain),
            "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
            "PYTHONDONTWRITEBYTECODE": "1",
        }
        stacks, at = Stacks(), Path(folder) / TESTS
        with subprocess.Popen(
            [sys.executable, *PYTEST, TESTS],
            cwd=folder,
            env=environment | stacks.environment(environment),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            pass_fds=[stacks.descriptor],
        ) as program:
            began, frames = time.monotonic(), tuple[Frame, ...]()
            while program.returncode is None:
                try:
                    said, _ = program.communicate(timeout=LOOK)
                except subprocess.TimeoutExpired:
                    late = time.monotonic() - began > timeout
                    frames = stacks.doing(program.pid, at) if late else ()
                    frames = frames or (stacks.loop(program.pid, at) if timeout <= USUAL else ())
                    if late or frames:
                        program.kill()
                        ran = time.monotonic() - began
                        return HANGS, f" After {ran:.0f} s they were here:{_lines(frames)}" if frames else ""
    if program.returncode == 0:
        return "", ""
    failed, error = FAILED.search(said), ERROR.search(said)
    why = error[1] if error else failed[2] if failed else ""
    if fixture := CALLED.match(why or ""):
        why = f"it calls the fixture '{fixture[1]}' like a function: name '{fixture[1]}' among its arguments"
    return (failed and failed[1]) or IMPORT, why or ""


def _lines(frames: Iterable[Frame]) -> str:
    """Return the lines of frames, of which those in the file of the tests are in the text that the reader has given."""
    return "".join(f"\n{replace(each, place='the tests') if each.place == TESTS else each}" for each in frames)


def _started_on_import(source: str) -> ast.Expr | None:
    """Return a program's call of its own `main()` that is not below a guard; None if there is none."""
    own = (node for node in syntax_tree(source).body if isinstance(node, ast.Expr))
    return next((node for node in own if next(calls(node, "main"), None)), None)
