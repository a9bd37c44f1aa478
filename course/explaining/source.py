"""Finding causes of a program's faults in its text, without running it."""

import ast
import functools
import linecache
import re
import sys
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator
from pathlib import Path
from types import FrameType

from course.foundation.syntax import syntax_tree, walk

# Functions that wait, and the position of the time limit among their arguments.
WAITS = {
    "call": 1,
    "spin": 9,
    "spin_once": 9,
    "spin_until_future_complete": 3,
    "wait_for_server": 0,
    "wait_for_service": 0,
}
# Functions that take a callback, and its position among the arguments.
Function = ast.FunctionDef | ast.AsyncFunctionDef
CALLBACKS = {
    "ActionServer": (3, "execute_callback"),
    "add_done_callback": (0, "fn"),
    "add_on_set_parameters_callback": (0, "callback"),
    "add_post_set_parameters_callback": (0, "callback"),
    "add_pre_set_parameters_callback": (0, "callback"),
    "create_service": (2, "callback"),
    "create_subscription": (2, "callback"),
    "create_timer": (1, "callback"),
}
GROUP = (9, "callback_group")  # in the same form: always given by name
SHORT = 0.5  # s that a callback may sleep without being thought to wait
SLEEPS = "sleeps, waits for input, or loops without end."  # which may end, unlike the other reasons of `blocked`
NOTHING_ELSE = (
    ", in which nothing else runs until the callback returns. Give the client a group of its own: "
    "`create_client(..., callback_group=ReentrantCallbackGroup())`."
)
ONLY_ITS_EXECUTOR = "only its own executor can receive, and the executor is busy with this callback."
WRITE_AWAIT = "write `await client.call_async(...)`"
AWAIT = f" Make it `async def`, {WRITE_AWAIT}, and give the client a callback group of its own."
UNSPUN = "nothing spins `{0}` of line {1}, and `{2}` has one thread: write `{0}.spin()` in its place."
ONE_AT_A_TIME = (
    "The callback group of {0}, without a `callback_group` the node's default one, lets one callback run at a time: "
    "each call begins only when the one before has ended, also while that one waits."
)
ENDS = ("exit", "_exit", "quit")
LOGS = ("sleep", "print", "debug", "info", "warn", "warning", "error")  # calls that change nothing in a loop


def text_at(path: Path) -> str:
    """Return the program's text; '' if its file is gone."""
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""


@functools.lru_cache(maxsize=8)
def parse(source: str) -> ast.Module:
    """Return the program's syntax tree; an empty one if it cannot be parsed.  A cell's shell commands are left out.

    The trees of the last programs are kept, because each look for a mistake asks for one: they must not change.
    """
    return parse_anew(source)


def parse_anew(source: str) -> ast.Module:
    """Return what `parse` does, as a tree of the caller's own."""
    lines = ("" if line.lstrip().startswith(("!", "%")) else line for line in source.splitlines())
    try:
        return syntax_tree("\n".join(lines))
    except (SyntaxError, ValueError):
        return ast.Module([], [])


def is_cell(filename: str) -> bool:
    """Return True if the name of compiled code is that of a notebook's cell."""
    return re.search(r"ipykernel_\d", filename) is not None or filename.startswith("<ipython-input")


def running_cell() -> str:
    """Return the name of the code of the cell that has called this, perhaps through others; '' if none has."""
    frame: FrameType | None = sys._getframe()
    found = ""
    while frame:
        if is_cell(frame.f_code.co_filename):
            found = frame.f_code.co_filename
        frame = frame.f_back
    return found


def cells_run() -> list[str]:
    """Return the texts of the cells that this kernel has run, the newest first."""
    return ["".join(linecache.getlines(file)) for file in reversed(list(linecache.cache)) if is_cell(file)]


def covers(node: ast.expr | ast.stmt, line: int) -> bool:
    """Return True if a line is one of the node's."""
    return node.lineno <= line <= (node.end_lineno or node.lineno)


def functions(tree: ast.AST) -> Iterator[Function]:
    """Yield all functions and methods in a tree."""
    return (node for node in walk(tree) if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)))


def undecorated(made: Iterable[Function]) -> set[str]:
    """Return the names of those of these functions that have no decorator, which may make anything of one."""
    return {each.name for each in made if not each.decorator_list}


def named(tree: ast.AST, names: Collection[str]) -> Iterator[Function]:
    """Yield the functions of these names, but not of a name that several have: a callback may be any of them.

    What a decorator makes of a function is not known, so those that have one are left out, too.
    """
    found = [*functions(tree)]
    count = Counter(function.name for function in found)
    plain = (function for function in found if not function.decorator_list)
    return (function for function in plain if function.name in names and count[function.name] == 1)


