"""Hints on wrong imports of ROS interfaces: compares with the installed ones, and names the right line."""

import ast
import difflib
import os
import re
from pathlib import Path

from course.explaining.source import parse
from course.foundation.syntax import walk

INDEX = Path("share", "ament_index", "resource_index", "rosidl_interfaces")
INTERFACE = re.compile(r"(msg|srv|action)/([A-Z]\w*)\.(?:msg|srv|action|idl)")
OF_A_PROGRAM = "my_package"  # the package of programs in the text, which has no interfaces
LISTED = 3  # possible imports in a hint


def installed() -> dict[str, dict[str, list[str]]]:
    """Return the names of importable interfaces by package, then by kind (msg, srv, action)."""
    found: dict[str, dict[str, list[str]]] = {}
    for prefix in filter(None, os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)):
        for path in sorted(Path(prefix, INDEX).glob("*")):
            kinds = found.setdefault(path.name, {})
            for kind, name in sorted(set(INTERFACE.findall(path.read_text(encoding="utf-8", errors="replace")))):
                kinds.setdefault(kind, []).append(name)
    return found


def wrong_import(module: str, name: str, source: str) -> str:
    """Return the hint on a failed import of `name` from `module`, or ''.

    Without a `name` the module itself is missing: the imported names are in `source`.
    """
    known = installed()
    package, _, kind = module.partition(".")
    for each in [name] if name else imported(module, source):
        places = places_of(each, known)
        own = [place for place in places if place.split(".")[0] == package]
        if own:
            return f"{each} is in {own[0]}: write `from {own[0]} import {each}`."
        if places and package in known:
            first = sorted(places, key=lambda place: place.split(".")[1] != kind)
            return f"{package} has no {each}. {told(each, first)}"
        if len(places) == 1 and package == OF_A_PROGRAM:
            return f"{each} is in {places[0]}: write `from {places[0]} import {each}`."
    if package in known and kind not in known[package] and not name:
        kinds = sorted(known[package])
        return f"{package} has {' and '.join(kinds)}, but no {kind}: `from {package}.{kinds[0]} import ...`."
    near = difflib.get_close_matches(package, known, 1, 0.85) if package not in known and not name else []
    return f"Did you mean the package {near[0]}?" if near else ""


def places_of(name: str, known: dict[str, dict[str, list[str]]]) -> list[str]:
    """Return the modules of the `known` interfaces (see `installed`) that have an interface called `name`."""
    return [f"{package}.{of}" for package, kinds in known.items() for of, names in kinds.items() if name in names]


def told(name: str, places: list[str]) -> str:
    """Return sentences on the modules that have `name`, and how to import it from the first."""
    return f"It is in {' and in '.join(places[:LISTED])}: write `from {places[0]} import {name}`."


def is_there(package: str) -> bool:
    """Return True if a package of interfaces can be imported here."""
    return package in installed()


def imported(module: str, source: str) -> list[str]:
    """Return the names that a program imports from `module`, or from modules in it."""
    imports = (node for node in walk(parse(source)) if isinstance(node, ast.ImportFrom) and node.module)
    inside = (node for node in imports if f"{node.module}.".startswith(f"{module}."))
    return [alias.name for node in inside for alias in node.names]
