"""Hints on names that are not there: one that nothing sets, a module, a class, or an attribute of something else."""

import ast
import builtins
import contextlib
import difflib
import importlib
import pkgutil
import re
import sys
from collections.abc import Iterable
from pathlib import Path

import rclpy

from course.explaining.imports import imported, installed, is_there, places_of, told, wrong_import
from course.explaining.mixups import hidden_by_file
from course.explaining.source import (
    functions,
    functions_of,
    methods,
    name_of,
    node_classes,
    outside_of_its_class,
    parse,
    runs_out,
    set_on_self,
)
from course.foundation import cells
from course.foundation.syntax import walk
from course.foundation.untrusted import read_regular

MOST = 1_000_000  # bytes of a file that is searched
ALIKE = 0.8  # least similarity of two names of a module of rclpy
OWN_FILE = 0.7  # least similarity of a module's name and the file that may be meant


def unbound(found: re.Match[str], source: str) -> str:
    """Return the hint on a variable of a function that is read before it is set, or where another one is meant."""
    name, tree = found[1], parse(source)
    if any(name in map(name_of, getattr(each, "targets", [getattr(each, "target", None)])) for each in tree.body):
        return (
            f"`{name}` is a variable of the whole text: a function that sets it begins with `global {name}`. "
            f"In a node, keep it in `self.{name}`."
        )
    for outer in functions(tree):
        inner = [each for each in functions(outer) if each is not outer and _stores(each, name)]
        if inner and len(_stores(outer, name)) > sum(len(_stores(each, name)) for each in inner):
            first = f"`nonlocal {name}`"
            return f"`{name}` is a variable of `{outer.name}`: begin `{inner[0].name}`, which sets it, with {first}."
    if skipped := _except_goes_on(tree, name):
        return skipped
    if _is_kept(tree, name):
        return (
            f"`{name}` is a variable of this function alone, and no line has set it yet. If the node's is meant, write "
            f"`self.{name}`; if not, give it a value at the beginning."
        )
    if any(map(any, (_stores(function, name) for function in functions(tree)))):
        return f"No line that sets `{name}` in this function has run yet: give it a value at the beginning."
    for each in walk(tree):
        methods = list(functions(each)) if isinstance(each, ast.ClassDef) else []
        setting = [method.name for method in methods if _stores(method, name)]
        if "__init__" in setting and len(setting) > 1:
            return (
                f"`{name}` is a local variable of `__init__`, gone when `__init__` returns: use `self.{name}` in every "
                "method."
            )
    return ""


def _is_kept(tree: ast.Module, name: str) -> bool:
    """Return True if `__init__` keeps an attribute of this name, and another method of the class sets such a name."""
    for cls in (node for node in walk(tree) if isinstance(node, ast.ClassDef)):
        methods = {each.name: each for each in functions_of(cls)}
        begin = methods.pop("__init__", None)
        kept = {node.attr for node in set_on_self(begin)} if begin else set()
        if name in kept and any(_stores(each, name) for each in methods.values()):
            return True
    return False


def _except_goes_on(tree: ast.Module, name: str) -> str:
    """Return the hint on an `except` that goes on without the variable that its `try` sets; '' without one."""
    setting = [function for function in functions(tree) if _stores(function, name)]
    for function in setting if len(setting) == 1 else ():
        for node in walk(function):
            if not isinstance(node, ast.Try) or False not in _stores(ast.Module(node.body, []), name):
                continue
            for handler in node.handlers:
                called = name_of(getattr(getattr(handler.body[-1], "value", None), "func", None))
                leaves = called in ("exit", "_exit", "quit", "error") or not runs_out(handler.body)
                if not leaves and not _stores(handler, name):
                    return (
                        f"`{name}` is set in the `try` of line {node.lineno}, and the `except` in line "
                        f"{handler.lineno} goes on without it: leave the function there, with `return ...`, or set "
                        f"`{name}` there, too."
                    )
    return ""


def _stores(function: ast.AST, name: str) -> list[bool]:
    """Return, for each place that sets a name in a function, whether it is in a branch or a loop."""
    inside = (node for node in walk(function) if isinstance(node, (ast.If, ast.For, ast.While, ast.Try)))
    may_run = {id(node) for block in inside for node in walk(block)}
    return [
        id(node) in may_run
        for node in walk(function)
        if isinstance(node, ast.Name) and node.id == name and isinstance(node.ctx, ast.Store)
    ]