def inside(function: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes of a function, without those of the functions inside it."""
    todo = [*ast.iter_child_nodes(function)]
    for node in todo:  # which grows meanwhile
        yield node
        if not isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)):
            todo += ast.iter_child_nodes(node)


def calls(tree: ast.AST, name: str) -> Iterator[ast.Call]:
    """Yield all calls of a function or a method called `name`."""
    return (node for node in walk(tree) if isinstance(node, ast.Call) and name_of(node.func) == name)


def the_method_itself(text: str, so: str = "", arguments: str = "") -> str:
    """Return the remark on a method without its brackets, `text` as it is written; `so` is the consequence."""
    return f"`{text}` is the method itself{so}. Call it: `{text}({arguments})`."


def name_of(node: ast.AST | None) -> str:
    """Return `enable` for `enable` and for `self.enable`; '' for anything else."""
    if isinstance(node, ast.Attribute):
        return node.attr
    return node.id if isinstance(node, ast.Name) else ""


def argument(call: ast.Call, place: int, name: str) -> ast.expr | None:
    """Return an argument of a call, given by position or by name."""
    if len(call.args) > place:
        return call.args[place]
    return next((keyword.value for keyword in call.keywords if keyword.arg == name), None)


def written_number(node: ast.expr | None) -> float | None:
    """Return a number that is written out; None for anything else, and for a whole number larger than any float."""
    value = node.value if isinstance(node, ast.Constant) else None
    try:
        return float(value) if isinstance(value, (int, float)) else None
    except OverflowError:
        return None


def signed_number(node: ast.expr | None) -> float | None:
    """Return a number that is written out, perhaps with a sign; None as for `written_number`."""
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.UAdd, ast.USub)):
        number = written_number(node.operand)
        return -number if number is not None and isinstance(node.op, ast.USub) else number
    return written_number(node)


def assigned(node: ast.Assign) -> Iterator[tuple[ast.expr, ast.expr]]:
    """Yield each target of an assignment with its value: of `a, b = 1, 2` two, of `a, b = pair` the target as it is."""
    for target in node.targets:
        if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
            yield from zip(target.elts, node.value.elts, strict=False)
        else:
            yield target, node.value


def last_parameter(function: ast.FunctionDef | ast.AsyncFunctionDef) -> str:
    """Return the name of a function's last parameter, as of the response of a service callback; '' without any."""
    return function.args.args[-1].arg if function.args.args else ""


def made_at(source: str, maker: str, name: str) -> int:
    """Return the line of a call of `maker`, such as `create_publisher`, with the name `name`; 0 if there is none."""
    for call in calls(parse(source), maker):
        given = [*call.args, *(keyword.value for keyword in call.keywords)]
        if any(str(getattr(each, "value", "")).lstrip("/~") == name.lstrip("/") for each in given):
            return call.lineno
    return 0


def without_global(tree: ast.Module) -> Iterator[tuple[ast.FunctionDef | ast.AsyncFunctionDef, ast.Name, int, bool]]:
    """Yield each function that sets a variable of its own, whose name also a variable of the whole text has.

    Another function reads the latter.  Yields the function, the name where it is set first, the line that sets the
    variable of the whole text, and True if the function also reads its own.
    """
    made = {
        each.id: statement.lineno
        for statement in tree.body
        if isinstance(statement, ast.Assign)
        for each in statement.targets
        if isinstance(each, ast.Name)
    }
    names = {function: [node for node in walk(function) if isinstance(node, ast.Name)] for function in functions(tree)}
    stored = {
        function: {node.id for node in used if not isinstance(node.ctx, ast.Load)} for function, used in names.items()
    }
    for function, used in names.items():
        nodes = [*walk(function)]
        known = {node.arg for node in nodes if isinstance(node, ast.arg)}
        known |= {name for node in nodes if isinstance(node, (ast.Global, ast.Nonlocal)) for name in node.names}
        here = {ast.unparse(node.targets[0]) for node in inside(function) if isinstance(node, ast.Assign)}
        for name in sorted(stored[function] & here & {*made} - known):
            others = [other for other in names if other is not function and name not in stored[other]]
            if any(node.id == name for other in others for node in names[other]):
                own = [node for node in used if node.id == name]
                first = min((node for node in own if not isinstance(node.ctx, ast.Load)), key=lambda node: node.lineno)
                yield function, first, made[name], any(isinstance(node.ctx, ast.Load) for node in own)


def service_callbacks(tree: ast.AST, service: str = "") -> set[str]:
    """Return the names of the service callbacks; with `service`, of that one, or of all if its name is not found."""
    found: dict[str, str] = {}
    for call in calls(tree, "create_service"):
        served = argument(call, 1, "srv_name")
        name = str(served.value).lstrip("/") if isinstance(served, ast.Constant) else ""
        if callback := name_of(argument(call, *CALLBACKS["create_service"])):
            found[callback] = name
    own = {callback for callback, name in found.items() if name == service.lstrip("/")}
    return own or set(found)


def answering(source: str, name: str) -> set[str]:
    """Return the names of the callbacks that answer requests to the service or goals of the action `name`."""
    tree = parse(source)
    found: set[str] = set()
    for call in (*calls(tree, "create_service"), *calls(tree, "ActionServer")):
        given = [*call.args, *(keyword.value for keyword in call.keywords)]
        texts = [str(each.value).lstrip("/") for each in given if isinstance(each, ast.Constant)]
        if name.lstrip("/") in texts:
            found |= {*map(name_of, given)} - {""}
    if name.rpartition("/")[2] in ("set_parameters", "set_parameters_atomically"):
        found |= parameter_callbacks(tree)
    return found & {function.name for function in functions(tree)}


def blocked(
    source: str,
    service: str,
    callback: str = "",
    *,
    threads: int = 1,
    is_served: Callable[[str], object] = lambda name: True,
    one_group: bool | None = None,
) -> str:
    """Return why the callback of `service` may never answer, judging by its text, or ''.

    `callback` is its name, if known, and `threads` those of its executor, if the text makes none.  `is_served` tells
    whether a service is there, and `one_group`, if known, whether a client is in the callback's own exclusive group.
    """
    idle_one = unspun_executor(source)
    several = threads > 1 or ("ThreadedExecutor(" in source and not idle_one)
    tree = parse(source)
    one_group = _one_group(tree) if one_group is None else one_group
    names = {callback} if callback else service_callbacks(tree, service)
    for function in named(tree, names):
        waits_for_a_server = [*calls(function, "wait_for_service"), *calls(function, "wait_for_server")]
        for asked, line in _asked(tree, function) if not waits_for_a_server else ():
            if "namespace" not in source and not is_served(asked):
                return f"its callback '{function.name}' asks {asked} in line {line}, and no node serves that."
        for name, place in WAITS.items():
            for call in calls(function, name):
                if argument(call, place, "timeout_sec") is not None or _own(tree, function, call):
                    continue
                if name.startswith("spin") and isinstance(argument(call, 0, "node"), ast.Attribute):
                    continue  # another node, `self.helper`
                if name in ("wait_for_server", "wait_for_service"):
                    return (
                        f"its callback '{function.name}' waits in line {call.lineno}, `{ast.unparse(call)}`, without "
                        "a limit, until there is a server. Check `service_is_ready()` of the client instead "
                        "(`server_is_ready()` for an action), which does not wait."
                    )
                waits = f"its callback '{function.name}' waits in `{ast.unparse(call.func)}(...)` for a response that"
                if name == "call" and several:
                    if one_group:
                        return f"{waits} comes to a client in its own callback group{NOTHING_ELSE}"
                    continue
                how = f" N{UNSPUN.format(*idle_one)[1:]}" if idle_one else _how_to_await(function, one_group)
                return f"{waits} {ONLY_ITS_EXECUTOR}{how}"
        if line := next((line for asked, line in _asked(tree, function) if asked == f"/{service.lstrip('/')}"), 0):
            return (
                f"its callback '{function.name}' calls {service}, its own service, in line {line}, and so waits for "
                "itself. Give the client the name of another service."
            )
        if _awaits(function) and one_group:
            return f"its callback '{function.name}' awaits a client in its own callback group{NOTHING_ELSE}"
        if loop := _awaits_in_a_loop(function):
            waits = f"its callback '{function.name}' waits in line {loop.lineno}, `while {ast.unparse(loop.test)}`,"
            if [*calls(loop, "spin_once"), *calls(loop, "spin_until_future_complete")]:
                why = "and spins its node there, which takes the node from the executor that spins it."
            else:
                why = f"for a response that {ONLY_ITS_EXECUTOR}"
            return f"{waits} {why}{_how_to_await(function, one_group)}"
        if _sleeps(function) or _endless(function):
            return f"its callback '{function.name}' {SLEEPS}"
    return ""


def _how_to_await(function: Function, one_group: bool) -> str:
    """Return what is still to be done so that a callback awaits its client, as a sentence."""
    if not isinstance(function, ast.AsyncFunctionDef):
        return AWAIT if one_group else f" Make it `async def`, and {WRITE_AWAIT}."
    own = ", and give the client a callback group of its own" if one_group else ""
    return f" {WRITE_AWAIT.capitalize()}{own}."


def endless_looks(tree: ast.AST) -> Iterator[ast.While]:
    """Yield the loops that look for a server until one comes, and do nothing else."""
    for loop in (node for node in walk(tree) if isinstance(node, ast.While)):
        asked = [each for each in getattr(loop.test, "values", [loop.test]) if ast.unparse(each) != "rclpy.ok()"]
        looks = asked[0].operand if len(asked) == 1 and isinstance(asked[0], ast.UnaryOp) else None
        is_one = isinstance(looks, ast.Call) and name_of(looks.func) in ("wait_for_service", "wait_for_server")
        joined = isinstance(loop.test, ast.BoolOp) and isinstance(loop.test.op, ast.Or)
        if is_one and not joined and all(map(changes_nothing, loop.body)):
            yield loop


def changes_nothing(statement: ast.stmt) -> bool:
    """Return True for a statement that changes nothing in a loop, such as a log."""
    if isinstance(statement, ast.Expr):
        call = statement.value
        return isinstance(call, ast.Constant) or (isinstance(call, ast.Call) and name_of(call.func) in LOGS)
    return isinstance(statement, (ast.Pass, ast.Continue))


def _sleeps(function: ast.AST) -> bool:
    """Return True if a function waits for input, or sleeps, but not for one sleep that is written out and short."""
    awaited = [node.value for node in walk(function) if isinstance(node, ast.Await)]
    loops = [node for node in walk(function) if isinstance(node, (ast.For, ast.While))]
    repeated = [call for loop in loops for call in calls(loop, "sleep")]
    for call in {*calls(function, "sleep")} - {*awaited}:
        lasts = getattr(call.args[0], "value", None) if call.args else None
        if call in repeated or not isinstance(lasts, (int, float)) or lasts >= SHORT:
            return True
    return next(calls(function, "input"), None) is not None


def one_at_a_time(source: str, service: str) -> int:
    """Return the line that makes `service` in an exclusive callback group, if its callback waits; 0 if there is none.

    In such a group, as the node's default one is, each call of it begins only when the one before has ended.
    """
    tree = parse(source)
    awaiting = {each.name for each in functions(tree) if _awaits(each) or next(calls(each, "call"), None)}
    line = made_at(source, "create_service", service)
    made = next((call for call in calls(tree, "create_service") if call.lineno == line), None)
    if made is None or name_of(argument(made, *CALLBACKS["create_service"])) not in awaiting:
        return 0
    exclusive = "MutuallyExclusiveCallbackGroup(" in _group(made) or _is_exclusive(tree, _group(made))
    return line if exclusive else 0


def _awaits(function: ast.AST) -> bool:
    return any(isinstance(node, ast.Await) for node in walk(function))


def _awaits_in_a_loop(function: ast.AST) -> ast.While | None:
    """Return the loop in which a function polls for the answer to its request."""
    if not list(calls(function, "call_async")):
        return None
    loops = (node for node in walk(function) if isinstance(node, ast.While) and not _awaits(node))
    return next((each for each in loops if [*calls(each.test, "done"), *calls(each.test, "result")]), None)


def _asked(tree: ast.AST, function: ast.AST) -> Iterator[tuple[str, int]]:
    """Yield the services that a function calls by clients of the program, as `/add`, with the lines of the calls."""
    clients: dict[str, str] = {}
    for node in walk(tree):
        if (
            isinstance(node, ast.Assign)
            and isinstance(node.value, ast.Call)
            and name_of(node.value.func) == "create_client"
        ):
            name = argument(node.value, 1, "srv_name")
            if isinstance(name, ast.Constant):
                clients |= {name_of(target): f"/{str(name.value).lstrip('/')}" for target in node.targets}
    for call in (*calls(function, "call_async"), *calls(function, "call")):
        if (owner := name_of(getattr(call.func, "value", None))) in clients:
            yield clients[owner], call.lineno


def _own(tree: ast.AST, function: ast.AST, call: ast.Call) -> bool:
    """Return True if a call in a function is awaited, or is of the program's own function: it is not rclpy's."""
    awaited = any(isinstance(node, ast.Await) and node.value is call for node in walk(function))
    own = isinstance(call.func, ast.Name) or name_of(getattr(call.func, "value", None)) == "self"
    return awaited or (own and name_of(call.func) in {each.name for each in functions(tree)})


def _one_group(tree: ast.AST) -> bool:
    """Return True if services and clients are made without a callback group, or all in the same exclusive one."""
    groups = {_group(call) for call in (*calls(tree, "create_service"), *calls(tree, "create_client"))}
    return len(groups) == 1 and _is_exclusive(tree, groups.pop())


def _is_exclusive(tree: ast.AST, group: str) -> bool:
    """Return True for the text of an exclusive callback group, or of none, which is the node's default one."""
    name = group.lstrip("*")
    made = [
        ast.unparse(node.value)
        for node in walk(tree)
        if isinstance(node, ast.Assign)
        for target in node.targets
        if ast.unparse(target) == name
    ]
    return not name or (bool(made) and all("MutuallyExclusiveCallbackGroup(" in each for each in made))


def _group(call: ast.Call) -> str:
    """Return the callback group of an endpoint, or the dict that may hold it (`**options`), as written; '' for none."""
    unpacked = (f"**{ast.unparse(each.value)}" for each in call.keywords if each.arg is None)
    given = argument(call, *GROUP)
    return ast.unparse(given) if given else next(unpacked, "")


def _endless(function: ast.AST) -> bool:
    """Return True if a function has a loop that nothing in it ends."""
    loops = (node for node in walk(function) if isinstance(node, ast.While))
    return any(
        isinstance(loop.test, ast.Constant)
        and loop.test.value
        and not any(isinstance(node, (ast.Break, ast.Return, ast.Raise)) for node in walk(loop))
        for loop in loops
    )


def exits(source: str) -> str:
    """Return the function, other than `main`, that exits the program; '' if none does."""
    for function in functions(parse(source)):
        raised = (node.exc for node in walk(function) if isinstance(node, ast.Raise) and node.exc)
        ended = any(name_of(getattr(error, "func", error)) == "SystemExit" for error in raised)
        if function.name != "main" and (ended or any(list(calls(function, name)) for name in ENDS)):
            return function.name
    return ""


def ends_its_node(source: str) -> tuple[str, int, str] | None:
    """Return a method that destroys its node or shuts rclpy down: its name, the line, and the call; None if none does.

    A method that nobody could pass as a callback is not looked at: `main`, and those that spin, or begin with `_`.
    """
    classes = (node for node in walk(parse(source)) if isinstance(node, ast.ClassDef))
    for function in (each for node in classes for each in functions(node)):
        if function.name == "main" or function.name.startswith("_") or next(calls(function, "spin"), None):
            continue
        for name in ("shutdown", "try_shutdown", "destroy_node"):
            for call in calls(function, name):
                of = ast.unparse(call.func).rpartition(".")[0]
                if of in (("self",) if name == "destroy_node" else ("rclpy", "self.context")):
                    return function.name, call.lineno, ast.unparse(call)
    return None


OUTCOMES: dict[type[ast.cmpop], str] = {ast.Eq: "false", ast.Is: "false", ast.NotEq: "true", ast.IsNot: "true"}


def outcome(node: ast.AST) -> str:
    """Return what the comparison of two values that are never equal always is, 'false' or 'true'; else ''."""
    single = isinstance(node, ast.Compare) and len(node.ops) == 1
    return OUTCOMES.get(type(node.ops[0]), "") if single else ""  # type: ignore[attr-defined]


def node_classes(tree: ast.AST) -> list[ast.ClassDef]:
    """Return the classes that are derived from Node itself."""
    return [node for node in walk(tree) if isinstance(node, ast.ClassDef) and "Node" in map(name_of, node.bases)]


AGAIN = (ast.For, ast.While, ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)


def makes_one_node(source: str) -> bool:
    """Return True if a program's text makes a single node: by one class of it or one call, outside of a loop."""
    tree = parse(source)
    classes = node_classes(tree)
    made = [call for name in ("Node", "create_node", *(each.name for each in classes)) for call in calls(tree, name)]
    several = (node for node in walk(tree) if isinstance(node, AGAIN))
    return len(classes) <= 1 == len(made) and not any(made[0] in walk(each) for each in several)


def without_self(source: str) -> set[str]:
    """Return the names of the methods whose first parameter is not `self`, without static and class methods."""
    classes = (node for node in walk(parse(source)) if isinstance(node, ast.ClassDef))
    plain = [each for node in classes for each in functions_of(node) if not each.decorator_list]
    return {each.name for each in plain if not _begins_with_self(each)}


def _begins_with_self(function: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    return [argument.arg for argument in function.args.args[:1]] == ["self"]


def methods(source: str) -> set[str]:
    """Return the names of all methods of the program's classes."""
    classes = (node for node in walk(parse(source)) if isinstance(node, ast.ClassDef))
    return {function.name for node in classes for function in functions(node)}


def misspelt_init(source: str, cls: str = "") -> str:
    """Return the method with a misspelt `__init__`, such as `_init_` or `__int__`; '' if there is none.

    Looks in the class `cls`, or in all classes.
    """
    for node in walk(parse(source)):
        if isinstance(node, ast.ClassDef) and cls in ("", node.name):
            names = [method.name for method in functions(node)]
            wrong = [
                name
                for name in names
                if name in ("_init_", "__init", "init__", "_init__", "__init_", "__int__", "init")
            ]
            if wrong and "__init__" not in names:
                return wrong[0]
    return ""


def outside_of_its_class(name: str, source: str) -> tuple[int, str] | None:
    """Return the line of a function `name` with a `self` that is in no class, and the function around it ('' for none).

    None if there is no such function, or a method of this name as well.
    """
    tree = parse(source)
    if name in {each.name for node in walk(tree) if isinstance(node, ast.ClassDef) for each in functions_of(node)}:
        return None
    around = {each: function.name for function in functions(tree) for each in functions(function) if each != function}
    for each in functions(tree):
        if each.name == name and _begins_with_self(each):
            return each.lineno, around.get(each, "")
    return None


def functions_of(node: ast.ClassDef) -> list[ast.FunctionDef | ast.AsyncFunctionDef]:
    """Return the methods of a class, without the functions inside them."""
    return [each for each in node.body if isinstance(each, (ast.FunctionDef, ast.AsyncFunctionDef))]


def callbacks(tree: ast.AST) -> set[str]:
    """Return the names of the functions that a text gives to rclpy as callbacks; '' for what has no name."""
    return {name_of(given) for _, given in given_callbacks(tree)}


def given_callbacks(tree: ast.AST) -> Iterator[tuple[ast.Call, ast.expr | None]]:
    """Yield each call that gives a callback to rclpy, and what it gives; None if that is not to be seen."""
    return ((call, argument(call, *place)) for maker, place in CALLBACKS.items() for call in calls(tree, maker))


def spins_in_a_callback(source: str) -> ast.Call | None:
    """Return a call by which a callback spins its own node; or None."""
    tree = parse(source)
    names = callbacks(tree) - {""}
    called = [*named(tree, names)]
    helpers = {name_of(node.func) for each in called for node in walk(each) if isinstance(node, ast.Call)}
    for function in (*called, *named(tree, helpers - names)):
        for call in (node for node in walk(function) if isinstance(node, ast.Call)):
            if name_of(call.func).startswith("spin") and name_of(argument(call, 0, "node")) == "self":
                return call
    return None


def spins_once(source: str) -> ast.Call | None:
    """Return the call of `spin_once` with which a program spins, if that is outside of a loop and the only one."""
    tree = parse(source)
    spins = [node for node in walk(tree) if isinstance(node, ast.Call) and "spin" in name_of(node.func)]
    loops = (node for node in walk(tree) if isinstance(node, (ast.For, ast.While)))
    repeated = any(spins[0] in walk(loop) for loop in loops) if spins else False
    return spins[0] if len(spins) == 1 and name_of(spins[0].func) == "spin_once" and not repeated else None


def set_on_self(tree: ast.AST) -> Iterator[ast.Attribute]:
    """Yield the attributes that a text sets on `self`: `self.enabled = False`."""
    for node in walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store) and name_of(node.value) == "self":
            yield node


def hidden_method(source: str, name: str = "") -> tuple[str, int] | None:
    """Return the method (`name`, or any) that an attribute hides, and the line: `self.enable = False`, `def enable`."""
    for made in (node for node in walk(parse(source)) if isinstance(node, ast.ClassDef)):
        stored: dict[str, int] = {}
        for node in set_on_self(made):
            stored[node.attr] = min(node.lineno, stored.get(node.attr, node.lineno))
        for each in functions_of(made):
            if each.name in stored and not each.decorator_list and name in ("", each.name):
                return each.name, stored[each.name]
    return None


def spins_a_class(source: str) -> tuple[str, str, int] | None:
    """Return a call that spins a class of the program in place of a node of it: the call, the class, and the line."""
    tree = parse(source)
    classes = {node.name for node in walk(tree) if isinstance(node, ast.ClassDef)}
    for name in ("spin", "spin_once", "spin_until_future_complete", "add_node"):
        for call in calls(tree, name):
            if call.args and name_of(call.args[0]) in classes:
                return ast.unparse(call.func), name_of(call.args[0]), call.lineno
    return None


def called_callback(source: str) -> tuple[str, int] | None:
    """Return the method that is called where it should be passed as a callback, and the line of the call."""
    tree = parse(source)
    own = methods(source) - _makers(tree)
    for _, given in given_callbacks(tree):
        if not isinstance(given, ast.Call) or given.args or given.keywords:
            continue  # what takes arguments may make the callback
        if name_of(given.func) in own:
            return name_of(given.func), given.lineno
    return None


def value_for_callback(source: str, kind: str) -> tuple[str, int] | None:
    """Return an attribute of the node that is given as a callback though it holds a value of the type `kind`, such as
    `bool`, and the line; None unless the class, and the function that gives it, set it to nothing else.
    """
    for made in (node for node in walk(parse(source)) if isinstance(node, ast.ClassDef)):
        for function in functions_of(made):
            for _, given in given_callbacks(function):
                if name_of(getattr(given, "value", None)) != "self" or not isinstance(given, ast.Attribute):
                    continue
                held = _set_to(ast.unparse(given), inside(function)) | _set_to(given.attr, made.body)
                if held == {kind} and given.attr not in methods(source):
                    return given.attr, given.lineno
    return None


def _set_to(name: str, nodes: Iterable[ast.AST]) -> set[str]:
    """Return the types of the values that statements give to a name; '' for one that is not written out."""
    found = []
    for node in nodes:
        if isinstance(node, ast.Assign):
            found += [value for target, value in assigned(node) if ast.unparse(target) == name]
        elif isinstance(node, ast.AnnAssign) and node.value and ast.unparse(node.target) == name:
            found.append(node.value)
    return {_written_type(value) for value in found}


def _written_type(value: ast.expr) -> str:
    try:
        return type(ast.literal_eval(value)).__name__
    except ValueError:
        return ""


def response_for_callback(source: str, kind: str) -> tuple[str, int] | None:
    """Return a response of an action's server that is given as a callback, `cancel_callback=CancelResponse.ACCEPT`.

    In the form of `value_for_callback`; `kind` is the name of its class.
    """
    for node in (each for each in walk(parse(source)) if isinstance(each, ast.keyword)):
        given = node.value if node.arg in ("cancel_callback", "goal_callback") else None
        if isinstance(given, ast.Attribute) and name_of(given.value) == kind:
            return given.attr, given.lineno
    return None


def _makers(tree: ast.AST) -> set[str]:
    """Return the names of the functions that make a function, and may return it."""
    made = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)
    found = functions(tree)
    return {each.name for each in found if any(isinstance(node, made) for node in walk(each) if node is not each)}


