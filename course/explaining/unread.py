"""Values in a text that go into a name which nothing reads, where another name of the text is meant."""

import ast
import difflib
from collections.abc import Collection, Iterator

from course.explaining.interface_fields import fields_of
from course.explaining.source import (
    argument,
    calls,
    functions_of,
    inside,
    last_parameter,
    name_of,
    named,
    service_callbacks,
)
from course.foundation.syntax import walk

LIKE = 0.85  # least similarity of two attributes' names that should be the same
LIKE_NONE = 0.7  # the same, if the one that is read is set to None and to nothing else
BY_NAME = {"locals", "vars", "getattr", "eval", "exec", "__dict__"}  # a text with one of them may read any name


def unread(tree: ast.AST, *, whole: bool) -> Iterator[tuple[int, str]]:
    """Yield each such value as its line and a sentence.

    Attributes are looked at only in a `whole` file: those of a cell's class may be read in another cell.
    """
    nodes = [*walk(tree)]
    if BY_NAME.intersection(map(name_of, nodes)):
        return
    given = {each.arg for function in named(tree, service_callbacks(tree)) for each in function.args.args[-2:]}
    loaded = [node for node in nodes if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Load)]
    read = {node.attr for node in loaded if not (isinstance(node.value, ast.Name) and node.value.id in given)}
    answers = dict(_answers(tree, {*read} if whole else None))
    yield from answers.values()
    for cls in (node for node in nodes if isinstance(node, ast.ClassDef)):
        yield from _without_self(cls, {*answers})
        if whole:
            yield from _misspelt(cls, read)
            yield from _never_set(cls, nodes)


def _answers(tree: ast.AST, read: Collection[str] | None) -> Iterator[tuple[ast.Assign, tuple[int, str]]]:
    """Yield values that a service callback keeps to itself, and that are called like a field of its response.

    `read` are the attributes that something reads, None if that is not known.
    """
    for call in calls(tree, "create_service"):
        known = fields_of(tree, argument(call, 0, "srv_type"), "Response")
        for function in named(tree, {name_of(argument(call, 2, "callback"))}):
            response = last_parameter(function)
            always = _fields_set(function.body, response)
            fields = {*known}.union(*(_fields_set(body, response) for body in _bodies(function)))
            for body in _bodies(function):
                here = always | _fields_set(body, response)
                for statement, target in _assigned(body):
                    field = name_of(target)
                    if field not in fields or field in here:
                        continue
                    if isinstance(target, ast.Name) and not _uses(function, field):
                        why = f"a variable of '{function.name}' alone, and nothing reads it"
                    elif _is_of_self(target) and read is not None and field not in read:
                        why = "an attribute of the node, and nothing in the file reads it"
                    else:
                        continue
                    text = f"`{ast.unparse(target)}` is {why}. To answer with it, write `{response}.{field} = ...`."
                    yield statement, (statement.lineno, text)


def _without_self(cls: ast.ClassDef, told: Collection[ast.Assign]) -> Iterator[tuple[int, str]]:
    """Yield variables of a method that nothing reads, and that are called like an attribute which its class reads."""
    attributes = [node for node in walk(cls) if isinstance(node, ast.Attribute) and _is_of_self(node)]
    read = {node.attr for node in attributes if isinstance(node.ctx, ast.Load)} - {
        each.name for each in functions_of(cls)
    }
    for function in functions_of(cls):
        kept = {node.attr for node in walk(function) if node in attributes and isinstance(node.ctx, ast.Store)}
        for body in _bodies(function):
            for statement, target in _assigned(body):
                name = target.id if isinstance(target, ast.Name) else ""
                if name in read - kept and statement not in told and not _uses(function, name):
                    text = f"`{name}` is a variable of '{function.name}' alone, and nothing reads it. To set the"
                    yield statement.lineno, f"{text} attribute of the object, write `self.{name} = ...`."


