"""Descriptions of code that runs, but cannot be intended: told as soon as a program or a class is started.

Each is certain by the text alone, because what it describes may only be noticed after a long wait.
"""

import ast
import re
from collections.abc import Iterator

from course.explaining.source import (
    UNSPUN,
    Function,
    argument,
    calls,
    changes_nothing,
    covers,
    endless_looks,
    functions,
    idle,
    inside,
    name_of,
    parse,
    unanswered,
    unspun_executor,
    written_number,
    wrong_cancel,
    wrong_range,
)
from course.foundation.syntax import walk

LOCKS = ("Lock", "RLock")
LEAVES = (ast.Break, ast.Continue, ast.Raise, ast.Return)
A_TIME = re.compile(r"(?:^|_)(?:period|seconds|secs?|interval)$")  # ends a name that holds seconds
LONG_GOAL = 20.0  # s that many a goal takes
LONGEST = 600.0  # s: more cannot be meant as a time limit of a student's program


def doubts(place: str, source: str) -> list[str]:
    """Return descriptions of code in a program or a cell that runs, but cannot be intended."""
    tree = parse(source)
    found = [why] if (why := idle(place, source)) else []
    if wrong := wrong_cancel(source):
        found.append(
            f"{place}, line {wrong[1]}: the cancel callback '{wrong[0]}' returns {wrong[2] or 'nothing'}, so "
            "rclpy refuses every cancel. Return `CancelResponse.ACCEPT` or `CancelResponse.REJECT`."
        )
    whole = "rclpy.init(" in source  # in a cell of a notebook it may be shown on purpose
    for name, line, response in unanswered(source) if whole else ():
        found.append(
            f"{place}, line {line}: the service callback '{name}' returns nothing, so no response is sent. End it with "
            f"`return {response}`."
        )
    if unspun := unspun_executor(source):
        found.append(f"{place}: {UNSPUN.format(*unspun)}")
    if unfit := wrong_range(source):
        line, name, has, needs = unfit
        kind = "double" if needs == "floating_point_range" else "integer"
        found.append(
            f"{place}, line {line}: the default of {name} is of the type {kind}, on which `{has}` has no effect. Use "
            f"`{needs}`."
        )
    found += [f"{place}, line {line}: {why}" for line, why in _waits_for_no_cancel(tree)]
    found += [f"{place}, line {line}: {why}" for line, why in never_released(tree)]
    found += [f"{place}, line {line}: {why}" for line, why in _rates_of_a_time(tree)]
    return found


def long_limit(source: str, line: int) -> str:
    """Return a sentence on a wait in this line whose time limit is written out and of many minutes; '' for another.

    Also if the limit is the default of an argument of the function around it, which no call gives.
    """
    tree = parse(source)
    for call in (node for node in walk(tree) if isinstance(node, ast.Call) and covers(node, line)):
        limit = next((each.value for each in call.keywords if each.arg == "timeout_sec"), None)
        if isinstance(limit, ast.Name):
            limit = _default(tree, line, limit.id)
        seconds = written_number(limit)
        if limit and seconds is not None and seconds > LONGEST:
            return f"A time limit is in seconds: {seconds:g} in line {limit.lineno} are {seconds / 60:.0f} minutes."
    return ""


def short_wait(source: str, least: float) -> tuple[int, float] | None:
    """Return the line of the one wait for a server, and its time limit in s, if that is less than `least`.

    None unless the text shows that it waits once: in no loop, and with a limit that is written out.
    """
    tree = parse(source)
    waits = [*calls(tree, "wait_for_service"), *calls(tree, "wait_for_server")]
    if len(waits) != 1 or any(isinstance(node, (ast.While, ast.For, ast.comprehension)) for node in walk(tree)):
        return None
    limit: ast.expr | None = argument(waits[0], 0, "timeout_sec")
    if isinstance(limit, ast.Name):
        limit = _default(tree, waits[0].lineno, limit.id)
    seconds = written_number(limit)
    return (waits[0].lineno, seconds) if seconds is not None and seconds < least else None


def short_result(source: str) -> tuple[int, float] | None:
    """Return the line of the one wait for the result of a goal, and its limit in s, if many goals take longer.

    None unless the text shows that it waits once: in no loop, and with a limit that is written out.
    """
    tree = parse(source)
    for function in functions(tree):
        made = [node for node in walk(function) if isinstance(node, ast.Assign)]
        if any(isinstance(node, (ast.While, ast.For)) for node in walk(function)):
            continue
        for call in calls(function, "spin_until_future_complete"):
            future, limit = argument(call, 1, "future"), argument(call, 3, "timeout_sec")
            above = [node for node in made if node.lineno < call.lineno]
            before = [node.value for node in above if ast.unparse(future or call) in map(ast.unparse, node.targets)]
            waited = before[-1] if before else future
            seconds = written_number(limit)
            of_result = isinstance(waited, ast.Call) and name_of(waited.func) == "get_result_async"
            if of_result and seconds is not None and seconds < LONG_GOAL:
                return call.lineno, seconds
    return None


def _default(tree: ast.Module, line: int, name: str) -> ast.expr | None:
    """Return the default of the argument `name` of the function around a line, if no call gives one; else None."""
    for function in (each for each in functions(tree) if covers(each, line)):
        given = [*function.args.args, *function.args.kwonlyargs]
        values = [
            *[None] * (len(function.args.args) - len(function.args.defaults)),
            *function.args.defaults,
            *function.args.kw_defaults,
        ]
        here = list(calls(tree, function.name))
        most = max((len(call.args) for call in here), default=0) + 1  # with `self`
        if any(each.arg in (name, None) for call in here for each in call.keywords):
            return None
        for place, (each, value) in enumerate(zip(given, values, strict=True)):
            stored = any(
                isinstance(node, ast.Name) and node.id == name and isinstance(node.ctx, ast.Store)
                for node in walk(function)
            )
            if each.arg == name and place >= most and not stored:
                return value
    return None