def wrong_return(source: str) -> tuple[str, int, str] | None:
    """Return a service callback that may not return its response: its name, a line, and its return value or ''.

    In place of the value is the assignment, `response = {...}`, that replaces the response.  None if all callbacks
    return theirs, judging by their text.
    """
    tree = parse(source)
    types = {
        name_of(argument(call, *CALLBACKS["create_service"])): name_of(argument(call, 0, "srv_type"))
        for call in calls(tree, "create_service")
    }
    for function in named(tree, service_callbacks(tree)):
        returned = [node.value for node in inside(function) if isinstance(node, ast.Return) and node.value]
        if not returned:
            return function.name, function.lineno, ""
        response = last_parameter(function)
        bare = [node.lineno for node in inside(function) if isinstance(node, ast.Return) and node.value is None]
        if bare or runs_out(function.body):
            return function.name, (bare or [function.lineno])[0], ""
        request = "".join(each.arg for each in function.args.args[-2:-1] if each.arg != "self")
        for value in returned:
            other = _is_no_response(value) and name_of(value) != response
            kept = isinstance(value, ast.Name) and value.id != response and _holds_no_response(function, value.id)
            held = _assigned(function, value.id) if isinstance(value, ast.Name) else []
            made = [value, *(each.value for each in held)]
            wrong = [each for each in made if _response_of(each) not in ("", types.get(function.name))]
            if wrong and len(made) < 3:  # the value itself, or all that its name holds
                return function.name, wrong[0].lineno, ast.unparse(wrong[0])
            if other or kept or (isinstance(value, ast.Name) and value.id == request):
                return function.name, value.lineno, ast.unparse(value)
            if held and name_of(value) == response and _holds_no_response(function, response):
                return function.name, held[0].lineno, ast.unparse(held[0])
    return None


