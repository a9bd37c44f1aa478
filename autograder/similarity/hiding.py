"""Programs whose text does not show what they do: seen by what is missing in the text, and not by how it is hidden."""

import ast
import re
import textwrap
import warnings
from collections.abc import Iterator, Sequence

from autograder.suitekit.untrusted import UNREADABLE
from course.foundation.syntax import syntax_tree

EXECUTING = {"exec", "eval", "compile"}
RUNNING = {  # modules that run other code, or find it
    *("bdb", "builtins", "cProfile", "code", "codeop", "ctypes", "doctest", "importlib", "marshal", "pdb", "pickle"),
    *("pkgutil", "profile", "pydoc", "rlcompleter", "runpy", "site", "subprocess", "timeit", "trace", "zipimport"),
}
# What evaluates the text of an annotation, wherever that text comes from.
EVALUATING = {
    *("ForwardRef", "PythonExpression", "eval_str", "get_annotations", "get_type_hints"),
    *("singledispatch", "singledispatchmethod"),
}
# What reads text that is not in the program's statements, such as a comment of another file: no exercise asks for that.
READING = {
    *("open", "read_text", "read_bytes", "readlines", "get_data", "fromfile", "genfromtxt", "loadtxt", "memmap"),
    *("getline", "getlines", "getcomments", "getdoc", "getsource", "getsourcelines", "get_source"),
}
# What reaches the interpreter: the code, the namespaces and the loaders behind what a program names.
INTERNAL = {
    *("__annotations__", "__args__", "__bases__", "__builtins__", "__closure__", "__code__", "__doc__", "__func__"),
    *("__getattribute__", "__globals__", "__import__", "__loader__", "__self__", "__spec__", "__wrapped__"),
    *("CodeType", "FunctionType", "co_code", "co_consts", "cr_code", "f_back", "f_builtins", "f_code", "f_globals"),
    *("f_locals", "gi_code", "tb_frame"),
    *("BaseConfigurator", "DictConfigurator", "dictConfig", "modules"),  # logging's find a function by its name
}
LONGEST, VARIED = 120, 20  # characters of a word in a text, and different ones among them: more are a packed text
FEW = 10  # statements in texts: an example, and not a program
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
    if _reaches(nodes) or (READING | EVALUATING) & _used(nodes) or RUNNING & _modules(nodes):
        return True
    texts = [node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)]
    if sum(_statements(text) for text in texts) > FEW or any(map(_evaluates, _annotations(nodes))):
        return True
    if any(_calls(inner) and _reaches(inner) for inner in map(parsed, texts)) or any(map(_is_packed, texts)):
        return True
    simple = [node for node in nodes if isinstance(node, ast.stmt) and not hasattr(node, "body")]
    return sum(_literals(node) for node in simple if not _is_docstring(node)) > size


def _is_packed(text: str) -> bool:
    return any(len(word) > LONGEST and len(set(word)) > VARIED for word in text.split())


def _reaches(nodes: Sequence[ast.AST]) -> bool:
    """Return True if a program executes a text, or reaches the interpreter."""
    own = {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    executing = any(isinstance(node, ast.Name) and node.id in EXECUTING - own for node in nodes)
    texts = {node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)}
    return executing or bool(INTERNAL & (_used(nodes) | texts))  # also vars(module)["__loader__"]


def _used(nodes: Sequence[ast.AST]) -> set[str]:
    """Return the names that a program uses and does not define, and those of attributes and keyword arguments."""
    names = [node for node in nodes if isinstance(node, ast.Name)]
    used = {node.id for node in names} | {node.attr for node in nodes if isinstance(node, ast.Attribute)}
    used |= {alias.name for node in nodes if isinstance(node, ast.ImportFrom) for alias in node.names}
    used |= {node.arg for node in nodes if isinstance(node, ast.keyword) and node.arg}
    return used - {node.id for node in names if isinstance(node.ctx, ast.Store)}


def _calls(nodes: Sequence[ast.AST]) -> bool:
    return any(isinstance(node, ast.Call) for node in nodes)


def _annotations(nodes: Sequence[ast.AST]) -> Iterator[ast.expr]:
    for node in nodes:
        found = getattr(node, "returns", None) or getattr(node, "annotation", None)
        if found:
            yield found


def _evaluates(annotation: ast.expr) -> bool:
    """Return True if an annotation has a text that does more than name a type, or is a text put together."""
    for node in ast.walk(annotation):
        if isinstance(node, ast.JoinedStr | ast.Add):
            return True
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and _calls(parsed(node.value)):
            return True
    return False


def _statements(text: str) -> int:
    """Return how many statements a text has, as a whole or in its paragraphs; a text without code has none."""
    for parts in ([text], re.split(r"\n\s*\n", text)):
        nodes = [node for part in parts for node in parsed(textwrap.dedent(part).strip())]
        words = sum(isinstance(node, ast.Expr) and not isinstance(node.value, ast.Call) for node in nodes)
        if statements := sum(isinstance(node, ast.stmt) for node in nodes) - words:
            return statements
    return 0


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
            return [*ast.walk(syntax_tree(text))]
    except UNREADABLE:
        return []
