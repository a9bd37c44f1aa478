"""Remarks on a line at which a program waits in vain, with what to write there: from its text, where that is sure."""

import ast
import os
import re
from collections.abc import Sequence

from course.explaining.failure_report import Frame
from course.explaining.hangs import THREADS
from course.explaining.locks import locked, still_set
from course.explaining.source import (
    argument,
    callbacks,
    calls,
    covers,
    endless_looks,
    functions,
    name_of,
    named,
    parse,
    service_callbacks,
)
from course.foundation.syntax import walk

AWAITED_CALL = re.compile(r"\bawait ([\w.]+)\.call\(")

BLOCKS = re.compile(r"\.(send_goal|get_result|cancel_goal)\(")

SPINS_ITSELF = re.compile(r"\brclpy\.spin_once\(\s*self\b")


def remark(frames: Sequence[Frame], source: str) -> list[str]:
    """Return a line on why the program `source` waits in vain where it is; [] if that is not certain."""
    at = frames[-1] if frames else None
    if at is None:
        return []
    if looks := endless_look_at(frames, source):
        return looks
    if awaited := AWAITED_CALL.search(at.code):
        return [f"`call(...)` blocks here, before anything is awaited: write `await {awaited[1]}.call_async(...)`."]
    tree = parse(source)
    alone = not ("ThreadedExecutor(" in source or THREADS.search(source))
    if why_locked := locked(frames, source, alone=alone):
        return why_locked
    if flag_set := still_set(frames, source):
        return flag_set
    if in_turn := _look_with_a_limit(at, tree, alone=alone):
        return [in_turn]
    if shared := _shared_future(at, tree):
        why = (
            f"`{shared}` is the future of the newest call: while one call waits here, the next one stores its own there"
        )
        return [f"{why}. Keep it in a variable of the function."]
    if not alone:
        return []
    if SPINS_ITSELF.search(at.code) and any(frame.function in callbacks(tree) for frame in frames):
        spin = next((call for call in calls(tree, "spin") if ast.unparse(call.func) == "rclpy.spin"), None)
        if spin is not None:
            why = (
                f"`{ast.unparse(spin)}` spins the node already, and waits until this callback returns: leave this out."
            )
            how = " To wait for an answer, write `await client.call_async(...)` in an `async def`."
            return [f"{why}{how if 'call_async(' in source else ''}"]
    if _is_of_a_rate(at.code, tree):
        why = "A rate sleeps until another thread spins the node, and the only one is here"
        return [f"{why}: use `time.sleep(seconds)`, or an executor with several threads."]
    if before := _before_the_spin(frames, tree):
        return [before]
    loop = next((each for each in walk(tree) if isinstance(each, ast.While) and covers(each, at.line)), None)
    if loop is None or any(frame.function in callbacks(tree) for frame in frames):
        return []
    waits = next(calls(loop.test, "done"), None)
    spins = any("spin" in name_of(node) for node in walk(loop))
    if waits is None or spins or not isinstance(waits.func, ast.Attribute):
        return []
    future = ast.unparse(waits.func.value)
    instead = f"`rclpy.spin_until_future_complete({_node(tree, at.line)}, {future})`"
    return [f"Nothing spins the node while this loop waits, so no answer comes: write {instead} in its place."]


def of_an_action(frames: Sequence[Frame]) -> list[str]:
    """Return a line on a call of an action client that blocks the callback it is in; [] for another line."""
    call = BLOCKS.search(frames[-1].code) if frames else None
    if call is None:
        return []
    how = f"Write `{call[1]}_async(...).add_done_callback(self.FUNCTION)`, and go on in that function."
    return [
        f"`{call[1]}(...)` blocks its callback until the answer has come, which this wait itself may prevent. {how}"
    ]


def endless_look_at(frames: Sequence[Frame], source: str) -> list[str]:
    """Return a line on the loop where the program is, if that looks for a server until one comes; else []."""
    if not frames or not any(covers(loop, frames[-1].line) for loop in endless_looks(parse(source))):
        return []
    how = "look once, with a limit, or count the rounds and give up."
    if frames[-1].function == "__init__":
        how = (
            "it keeps the node from being spun meanwhile. Leave it out of the constructor: check `service_is_ready()` "
            "of the client where a request is sent."
        )
    elif frames[-1].function in service_callbacks(parse(source)):
        how = (
            "meanwhile the node answers no request. Check `service_is_ready()` of the client once, and say in the "
            "response that the server is not there."
        )
    return [f"This loop goes on until there is a server: {how}"]


