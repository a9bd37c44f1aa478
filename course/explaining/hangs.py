"""Finds out that a program's callback, or its start, cannot end in time, from its threads' stacks and its text.

Only what is certain counts, because a wait ends early for it: a `sleep` that is longer than the limit, a loop that
cannot end, or a lock that the program acquires and never releases.  However slow the machine is, such a callback
returns too late.
"""

import ast
import re
from collections.abc import Collection, Sequence
from pathlib import Path

from course.explaining.endless_waits import EXECUTORS, Call, is_own, of_rclpy, threads
from course.explaining.failure_report import Frame
from course.explaining.source import Function, calls, covers, functions, name_of, parse, text_at, written_number
from course.foundation.syntax import walk

CALLING = (EXECUTORS, "task.py")  # rclpy's files whose functions call a callback
# A program with one of these may run other code while a callback waits.
OTHERS = re.compile(r"ThreadedExecutor|EventsExecutor|\bThread\b|\bTimer\b|_thread\b|asyncio|concurrent|\bsignal\b")
THREADS = re.compile(r"\bThread\b|\bTimer\b|_thread\b|asyncio|concurrent|\bsignal\b")  # the same before it spins
RELEASES = re.compile(r"\.release\b|\b__exit__\b")
BY_CTRL_C = ("ExternalShutdownException", "KeyboardInterrupt")  # errors that no loop raises by itself
IDLE = ("sleep", "print", "debug", "info", "warn", "warning", "error")  # calls that change nothing in the program
PURE = ("abs", "all", "any", "bool", "done", "float", "int", "len", "max", "min", "result", "str")
OF_THE_REQUEST = re.compile(r"(\w+\.)?request\.\w+")  # nothing changes the fields of a request meanwhile
ORDERS = (ast.Gt, ast.GtE, ast.Lt, ast.LtE)  # comparisons of numbers
LEAVES = (ast.Assert, ast.Break, ast.Raise, ast.Return, ast.Yield, ast.YieldFrom)  # what may leave a loop
NOT_SPUN = "nothing spins its node, so none of its callbacks is called."


def hang(stacks: str, path: Path, callbacks: Collection[str], limit: float) -> tuple[Frame, ...]:
    """Return the frames of a callback that will not return within `limit` s of its call; () if there is none.

    `stacks` are those of the program at `path` (output of `faulthandler`).  One of its functions `callbacks` must
    return; in a program with one thread, an endless loop in any other callback prevents that, too.
    """
    source = text_at(path)
    tree, lines = parse(source), source.splitlines()
    spins = [node for node in walk(tree) if isinstance(node, ast.Call) and "spin" in name_of(node.func)]
    alone = len(spins) == 1 and not OTHERS.search(source)
    for thread in threads(stacks):
        calling = [number for number, call in enumerate(thread) if of_rclpy(call)[0] in CALLING]
        chain = [call for call in thread[: calling[-1] if calling else 0] if is_own(call, path)]
        if not chain or any(line > len(lines) for _, line, _ in chain):
            continue
        answers = chain[-1][2] in callbacks
        late = answers and chain[0] is thread[0] and _shortest_sleep(tree, chain[0][1]) >= limit
        locked = answers and chain[0] is thread[0] and _waits_for_ever(tree, source, chain[0][1])
        if late or locked or ((answers or alone) and "suppress" not in source and _in_endless_loop(tree, chain, alone)):
            return tuple(Frame(path.name, line, name, lines[line - 1].strip()) for _, line, name in reversed(chain))
    return ()