def _never_set(cls: ast.ClassDef, nodes: list[ast.AST]) -> Iterator[tuple[int, str]]:
    """Yield variables of a method that hide an attribute: one that is read, and that only `__init__` sets.

    It is set to None; or to a bool, and the variable to what the method is given: `stopped = request.data`.
    """
    begins = next((each for each in functions_of(cls) if each.name == "__init__"), None)
    if begins is None or "setattr" in map(name_of, nodes):
        return
    stored = [node for node in nodes if isinstance(node, ast.Attribute) and not isinstance(node.ctx, ast.Load)]
    first = {
        name_of(target): statement.value.value
        for statement, target in _assigned(begins.body)
        if _is_of_self(target) and isinstance(statement.value, ast.Constant)
    }
    for function in functions_of(cls):
        given = [each.arg for each in function.args.args[1:]]
        own = [node for node in walk(function) if isinstance(node, ast.Attribute) and _is_of_self(node)]
        for body in _bodies(function):
            for statement, target in _assigned(body):
                name, value = target.id if isinstance(target, ast.Name) else "", first.get(name_of(target))
                of_the_call = isinstance(statement.value, ast.Attribute) and name_of(statement.value.value) in given
                once = sum(node.attr == name for node in stored) == 1 and name not in map(name_of, own)
                read = any(
                    isinstance(node, ast.Attribute) and node.attr == name and _is_of_self(node)
                    for node in walk(cls)
                    if node not in stored
                )
                stays = name in first and (value is None or (isinstance(value, bool) and of_the_call))
                if stays and once and read and _uses(function, name):
                    text = f"`{name}` is a variable of '{function.name}' alone, and nothing sets `self.{name}`, which"
                    yield statement.lineno, f"{text} stays {value!r}. To set that, write `self.{name} = ...`."


def _misspelt(cls: ast.ClassDef, read: set[str]) -> Iterator[tuple[int, str]]:
    """Yield attributes that nothing reads, called nearly like one that `__init__` sets and something reads."""
    begins = next((each for each in functions_of(cls) if each.name == "__init__"), None)
    stored = [node for node in walk(cls) if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store)]
    stored = [node for node in stored if _is_of_self(node)]
    first = {node.attr for node in stored if begins and begins.lineno <= node.lineno <= (begins.end_lineno or 0)}
    for node in stored:
        if node.attr in first or node.attr in read or any(letter.isdigit() for letter in node.attr):
            continue
        near = difflib.get_close_matches(node.attr, first.intersection(read), 1, LIKE)
        near = near or difflib.get_close_matches(node.attr, sorted(only_none(cls) & read), 1, LIKE_NONE)
        if near:
            yield node.lineno, f"nothing in the file reads `self.{node.attr}`. Did you mean `self.{near[0]}`?"


def only_none(cls: ast.ClassDef) -> set[str]:
    """Return the attributes that a class sets to None, and to nothing else, by its text."""
    if next(calls(cls, "setattr"), None):
        return set()
    nodes = [*walk(cls)]
    none = [
        target
        for node in nodes
        if isinstance(node, (ast.Assign, ast.AnnAssign)) and isinstance(node.value, ast.Constant)
        if node.value.value is None
        for target in (node.targets if isinstance(node, ast.Assign) else [node.target])
    ]
    stored = [node for node in nodes if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store)]
    return {name_of(each) for each in none if isinstance(each, ast.Attribute) and _is_of_self(each)} - {
        each.attr for each in stored if each not in none
    }


def _assigned(body: list[ast.stmt]) -> Iterator[tuple[ast.Assign, ast.expr]]:
    """Yield the statements of a block that give a value to one name, with that name."""
    for statement in body:
        if isinstance(statement, ast.Assign) and len(statement.targets) == 1:
            yield statement, statement.targets[0]


def _bodies(function: ast.AST) -> Iterator[list[ast.stmt]]:
    """Yield the blocks of a function, without those of functions inside it."""
    for node in (function, *inside(function)):
        if node is function or not isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda, ast.ClassDef)):
            for part in ("body", "orelse", "finalbody"):
                if isinstance(body := getattr(node, part, None), list):
                    yield body


def _fields_set(body: list[ast.stmt], owner: str) -> set[str]:
    """Return the fields of `owner` that the statements of a block set themselves."""
    made = [target for each in body if isinstance(each, ast.Assign) for target in each.targets]
    return {name_of(each) for each in made if isinstance(each, ast.Attribute) and name_of(each.value) == owner}


def _uses(function: ast.AST, name: str) -> bool:
    """Return True if a function reads or deletes a variable, or says that it is not its own."""
    nodes = [*walk(function)]
    return any(name in node.names for node in nodes if isinstance(node, (ast.Global, ast.Nonlocal))) or any(
        node.id == name and not isinstance(node.ctx, ast.Store) for node in nodes if isinstance(node, ast.Name)
    )


def _is_of_self(node: ast.expr) -> bool:
    return isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "self"
