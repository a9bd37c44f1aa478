"""Hints on requests and goals that a callback answers in the wrong way: by an exception, or by a second end."""

import ast
import re

from course.explaining.source import (
    Function,
    argument,
    calls,
    covers,
    functions,
    name_of,
    named,
    parameter_callbacks,
    parse,
    service_callbacks,
)
from course.foundation.syntax import walk

ENDS = {"ABORTED": "abort", "CANCELED": "canceled", "SUCCEEDED": "succeed"}
GOAL_CALLBACK, CANCEL_CALLBACK = (9, "goal_callback"), (10, "cancel_callback")  # of an ActionServer


def refused_by_raising(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a callback whose own `raise` is meant to refuse what it is asked; '' for another line."""
    if not re.match(r"raise (?!SystemExit|KeyboardInterrupt|ExternalShutdown)\w", code):
        return ""
    tree = parse(source)
    if around(code, source, parameter_callbacks(tree, "add_on_set_parameters_callback")):
        return "An exception does not refuse values: `return SetParametersResult(successful=False, reason='...')` does."
    if around(code, source, _given(tree, GOAL_CALLBACK)):
        return "An exception does not reject a goal: `return GoalResponse.REJECT` does."
    if around(code, source, service_callbacks(tree)):
        how = ", `response.success = False`," if re.search(r"\bresponse\.success\b", source) else ""
        return f"An exception sends no response. To refuse a request, say so in the response{how} and return it."
    return ""


def ended_twice(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a goal that has already ended, or has been ended in a state that does not allow it."""
    state, event = found[1], found[2]
    if state == "EXECUTING" and event == "CANCELED":
        tree = parse(source)
        if any(next(calls(each, "canceled"), None) for each in named(tree, _given(tree, CANCEL_CALLBACK))):
            return (
                "The cancel callback only answers the request: it returns `CancelResponse.ACCEPT`. The execute "
                "callback calls `canceled()` when it sees `goal_handle.is_cancel_requested`."
            )
        return "Nobody has asked to cancel this goal: check `is_cancel_requested` before `canceled()`."
    if state not in ENDS:
        return ""
    ended = f"This goal has already ended, as {state.lower()}"
    if other := _elsewhere(ENDS[state], source, code):
        kept = [each.func.value for each in calls(parse(code), event.lower()) if isinstance(each.func, ast.Attribute)]
        if len(kept) == 1 and isinstance(kept[0], ast.Attribute):  # `self.newest`, and not a goal of its own
            how = f"Check first that it still runs: `if {ast.unparse(kept[0])}.is_active:`."
        else:
            leave = "leave the loop and return" if _in_a_loop(code, source) else "return"
            how = f"When `is_active` of the goal handle is False, {leave} the result, without ending the goal again."
        return f"{ended}, perhaps by `{ast.unparse(other)}` in line {other.lineno}. {how}"
    return f"{ended}. After `succeed()`, `canceled()` or `abort()`, leave the loop and return the result."


def _in_a_loop(code: str, source: str) -> bool:
    """Return True if the line `code` stands in a loop."""
    lines = [number for number, line in enumerate(source.splitlines(), 1) if line.strip() == code.strip()]
    loops = [each for each in walk(parse(source)) if isinstance(each, (ast.For, ast.While))]
    return any(covers(loop, line) for loop in loops for line in lines)


def _elsewhere(method: str, source: str, code: str) -> ast.Call | None:
    """Return the call that ends a goal in the same way in another function than the line's; None without one."""
    here = {each.lineno for each in around(code, source)}
    for function in functions(parse(source)) if here else ():
        if function.lineno not in here and (call := next(calls(function, method), None)) is not None:
            return call
    return None


def around(code: str, source: str, names: set[str] | None = None) -> list[Function]:
    """Return the functions (of these `names`) that have the line `code`, if the whole text has it once."""
    lines = [number for number, line in enumerate(source.splitlines(), 1) if line.strip() == code.strip()]
    tree = parse(source)
    if len(lines) != 1:  # then each of its places must be in one of these functions
        return [] if names is None or not lines else _holding_all(tree, lines, names)
    made = functions(tree) if names is None else named(tree, names)
    return [each for each in made if covers(each, lines[0])]


def _holding_all(tree: ast.Module, lines: list[int], names: set[str]) -> list[Function]:
    made = [*named(tree, names)]
    held = [any(covers(each, line) for each in made) for line in lines]
    return made if made and all(held) else []


def _given(tree: ast.Module, place: tuple[int, str]) -> set[str]:
    return {name_of(argument(call, *place)) for call in calls(tree, "ActionServer")} - {""}