def _assigned(function: ast.AST, name: str) -> list[ast.Assign]:
    """Return the assignments to a name in a function."""
    found = (node for node in walk(function) if isinstance(node, ast.Assign))
    return [node for node in found if any(isinstance(each, ast.Name) and each.id == name for each in node.targets)]


def _response_of(value: ast.expr) -> str:
    """Return `Trigger` for `Trigger.Response(...)`, and '' for anything else."""
    made = value.func if isinstance(value, ast.Call) else None
    return name_of(made.value) if isinstance(made, ast.Attribute) and made.attr == "Response" else ""


NO_RESPONSES = (  # expressions whose value is no response
    *(ast.Attribute, ast.Constant, ast.BinOp, ast.Compare, ast.JoinedStr, ast.UnaryOp),
    *(ast.Dict, ast.DictComp, ast.List, ast.ListComp, ast.Set, ast.SetComp, ast.Tuple, ast.GeneratorExp),
)
OF_PYTHON = ("bool", "dict", "float", "int", "list", "set", "str", "tuple")
OTHER_PARTS = ("Request", "Goal", "Result", "Feedback")  # of an interface


def _is_no_response(value: ast.expr) -> bool:
    if isinstance(value, ast.Call):
        made = isinstance(value.func, ast.Name) and value.func.id in OF_PYTHON
        return made or (isinstance(value.func, ast.Attribute) and value.func.attr in OTHER_PARTS)
    return isinstance(value, NO_RESPONSES)