def no_such_class(found: re.Match[str], source: str) -> str:
    """Return the hint on a name that a module does not have."""
    name, module = found[1], found[2]
    if wrong := wrong_import(module, name, source):
        return wrong
    try:
        names = [each for each in dir(importlib.import_module(module)) if not each.startswith("_")]
    except ImportError:
        names = []
    of_types = module.rpartition(".")[2] in ("msg", "srv", "action") and not module.startswith("rclpy.")
    known = [each for each in names if each[:1].isupper() and "_" not in each] if of_types else names
    near = difflib.get_close_matches(name, known, 1)
    meant = f" Did you mean `{near[0]}`?" if near else ""
    usual = {COURSE: USUAL, "rclpy": OF_RCLPY}.get(module.split(".")[0], ())
    if name not in near and (place := _module_with(name, usual)):
        return f"{name} is in {place}: write `from {place} import {name}`."
    if name not in near and module.startswith("rclpy") and (types := places_of(name, installed())):
        return f"{module} has no {name}. {told(name, types)}"
    if owner := _class_with(name, module):
        return (
            f"`{name}` is a method of the class {owner} in {module}: write `from {module} import {owner}`, and call it "
            f"of an object, `{owner}().{name}(...)`."
        )
    if hasattr(builtins, name):
        return f"`{name}` is one of Python's own names: it needs no import."
    if not of_types:
        elsewhere = not near and module.split(".")[0] != COURSE  # a page's own names are all known here
        return f"{module} has no {name}{': look for the module that has it.' if elsewhere else '.'}{meant}"
    return (
        f"{module} has no {name}: compare spelling and capital letters with the name of the definition's file.{meant}"
    )


def _class_with(name: str, module: str) -> str:
    """Return the one class of a loaded module that has a method or a variable called `name`; '' without one."""
    own = [each for each in vars(sys.modules.get(module, object)).values() if isinstance(each, type)]
    found = [each.__name__ for each in own if each.__module__ == module and name in vars(each)]
    return found[0] if len(found) == 1 else ""


def of_rclpy(found: re.Match[str], source: str) -> str:
    """Return the hint on a class that is taken from `rclpy` itself, as `rclpy.Node`."""
    place = _module_with(found[1], OF_RCLPY)
    return f"{found[1]} is in {place}: write `from {place} import {found[1]}`." if place else ""


def _module_with(name: str, usual: Iterable[str]) -> str:
    """Return the one of the `usual` modules that makes `name`, or the first that has it; '' if none has."""
    having = []
    for module in usual:
        with contextlib.suppress(ImportError):
            if hasattr(made := importlib.import_module(module), name):
                having.append((module, getattr(getattr(made, name), "__module__", None)))
    own = [module for module, maker in having if f"{maker}.".startswith(f"{module}.")]
    return next(iter(own or [module for module, _ in having]), "")


def _part_of_a_module(named: str, source: str) -> str:
    """Return the hint on a class or a function that a program imports as if it were a module: `rclpy.node.Node`."""
    module, _, name = named.rpartition(".")
    imports = (node for node in walk(parse(source)) if isinstance(node, ast.Import))
    if not module or named not in (alias.name for node in imports for alias in node.names):
        return ""
    with contextlib.suppress(ImportError):
        known = is_there(module.partition(".")[0])  # its modules of interfaces have nothing but classes
        if hasattr(importlib.import_module(module) if known else sys.modules.get(module), name):
            return f"`{name}` is a part of the module {module}: write `from {module} import {name}`."
    return ""


def _module_of_rclpy(module: str, source: str) -> str:
    """Return the hint on a module that rclpy does not have: `rclpy.executor`; '' if none is like it."""
    known = [f"rclpy.{each.name}" for each in pkgutil.iter_modules(rclpy.__path__)]
    near = difflib.get_close_matches(module, known, 1, ALIKE)
    names = imported(module, source)
    if not near or (names and not _module_with(names[0], near)):
        places = [(each, place) for each in names if (place := _module_with(each, OF_RCLPY))]
        if places:
            name, place = places[0]
            return f"rclpy has no module `{module}`. {name} is in {place}: write `from {place} import {name}`."
    return f"Did you mean `{near[0]}`?" if near else ""


