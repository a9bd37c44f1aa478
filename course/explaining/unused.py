"""Things that a text makes and nothing uses, where their purpose is certain: a callback, or the result of a check."""

import ast
import re
from collections.abc import Collection, Iterator

from rclpy.node import Node

from course.explaining.source import Function, argument, calls, functions_of, inside, name_of, node_classes
from course.foundation.syntax import walk

SPINS = re.compile(r"spin|add_node")
NEED_SPINNING = {
    "create_client",
    "create_service",
    "create_subscription",
    "create_timer",
    "ActionClient",
    "ActionServer",
}
ANSWERS = {"GoalResponse": "goal_callback", "CancelResponse": "cancel_callback"}
RESULTS = ("SetParametersResult",)  # what only a `return` hands on


def unused(tree: ast.Module, *, whole: bool) -> Iterator[tuple[int, str]]:
    """Yield each such place as its line and a sentence.

    Methods are looked at only in a `whole` file: those of a cell's class may be used in another cell.  A check of
    parameters is looked at in a cell, too, if it starts the class.
    """
    yield from _results(tree)
    nodes = [*walk(tree)]
    used = {node.attr for node in nodes if isinstance(node, ast.Attribute)}
    used |= {node.id for node in nodes if isinstance(node, ast.Name)}
    texts = {node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)}
    started = {name_of(call.args[0]) for call in calls(tree, "start") if call.args}
    for cls in node_classes(tree):
        if not whole and cls.name not in started:
            continue
        plain = [each for each in functions_of(cls) if not each.decorator_list and not hasattr(Node, each.name)]
        idle = [each for each in plain if each.name not in used | texts] if len(cls.bases) == 1 else []
        yield from _unregistered(idle, whole=whole)
        if whole and next(calls(cls, "ActionServer"), None):
            yield from _never_accepted(idle)
            yield from _never_asked(idle)
        if whole:
            yield from _of_another(cls, {each.name for each in idle}, {each.name for each in plain})
    if whole:
        yield from _unspun(tree)


