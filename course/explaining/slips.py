"""Certain mistakes in the text of a cell that Python accepts silently."""

import ast
import builtins
import difflib
import re
from collections.abc import Iterator, Mapping
from itertools import pairwise

from course.explaining.conditions import always, asked_by
from course.explaining.decimal_commas import decimal_commas
from course.explaining.doubled import doubled
from course.explaining.exchanged_limits import exchanged_limits
from course.explaining.lost_values import lost_values
from course.explaining.misspelt_texts import misspelt_texts
from course.explaining.never_equal import never_equal
from course.explaining.operands import called_numbers
from course.explaining.source import (
    CALLBACKS,
    argument,
    bare_statements,
    callbacks,
    calls,
    functions,
    functions_of,
    last_parameter,
    made_in_a_callback,
    name_of,
    named,
    node_classes,
    parameter_callbacks,
    parse,
    service_callbacks,
    the_method_itself,
    undecorated,
    without_global,
)
from course.explaining.thrown_away import thrown_away
from course.explaining.unmeant import unmeant
from course.explaining.unread import unread
from course.explaining.unused import unused
from course.explaining.whole_values import given_to_callbacks, other_than_success, whole_values
from course.foundation.syntax import walk

# Methods without arguments that are called for their effect; of `execute` the session says more.
CALLED = ("abort", "cancel", "canceled", "destroy_node", "reset", "shutdown", "spin", "succeed", "try_shutdown")
CALLED_WITH = ("call_async", "publish", "publish_feedback", "send_goal_async")  # the same, with arguments
ASKS = {"call_async": "...", "cancel_goal_async": "", "get_result_async": "", "send_goal_async": "..."}  # the same
FROM = {"ExternalShutdownException": "rclpy.executors", "NodeNameNonExistentError": "rclpy.node"}
SHOWN = ("debug", "info", "warn", "warning", "error", "fatal", "print")  # functions that show a text
ANSWERS = ("message", "reason")  # fields with a text that is shown
IN_BRACES = re.compile(r"\{([A-Za-z_]\w*)(?:\.\w+)*(?:\([^(){}]*\))?(?:!r)?(?::[^{}]*)?\}")
MAKERS = re.compile(
    r"create_(?:client|publisher|service|subscription|timer)|declare_parameters?|Action(?:Client|Server)"
    r"|add_\w+_parameters_callback"
)
NUMBERS = re.compile(r"u?int\d+|float|double")
ALIKE = 0.75  # least similarity of two names of a parameter that should be the same


def slips(cell: str) -> list[str]:
    """Return a sentence for each certain mistake in the functions of a cell, in order of the lines."""
    tree = parse(cell)
    skipped = 1 if cell.lstrip("\n").startswith("%%exercise") else 0  # the first line is not part of the file
    found = {*_compared(tree), *methods_asked(tree), *_unknown_parameters(tree), *_not_called(tree), *_arrays(tree)}
    found |= {*_unawaited(tree), *thrown_away(tree), *whole_values(tree)}
    found |= {*_parts_of_a_word(tree), *lost_values(tree, skipped), *_names_in_a_list(tree)}
    found |= {*exchanged_limits(tree), *doubled(tree, skipped), *never_equal(tree), *hides_a_property(tree)}
    found |= {*_not_formatted(tree), *_after_the_end(tree, skipped), *unmeant(tree), *called_numbers(tree)}
    found |= {*decimal_commas(tree, cell)}
    found |= {*_set_in_vain(tree, skipped), *_looked_up(tree), *always(tree), *unread(tree, whole=skipped > 0)}
    found |= {*unused(tree, whole=skipped > 0), *_signs(tree, cell), *_set_again(tree, skipped), *_stored_already(tree)}
    if skipped:  # a file has only what it imports and makes itself
        found |= {*_unknown_exceptions(tree), *misspelt_texts(tree), *_lists_its_own_client(tree)}
        found |= {*other_than_success(tree)}
    if more := made_in_a_callback(cell.partition("\n")[2] if skipped else cell):
        line, text = more
        found.add((line + skipped, text))
    return [f"note: line {number - skipped}: {text}" for number, text in sorted(found)]


