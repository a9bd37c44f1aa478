"""Hints on the callbacks for parameters: what they are given, and what they must return."""

import ast
import re

from course.explaining.endings import around
from course.explaining.mixups import line_tree
from course.explaining.source import last_parameter, name_of, named, parameter_callbacks, parse, wrong_result
from course.foundation.syntax import walk


def list_of_parameters(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on `parameters['low']` in a parameter callback, which is given a list."""
    for function in around(code, source, parameter_callbacks(parse(source))):
        given = last_parameter(function)
        if re.search(rf"(?<![\w.]){given}\[\s*['\"]", code):
            return (
                f"`{given}` is a list of Parameters, each with `.name` and `.value`. A dict of them is "
                f"`{{each.name: each.value for each in {given}}}`; only those that are set are in it."
            )
    return ""


def parameters_for_one(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on `get_parameters('kp').value`, which takes and returns a list, and each letter for a name."""
    for node in (each for each in walk(line_tree(code)) if isinstance(each, ast.Attribute) and each.attr == "value"):
        asked = node.value
        if isinstance(asked, ast.Call) and name_of(asked.func) == "get_parameters" and len(asked.args) == 1:
            (name,) = getattr(asked.args[0], "elts", [])[:1] or asked.args
            one = f"{ast.unparse(asked.func).removesuffix('s')}({ast.unparse(name)}).value"
            return f"`get_parameters` takes a list of names and returns a list. For one parameter, write `{one}`."
    return ""


def parameter_kept(source: str) -> str:
    """Return the hint on a callback that keeps a Parameter in the place of its value: `new[each.name] = each`."""
    if re.search(r"get_parameter\([^()]*\)(?!\s*\.)|get_parameters\(", source):
        return ""  # another one may be meant
    tree = parse(source)
    for function in named(tree, parameter_callbacks(tree)):
        given = last_parameter(function)
        for made in (
            node for node in walk(function) if isinstance(node, (ast.DictComp, ast.GeneratorExp, ast.ListComp))
        ):
            kept = made.value if isinstance(made, ast.DictComp) else getattr(made.elt, "elts", [None])[-1]
            name = made.generators[0].target
            if ast.unparse(made.generators[0].iter) == given and kept and ast.unparse(kept) == ast.unparse(name):
                text = f"Line {made.lineno} keeps the whole Parameter for each name."
                return f"{text} Its value is `{ast.unparse(name)}.value`."
        for loop in (node for node in walk(function) if isinstance(node, ast.For)):
            if ast.unparse(loop.iter) != given or not isinstance(loop.target, ast.Name):
                continue
            for node in (each for each in walk(loop) if isinstance(each, ast.Assign)):
                if ast.unparse(node.value) == loop.target.id:
                    text = f"Line {node.lineno}: `{ast.unparse(node)}` keeps the whole Parameter."
                    return f"{text} Its value is `{loop.target.id}.value`."
    return ""


def no_check_result(found: re.Match[str], source: str) -> str:
    """Return the hint on a parameter that cannot be declared, because an on-set callback returns no result."""
    must = "must return `SetParametersResult(successful=...)`, on every path through it."
    if wrong := wrong_result(source):
        name, line, returned = wrong
        what = f"returns `{returned}` in line {line}" if returned else "returns nothing on some path through it"
        return f"The on-set callback '{name}' {what}. It {must}"
    return f"An on-set callback {must}"