def endless_look(source: str) -> int:
    """Return the line of a loop that looks for a server until one comes, and does nothing else; 0 without one."""
    return next((loop.lineno for loop in endless_looks(parse(source))), 0)


def _waits_for_no_cancel(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield the loops that wait, once a goal's cancel is requested, until it is no longer requested."""
    for function in functions(tree):
        for loop in (node for node in inside(function) if isinstance(node, ast.While)):
            if isinstance(loop.test, ast.Attribute) and loop.test.attr == "is_cancel_requested":
                handle = ast.unparse(loop.test.value)
                if all(map(changes_nothing, loop.body)) and not _ends_elsewhere(tree, function):
                    why = f"once a cancel is requested, `while {ast.unparse(loop.test)}` never ends."
                    yield loop.lineno, f"{why} Write `if`, call `{handle}.canceled()`, and return the result."


def _ends_elsewhere(tree: ast.Module, function: Function) -> bool:
    """Return True if another function may end a goal."""
    ends = ("abort", "canceled", "succeed")
    return any(next(calls(each, name), None) for each in functions(tree) if each is not function for name in ends)


def never_released(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield the calls of a lock's `acquire()` after which a way through the function never releases it."""
    made = {each: node.value for node in walk(tree) if isinstance(node, ast.Assign) for each in node.targets}
    locks = {
        ast.unparse(each)
        for each, value in made.items()
        if isinstance(value, ast.Call) and name_of(value.func) in LOCKS
    }
    for function in functions(tree):
        above = _above(function)
        for call in (each for each in calls(function, "acquire") if not each.args and not each.keywords):
            lock = ast.unparse(call.func).rpartition(".")[0]
            releases = [each for each in calls(tree, "release") if ast.unparse(each.func).rpartition(".")[0] == lock]
            own = [each for each in releases if covers(function, each.lineno)]
            statement = above[call][0]
            if lock not in locks or len(own) < len(releases) or not isinstance(statement, ast.Expr):
                continue
            if leaves := next(
                (
                    each
                    for each in inside(function)
                    if isinstance(each, (ast.Return, ast.Break)) and _keeps_it(each, statement, own, above)
                ),
                None,
            ):
                yield (
                    call.lineno,
                    (
                        f"`{ast.unparse(call)}` takes the lock, but the path through line {leaves.lineno}, "
                        f"`{ast.unparse(leaves)}`, never releases it: the next one that needs it waits without end. "
                        f"Write `with {lock}:`, which releases it on every path."
                    ),
                )


Above = dict[ast.AST, tuple[ast.AST, str]]  # what a node is part of, and in which field


def _above(tree: ast.AST) -> Above:
    found: Above = {}
    for node in walk(tree):
        for field, value in ast.iter_fields(node):
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST):
                    found[child] = (node, field)
    return found


def _keeps_it(leaves: ast.stmt, taken: ast.stmt, releases: list[ast.Call], above: Above) -> bool:
    """Return True if a `return`, or a `break`, comes after `taken` in any case, and none of these calls on its way."""
    around = [leaves, *_around(leaves, above)]
    if above[taken] not in [above[each] for each in around if each in above] or leaves.lineno < taken.lineno:
        return False
    loop = next((each for each in around if isinstance(each, (ast.While, ast.For, ast.AsyncFor))), None)
    last = loop if isinstance(leaves, ast.Break) and loop else leaves
    for call in releases:
        at = [call, *_around(call, above)]
        if last is loop and call.lineno > (loop.end_lineno or 0):
            return False  # the way goes on after the loop
        if any(isinstance(each, ast.Try) and any(node in at for node in each.finalbody) for each in around):
            return False
        if taken.lineno < call.lineno < leaves.lineno and not _is_another_way(at, around, above):
            return False
    return True


def _around(node: ast.AST, above: Above) -> Iterator[ast.AST]:
    while node in above:
        node = above[node][0]
        yield node


def _is_another_way(at: list[ast.AST], around: list[ast.AST], above: Above) -> bool:
    """Return True if what is in `at` has not run where what is in `around` runs: another branch, or one that leaves."""
    common = next(each for each in at if each in around)
    branch, other = at[at.index(common) - 1], around[around.index(common) - 1]
    if isinstance(common, ast.If) and above[branch][1] != above[other][1]:
        return True
    for each in at[: at.index(common)]:
        siblings = getattr(above[each][0], above[each][1], None)
        if isinstance(siblings, list) and each is not branch and isinstance(siblings[-1], LEAVES):
            return True
    return False


def _rates_of_a_time(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield the calls of `create_rate`, which takes Hz, with a name that holds seconds."""
    for call in calls(tree, "create_rate"):
        given = argument(call, 0, "frequency")
        if given is not None and A_TIME.search(name_of(given)):
            text = ast.unparse(given)
            yield (
                call.lineno,
                (
                    f"`create_rate` takes a frequency in Hz, and `{text}` is a time: with 0.25 it sleeps 4 s. Write "
                    f"`create_rate(1.0 / {text})`, or `time.sleep({text})`."
                ),
            )