def _holds_no_response(function: ast.AST, name: str) -> bool:
    """Return True if nothing that a function assigns to a name is a response."""
    stored = [
        node
        for node in walk(function)
        if isinstance(node, ast.Name) and node.id == name and isinstance(node.ctx, ast.Store)
    ]
    given = [node.value for node in _assigned(function, name)]
    plain = all(_is_no_response(value) and not isinstance(value, ast.Attribute) for value in given)
    return bool(given) and len(given) == len(stored) and plain


def defined(error: str, source: str) -> tuple[str, int] | None:
    """Return the function that was called with the wrong number of arguments, and the line of its `def`."""
    found = re.search(r"(\w+)\(\) (?:takes|missing) .*positional argument", error)
    made = (function for function in functions(parse(source)) if found and function.name == found[1])
    return next(((function.name, function.lineno) for function in made if function.name != "__init__"), None)


def no_result(source: str) -> tuple[str, int] | None:
    """Return the name of an execute callback whose last line is not a `return`, and the line of its `def`."""
    tree = parse(source)
    names = {name_of(argument(call, *CALLBACKS["ActionServer"])) for call in calls(tree, "ActionServer")}
    for function in named(tree, names):
        if not isinstance(function.body[-1], (ast.Return, ast.Raise)):
            return function.name, function.lineno
    return None


