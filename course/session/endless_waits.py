"""Finds out from the stacks of a program's threads that it waits for something that cannot come, and says why."""

import ast
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from course.session.failure_report import text_at
from course.session.source import WAITS, argument, calls, name_of, parse

BLOCKING = ("call", "send_goal", "get_result", "cancel_goal")  # each has a twin that ends in `_async`
# Methods that wait for a server, what creates their client, and the position and name of its argument with the name.
SERVERS = {"wait_for_service": ("create_client", 1, "srv_name"), "wait_for_server": ("ActionClient", 2, "action_name")}
OF_RCLPY = re.compile(r"/rclpy/(.+)$")
EXECUTORS, FOR_ITSELF = "executors.py", "__init__.py"  # rclpy's files with the executors, and with `rclpy.spin`
CALLBACK = "handler"  # the executors' function that runs a callback of a node

Call = tuple[str, int, str]  # file, line and function of a frame


def endless_wait(stacks: str, path: Path, served: Mapping[str, Sequence[str]]) -> str:
    """Return why the program at `path`, with these `stacks` (output of `faulthandler`), waits without end; else ''.

    `served` are the services and actions that have a server, with their types.
    """
    source, threads = text_at(path), list(_threads(stacks))
    for thread in threads:
        own = next((number for number, call in enumerate(thread) if _is_own(call, path)), None)
        if own is None:
            continue
        line = thread[own][1]
        waiting = _waiting_call(source, line, [function for _, function in map(_of_rclpy, thread[:own])])
        if waiting in SERVERS and (why := _no_server(source, line, waiting, served)):
            return why
        if any(_may_spin(each, path) for each in threads if each is not thread):
            continue
        if waiting in BLOCKING:
            return (
                f"`{waiting}(...)` in line {line} waits for a response that can only be received while the node is "
                f"spun, and nothing spins it meanwhile. Use `{waiting}_async(...)`, then "
                "`rclpy.spin_until_future_complete(node, future)`."
            )
        if outer := _outer_spin(source, thread, own, path):
            return (
                f"Line {line} spins in a callback, inside the spin of line {outer}, and nothing else of this node runs "
                "until that callback returns, so what it waits for cannot arrive. Do not wait there: "
                "`future.add_done_callback(...)` runs a function once the future is done."
            )
    return ""


def _threads(stacks: str) -> Iterator[list[Call]]:
    """Yield the frames of each thread, the innermost first."""
    for stack in re.split(r"^.*\(most recent call first\):$", stacks, flags=re.MULTILINE):
        found = re.findall(r'^  File "(.+)", line (\d+) in (.+)$', stack, re.MULTILINE)
        yield [(file, int(line), function) for file, line, function in found]


def _of_rclpy(call: Call) -> tuple[str, str]:
    """Return rclpy's file of a frame, and its function; ('', '') for a frame in other code."""
    found = OF_RCLPY.search(call[0])
    return (found[1], call[2]) if found else ("", "")


def _is_own(call: Call, path: Path) -> bool:
    return Path(call[0]).name == path.name and not OF_RCLPY.search(call[0])


def _may_spin(thread: Sequence[Call], path: Path) -> bool:
    """Return True if a thread runs an executor, or the program's own code, which may be about to."""
    return any(_is_own(call, path) or _of_rclpy(call)[0] == EXECUTORS for call in thread)


def _waiting_call(source: str, line: int, inner: Sequence[str]) -> str:
    """Return the function of rclpy that a line of the program calls, without a time limit, and that has not returned.

    `inner` are rclpy's functions that run there.
    """
    tree = parse(source)
    for name in (*BLOCKING, *SERVERS):
        for call in calls(tree, name) if {name, f"_{name}"} & {*inner} else ():
            here = call.lineno <= line <= (call.end_lineno or call.lineno)
            if here and argument(call, WAITS.get(name, len(call.args)), "timeout_sec") is None:
                return name
    return ""


def _no_server(source: str, line: int, waiting: str, served: Mapping[str, Sequence[str]]) -> str:
    """Return why a wait for a server does not end, if the program names only one server; else ''."""
    maker, place, argument_name = SERVERS[waiting]
    made = list(calls(parse(source), maker))
    names = [argument(call, place, argument_name) for call in made]
    if len(made) != 1 or not isinstance(names[0], ast.Constant):
        return ""
    name = f"/{str(names[0].value).lstrip('/')}"
    kind = name_of(argument(made[0], 0 if maker == "create_client" else 1, ""))
    types = served.get(name, ())
    if any(each.rpartition("/")[2] == kind for each in types):
        return ""
    there = ", ".join(sorted(served))
    why = f"{name} is served with the type {types[0]}" if types else f"no node serves {name}"
    return (
        f"`{waiting}()` in line {line} waits without a limit, and {why}."
        + (f" Served here: {there}." if there and not types else "")
        + f" `{waiting}(timeout_sec=5.0)` returns False after 5 s."
    )


def _outer_spin(source: str, thread: Sequence[Call], own: int, path: Path) -> int:
    """Return the line in which the program spins, while a callback that this has called spins again; 0 if none does."""
    spins = [number for number, call in enumerate(thread) if _of_rclpy(call)[0] == FOR_ITSELF and "spin" in call[2]]
    if "callback_group" in source or len(spins) < 2 or spins[0] > own:
        return 0
    between = thread[own : spins[-1]]
    if not any(_of_rclpy(call) == (EXECUTORS, CALLBACK) for call in between):
        return 0
    return next((call[1] for call in thread[spins[-1] :] if _is_own(call, path)), 0)