def _look_with_a_limit(at: Frame, tree: ast.Module, *, alone: bool) -> str:
    """Return a line on a look for a server that waits inside the callback of a service, up to a limit; or ''."""
    for function in named(tree, service_callbacks(tree)):
        for method, instead in (("wait_for_service", "service_is_ready"), ("wait_for_server", "server_is_ready")):
            for call in calls(function, method):
                if covers(call, at.line) and argument(call, 0, "timeout_sec") is not None:
                    which, others = "its", "and meanwhile that answers no other caller"
                    if alone:
                        which, others = "the only", "so the callers wait one after the other"
                    return (
                        f"`{method}` keeps {which} thread until a server comes or its time is over, {others}. Ask "
                        f"`{instead}()`, which does not wait."
                    )
    return ""


def _shared_future(at: Frame, tree: ast.Module) -> str:
    """Return the attribute that a callback of a service polls, and in which each call keeps its future; else ''."""
    for function in named(tree, service_callbacks(tree)):
        made = [node for node in walk(function) if isinstance(node, ast.Assign) and [*calls(node, "call_async")]]
        kept = {ast.unparse(each) for node in made for each in node.targets if isinstance(each, ast.Attribute)}
        for loop in (each for each in walk(function) if isinstance(each, ast.While) and covers(each, at.line)):
            for call in calls(loop.test, "done"):
                if isinstance(call.func, ast.Attribute) and ast.unparse(call.func.value) in kept:
                    return ast.unparse(call.func.value)
    return ""


def _before_the_spin(frames: Sequence[Frame], tree: ast.Module) -> str:
    """Return a line on a loop of main() that waits for callbacks of the node, above the line that spins it; or ''."""
    main = next((each for each in functions(tree) if each.name == "main"), None)
    spins = [call.lineno for call in calls(main, "spin")] if main else []
    frame = next((each for each in frames if each.function == "main"), None)
    if main is None or frame is None or frames[0] is not frame or len(spins) != 1:
        return ""
    classes = {each.name for each in walk(tree) if isinstance(each, ast.ClassDef)}
    made = [node for node in walk(main) if isinstance(node, ast.Assign) and _makes(node.value, classes)]
    nodes = {ast.unparse(each) for node in made for each in node.targets}
    for loop in (each for each in walk(main) if isinstance(each, ast.While) and covers(each, frame.line)):
        asked = {ast.unparse(each) for each in walk(loop.test) if isinstance(each, ast.Name)}
        if asked & nodes and loop.lineno < spins[0] and not any("spin" in name_of(each) for each in walk(loop)):
            return (
                f"Nothing spins the node while the loop in line {loop.lineno} waits, so none of its callbacks is "
                f"called: write `rclpy.spin_once({min(asked & nodes)}, timeout_sec=0.1)` in the loop, or leave it out."
            )
    return ""


def _makes(value: ast.expr, classes: set[str]) -> bool:
    return isinstance(value, ast.Call) and name_of(value.func) in classes


def crowded(source: str, in_calls: int) -> list[str]:
    """Return a line on an executor all of whose threads, at least `in_calls`, block in a `call(...)`; [] otherwise."""
    _, count, _ = executor_threads(source)
    others = "SingleThreadedExecutor(" in source or THREADS.search(source)  # which may receive the answer
    if others or not 0 < count <= in_calls:
        return []
    why = f"All {count} threads of its executor wait in such a call, so none is left to receive an answer"
    return [f"{why}: give it more, or write `await client.call_async(...)`, which blocks none."]


def executor_threads(source: str) -> tuple[int, int, bool]:
    """Return the line that makes the only MultiThreadedExecutor of a program, and how many threads it has.

    And whether the program says so; (0, 0, False) if that is unknown.
    """
    made = list(calls(parse(source), "MultiThreadedExecutor"))
    given = argument(made[0], 0, "num_threads") if len(made) == 1 else None
    count = getattr(given, "value", None) if given else os.cpu_count()
    return (made[0].lineno, count, bool(given)) if len(made) == 1 and isinstance(count, int) else (0, 0, False)


def _is_of_a_rate(code: str, tree: ast.Module) -> bool:
    """Return True if a line sleeps by a rate of rclpy."""
    slept = re.search(r"([\w.]+|\))\.sleep\(\s*\)", code)
    if not slept:
        return False
    made = [node for node in walk(tree) if isinstance(node, ast.Assign) and [*calls(node.value, "create_rate")]]
    return "create_rate(" in code or slept[1] in {ast.unparse(each) for node in made for each in node.targets}


def _node(tree: ast.Module, line: int) -> str:
    """Return how the function around a line calls the node: `self` in a method, or `node`."""
    around = [each for each in functions(tree) if covers(each, line)]
    return "self" if any(argument.arg == "self" for each in around for argument in each.args.args) else "node"