def wrong_result(source: str) -> tuple[str, int, str] | None:
    """Return the name of a parameter callback that does not return a result, a line, and its return value or ''.

    None if all do, judging by their text.
    """
    tree = parse(source)
    where = CALLBACKS["add_on_set_parameters_callback"]
    return _plain_return(
        tree, {name_of(argument(call, *where)) for call in calls(tree, "add_on_set_parameters_callback")}
    )


def swapped_callbacks(source: str) -> tuple[str, int, str, int] | None:
    """Return an on-set callback that returns nothing and a post-set callback that returns the result of a check.

    Their names, and the lines that register them; None unless the text shows both.
    """
    acts, _ = _acting_and_checking(source, "add_on_set_parameters_callback")
    _, checks = _acting_and_checking(source, "add_post_set_parameters_callback")
    return (*acts[0], *checks[0]) if acts and checks else None


def second_check(source: str) -> tuple[str, int, str] | None:
    """Return an on-set callback that returns nothing, its line, and another one that returns the result of a check.

    None unless the text shows both, and no post-set callback: the first is meant as that.
    """
    acts, checks = _acting_and_checking(source, "add_on_set_parameters_callback")
    if not acts or not checks or parameter_callbacks(parse(source), "add_post_set_parameters_callback"):
        return None
    return (*acts[0], checks[0][0])


def _acting_and_checking(source: str, maker: str) -> tuple[list[tuple[str, int]], list[tuple[str, int]]]:
    """Return the callbacks given to `maker` that return nothing, and those that return a result, with their lines."""
    tree = parse(source)
    given = [(name_of(argument(call, *CALLBACKS[maker])), call.lineno) for call in calls(tree, maker)]
    answers = {
        each.name: [node.value for node in inside(each) if isinstance(node, ast.Return) and node.value]
        for each in named(tree, {name for name, _ in given})
    }
    acts = [each for each in given if answers.get(each[0]) == []]
    checks = [
        each
        for each in given
        if any(
            isinstance(value, ast.Call) and name_of(value.func) == "SetParametersResult"
            for value in answers.get(each[0], ())
        )
    ]
    return acts, checks


def parameter_callbacks(tree: ast.AST, *makers: str) -> set[str]:
    """Return the names of the parameter callbacks, registered by these `makers` or by any."""
    wanted = makers or tuple(name for name in CALLBACKS if name.endswith("_parameters_callback"))
    return {name_of(argument(call, *CALLBACKS[maker])) for maker in wanted for call in calls(tree, maker)}


def no_list(source: str) -> tuple[str, int, str] | None:
    """Return a pre-set callback that does not return the list of parameters, in the form of `wrong_result`."""
    tree = parse(source)
    names = parameter_callbacks(tree, "add_pre_set_parameters_callback")
    for function in named(tree, names):
        for node in inside(function):
            if isinstance(node, ast.Return) and name_of(getattr(node.value, "func", None)) == "SetParametersResult":
                return function.name, node.lineno, ast.unparse(node.value)  # type: ignore[arg-type]
    return _plain_return(tree, names)


def hides_rclpy(source: str, names: Iterable[str]) -> tuple[str, int] | None:
    """Return an attribute with one of these names that a class sets, `self._parameters = {}`, and the line."""
    wanted = set(names)
    return next(((node.attr, node.lineno) for node in set_on_self(parse(source)) if node.attr in wanted), None)


