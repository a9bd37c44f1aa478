"""Helpers of public checks: what the text of a program, or its log, shows about a promise that it has not kept."""

import ast
import re
from pathlib import Path

from course.session.failure_report import frame_at, text_at
from course.session.node_process import NodeProcess
from course.session.source import CALLBACKS, argument, calls, functions, name_of, named, parse
from course.session.watch import Handle

LOOKS = re.compile(r"\b(?:is_cancel_requested|is_active|status|STATUS_CANCELING|goal_cancelled)\b")
LISTED = 6  # lines of a log that are shown


def no_cancel(file: str) -> str:
    """Return a sentence on an action server whose text never asks whether a cancel is requested; '' otherwise."""
    if LOOKS.search(text_at(Path(file))):
        return ""
    return (
        f". Nothing in {file} reads `is_cancel_requested` of the goal handle: the execute callback must look at it "
        "before each step"
    )


def published_only_if(file: str) -> str:
    """Return lines on a timer's callback that publishes in a branch alone; '' if it does so on every path."""
    source = text_at(Path(file))
    tree = parse(source)
    publishing = {each.name for each in functions(tree) if next(calls(each, "publish"), None)}
    timed = {name_of(argument(call, *CALLBACKS["create_timer"])) for call in calls(tree, "create_timer")}
    for function in named(tree, timed):
        others = {*publishing, "publish"} - {function.name}
        sends = [call for name in sorted(others) for call in calls(function, name)]
        if len(sends) != 1:
            continue
        at, why = sends[0].lineno, "A command must be published each time, also before the first scan."
        branches = [node for node in ast.walk(function) if isinstance(node, ast.If)]
        around = [node.lineno for node in branches if sends[0] in ast.walk(node)]
        if around and not _publishes(function.body, sends[0]):
            return (
                f"\n{frame_at(file, at, source)}\nThis runs in a branch of the `if` of line {min(around)} alone. {why}"
            )
        ends = [each.lineno for node in branches for each in ast.walk(node) if isinstance(each, ast.Return)]
        if ends and min(ends) < at:
            return f"\n{frame_at(file, min(ends), source)}\nThis ends '{function.name}' without a command. {why}"
    return ""


def _publishes(body: list[ast.stmt], send: ast.Call) -> bool:
    """Return True if the statement with `send` is one of `body` itself, or of a block there that always runs."""
    for statement in body:
        if isinstance(statement, (ast.With, ast.Try)):
            if _publishes(statement.body, send) or (
                isinstance(statement, ast.Try) and _publishes(statement.finalbody, send)
            ):
                return True
        elif not isinstance(statement, (ast.If, ast.For, ast.While, ast.Match)) and send in ast.walk(statement):
            return True
    return False


def log_of(server: Handle) -> str:
    """Return lines with the end of a program's log, and on a level of its text that is not shown."""
    if not isinstance(server, NodeProcess):
        return ""
    lines = [line for line in server.output.splitlines() if line.strip()][-LISTED:]
    shown = "".join(f"\n  {line}" for line in lines)
    found = f"\nThe end of its log is:{shown}" if shown else "\nIts log is empty."
    for call in calls(parse(server.source), "debug"):
        if isinstance(call.func, ast.Attribute) and "logger" in ast.unparse(call.func.value):
            at = frame_at(server.name, call.lineno, server.source)
            return f"{found}\n{at}\nWhat is logged with `debug` is not shown by default: use `info`."
    return found
