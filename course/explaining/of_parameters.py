"""Hints on the callbacks for parameters: what they are given, and what they must return."""

import re

from course.explaining.endings import around
from course.explaining.source import parameter_callbacks, parse, wrong_result


def list_of_parameters(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on `parameters['low']` in a parameter callback, which is given a list."""
    for function in around(code, source, parameter_callbacks(parse(source))):
        given = function.args.args[-1].arg if function.args.args else ""
        if re.search(rf"(?<![\w.]){given}\[\s*['\"]", code):
            return (
                f"`{given}` is a list of Parameters, each with `.name` and `.value`. A dict of them is "
                f"`{{each.name: each.value for each in {given}}}`; only those that are set are in it."
            )
    return ""


def no_check_result(found: re.Match[str], source: str) -> str:
    """Return the hint on a parameter that cannot be declared, because an on-set callback returns no result."""
    must = "must return `SetParametersResult(successful=...)`, on every path through it."
    if wrong := wrong_result(source):
        name, line, returned = wrong
        what = f"returns `{returned}` in line {line}" if returned else "returns nothing on some path through it"
        return f"The on-set callback '{name}' {what}. It {must}"
    return f"An on-set callback {must}"
