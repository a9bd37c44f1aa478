"""The outline of a program, by its text: whether it makes a node, serves, spins it, and calls its `main`."""

import ast
import inspect
import re
import textwrap
from collections.abc import Callable, Iterator

from course.explaining.source import Function, calls, functions, functions_of, name_of, node_classes, parse
from course.foundation.syntax import walk


def returns_nothing(callback: Callable[..., object]) -> bool:
    """Return True if a function's source has no `return` with a value."""
    try:
        found = list(functions(parse(textwrap.dedent(inspect.getsource(callback)))))
    except (OSError, TypeError):
        return False
    return bool(found) and not _returns(found[0])


def never_called(source: str, name: str = "main") -> bool:
    """Return True if a program defines the function `name` and never calls it."""
    tree = parse(source)
    return any(function.name == name for function in functions(tree)) and not list(calls(tree, name))


def uncalled_main(source: str) -> tuple[int, str] | None:
    """Return why the main() of a program does not run, and the line that only names it, or 0; None if it is called.

    The text may also hand main() to something that calls it, such as a thread: then this is None, too.
    """
    if not never_called(source):
        return None
    tree = parse(source)
    main = next(each for each in functions(tree) if each.name == "main")
    run = "sys.exit(main())" if _returns(main) else "main()"
    bare = [node for node in walk(tree) if isinstance(node, ast.Expr) and name_of(node.value) == "main"]
    ended = [call for name in EXITS for call in calls(tree, name) if "main" in map(name_of, call.args)]
    if len(bare) + len(ended) < sum(name_of(node) == "main" for node in walk(tree) if isinstance(node, ast.Name)):
        return None
    for node, write in (*((each.value, run) for each in bare), *((each, "sys.exit(main())") for each in ended)):
        return node.lineno, f"`{ast.unparse(node)}` names the function and does not call it: write `{write}`."
    return 0, f"main() is defined, but never called: end the file with `if __name__ == '__main__': {run}`."


EXITS = ("exit", "_exit", "SystemExit")


def makes_a_node(source: str) -> bool:
    """Return True if a program's text makes a node, of its own class or by rclpy."""
    tree = parse(source)
    made = ("create_node", "Node", *(node.name for node in node_classes(tree)))
    return any(list(calls(tree, name)) for name in made)


def makes_no_node(source: str) -> str:
    """Return a sentence on a program that makes no node, so that it has nothing to do; '' if it may make one."""
    tree = parse(source)
    nodes = node_classes(tree)
    if makes_a_node(source):
        return ""
    if nodes:
        return (
            f"The file has the class {nodes[-1].name}, and makes no node of it. `main()` creates the node and spins "
            "it, and the file ends with `if __name__ == '__main__': main()`."
        )
    return "" if re.search(r"\b(?:rclpy|course|import_module)\b", source) else "It ended at once: it makes no node."


SERVES = ("create_service", "ActionServer", "create_timer", "create_subscription", "create_publisher")


def is_client(source: str) -> bool:
    """Return True if a program makes clients, and nothing that others ask, hear or wait for."""
    tree = parse(source)
    asks = any(list(calls(tree, name)) for name in ("create_client", "ActionClient"))
    return asks and not serves(source)


def serves(source: str) -> bool:
    """Return True if a program makes something that must run on: a server, a timer, or an end of a topic."""
    tree = parse(source)
    return any(list(calls(tree, name)) for name in SERVES)


def never_spins(source: str) -> bool:
    """Return True if a program makes its node but never waits for callbacks.

    A wait counts, too, unless it is in a method of a node that only callbacks run: those are not called without a spin.
    """
    tree = parse(source)
    if any(list(calls(tree, name)) for name in SPINS):
        return False
    waits = [call for name in WAITING for call in calls(tree, name)]
    if not waits or re.search(r"\b(?:Thread|Timer|submit)\b", source):
        return not waits
    of_callbacks = {id(node) for method in _of_callbacks(tree) for node in walk(method)}
    return all(id(call) in of_callbacks for call in waits)


EXECUTOR = "ThreadedExecutor"  # ends the names of rclpy's executors


def spin(source: str) -> str:
    """Return the call that a program's main() must make to spin its node: of its own executor, if it has made one."""
    for made in (node for node in walk(parse(source)) if isinstance(node, ast.Assign)):
        kept, value = made.targets[0], made.value
        if isinstance(kept, ast.Name) and isinstance(value, ast.Call) and name_of(value.func).endswith(EXECUTOR):
            return f"{kept.id}.spin()"
    return "rclpy.spin(node)"


SPINS = ("spin", "spin_once", "spin_until_future_complete", "spin_once_until_future_complete")
WAITING = ("wait", "sleep", "input")


def _of_callbacks(tree: ast.Module) -> Iterator[Function]:
    """Yield the methods of node classes that the program does not reach from its main part or a constructor."""
    methods = {each.name: each for cls in node_classes(tree) for each in functions_of(cls)}
    inside = {id(node) for method in methods.values() for node in walk(method)}
    used = {name_of(node) for node in walk(tree) if id(node) not in inside} | {"__init__"}
    reached: set[str] = set()
    while new := (used & {*methods}) - reached:
        reached |= new
        for each in new:
            called = (node.func for node in walk(methods[each]) if isinstance(node, ast.Call))
            used |= {func.attr for func in called if isinstance(func, ast.Attribute)}
    yield from (method for name, method in methods.items() if name not in reached)


def _returns(function: ast.AST) -> bool:
    return any(isinstance(node, ast.Return) and node.value is not None for node in walk(function))