def is_a_module(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a module that is used as if it were the function or the class of its name."""
    imports = (node for node in walk(parse(source)) if isinstance(node, ast.Import))
    for alias in (each for node in imports for each in node.names):
        name = alias.asname or alias.name
        if re.search(rf"(?<![\w.]){re.escape(name)}(?![\w.])", code):
            inside = dir(sys.modules.get(alias.name))
            last = alias.name.rpartition(".")[2]
            meant = last if last in inside else next((each for each in inside if each.lower() == last.lower()), "")
            how = f": write `from {alias.name} import {meant}`." if meant else ", not a function or a class."
            return f"`{name}` is the module {alias.name}{how}"
    return ""


def of_the_course(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on an argument for a function of the course that takes none."""
    return f"`course.{found[1]}()` takes no argument." if f"course.{found[1]}(" in code else ""


COURSE = "course"
OF_RCLPY = (
    "rclpy.node",
    "rclpy.action",
    "rclpy.executors",
    "rclpy.callback_groups",
    "rclpy.parameter",
    "rclpy.qos",
    "rclpy.duration",
    "rclpy.time",
    "rclpy.exceptions",
)


USUAL = (  # the modules that the pages import from
    "course.recorders",
    "course.figures",
    "course.notebook.terminal",
    "course.notebook.judging",
    "course.notebook.mutants",
    "course.world.node",
    "course.world.practice",
    "course.robot.agent",
    "course.robot.driver",
    "course.robot.sectors",
    "course.nodes.arm",
    "course.interfaces",
)


def _not_imported(name: str, source: str) -> bool:
    """Return True if a name is not that of an attribute, but of what makes its value, or of one of Python's modules.

    As in `self.time = time.monotonic()`, in a program without `import time`.
    """
    tree = parse(source)
    module = sys.modules.get(name) if name in sys.stdlib_module_names else None
    used = [node.attr for node in walk(tree) if isinstance(node, ast.Attribute) and ast.unparse(node.value) == name]
    if module and any(hasattr(module, each) for each in used):
        return True
    makes = [
        node.value
        for function in functions(tree)
        if name not in {each.arg for each in function.args.args}
        for node in walk(function)
        if isinstance(node, ast.Assign) and f"self.{name}" in map(ast.unparse, node.targets)
    ]
    return any(isinstance(each, ast.Name) and each.id == name for value in makes for each in walk(value))


def _class_in_capitals(name: str, source: str) -> str:
    """Return the hint on a class that is called in other letters: `state.LOOKING` for `State.LOOKING`."""
    tree = parse(source)
    used = [node.attr for node in walk(tree) if isinstance(node, ast.Attribute) and ast.unparse(node.value) == name]
    for cls in (node for node in walk(tree) if isinstance(node, ast.ClassDef)):
        members = {name_of(target) for line in cls.body for target in getattr(line, "targets", [])}
        if cls.name.lower() == name.lower() != cls.name and used and members.issuperset(used):
            return f"The class is called `{cls.name}`: write `{cls.name}.{used[0]}`."
    return ""


def own_attribute(found: re.Match[str], source: str) -> str:
    """Return the hint on a name that is not defined, where what is meant is known."""
    name = found[1]
    if name == "ros" and "rclpy.init(" in source:
        return (
            "A file is a program of its own, without the session `ros`: its `main()` creates the node and spins it, "
            "and the file ends with `if __name__ == '__main__': main()`."
        )
    owner = _holder(name, source)
    if found_class := _class_in_capitals(name, source):
        return found_class
    if re.search(rf"\bself\.{name}\b", source) and not _not_imported(name, source):
        of_the_node = " of the node" if "Node" in source else ""
        return f"An attribute{of_the_node} needs `{owner}.`: write `{owner}.{name}`."
    if name in methods(source):
        return f"`{name}` is a method of the node: write `{owner}.{name}`."
    if cls := _class_that_sets(name, source):
        return f"`{name}` is set in the class {cls}, outside of its methods: write `{cls}.{name}`."
    for path in sorted(Path.cwd().glob("*.py")):  # a class of an exercise's file, which no copy is: `x.edited-1.py`
        if not path.stem.isidentifier():
            continue
        with contextlib.suppress(OSError, ValueError):
            text = read_regular(path, MOST).decode(errors="replace")
            if not re.search(rf"^class {name}\b", text, re.MULTILINE):
                continue
            if not node_classes(parse(text)) and "rclpy" not in text:
                return f"`{name}` is a class of the file {path.name}: `from {path.stem} import {name}`."
            return (
                f"`{name}` is a class of the file {path.name}, which runs as a program of its own: "
                f"`ros.start('{path.name}')`."
            )
    return ""


def _class_that_sets(name: str, source: str) -> str:
    """Return the one class whose body sets a name, outside of its methods; '' without one."""
    classes = [node for node in walk(parse(source)) if isinstance(node, ast.ClassDef)]
    lines = [(cls.name, line) for cls in classes for line in cls.body]
    found = {cls for cls, line in lines if isinstance(line, ast.Assign) and name in map(name_of, line.targets)}
    found |= {cls for cls, line in lines if isinstance(line, ast.AnnAssign) and name_of(line.target) == name}
    return found.pop() if len(found) == 1 else ""


def _holder(name: str, source: str) -> str:
    """Return what holds the node where a name of it is used alone: `self`, or a variable of a function such as main."""
    tree = parse(source)
    classes = {node.name for node in walk(tree) if isinstance(node, ast.ClassDef)}
    for function in functions(tree):
        inside = [*walk(function)]
        if "self" in (each.arg for each in function.args.args) or name not in map(name_of, inside):
            continue
        for node in inside:
            if isinstance(node, ast.Assign) and name_of(getattr(node.value, "func", None)) in classes:
                return ast.unparse(node.targets[0])
    return "self"


def written_outside(found: re.Match[str], source: str) -> str:
    """Return the hint on a method that is written outside of its class, or inside another method."""
    if f"class {found[1]}" not in source:
        return ""
    if not (place := outside_of_its_class(found[2], source)):
        return _own_function(found[2], source)
    line, around = place
    where = f"inside of `{around}`" if around else "outside of the class"
    return f"`def {found[2]}(self, ...)` in line {line} stands {where}: indent it as the methods of {found[1]}."


def _own_function(name: str, source: str) -> str:
    """Return the hint on a function of the whole text that is called as if it were a method: `self.nearest(...)`."""
    made = [each for each in parse(source).body if isinstance(each, ast.FunctionDef) and each.name == name]
    is_set = re.search(rf"\bself\.{name}\s*=[^=]", source)
    if not made or is_set or not re.search(rf"\bself\.{name}\b", source):
        return ""
    return (
        f"`{name}` is a function outside of the class (line {made[0].lineno}), not a method: call it without `self.`, "
        f"`{name}(...)`."
    )


def is_module(found: re.Match[str], source: str) -> str:
    """Return the hint on a module that is not there."""
    package = found[1].split(".")[0]
    if found[1] == f"{package}.py":
        return f"An import names a module without `.py`: `{package}`."
    if part := _part_of_a_module(found[1], source):
        return part
    if package == COURSE and "." in found[1]:
        near = difflib.get_close_matches(found[1], USUAL, 1)
        return f"Did you mean `{near[0]}`?" if near else ""
    if "." in found[1] and (hidden := hidden_by_file(found, source)):
        return hidden
    if package == rclpy.__name__ and "." in found[1]:
        return _module_of_rclpy(found[1], source)
    if wrong := wrong_import(found[1], "", source):
        return wrong
    if is_there(package):
        return ""
    stem = package.removesuffix("_interfaces")
    if stem != package and (there := [each for each in (f"{stem}_srvs", f"{stem}_msgs") if is_there(each)]):
        return f"There is no package {package}: did you mean {' or '.join(f'`{each}`' for each in there)}?"
    if package.endswith("_interfaces") or package == "my_package":
        return f"{package} is not built here: run the cell that builds it, with `%%exercise` or `build(...)`."
    for notebook in cells.notebooks(Path()):  # one that lacks the file of an exercise's cell
        with contextlib.suppress(OSError, ValueError):
            if f'"%%exercise {package}.py' in read_regular(notebook, MOST).decode(errors="replace"):
                return f"{package}.py is not in this folder yet: run the cell `%%exercise {package}.py` first."
    if near := difflib.get_close_matches(package, [path.stem for path in Path().glob("*.py")], 1, OWN_FILE):
        return f"This folder has {near[0]}.py, but no {package}.py: did you mean `{near[0]}`?"
    return ""
