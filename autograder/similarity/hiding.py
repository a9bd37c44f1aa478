"""Programs whose text does not show what they do: seen by what is missing in the text, and not by how it is hidden."""

import ast
import warnings
from collections.abc import Sequence

from autograder.suitekit.untrusted import UNREADABLE

EXECUTING = {"exec", "eval"}
ROS = "rclpy"


def hides(nodes: Sequence[ast.AST]) -> bool:
    """Return True if a program has no class of its own and does not import ROS 2: something else does its work.

    Every program of an exercise has one of them.
    """
    modules = [alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names]
    modules += [node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)]
    classes = any(isinstance(node, ast.ClassDef) for node in nodes)
    return bool(nodes) and not classes and ROS not in {module.partition(".")[0] for module in modules}


def may_hide(nodes: Sequence[ast.AST], size: int) -> bool:
    """Return True if a program whose other tokens have `size` characters executes a text, or is mainly one literal."""
    names = [node for node in nodes if isinstance(node, ast.Name)]
    own = {node.id for node in names if isinstance(node.ctx, ast.Store)}
    if (EXECUTING & {node.id for node in names}) - own:
        return True
    simple = [node for node in nodes if isinstance(node, ast.stmt) and not hasattr(node, "body")]
    return any(_literals(node) > size for node in simple if not _is_docstring(node))


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