def wrong_cancel(source: str) -> tuple[str, int, str] | None:
    """Return a cancel callback that does not return a CancelResponse, in the form of `wrong_result`."""
    tree = parse(source)
    names = {name_of(argument(call, 10, "cancel_callback")) for call in calls(tree, "ActionServer")}
    for function in named(tree, names):
        for node in inside(function):
            if isinstance(node, ast.Return) and name_of(getattr(node.value, "value", None)) == "GoalResponse":
                return function.name, node.lineno, ast.unparse(node.value)  # type: ignore[arg-type]
    return _plain_return(tree, names)


def unanswered(source: str) -> Iterator[tuple[str, int, str]]:
    """Yield the service callbacks that return nothing on any path: name, line, and the name of the response."""
    tree = parse(source)
    for function in named(tree, service_callbacks(tree)):
        nodes = [*inside(function)]
        returned = any(isinstance(node, ast.Return) and node.value is not None for node in nodes)
        ends = any(isinstance(node, (ast.Raise, ast.Yield, ast.While)) for node in nodes)
        if not returned and not ends and len(function.args.args) > 1:
            yield function.name, function.lineno, function.args.args[-1].arg


def _plain_return(tree: ast.Module, names: set[str]) -> tuple[str, int, str] | None:
    """Return the first function of these names that returns nothing, a constant or a truth value."""
    for function in named(tree, names):
        for node in inside(function):
            if isinstance(node, ast.Return) and (node.value is None or _is_plain(node.value)):
                return function.name, node.lineno, ast.unparse(node.value) if node.value else ""
        if runs_out(function.body):
            return function.name, function.lineno, ""
    return None


def _is_plain(value: ast.expr) -> bool:
    """Return True for a constant and a truth value, also as the last part of `a and b`."""
    if isinstance(value, ast.BoolOp):
        return _is_plain(value.values[-1])
    return isinstance(value, (ast.Constant, ast.Compare, ast.UnaryOp))


def runs_out(body: list[ast.stmt]) -> bool:
    """Return True if the end of these statements may be reached without a `return`."""
    last = body[-1]
    if isinstance(last, ast.If):
        return not last.orelse or runs_out(last.body) or runs_out(last.orelse)
    if isinstance(last, (ast.With, ast.AsyncWith)):
        return runs_out(last.body)
    if isinstance(last, (ast.For, ast.AsyncFor)) and last.orelse:
        return any(isinstance(node, ast.Break) for node in inside(last)) or runs_out(last.orelse)
    if isinstance(last, ast.Try):
        ends = [last.orelse or last.body, *(handler.body for handler in last.handlers)]
        return runs_out(last.finalbody or [ast.Pass()]) and any(map(runs_out, ends))
    return not isinstance(last, (ast.Return, ast.Raise, ast.While, ast.Match))


def may_return_nothing(function: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    """Return True if the end of a function may be reached without a `return` with a value."""
    returned = [node for node in inside(function) if isinstance(node, ast.Return)]
    return runs_out(function.body) or any(node.value is None for node in returned)


def never_begins(source: str) -> tuple[str, int] | None:
    """Return the name (or the text) of a `handle_accepted_callback` that never executes the goal, and its line."""
    tree = parse(source)
    name = "handle_accepted_callback"
    given = [argument(call, 9, name) for call in calls(tree, "ActionServer")]
    given += [
        each.value for node in walk(tree) if isinstance(node, ast.Call) for each in node.keywords if each.arg == name
    ]
    bare = {id(node.value) for node in bare_statements(tree)} | {id(each.body) for each in _named_alone(given)}
    begins = any(
        isinstance(node, ast.Attribute)
        and node.attr == "execute"
        and name_of(node.value) != "self"
        and id(node) not in bare
        for node in walk(tree)
    )
    for each in given if not begins else ():
        if isinstance(each, ast.Lambda) and (each in _named_alone(given) or not _keeps(each)):
            return ast.unparse(each), each.lineno
    names = {name_of(each) for each in given if each is not None}
    found = (function for function in named(tree, names) if not begins and not list(calls(function, "super")))
    return next(((function.name, function.lineno) for function in found), None)


def _named_alone(given: Iterable[ast.expr | None]) -> list[ast.Lambda]:
    """Return the functions among these that only name the method: `lambda goal_handle: goal_handle.execute`."""
    return [each for each in given if isinstance(each, ast.Lambda) and name_of(each.body) == "execute"]


def _runs_itself(tree: ast.Module, name: str) -> ast.Call | None:
    """Return the call, in the function `name`, of the program's own execute callback; None if there is none."""
    executes = {name_of(argument(call, 3, "execute_callback")) for call in calls(tree, "ActionServer")} - {""}
    return next((call for made in named(tree, {name}) for each in executes for call in calls(made, each)), None)


def _keeps(function: ast.Lambda) -> bool:
    """Return True if a lambda hands its argument on to something that may keep it."""
    names = {each.arg for each in function.args.args}
    shown = isinstance(function.body, ast.Call) and name_of(function.body.func) in ("print", "info")
    return not shown and any(isinstance(each, ast.Name) and each.id in names for each in walk(function.body))


def bare_statements(tree: ast.AST) -> Iterator[ast.Expr]:
    """Yield the statements that only name an attribute, such as `goal_handle.execute`."""
    return (node for node in walk(tree) if isinstance(node, ast.Expr) and isinstance(node.value, ast.Attribute))


def empty_executor(source: str) -> tuple[str, int] | None:
    """Return the call that spins an executor to which a program adds no node, and its line; None if none does."""
    tree = parse(source)
    if "add_node" in source or any(isinstance(node, ast.Attribute) and node.attr == "executor" for node in walk(tree)):
        return None
    made = {
        ast.unparse(target)
        for node in walk(tree)
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Call)
        if name_of(node.value.func) in ("MultiThreadedExecutor", "SingleThreadedExecutor")
        for target in node.targets
    }
    handed = {
        ast.unparse(each)
        for node in walk(tree)
        if isinstance(node, ast.Call)
        for each in (*node.args, *(keyword.value for keyword in node.keywords))
    }
    for call in calls(tree, "spin"):
        if isinstance(call.func, ast.Attribute) and ast.unparse(call.func.value) in made - handed:
            return ast.unparse(call), call.lineno
    return None


