"""Comparisons with a text that nothing can be equal to, because another spelling of it is the one that comes."""

import ast
import difflib
from collections.abc import Iterator

from course.explaining.source import calls, name_of
from course.foundation.syntax import walk

OPERATIONS = ("add", "subtract", "multiply", "divide")  # of the calculator
ALIKE = 0.8  # least similarity of two spellings of a word
CHANGED = ("capitalize", "replace", "title", "translate", "upper")  # methods that make another spelling of a text
INDIRECT = ("setattr", "vars", "__dict__", "__setattr__", "update")  # set attributes whose names are not written


def misspelt_texts(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield the comparisons of a text with a misspelt operation, or with a state that nothing sets."""
    yield from ((line, text) for line, _, text in operations(tree))
    yield from _states(tree)


def _compared(tree: ast.AST) -> Iterator[tuple[ast.Compare, ast.expr, str]]:
    """Yield the comparisons for equality with a text that is written out: what is compared, and the text."""
    for node in walk(tree):
        if isinstance(node, ast.Compare) and len(node.ops) == 1 and isinstance(node.ops[0], (ast.Eq, ast.NotEq)):
            sides = node.left, node.comparators[0]
            for one, other in (sides, sides[::-1]):
                if isinstance(other, ast.Constant) and isinstance(other.value, str):
                    yield node, one, other.value


def operations(tree: ast.AST) -> Iterator[tuple[int, str, str]]:
    """Yield the comparisons with a misspelt operation: the line, the operation that is meant, and a sentence."""
    written = {node.value for node in walk(tree) if isinstance(node, ast.Constant)}
    kept = {
        name_of(target)
        for node in walk(tree)
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Attribute) and node.value.attr == "operation"
        for target in node.targets
    }
    asked = [
        (node, word)
        for node, one, word in _compared(tree)
        if (isinstance(one, ast.Attribute) and one.attr == "operation")
        or (isinstance(one, ast.Name) and one.id in kept)
    ]
    meant = {word: _near(word, OPERATIONS) for _, word in asked}
    if len({*meant.values()} - {""}) < 2 or any(next(calls(tree, name), None) for name in CHANGED):
        return
    for node, word in asked:
        if meant[word] and meant[word] not in written:
            why = f"`{ast.unparse(node)}` compares with '{word}', which no client sends."
            yield node.lineno, meant[word], f"{why} The operation is called '{meant[word]}'."


def _states(tree: ast.AST) -> Iterator[tuple[int, str]]:
    nodes = [*walk(tree)]
    names = {name_of(node) for node in nodes} | {node.value for node in nodes if isinstance(node, ast.Constant)}
    for node, one, word in () if names & {*INDIRECT} else _compared(tree):
        if not isinstance(one, ast.Attribute) or name_of(one.value) != "self":
            continue
        near = _near(word, _set_to(nodes, one.attr))
        if near and near != word:
            when = "never" if isinstance(node.ops[0], ast.Eq) else "always"
            why = f"nothing sets `{ast.unparse(one)}` to '{word}', so `{ast.unparse(node)}` is {when} true."
            yield node.lineno, f"{why} Did you mean '{near}'?"


def _set_to(nodes: list[ast.AST], name: str) -> tuple[str, ...]:
    """Return the texts that the attributes of this name are set to; () if one may be set to something else."""
    stored = {id(node) for node in nodes if name_of(node) == name and isinstance(getattr(node, "ctx", 0), ast.Store)}
    values: list[ast.expr] = []
    for node in nodes:
        targets = getattr(node, "targets", [getattr(node, "target", None)])
        mine = [each for each in targets if id(each) in stored and isinstance(node, (ast.Assign, ast.AnnAssign))]
        stored -= {*map(id, mine)}
        if mine and isinstance(node, (ast.Assign, ast.AnnAssign)) and node.value:
            values.append(node.value)
    for value in values:
        if isinstance(value, ast.IfExp):
            values += [value.body, value.orelse]
    texts = [each for each in values if not isinstance(each, ast.IfExp)]
    if stored or not all(isinstance(each, ast.Constant) and isinstance(each.value, str) for each in texts):
        return ()
    return tuple(str(each.value) for each in texts if isinstance(each, ast.Constant))


def _near(word: str, known: tuple[str, ...]) -> str:
    """Return which of these a word is, or is a misspelling of; '' for none."""
    if word in known:
        return word
    same = [each for each in known if each.lower() == word.strip().lower()]
    return next(iter(same or difflib.get_close_matches(word, known, 1, ALIKE)), "")
