"""Code of a cell that runs without what it is meant to do: a coroutine that nobody awaits, another unit."""

import ast
from collections.abc import Iterator

from course.explaining.source import (
    CALLBACKS,
    argument,
    assigned,
    calls,
    functions,
    functions_of,
    inside,
    last_parameter,
    name_of,
    named,
    service_callbacks,
    written_number,
)
from course.foundation.syntax import walk

MILLISECONDS = 1e6  # nanoseconds in one
NOW = {"now", "monotonic", "time", "perf_counter"}


def unmeant(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield each such place as its line and a sentence."""
    yield from _not_awaited(tree)
    yield from _answers_later(tree)
    yield from _milliseconds(tree)
    yield from _negative_ages(tree)
    yield from _cancels_in_vain(tree)
    yield from _first_rounds(tree)
    yield from _new_locks(tree)
    yield from _empty_slices(tree)
    yield from _tuples_of_one(tree)
    yield from _computed_once(tree)
    yield from _fields_of_another_type(tree)
    yield from _steps_of_the_clock(tree)


def _computed_once(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield parameters whose default is the time, which is asked for when the function is made: `now=monotonic()`."""
    for function in functions(tree):
        for default in (*function.args.defaults, *filter(None, function.args.kw_defaults)):
            if isinstance(default, ast.Call) and name_of(default.func) in NOW:
                yield (
                    default.lineno,
                    (
                        f"`{ast.unparse(default)}` is asked once, when '{function.name}' is made, and not at each "
                        "call: write it in the function."
                    ),
                )


def _steps_of_the_clock(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield where `time.time()` gives a step, the time since a kept one, with which a function computes."""
    for function in functions(tree):
        nodes = [*inside(function)]
        made = [pair for node in nodes if isinstance(node, ast.Assign) for pair in _pairs(node)]
        clocks = {ast.unparse(target): value for target, value in made if _is_clock(value)}
        steps: dict[ast.AST, ast.expr] = {}  # with what asks the clock
        for step in (each for each in nodes if isinstance(each, ast.BinOp) and isinstance(each.op, ast.Sub)):
            clock = step.left if _is_clock(step.left) else clocks.get(ast.unparse(step.left))
            if clock and isinstance(step.right, ast.Attribute):
                steps[step] = clock
        kept = {ast.unparse(target): steps[node] for target, value in made for node in walk(value) if node in steps}
        for node in nodes:
            if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Mult, ast.Div)):
                for side in (node.left, node.right):
                    if clock := steps.get(side) or kept.get(ast.unparse(side)):
                        text = f"`{ast.unparse(clock)}` jumps when the clock of the computer is set."
                        yield clock.lineno, f"{text} To measure a step, use `time.monotonic()`, which does not."


def _is_clock(value: ast.expr) -> bool:
    return isinstance(value, ast.Call) and ast.unparse(value) in ("time()", "time.time()")


def _tuples_of_one(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield assignments of a value with a comma behind it, and without brackets: `self.stopped = False,`."""
    for node in (each for each in walk(tree) if isinstance(each, ast.Assign) and isinstance(each.value, ast.Tuple)):
        targets, value = node.targets, node.value
        several = any(isinstance(target, (ast.Tuple, ast.List)) for target in targets)
        one = value.elts[0] if isinstance(value, ast.Tuple) and len(value.elts) == 1 and not several else None
        if one is not None and one.col_offset == value.col_offset:
            how = f"write `{ast.unparse(one)}`, without the comma."
            yield value.lineno, f"the comma at the end makes a tuple of it: {how}"


FIELDS = {"bool": "bool_value", "float": "double_value", "int": "integer_value", "str": "string_value"}


def _fields_of_another_type(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield where the value of a parameter is read from a field of another type than that of its default."""
    defaults = {}
    for call in calls(tree, "declare_parameter"):
        name, default = argument(call, 0, "name"), argument(call, 1, "value")
        if isinstance(name, ast.Constant) and isinstance(default, ast.Constant) and default.value is not None:
            defaults[name.value] = type(default.value).__name__
    for node in (each for each in walk(tree) if isinstance(each, ast.Attribute) and each.attr in FIELDS.values()):
        for call in calls(node.value, "get_parameter"):
            name = argument(call, 0, "name")
            kind = defaults.get(name.value, "") if isinstance(name, ast.Constant) else ""
            if kind in FIELDS and node.attr != FIELDS[kind]:
                yield (
                    node.lineno,
                    (
                        f"`{node.attr}` is empty here: the default of this parameter is of the type {kind}, so its "
                        f"value is in `{FIELDS[kind]}`. `{ast.unparse(call)}.value` has it whatever the type is."
                    ),
                )


def _not_awaited(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield calls of the text's own `async def` as statements, without `await`."""
    own = {each.name for each in functions(tree) if isinstance(each, ast.AsyncFunctionDef)}
    coroutines = {each.name for each in named(tree, own)}
    for function in functions(tree):
        for node in inside(function):
            call = node.value if isinstance(node, ast.Expr) else None
            if not isinstance(call, ast.Call) or name_of(call.func) not in coroutines:
                continue
            if isinstance(call.func, ast.Name) or name_of(call.func.value) == "self":  # type: ignore[attr-defined]
                what = ast.unparse(call.func)
                here = "" if isinstance(function, ast.AsyncFunctionDef) else f", and `async def {function.name}`"
                yield (
                    call.lineno,
                    (
                        f"`{what}(...)` alone runs nothing, because `{name_of(call.func)}` is an `async def`: write "
                        f"`await {what}(...)`{here}."
                    ),
                )


def _answers_later(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield calls by which a service callback has its response filled in by a task or a thread, and returns before."""
    for function in named(tree, service_callbacks(tree)):
        response = last_parameter(function)
        nodes = [*inside(function)]
        called = {name_of(node.func) for node in nodes if isinstance(node, ast.Call)}
        if called & WAITS or any(isinstance(node, (ast.Await, ast.Nonlocal)) for node in nodes):
            continue
        for call in (node for node in nodes if isinstance(node, ast.Call) and name_of(node.func) in LATER):
            given = [*call.args, *(each.value for each in call.keywords)]
            if response in {name_of(each) for one in given for each in walk(one) if isinstance(each, ast.Name)}:
                yield (
                    call.lineno,
                    (
                        f"`{name_of(call.func)}` runs it later, and `{response}` is sent before: make "
                        f"'{function.name}' an `async def` and `await` what fills in the response."
                    ),
                )


LATER = {"create_task", "submit", "Thread"}  # what runs a function beside the callback
WAITS = {"join", "result", "wait", "acquire", "get", "sleep", "spin_once", "spin_until_future_complete"}


def _cancels_in_vain(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield the places where an execute callback asks for a cancel in a text that never ends a goal as canceled."""
    if any(isinstance(node, ast.Attribute) and node.attr == "canceled" for node in walk(tree)):
        return
    names = {name_of(argument(call, *CALLBACKS["ActionServer"])) for call in calls(tree, "ActionServer")} - {""}
    for function in named(tree, names):
        for node in (each for each in inside(function) if isinstance(each, ast.If)):
            asked, ends = node.test, node.body[-1]
            if (
                isinstance(asked, ast.Attribute)
                and asked.attr == "is_cancel_requested"
                and isinstance(ends, (ast.Break, ast.Return))
            ):
                yield (
                    ends.lineno,
                    (
                        f"a goal whose cancel is requested ends as canceled only by `{ast.unparse(asked.value)}"
                        ".canceled()`, which nothing here calls."
                    ),
                )


def _first_rounds(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield the loops over values that return in their first round in any case, whatever the first value is."""
    for function in functions(tree):
        for loop in (node for node in inside(function) if isinstance(node, ast.For)):
            inner = [node for statement in loop.body for node in (statement, *inside(statement))]
            returned = {ast.unparse(node) for node in inner if isinstance(node, ast.Return)}
            goes_on = any(
                isinstance(node, (ast.Break, ast.Continue, ast.Try, ast.Yield, ast.YieldFrom)) for node in inner
            )
            if len(returned) > 1 and not goes_on and _returns(loop.body) and name_of(_called(loop.iter)) != "range":
                why = (
                    f"each path through this loop ends with a `return`, so only the first of `{ast.unparse(loop.iter)}`"
                )
                yield loop.lineno, f"{why} is looked at. The `return` that follows the last one belongs below the loop."


def _empty_slices(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield the slices of a scan's ranges that should go on from the last beams to the first: `ranges[-25:25]`."""
    for node in walk(tree):
        if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Slice) and name_of(node.value) == "ranges":
            low, high = node.slice.lower, written_number(node.slice.upper)
            last = (
                written_number(low.operand) if isinstance(low, ast.UnaryOp) and isinstance(low.op, ast.USub) else None
            )
            if last and high is not None and not node.slice.step:
                text, of = ast.unparse(node), ast.unparse(node.value)
                why = (
                    f"`{text}` is empty where there are {last + high:g} beams or more: a slice ends at the last of them"
                )
                yield node.lineno, f"{why}. The two parts are `{of}[-{last:g}:]` and `{of}[:{high:g}]`."


def _new_locks(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield the locks that a method of a class makes and locks itself, so that each call has one of its own."""
    for cls in (node for node in walk(tree) if isinstance(node, ast.ClassDef)):
        for function in (each for each in functions_of(cls) if each.name != "__init__"):
            nodes = [*walk(function)]
            used = {
                node.func.value
                for node in nodes
                if isinstance(node, ast.Call)
                and isinstance(node.func, ast.Attribute)
                and node.func.attr in ("acquire", "release")
            }
            used |= {node.context_expr for node in nodes if isinstance(node, ast.withitem)}
            for node in nodes:
                target = node.targets[0] if isinstance(node, ast.Assign) and len(node.targets) == 1 else None
                if isinstance(target, ast.Name) and name_of(_called(node.value)) in LOCKS:  # type: ignore[attr-defined]
                    same = {each for each in nodes if isinstance(each, ast.Name) and each.id == target.id}
                    inner = any(
                        isinstance(each, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)) for each in nodes[1:]
                    )
                    if not inner and same - {target} and same - {target} <= used:
                        why = f"each call of '{function.name}' makes a lock of its own here, which no other call waits"
                        how = f"Make it once, in `__init__`: `self.{ast.unparse(node)}`."
                        yield target.lineno, f"{why} for. {how}"


LOCKS = ("Lock", "RLock")


def _called(value: ast.expr) -> ast.expr | None:
    return value.func if isinstance(value, ast.Call) else None


def _returns(body: list[ast.stmt]) -> bool:
    """Return True if each way through a block ends at a `return`."""
    last = body[-1] if body else None
    if isinstance(last, ast.If):
        return _returns(last.body) and _returns(last.orelse)
    return isinstance(last, ast.Return) or (isinstance(last, ast.With) and _returns(last.body))


def _milliseconds(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield comparisons of a time in milliseconds with a number that is meant in seconds: `.nanoseconds / 1e6 < 1`."""
    for node in walk(tree):
        if not (isinstance(node, ast.Compare) and len(node.ops) == 1):
            continue
        for one, other in ((node.left, node.comparators[0]), (node.comparators[0], node.left)):
            limit = getattr(other, "value", None)
            if (
                isinstance(one, ast.BinOp)
                and isinstance(one.op, ast.Div)
                and name_of(one.left) == "nanoseconds"
                and getattr(one.right, "value", None) == MILLISECONDS
                and isinstance(limit, (int, float))
                and 0 < limit <= 1
            ):
                yield (
                    node.lineno,
                    (
                        f"`.nanoseconds / 1e6` is in milliseconds, so {limit:g} means "
                        f"{limit:g} ms. Seconds are `.nanoseconds / 1e9`."
                    ),
                )


def _negative_ages(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield ages with their times swapped: `self.came - self.get_clock().now() < limit`."""
    for cls in (node for node in walk(tree) if isinstance(node, ast.ClassDef)):
        stored: dict[str, list[ast.AST]] = {}
        for node in (each for each in walk(cls) if isinstance(each, (ast.Assign, ast.AugAssign))):
            for target, value in _pairs(node) if isinstance(node, ast.Assign) else [(node.target, node)]:
                stored.setdefault(ast.unparse(target), []).append(value)
        past = {name for name, values in stored.items() if name.startswith("self.") and _are_of_the_past(values)}
        for asked in (each for each in walk(cls) if isinstance(each, ast.Compare)):
            age, below = _made(asked.left, cls), isinstance(asked.ops[0], (ast.Lt, ast.LtE))
            if isinstance(age, ast.BinOp) and isinstance(age.op, ast.Sub) and below and len(asked.ops) == 1:
                then, now = ast.unparse(age.left), ast.unparse(age.right)
                if then in past and _is_now(age.right):
                    yield (
                        age.lineno,
                        f"`{then} - {now}` is below 0, since now is the later of the two: write `{now} - {then}`.",
                    )


def _made(value: ast.expr, cls: ast.ClassDef) -> ast.expr:
    """Return what a variable is set to, if the class sets one of that name once; the value itself otherwise."""
    if not isinstance(value, ast.Name):
        return value
    stored = [node for node in walk(cls) if isinstance(node, ast.Name) and node.id == value.id]
    made = [node for node in walk(cls) if isinstance(node, ast.Assign) and value.id in map(ast.unparse, node.targets)]
    once = sum(isinstance(node.ctx, ast.Store) for node in stored) == len(made) == 1
    return made[0].value if once else value


def _pairs(node: ast.Assign) -> Iterator[tuple[ast.expr, ast.expr]]:
    """Yield each variable of an assignment with its value, or with the one that is unpacked: `a, b = pair`."""
    for target, value in assigned(node):
        yield from ((each, value) for each in getattr(target, "elts", [target]))


def _is_now(value: ast.AST) -> bool:
    return isinstance(value, ast.Call) and name_of(value.func) in NOW and not value.args


def _are_of_the_past(values: list[ast.AST]) -> bool:
    """Return True if some of these values are the time of their line, and the others None."""
    others = [each for each in values if not _is_now(each)]
    return len(others) < len(values) and all(isinstance(each, ast.Constant) and each.value is None for each in others)