def unspun_executor(source: str) -> tuple[str, int, str] | None:
    """Return an executor with several threads that nothing spins, its line, and the spin that uses another one.

    None unless the text shows it: the executor is given a node, and used for nothing else.
    """
    tree = parse(source)
    spins = [call for call in calls(tree, "spin") if ast.unparse(call.func) == "rclpy.spin"]
    if len(spins) != 1 or len(spins[0].args) + len(spins[0].keywords) != 1:
        return None
    for node in walk(tree):
        made = node.value if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name) else None
        if not isinstance(made, ast.Call) or name_of(made.func) != "MultiThreadedExecutor":
            continue
        name = ast.unparse(node.targets[0])  # type: ignore[attr-defined]
        used = [each.attr for each in walk(tree) if isinstance(each, ast.Attribute) and name_of(each.value) == name]
        named_there = [each for each in walk(tree) if isinstance(each, ast.Name) and each.id == name]
        if "add_node" in used and {*used} <= {"add_node", "shutdown"} and len(named_there) == len(used) + 1:
            return name, node.lineno, ast.unparse(spins[0])  # type: ignore[attr-defined]
    return None


MADE_ONCE = {"create_timer": "timer", "create_publisher": "publisher"}  # in a callback, each call makes one more


def made_in_a_callback(source: str) -> tuple[int, str] | None:
    """Return the line in which a callback makes one more timer or publisher at each call, and a sentence; or None."""
    tree = parse(source)
    if any(next(calls(tree, name), None) for name in ("cancel", "destroy", "destroy_timer", "destroy_publisher")):
        return None
    makers = ("create_subscription", "create_timer", "create_service")
    names = {name_of(argument(call, *CALLBACKS[maker])) for maker in makers for call in calls(tree, maker)}
    for function in named(tree, names):
        for statement in function.body:
            if any(isinstance(node, (ast.Return, ast.Raise)) for node in walk(statement)):
                break  # what follows may run only once
            made = statement.value if isinstance(statement, (ast.Assign, ast.Expr)) else None
            if isinstance(made, ast.Call) and name_of(made.func) == "publish" and isinstance(made.func, ast.Attribute):
                made = made.func.value  # create_publisher(...).publish(...)
            if isinstance(made, ast.Call) and name_of(made.func) in MADE_ONCE:
                what = MADE_ONCE[name_of(made.func)]
                return made.lineno, (
                    f"'{function.name}' makes one more {what} each time that it is called. Make the {what} once, in "
                    "`__init__`."
                )
    return None


def idle(place: str, source: str) -> str:
    """Return why a program does nothing that it is asked for, with the line; '' if its text does not show that."""
    if silent := never_begins(source):
        bare = next((node for node in bare_statements(parse(source)) if name_of(node.value) == "execute"), None)
        if silent[0].endswith(".execute"):
            return (
                f"{place}, line {silent[1]}: `{silent[0].rpartition(': ')[2]}` is the method itself, and nothing calls "
                f"it, so no goal starts. Write `{silent[0]}()`."
            )
        if bare:
            text = ast.unparse(bare)
            return (
                f"{place}, line {bare.lineno}: `{text}` is the method itself, and nothing calls it, so no goal starts. "
                f"Write `{text}()`."
            )
        why = (
            f"{place}, line {silent[1]}: '{silent[0]}' receives each accepted goal, but nothing "
            "calls `goal_handle.execute()`, so no goal starts."
        )
        if own := _runs_itself(parse(source), silent[0]):
            why += (
                f" `{ast.unparse(own)}` only runs your function: write `goal_handle.execute()`, which starts the goal."
            )
        return why
    if empty := empty_executor(source):
        return (
            f"{place}, line {empty[1]}: `{empty[0]}` spins an executor to which no node was added, so no callback "
            f"runs. Add the node before: `{empty[0].rpartition('.')[0]}.add_node(node)`."
        )
    return ""


def wrong_range(source: str) -> tuple[int, str, str, str] | None:
    """Return a declared parameter whose range is of another type than its default, which has no effect.

    Its line, its name (as written), and the fields of the descriptor that it has and needs; None if there is none.
    """
    tree = parse(source)
    stored = sorted((node for node in walk(tree) if isinstance(node, ast.Assign)), key=lambda node: node.lineno)
    for call in calls(tree, "declare_parameter"):
        before = (node for node in stored if node.lineno < call.lineno)
        made = {name_of(target): node.value for node in before for target in node.targets}  # the last of a name
        name, default = argument(call, 0, "name"), argument(call, 1, "value")
        described = argument(call, 2, "descriptor")
        described = made.get(name_of(described), described)
        value = getattr(default, "value", None)
        has = {each.arg for each in described.keywords} if isinstance(described, ast.Call) else set()
        for kind, wrong, right in RANGES:
            if type(value) is kind and wrong in has and right not in has and name:
                return call.lineno, ast.unparse(name), wrong, right
    return None


RANGES = (  # a type of values, the range that has no effect on them, and the one that has
    (float, "integer_range", "floating_point_range"),
    (int, "floating_point_range", "integer_range"),
)
OF_GUARDS = (ast.Name, ast.Constant, ast.Compare, ast.Eq, ast.NotEq, ast.UnaryOp, ast.Not)


def wrong_guard(source: str) -> tuple[str, int] | None:
    """Return the condition that keeps main() from running when the file is run, as written, and its line."""
    for node in parse(source).body:
        if isinstance(node, ast.If) and list(calls(node, "main")) and _is_false_when_run(node.test):
            return ast.unparse(node.test), node.lineno
    return None


def _is_false_when_run(test: ast.expr) -> bool:
    nodes = [node for node in walk(test) if not isinstance(node, ast.expr_context)]
    if not all(isinstance(node, OF_GUARDS) and getattr(node, "id", "__name__") == "__name__" for node in nodes):
        return False
    return not eval(ast.unparse(test), {"__name__": "__main__", "__builtins__": {}})


def class_text(source: str, name: str) -> str:
    """Return the last class `name` of a program in a form that comments and blank lines do not change; '' if none."""
    found = [node for node in walk(parse(source)) if isinstance(node, ast.ClassDef) and node.name == name]
    return ast.dump(found[-1]) if found else ""