def beginning(stacks: str, path: Path, *, endless: bool) -> tuple[Frame, ...]:
    """Return the frames of the program at `path` that runs no callbacks yet; () if it does.

    `endless`: only if it is in a loop that cannot end.
    """
    source = text_at(path)
    found, lines = list(threads(stacks)), source.splitlines()
    chain = [call for call in found[-1] if is_own(call, path)] if found else []  # the main thread comes last
    spun = any(of_rclpy(call)[0] == EXECUTORS for thread in found for call in thread)
    if spun or not chain or any(line > len(lines) for _, line, _ in chain):
        return ()
    inner = [call for call in chain if call[2] != "<module>"]
    alone = not THREADS.search(source)
    if endless and ("suppress" in source or not _in_endless_loop(parse(source), inner, alone)):
        return ()
    loops = [node for node in walk(parse(source)) if isinstance(node, ast.While)]
    again = {call for call in inner if any(covers(loop, call[1]) for loop in loops)}  # main() may be why it goes on
    own = [call for call in inner if call[2] != "main" or call in again] or chain[:1]
    return tuple(Frame(path.name, line, name, lines[line - 1].strip()) for _, line, name in reversed(own))


def unspun(stacks: str, path: Path) -> tuple[Frame, ...]:
    """Return the frames of the program at `path` if a loop that cannot end keeps it from spinning its node; else ().

    Only main() may spin it then, by its text, because the loop may call whatever else does.
    """
    source = text_at(path)
    tree = parse(source)
    others = [node for each in functions(tree) if each.name != "main" for node in walk(each)]
    if THREADS.search(source) or any("spin" in name_of(node) for node in others):
        return ()
    return beginning(stacks, path, endless=True)


def in_calls(stacks: str, path: Path) -> int:
    """Return the number of threads of the program at `path` that block in a `call(...)` of a callback."""
    lines = text_at(path).splitlines()
    found = 0
    for thread in threads(stacks):
        calling = [number for number, call in enumerate(thread) if of_rclpy(call)[0] in CALLING]
        inside = thread[: calling[-1] if calling else 0]
        chain = [call for call in inside if is_own(call, path)]
        blocks = ("client.py", "call") in map(of_rclpy, inside)
        found += blocks and bool(chain) and chain[0][1] <= len(lines) and ".call(" in lines[chain[0][1] - 1]
    return found


def _shortest_sleep(tree: ast.Module, line: int) -> float:
    """Return the shortest time (s) that a `sleep` in a line takes; 0 if a time is not written out."""
    here = [call for call in calls(tree, "sleep") if covers(call, line)]
    return min((written_number(call.args[0] if call.args else None) or 0.0 for call in here), default=0.0)


def _waits_for_ever(tree: ast.Module, source: str, line: int) -> bool:
    """Return True if a line waits for a lock that the program acquires without ever releasing it."""
    taken = [_lock(each) for each in calls(tree, "acquire") if not (each.args or each.keywords)]
    here = [_lock(each) for each in calls(tree, "acquire") if covers(each, line)]
    blocks = [node for node in walk(tree) if isinstance(node, ast.With) and node.lineno == line]
    here += [ast.unparse(item.context_expr) for block in blocks for item in block.items]
    return not RELEASES.search(source) and len(here) == 1 and here[0] in taken


def _lock(call: ast.Call) -> str:
    return ast.unparse(call.func).rpartition(".")[0]


def _in_endless_loop(tree: ast.Module, chain: Sequence[Call], alone: bool) -> bool:
    """Return True if one of these calls, the innermost first, is in a loop that cannot end."""
    around = [_function(tree, line) for _, line, _ in chain]
    for number, (_, line, _) in enumerate(chain):
        outer = around[number:]
        if any(each is None or _handles_errors(each) for each in outer):  # an error, too, leaves the loop
            continue
        function = outer[0]
        loops = [node for node in walk(function) if isinstance(node, ast.While)] if function else []
        if function and any(covers(loop, line) and _is_endless(loop, function, tree, alone) for loop in loops):
            return True
    return False


def _function(tree: ast.Module, line: int) -> Function | None:
    """Return the innermost function around a line."""
    around = [function for function in functions(tree) if covers(function, line)]
    return max(around, key=lambda function: function.lineno, default=None)


def _handles_errors(function: Function) -> bool:
    handlers = [node.type for node in walk(function) if isinstance(node, ast.ExceptHandler)]
    caught = [name for kind in handlers for name in (kind.elts if isinstance(kind, ast.Tuple) else [kind])]
    return any(name_of(each) not in BY_CTRL_C for each in caught)