def _compared(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield comparisons used as statements: `response.success == True`."""
    for function in functions(tree):
        for node in walk(function):
            if not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Compare)):
                continue
            left, operator = node.value.left, node.value.ops[0]
            if (
                isinstance(operator, ast.Eq)
                and len(node.value.ops) == 1
                and isinstance(left, (ast.Attribute, ast.Name))
            ):
                text, how = ast.unparse(node), f"{ast.unparse(left)} = {ast.unparse(node.value.comparators[0])}"
                if isinstance(left, ast.Name) and _is_last(node, left.id, function):
                    how = f"return 0 if {text} else 1" if function.name == "main" else f"return {text}"
                    yield node.lineno, f"`{text}` compares, and does nothing with it. To return it, write `{how}`."
                else:
                    yield node.lineno, f"`{text}` compares, and changes nothing. To set it, write `{how}`."


def _lists_its_own_client(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield the calls that look for a server in a list which also names services that only have a client."""
    client = next(calls(tree, "create_client"), None)
    text = (
        "`get_service_names_and_types()` also lists services that only have a client, as this node's own. Ask the "
        "client: `service_is_ready()`."
    )
    yield from ((call.lineno, text) for call in calls(tree, "get_service_names_and_types") if client)


def _looked_up(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield values of a dict of the whole text that a function looks up and does not use: `WORDS.get(status)`."""
    made = [node for node in tree.body if isinstance(node, ast.Assign) and isinstance(node.value, ast.Dict)]
    dicts = {name_of(target) for node in made for target in node.targets if isinstance(target, ast.Name)}
    for function in functions(tree):
        for node in walk(function):
            if not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)):
                continue
            called = node.value.func
            if isinstance(called, ast.Attribute) and called.attr == "get" and ast.unparse(called.value) in dicts:
                text = ast.unparse(node)
                yield node.lineno, f"`{text}` is looked up, and nothing uses it. To return it, write `return {text}`."


def _not_formatted(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield texts without `f` that a function logs, prints or answers with, and that name its values in braces."""
    for function in functions(tree):
        nodes = [*walk(function)]
        known = {node.arg for node in nodes if isinstance(node, ast.arg)}
        known |= {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
        given = [call.args[0] for name in SHOWN for call in calls(function, name) if call.args]
        set_here = (node for node in nodes if isinstance(node, ast.Assign))
        given += [node.value for node in set_here if name_of(node.targets[0]) in ANSWERS]
        given += [node.value for node in nodes if isinstance(node, ast.keyword) and node.arg in ANSWERS]
        given += [part for each in given if isinstance(each, ast.IfExp) for part in (each.body, each.orelse)]
        if next(calls(function, "format"), None):
            continue
        for text in given:
            if isinstance(text, ast.Constant) and isinstance(text.value, str):
                named_there = IN_BRACES.findall(text.value)
                if named_there and known.issuperset(named_there):
                    short = text.value if len(text.value) <= 30 else f"{text.value[:27]}..."
                    yield (
                        text.lineno,
                        f"{short!r} shows its braces as they are: write `f` before the first quotation mark.",
                    )


def _unawaited(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield lambdas that are given as a callback, and only call an `async def` of the text: nothing awaits that."""
    made = [*functions(tree)]
    coroutines = {each.name for each in made if isinstance(each, ast.AsyncFunctionDef)} - {
        each.name for each in made if isinstance(each, ast.FunctionDef)
    }
    for maker in ("create_service", "create_subscription", "create_timer"):
        for given in (argument(call, *CALLBACKS[maker]) for call in calls(tree, maker)):
            called = given.body if isinstance(given, ast.Lambda) else None
            if isinstance(given, ast.Lambda) and isinstance(called, ast.Call) and name_of(called.func) in coroutines:
                text = ast.unparse(called.func)
                why = f"the lambda only begins `{text}`, which is `async def`, and nothing awaits it."
                same = [each.arg for each in given.args.args] == [
                    *map(ast.unparse, called.args)
                ] and not called.keywords
                how = f"Pass `{text}` itself." if same else f"Pass an `async def` that awaits `{text}`."
                yield given.lineno, f"{why} {how}"


def _after_the_end(tree: ast.Module, skipped: int) -> Iterator[tuple[int, str]]:
    """Yield logs, and parts of a node, that stand behind the `return` of their block, and so are never reached."""
    for function in functions(tree):
        for node in walk(function):
            for part in ("body", "orelse"):
                body = getattr(node, part, None)
                for before, after in pairwise(body if isinstance(body, list) else ()):
                    if isinstance(before, ast.Return) and (_logs(after) or _makes(after)):
                        yield (
                            after.lineno,
                            f"this never runs: the `return` of line {before.lineno - skipped} ends the function.",
                        )


def _logs(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.Expr) and any(next(calls(statement, name), None) for name in SHOWN)


def _makes(statement: ast.stmt) -> bool:
    """Return True if a statement makes a part of a node: `self.client = self.create_client(...)`."""
    made = statement.value if isinstance(statement, (ast.Assign, ast.Expr)) else None
    return isinstance(made, ast.Call) and MAKERS.fullmatch(name_of(made.func)) is not None


def _signs(tree: ast.Module, cell: str) -> Iterator[tuple[int, str]]:
    """Yield values with a sign that nobody writes: `total =+ step`, for `total += step`; of numbers, only a 1."""
    for node in (each for each in walk(tree) if isinstance(each, ast.Assign)):
        target, written = (ast.get_source_segment(cell, each) or "" for each in (node.targets[0], node.value))
        sign, rest = written[:1], written[1:].lstrip()
        a_number = isinstance(getattr(node.value, "operand", None), ast.Constant)
        told = written in ("+ 1", "- 1") or (sign == "+" and not a_number)
        if told and f"{target} ={written}" in (ast.get_source_segment(cell, node) or ""):
            how = f"To {'add to it' if sign == '+' else 'subtract from it'}, write `{target} {sign}= {rest}`."
            yield node.lineno, f"`{target} ={written}` replaces its value. {how}"


def _set_again(tree: ast.Module, skipped: int) -> Iterator[tuple[int, str]]:
    """Yield fields that two statements in a row set: `question.a = a`, `question.a = b`."""
    for function in functions(tree):
        for node in walk(function):
            body = getattr(node, "body", None)
            for before, after in pairwise(body if isinstance(body, list) else ()):
                first, second = (_field(each) for each in (before, after))
                if first and first == second and first not in map(ast.unparse, walk(after.value)):
                    text = f"`{first}` is set here, and in line {before.lineno - skipped} just before it"
                    yield after.lineno, f"{text}, whose value is lost. Is another field meant in one of the two?"


def _field(statement: ast.stmt) -> str:
    """Return the field of a message that a statement sets; '' for another one, and for an attribute of the node."""
    target = statement.targets[0] if isinstance(statement, ast.Assign) and len(statement.targets) == 1 else None
    of_a_name = isinstance(target, ast.Attribute) and isinstance(target.value, ast.Name) and target.value.id != "self"
    return ast.unparse(target) if of_a_name and target else ""


def _is_last(statement: ast.stmt, name: str, function: ast.AST) -> bool:
    """Return True if nothing in a function uses the variable `name` after a statement, which is not in a loop."""
    nodes = [*walk(function)]
    loops = [node for node in nodes if isinstance(node, (ast.For, ast.While))]
    outside = any(name in node.names for node in nodes if isinstance(node, (ast.Global, ast.Nonlocal)))
    later = [
        node for node in nodes if isinstance(node, ast.Name) and node.id == name and node.lineno > statement.lineno
    ]
    return not later and not outside and not any(statement in walk(loop) for loop in loops)


def _set_in_vain(tree: ast.Module, skipped: int) -> Iterator[tuple[int, str]]:
    """Yield variables of a function that nothing reads, and that are called like one of the whole text."""
    for function, name, line, is_read in without_global(tree):
        if not is_read and not list(calls(function, "locals")):
            text = (
                f"`{name.id}` is a variable of '{function.name}' alone here, and nothing reads it. To set that of line"
            )
            yield name.lineno, f"{text} {line - skipped}, begin '{function.name}' with `global {name.id}`."


def _not_called(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield methods used as statements, without their brackets: `goal_handle.succeed`."""
    own = undecorated(functions(tree))
    for function in functions(tree):
        for node in bare_statements(function):
            of_self = isinstance(node.value, ast.Attribute) and name_of(node.value.value) == "self"
            if name_of(node.value) in (own if of_self else CALLED):
                yield node.lineno, the_method_itself(ast.unparse(node), ", and calls nothing")
            elif not of_self and name_of(node.value) in CALLED_WITH:
                yield node.lineno, the_method_itself(ast.unparse(node), ", and calls nothing", "...")
    called = {name_of(node.func) for node in walk(tree) if isinstance(node, ast.Call)}
    for kept in (node for node in walk(tree) if isinstance(node, ast.Assign)):
        alone = isinstance(kept.value, ast.Attribute) and not called & {*map(name_of, kept.targets)}
        if alone and (asks := name_of(kept.value)) in ASKS:
            yield kept.lineno, the_method_itself(ast.unparse(kept.value), ", and asks for nothing", ASKS[asks])


def _parts_of_a_word(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield fields of a request that are looked for inside a word: `request.operation in 'add'`."""
    for function in named(tree, service_callbacks(tree)):
        request = function.args.args[-2].arg if len(function.args.args) > 1 else ""
        for node in walk(function):
            if not (isinstance(node, ast.Compare) and isinstance(node.ops[0], ast.In) and len(node.ops) == 1):
                continue
            left, word = node.left, node.comparators[0]
            of_request = isinstance(left, ast.Attribute) and name_of(left.value) == request
            if of_request and isinstance(word, ast.Constant) and isinstance(word.value, str) and word.value.isalpha():
                yield (
                    node.lineno,
                    (
                        f"`{ast.unparse(node)}` is also true for an empty text and for each part of the word. To "
                        f"compare, write `{ast.unparse(left)} == {word.value!r}`."
                    ),
                )


ALIKE = 0.7  # least similarity of a callback's name and the attribute that may be meant, such as `block` and `blocked`


def methods_asked(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield methods used without a call as a condition: `if self.is_fresh:`."""
    given = callbacks(tree)
    for cls in (node for node in walk(tree) if isinstance(node, ast.ClassDef)):
        own = undecorated(functions_of(cls))
        nodes = (node for node in walk(cls) if isinstance(node, (ast.Attribute, ast.Name)))
        stored = {name_of(node) for node in nodes if isinstance(node.ctx, ast.Store)}
        for node in walk(cls):
            for asked in asked_by(node):
                of_self = isinstance(asked, ast.Attribute) and name_of(asked.value) == "self"
                if not of_self or name_of(asked) not in own - stored:
                    continue
                text, near = ast.unparse(asked), difflib.get_close_matches(name_of(asked), stored, 1, ALIKE)
                if name_of(asked) not in given:
                    yield asked.lineno, the_method_itself(text, ", which is always true")
                elif near:
                    yield asked.lineno, f"`{text}` is a callback, which is always true. Is `self.{near[0]}` meant?"
                else:
                    yield asked.lineno, f"`{text}` is a callback, which is always true: ask for a value."


SPUN = {  # properties of a node that its executor reads, and what makes their parts; each node has services of its own
    "clients": ("create_client",),
    "guards": ("create_guard_condition",),
    "services": (),
    "subscriptions": ("create_subscription",),
    "timers": ("create_timer",),
    "waitables": ("ActionClient", "ActionServer"),
}
NEEDED = ("default_callback_group", "handle")  # the same, without which no node can be made


def hides_a_property(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield attributes of a node's class that hide what the executor, or the node itself, reads: `services = {}`."""
    for node in (each for cls in node_classes(tree) for each in cls.body):
        if not isinstance(node, (ast.Assign, ast.AnnAssign)) or node.value is None:
            continue
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        for name in (each.id for each in targets if isinstance(each, ast.Name)):
            if name in NEEDED:
                yield node.lineno, f"`{name}` hides rclpy's own `{name}` of a node: choose another name."
            if name not in SPUN:
                continue
            is_empty = ast.unparse(node.value) in ("[]", "{}", "()", "set()", "list()", "dict()")
            if is_empty and SPUN[name] and not any(next(calls(tree, maker), None) for maker in SPUN[name]):
                continue  # then it hides nothing
            why = f"`{name}` hides rclpy's own `{name}` of a node, by which the executor finds its {name}"
            yield node.lineno, f"{why}: choose another name."


ARRAY = re.compile(r"sequence<(?:u?int\d+|float|double)(?:, \d+)?>")


def _arrays(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield comparisons of an array that a callback is given with a list: `goal.floors == []`."""
    for function, given, _, fields in given_to_callbacks(tree):
        yield from _compared_with_lists(function, given, {key for key, each in fields.items() if ARRAY.fullmatch(each)})
        yield from _of_another_kind(function, given, fields)


def _compared_with_lists(function: ast.AST, given: str, fields: set[str]) -> Iterator[tuple[int, str]]:
    for node in walk(function):
        if not (isinstance(node, ast.Compare) and isinstance(node.ops[0], (ast.Eq, ast.NotEq))):
            continue
        for one, other in ((node.left, node.comparators[0]), (node.comparators[0], node.left)):
            text = ast.unparse(one)
            if isinstance(other, ast.List) and text in {f"{given}.{field}" for field in fields}:
                always = "true" if isinstance(node.ops[0], ast.NotEq) else "false"
                why = f"is always {always}: the field is an array, and an array is never equal to a list"
                yield node.lineno, f"`{ast.unparse(node)}` {why}. Write `list({text})`."


def _of_another_kind(function: ast.AST, given: str, fields: Mapping[str, str]) -> Iterator[tuple[int, str]]:
    """Yield comparisons of a field of a callback's argument with a constant of another type: `request.data == 'on'`."""
    kinds = {f"{given}.{field}": kind for field, kind in fields.items()}
    stored = {ast.unparse(node) for node in walk(function) if isinstance(getattr(node, "ctx", None), ast.Store)}
    for node in walk(function):
        if not (isinstance(node, ast.Compare) and len(node.ops) == 1 and isinstance(node.ops[0], (ast.Eq, ast.NotEq))):
            continue
        for one, other in ((node.left, node.comparators[0]), (node.comparators[0], node.left)):
            text, value = ast.unparse(one), getattr(other, "value", None)
            kind, same = kinds.get(text, ""), "false" if isinstance(node.ops[0], ast.Eq) else "true"
            of_numbers = kind == "boolean" or NUMBERS.fullmatch(kind)
            if {given, text} & stored or not isinstance(other, ast.Constant):
                continue
            if (of_numbers and isinstance(value, str)) or (kind == "string" and isinstance(value, (bool, int, float))):
                has, meant = ("a text", f"'{value}'") if kind == "string" else ("a number", "a number")
                if kind == "boolean":
                    has, meant = "True or False, not a text", f"`{text}` alone, or `not {text}`"
                why = f"`{ast.unparse(node)}` is always {same}: the field is {has}."
                yield node.lineno, f"{why} {'Use' if kind == 'boolean' else 'Compare it with'} {meant}."


def _unknown_exceptions(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield the exceptions that a file's `except` names, and that it neither imports nor makes.

    Python looks for the name only when there is an exception to catch, as when the program is stopped.
    """
    nodes = [*walk(tree)]
    made = {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    made |= {node.arg for node in nodes if isinstance(node, ast.arg)}
    made |= {node.name for node in nodes if isinstance(node, (ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef))}
    for node in nodes:
        if isinstance(node, (ast.Import, ast.ImportFrom)):
            made |= {alias.asname or alias.name.partition(".")[0] for alias in node.names}
    for handler in nodes if "*" not in made else ():
        caught = [*walk(handler.type)] if isinstance(handler, ast.ExceptHandler) and handler.type else []
        for name in caught:
            if isinstance(name, ast.Name) and name.id not in made and not hasattr(builtins, name.id):
                text = f"`except` needs `{name.id}`, which this file does not import"
                origin = f": `from {FROM[name.id]} import {name.id}`" if name.id in FROM else ""
                yield name.lineno, f"{text}{origin}."


def _unknown_parameters(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield comparisons in parameter callbacks with a name used nowhere else: `each.name == 'treshold'`."""
    declared = set(_declared(tree))
    texts = [node.value for node in walk(tree) if isinstance(node, ast.Constant)]
    for function in named(tree, parameter_callbacks(tree)):
        for node in walk(function):
            if not (isinstance(node, ast.Compare) and isinstance(node.ops[0], ast.Eq)):
                continue
            for one, other in ((node.left, node.comparators[0]), (node.comparators[0], node.left)):
                if not (name_of(one) == "name" and isinstance(one, ast.Attribute) and isinstance(other, ast.Constant)):
                    continue
                asked = str(other.value)
                near = [each for each in sorted(declared) if each.lower() == asked.lower()]  # in other capitals
                near = near or difflib.get_close_matches(asked, declared, 1, ALIKE)
                if near and asked not in declared and texts.count(asked) == 1:
                    text = f"no parameter '{asked}' is declared, so this is never true. Did you mean '{near[0]}'?"
                    yield node.lineno, text


def _declared(tree: ast.AST) -> Iterator[str]:
    """Yield the names of the parameters that a text declares: by itself, in a loop over them, or by a method."""
    makers = {"declare_parameter"}
    for function in functions(tree):  # `declare_gain(self, name, ...)`
        given = [each.arg for each in function.args.args[1:2]]
        if any(name_of(argument(call, 0, "name")) in given for call in calls(function, "declare_parameter")):
            makers.add(function.name)
    texts = [argument(call, 0, "name") for name in makers for call in calls(tree, name)]
    for loop in (node for node in walk(tree) if isinstance(node, ast.For)):
        names = [ast.unparse(each) for each in (getattr(loop.target, "elts", None) or [loop.target])[:1]]
        if any(name_of(argument(call, 0, "name")) in names for name in makers for call in calls(loop, name)):
            rows = getattr(loop.iter, "elts", [])
            texts += [(getattr(each, "elts", None) or [each])[0] for each in rows]
    yield from (each.value for each in texts if isinstance(each, ast.Constant) and isinstance(each.value, str))


def _names_in_a_list(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield names that a parameter callback looks for in its list of Parameters: `if 'output_min' in params`."""
    for function in named(tree, parameter_callbacks(tree)):
        given = last_parameter(function)
        nodes = [*walk(function)]
        if any(isinstance(node, ast.Name) and node.id == given and isinstance(node.ctx, ast.Store) for node in nodes):
            continue
        for node in (each for each in nodes if isinstance(each, ast.Compare) and len(each.ops) == 1):
            word, listed = getattr(node.left, "value", None), node.comparators[0]
            if (
                isinstance(node.ops[0], (ast.In, ast.NotIn))
                and isinstance(word, str)
                and isinstance(listed, ast.Name)
                and listed.id == given
            ):
                always = "false" if isinstance(node.ops[0], ast.In) else "true"
                how = f"{{each.name: each.value for each in {given}}}"
                text = (
                    f"`{ast.unparse(node)}` is always {always}: `{given}` is a list of Parameters, not of their names"
                )
                yield node.lineno, f"{text}. A dict of them is `{how}`."


def _stored_already(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield comparisons of a new value with the stored one in a post-set callback, which runs when it is stored."""
    for function in named(tree, parameter_callbacks(tree, "add_post_set_parameters_callback")):
        compared = [node for node in walk(function) if isinstance(node, ast.Compare) and len(node.ops) == 1]
        sides = [(node, ast.unparse(node.left), ast.unparse(node.comparators[0])) for node in compared]
        asked = {frozenset((left, right)) for _, left, right in sides}
        for node, *both in sides:
            for one, other in (both, both[::-1]):
                stored = re.fullmatch(r"self\.get_parameter\((.+)\)\.value", other)
                each = one.removesuffix(".value")
                known = stored and (stored[1] == f"{each}.name" or {f"{each}.name", stored[1]} in asked)
                if known and one == f"{each}.value" and isinstance(node.ops[0], (ast.Eq, ast.NotEq)):
                    same = "true" if isinstance(node.ops[0], ast.Eq) else "false"
                    text = f"`{ast.unparse(node)}` is always {same}: a post-set callback runs when the new value is"
                    yield node.lineno, f"{text} stored. Keep the value before in an attribute of the node."
