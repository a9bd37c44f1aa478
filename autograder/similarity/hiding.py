"""Programs whose text does not show what they do: seen by what is missing in the text, and not by how it is hidden."""

import ast
import warnings
from collections.abc import Sequence

from autograder.suitekit.untrusted import UNREADABLE

EXECUTING = {"exec", "eval", "compile", "__import__", "__builtins__"}
RUNNING = {  # modules that run other code, or find it
    *("bdb", "builtins", "cProfile", "code", "codeop", "ctypes", "doctest", "importlib", "marshal", "pdb", "pickle"),
    *("pkgutil", "profile", "pydoc", "runpy", "subprocess", "timeit", "trace", "zipimport"),
}
# What reads text that is not in the program's statements, such as a comment of another file: no exercise asks for that.
READING = {
    *("open", "read_text", "read_bytes", "readlines", "get_data", "fromfile", "genfromtxt", "loadtxt", "memmap"),
    *("getline", "getlines", "getcomments", "getsource", "getsourcelines", "get_source", "__doc__"),
}
ROS = "rclpy"


def hides(nodes: Sequence[ast.AST]) -> bool:
    """Return True if a program has no class of its own and does not use ROS 2: something else does its work.

    Every program of an exercise does one of them.  What is only imported is not used.
    """
    names: set[str] = set()  # that stand for ROS 2, or something of it
    for node in nodes:
        if isinstance(node, ast.Import):
            ros = [alias for alias in node.names if _is_ros(alias.name)]
            names |= {alias.asname or alias.name.partition(".")[0] for alias in ros}
        elif isinstance(node, ast.ImportFrom) and _is_ros(node.module or ""):
            names |= {alias.asname or alias.name for alias in node.names}
    uses = "*" in names or any(isinstance(node, ast.Name) and node.id in names for node in nodes)
    return bool(nodes) and not uses and not any(isinstance(node, ast.ClassDef) for node in nodes)


def _is_ros(module: str) -> bool:
    return module.partition(".")[0] == ROS


def may_hide(nodes: Sequence[ast.AST], size: int) -> bool:
    """Return True if a program whose tokens have `size` characters may run other code, or is mainly literals."""
    names = [node for node in nodes if isinstance(node, ast.Name)]
    own = {node.id for node in names if isinstance(node.ctx, ast.Store)}
    used = {node.id for node in names} | {node.attr for node in nodes if isinstance(node, ast.Attribute)}
    imported = {alias.name for node in nodes if isinstance(node, ast.ImportFrom) for alias in node.names}
    if EXECUTING & {node.id for node in names} - own or RUNNING & _modules(nodes) or READING & (used | imported) - own:
        return True
    simple = [node for node in nodes if isinstance(node, ast.stmt) and not hasattr(node, "body")]
    return sum(_literals(node) for node in simple if not _is_docstring(node)) > size


def _modules(nodes: Sequence[ast.AST]) -> set[str]:
    """Return the names of the imported packages and modules, up to the first point."""
    names = [alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names]
    names += [node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)]
    return {name.partition(".")[0] for name in names}


def _is_docstring(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def _literals(node: ast.stmt) -> int:
    """Return how many characters the literals of a statement have."""
    return sum(len(str(part.value)) for part in ast.walk(node) if isinstance(part, ast.Constant))


def parsed(text: str) -> list[ast.AST]:
    """Return the nodes of a Python text; none if it cannot be parsed, and so not be run either."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return [*ast.walk(ast.parse(text))]
    except UNREADABLE:
        return []