def _unspun(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield the nodes with callbacks or clients that a file makes and never gives to what spins its other nodes."""
    classes = {cls.name: cls for cls in node_classes(tree)}
    if not any(SPINS.search(name_of(node.func)) for node in walk(tree) if isinstance(node, ast.Call)):
        return
    own = {each.name for each in walk(tree) if isinstance(each, (ast.FunctionDef, ast.AsyncFunctionDef))}
    makers = {"Node", "create_node", *classes}
    made_by = {each: name_of(getattr(each.value, "func", None)) for each in walk(tree) if isinstance(each, ast.Assign)}
    assigned = {each: maker for each, maker in made_by.items() if maker in makers}
    others = {name_of(each.targets[0]) for each in assigned}
    for node, maker in assigned.items():
        target = node.targets[0]
        cls = classes.get(maker)
        inside_it = [call for call in walk(cls) if isinstance(call, ast.Call)] if cls else []
        if any(_may_spin(call, own, others) for call in inside_it):
            continue
        alike = (each for each in walk(tree) if isinstance(each, (ast.Name, ast.Attribute)))
        same = [each for each in alike if type(each) is type(target) and name_of(each) == name_of(target)]
        parts = [each for each in walk(tree) if isinstance(each, ast.Attribute) and each.value in same]
        makes = {each.attr for each in parts} | {name_of(call.func) for call in inside_it}
        if len(parts) == sum(isinstance(each.ctx, ast.Load) for each in same) and makes & NEED_SPINNING:
            yield (
                node.lineno,
                (
                    f"nothing spins the node `{ast.unparse(target)}`, so its callbacks never run, and no answer "
                    "reaches its clients. Make them in the node that is spun, or give both nodes to one executor with "
                    "`executor.add_node(...)`."
                ),
            )


def _may_spin(call: ast.Call, own: Collection[str], others: Collection[str]) -> bool:
    """Return True for a call in a class that spins its node, or something else than the `others`, or may do so.

    A function of the file, one of its `own`, may spin the node that it is given.
    """
    given = [*call.args, *(each.value for each in call.keywords)]
    if SPINS.search(name_of(call.func)):
        return bool(given) and name_of(given[0]) not in others
    return name_of(call.func) in own and any(isinstance(each, ast.Name) and each.id == "self" for each in given)


def _results(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield the results of a check that are made and not returned."""
    for node in walk(tree):
        made = node.value if isinstance(node, ast.Expr) else None
        if isinstance(made, ast.Call) and name_of(made.func) in RESULTS:
            name = ast.unparse(made.func)
            yield made.lineno, f"`{name}(...)` alone neither refuses nor accepts anything: write `return {name}(...)`."


def _unregistered(methods: Collection[Function], *, whole: bool) -> Iterator[tuple[int, str]]:
    """Yield those of these methods that can only be callbacks for parameters; only their checks without `whole`."""
    for method in methods:
        names = [each.arg for each in method.args.args]
        returned = [node.value for node in inside(method) if isinstance(node, ast.Return) and node.value]
        if len(names) != 2 or names[0] != "self":
            continue
        if any(isinstance(each, ast.Call) and name_of(each.func) in RESULTS for each in returned):
            kind, does = "on_set", "returns a SetParametersResult"
        elif not whole or not _reads_parameters(method, names[1]):
            continue
        elif not returned:
            kind, does = "post_set", "looks at the parameters that it is given"
        elif all(name_of(each) == names[1] and isinstance(each, ast.Name) for each in returned):
            kind, does = "pre_set", "returns the parameters that it is given"
        else:
            continue
        how = f"`self.add_{kind}_parameters_callback(self.{method.name})` in `__init__`"
        yield method.lineno, f"'{method.name}' {does}, and nothing calls or registers it: write {how}."


def _never_accepted(methods: Collection[Function]) -> Iterator[tuple[int, str]]:
    """Yield those of these methods that begin an accepted goal, which is given to them."""
    for method in methods:
        given = {each.arg for each in method.args.args[1:]}
        begins = (node for node in inside(method) if isinstance(node, ast.Attribute) and node.attr == "execute")
        if any(name_of(node.value) in given for node in begins):
            what = f"'{method.name}' begins an accepted goal, and nothing calls or registers it: write "
            yield method.lineno, f"{what}`handle_accepted_callback=self.{method.name}` where the ActionServer is made."


def _never_asked(methods: Collection[Function]) -> Iterator[tuple[int, str]]:
    """Yield those of these methods that answer a goal, or its cancel: they return a response of rclpy."""
    for method in methods:
        returned = [node.value for node in inside(method) if isinstance(node, ast.Return)]
        kinds = {name_of(each.value) for each in returned if isinstance(each, ast.Attribute)} & {*ANSWERS}
        for kind in kinds if len(method.args.args) == 2 else ():
            what = f"'{method.name}' returns a {kind}, and nothing calls or registers it: write "
            yield method.lineno, f"{what}`{ANSWERS[kind]}=self.{method.name}` where the ActionServer is made."


def _reads_parameters(method: Function, given: str) -> bool:
    """Return True if a method reads name and value of each of what it is given."""
    for loop in (node for node in inside(method) if isinstance(node, ast.For)):
        if ast.unparse(loop.iter) == given and isinstance(loop.target, ast.Name):
            read = {
                each.attr
                for each in walk(loop)
                if isinstance(each, ast.Attribute) and name_of(each.value) == loop.target.id
            }
            return {"name", "value"} <= read
    return False


def _of_another(cls: ast.ClassDef, idle: Collection[str], own: Collection[str]) -> Iterator[tuple[int, str]]:
    """Yield the services that another method serves than the one that has their name and that nothing uses."""
    for call in calls(cls, "create_service"):
        served, callback = argument(call, 1, "srv_name"), argument(call, 2, "callback")
        name = str(served.value) if isinstance(served, ast.Constant) else ""
        meant = name.rpartition("/")[2]
        if meant in idle and name_of(callback) in own and isinstance(callback, ast.Attribute):
            text = f"{name} is served by `{ast.unparse(callback)}`, and nothing uses the method `{meant}`."
            yield call.lineno, f"{text} Did you mean `self.{meant}`?"
