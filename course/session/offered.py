"""Finds out from a program's text that it cannot offer a certain service, action or topic."""

import ast
import re
from collections.abc import Mapping
from pathlib import Path

from course.explaining.source import argument, callbacks, calls, functions, name_of, parse
from course.foundation.syntax import walk
from course.ros.names import SERVICES_OF_EVERY_NODE, base, can_be, is_of_every_node
from course.session.node_process import NodeProcess
from course.session.watch import Handle

# What makes a node's endpoints, and position and name of the argument with their name.
MAKERS = {
    "create_service": (1, "srv_name"),
    "create_client": (1, "srv_name"),
    "create_publisher": (1, "topic"),
    "create_subscription": (1, "topic"),
    "ActionServer": (2, "action_name"),
    "ActionClient": (2, "action_name"),
}


def may_serve(source: str, service: str) -> bool:
    """Return False if a program's text shows that it cannot serve `service`: it makes others, or no node of that name.

    The text of a node may be unknown (''): it may serve anything.
    """
    if is_of_every_node(service):
        return not source or base(service.rpartition("/")[0]) in source
    if source and _without_ros(source):
        return False
    others = other_names(source, "create_service", service)
    return "/_action/" in service or not (others or _has_none(source, "create_service"))


def may_act(source: str, action: str) -> bool:
    """Return False if a program's text shows that it has no action server of that name."""
    tree = parse(source)
    none = bool(source) and not list(calls(tree, "ActionServer")) and not _own_modules(tree)
    return not (none or other_names(source, "ActionServer", action))


def services_made(source: str) -> list[str] | None:
    """Return the services that a program can make by its text, as written there; None if it may make any.

    Those that every node has are among them, unless it makes no node.
    """
    if not source:
        return None
    if _without_ros(source):
        return []
    made = [argument(call, *MAKERS["create_service"]) for call in calls(parse(source), "create_service")]
    names = [given.value for given in made if isinstance(given, ast.Constant) and isinstance(given.value, str)]
    if len(names) < len(made) or "ActionServer" in source or not (names or _has_none(source, "create_service")):
        return None
    return [*names, *sorted(SERVICES_OF_EVERY_NODE)]


def other_names(source: str, maker: str, name: str, *, reached: bool = False) -> list[tuple[str, int]]:
    """Return the names that a program passes to `maker`, with their lines, if none can be `name`; else [].

    That is known only if all of them are written out.  With `reached`, calls behind a `return` are left out.
    """
    found, tree = [], parse(source)
    never = _never_reached(tree) if reached else {}
    for call in (each for each in calls(tree, maker) if each not in never):
        given = argument(call, *MAKERS[maker])
        if not (isinstance(given, ast.Constant) and isinstance(given.value, str)):
            return []
        if can_be(f"/{name}", given.value):
            return []
        found.append((given.value, call.lineno))
    return found


def client_for_service(source: str, service: str) -> str:
    """Return the hint on a program that makes a client of `service`, and no service at all; '' for another one."""
    clients = [line for name, line in _named(source, "create_client") if can_be(service, name)]
    if not clients or "create_service" in source:
        return ""
    return (
        f"`create_client(...)` in line {clients[0]} makes a client, which asks. A server is made with "
        f"`create_service(TheType, '{service}', self.callback)`."
    )


def never_made(place: str, source: str, service: str) -> str:
    """Return lines about a `create_service` for `service` that has not run: in a callback, or behind a `return`; ''."""
    tree = parse(source)
    for function in functions(tree):
        for call in calls(function, "create_service"):
            name = argument(call, *MAKERS["create_service"])
            if not (isinstance(name, ast.Constant) and can_be(service, str(name.value))):
                continue
            code = source.splitlines()[call.lineno - 1].strip()
            at = f"\n  {place}, line {call.lineno}, in {function.name}\n    {code}"
            if function.name in callbacks(tree):
                return (
                    f"{at}\nThis is in a callback, and runs only when that is called. Make the service in `__init__`."
                )
            if call in (never := _never_reached(tree)):
                return f"{at}\nThis never runs: the `return` of line {never[call]} ends '{function.name}'."
    return ""


def _never_reached(tree: ast.Module) -> dict[ast.AST, int]:
    """Return what stands behind a `return` of its own block, with the line of the `return`."""
    found: dict[ast.AST, int] = {}
    for block in walk(tree):
        body = getattr(block, "body", None)
        body = body if isinstance(body, list) else []
        ends = next((number for number, each in enumerate(body) if isinstance(each, ast.Return)), len(body))
        for statement in body[ends + 1 :]:
            found |= {node: found.get(node, body[ends].lineno) for node in walk(statement)}
    return found


def _named(source: str, maker: str) -> list[tuple[str, int]]:
    """Return the names that a program passes to `maker` as they are written out, with their lines."""
    given = [(argument(call, *MAKERS[maker]), call.lineno) for call in calls(parse(source), maker)]
    return [(str(each.value), line) for each, line in given if isinstance(each, ast.Constant)]


def none_will_offer(handles: Mapping[str, Handle], maker: str, name: str) -> bool:
    """Return True if programs of the session run, and the text of none of them can offer `name` by `maker`."""
    if "/_action/" in name:
        return False
    texts = [each.source for each in list(handles.values()) if isinstance(each, NodeProcess) and each.alive]
    return bool(texts) and all(other_names(text, maker, name, reached=True) or _has_none(text, maker) for text in texts)


def strangers(one: str, other: str) -> bool:
    """Return True if two programs, by their texts, use no service, action or topic in common.

    A name of both may be in different namespaces: then they count as acquainted, as do programs with unknown names.
    """
    if any(each and _without_ros(each) for each in (one, other)):
        return True
    ours, theirs = _names_used(one), _names_used(other)
    return ours is not None and theirs is not None and ours.isdisjoint(theirs)


def _names_used(source: str) -> set[str] | None:
    """Return the services, actions and topics of a program, without namespaces; None if its text does not tell."""
    tree = parse(source)
    if not source or _own_modules(tree) or re.search(r"\bcourse\.nodes\b|ParameterClient\b", source):
        return None
    given = [argument(call, *MAKERS[maker]) for maker in MAKERS for call in calls(tree, maker)]
    names = {each.value for each in given if isinstance(each, ast.Constant) and isinstance(each.value, str)}
    written = all(isinstance(each, ast.Constant) for each in given)
    known = written and bool(names or not any(maker in source for maker in MAKERS))
    return {*map(base, names)} if known and not any(map(is_of_every_node, names)) else None


def _without_ros(source: str) -> bool:
    """Return True if a program imports neither rclpy nor the course, nor files beside it, which might do so."""
    return not re.search(r"\b(?:rclpy|course)\b", source) and not _own_modules(parse(source))


def _has_none(source: str, maker: str) -> bool:
    """Return True if a program, made of nothing but classes derived from Node, does not use `maker` at all."""
    tree = parse(source)
    classes = [node for node in walk(tree) if isinstance(node, ast.ClassDef)]
    plain = all(name_of(base) == "Node" for each in classes for base in each.bases)
    return bool(classes) and plain and maker not in source and not _own_modules(tree)


def _own_modules(tree: ast.AST) -> list[str]:
    """Return the modules that a program imports from files beside it."""
    named = [node.module for node in walk(tree) if isinstance(node, ast.ImportFrom) and node.module]
    named += [alias.name for node in walk(tree) if isinstance(node, ast.Import) for alias in node.names]
    return [name for name in named if Path(f"{name}.py").exists()]