def _is_endless(loop: ast.While, function: Function, tree: ast.Module, alone: bool) -> bool:
    """Return True if a loop in a function cannot end; `alone`: no other code of the program runs meanwhile."""
    inside = [node for statement in loop.body for node in walk(statement)]
    if any(isinstance(node, LEAVES) or "spin" in name_of(node) for node in inside):
        return False
    if isinstance(loop.test, ast.Constant):
        return bool(loop.test.value)
    if isinstance(loop.test, ast.Call) and name_of(loop.test.func) == "ok" and not loop.test.args:
        return not _shuts_down(loop, tree)  # `rclpy.ok()`
    if _is_fixed(loop, function):
        return True
    return (
        alone and all(map(_is_idle, loop.body)) and _is_pure(loop.test, {each.name: each for each in functions(tree)})
    )


def _shuts_down(loop: ast.While, tree: ast.Module) -> bool:
    """Return True if a loop, or another function than main(), shuts rclpy down."""
    places = [loop, *(each for each in functions(tree) if each.name != "main")]
    return any(next(calls(each, name), None) for each in places for name in ("shutdown", "try_shutdown"))


def _is_fixed(loop: ast.While, function: Function) -> bool:
    """Return True if a loop's test compares local numbers that the loop never changes."""
    test = loop.test
    if not isinstance(test, ast.Compare) or not all(isinstance(each, ORDERS) for each in test.ops):
        return False
    whole = list(walk(function))
    if any(isinstance(node, (ast.Global, ast.Nonlocal)) for node in whole):
        return False
    parameters = {node.arg for node in whole if isinstance(node, ast.arg)}
    stored = {node.id for node in whole if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    names, fields = set(), set()
    for operand in (test.left, *test.comparators):
        if isinstance(operand, ast.Name) and operand.id in parameters | stored:
            names.add(operand.id)
        elif isinstance(operand, ast.Attribute) and OF_THE_REQUEST.fullmatch(ast.unparse(operand)):
            fields.add(ast.unparse(operand))
        elif not isinstance(operand, ast.Constant):
            return False
    for parent in (each for statement in loop.body for each in walk(ast.Module([statement], []))):
        for child in ast.iter_child_nodes(parent):
            if isinstance(child, ast.Name) and child.id in names and not _only_reads(parent, child):
                return False
            changed = isinstance(getattr(child, "ctx", None), (ast.Store, ast.Del))
            if changed and ast.unparse(child) in fields:
                return False
    return True


def _only_reads(parent: ast.AST, name: ast.Name) -> bool:
    """Return True if an expression or statement reads a number, and cannot change it, whatever its type is."""
    index = isinstance(parent, ast.Subscript) and parent.slice is name
    return isinstance(name.ctx, ast.Load) and (
        index or isinstance(parent, (ast.BinOp, ast.Compare, ast.FormattedValue))
    )


def _is_idle(statement: ast.stmt) -> bool:
    """Return True if a statement changes nothing in the program."""
    if isinstance(statement, ast.Expr):
        call = statement.value
        return isinstance(call, ast.Constant) or (isinstance(call, ast.Call) and name_of(call.func) in IDLE)
    return isinstance(statement, (ast.Pass, ast.Continue))


def _is_pure(test: ast.AST, own: dict[str, Function]) -> bool:
    """Return True if an expression keeps its value until other code of the program runs; `own` are its functions."""
    used = {name for name in _names_used(test) if name in own}  # a property is used without being called
    return _only_computes(test, {*PURE, *used}) and all(
        _only_computes(own[name], PURE) and not own.keys() & _names_used(*own[name].body) for name in used
    )


def _names_used(*nodes: ast.AST) -> set[str]:
    return {name_of(each) for node in nodes for each in walk(node)}


def _only_computes(node: ast.AST, known: Collection[str]) -> bool:
    """Return True if code sets nothing and calls nothing but these functions."""
    inside = list(walk(node))
    called = {name_of(each.func) for each in inside if isinstance(each, ast.Call)}
    sets = any(isinstance(getattr(each, "ctx", None), (ast.Store, ast.Del)) for each in inside)
    return not sets and called <= {*known} and not any(isinstance(each, ast.Await) for each in inside)
