"""Finds out from the stacks of a program's threads that it waits for something that cannot come, and says why."""

import ast
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from course.explaining.source import WAITS, argument, calls, covers, exits, functions, name_of, parse, text_at
from course.foundation.syntax import walk

BLOCKING = ("call", "send_goal", "get_result", "cancel_goal")  # each has a twin that ends in `_async`
# Methods that wait for a server, what creates their client, and the position and name of its argument with the name.
SERVERS = {"wait_for_service": ("create_client", 1, "srv_name"), "wait_for_server": ("ActionClient", 2, "action_name")}
OF_RCLPY = re.compile(r"/rclpy/(.+)$")
EXECUTORS, FOR_ITSELF = "executors.py", "__init__.py"  # rclpy's files with the executors, and with `rclpy.spin`
THREADING, ENDING = "threading.py", "_shutdown"  # Python's file, and its function that waits for the other threads
NO_LIMIT = "                waiter.acquire()"  # a line of `Condition.wait`
SHUT_DOWN = ("shutdown", "try_shutdown", "kill", "raise_signal", "interrupt_main")
LEFT = (
    "The main part of the program has ended, but a thread that it has started, as in line {}, {} without end, and a "
    "program ends only after its threads. "
)
CALLBACK = "handler"  # the executors' function that runs a callback of a node

# What may complete a future, or answer a request, later and by itself, and what a program asks or hears others by.
BY_ITSELF = re.compile(
    r"\basync\b|asyncio|concurrent|\bThread\b|_thread\b|\bTimer\b|\bsignal\b|subprocess|create_timer|create_task|"
    r"create_guard_condition|create_rate|create_subscription|wait_for_message|ParameterClient|import_module|"
    r"multiprocessing|namespace"
)
ASKS = re.compile(r"create_client|ActionClient")
ANSWERS = re.compile(r"create_service|ActionServer|_parameters_callback")

Call = tuple[str, int, str]  # file, line and function of a frame
Placed = TypeVar("Placed", bound=ast.expr | ast.stmt)


@dataclass(frozen=True)
class EndlessSpin:
    """A line of a program's main part that spins without a limit: until a future is done, or until Ctrl-C."""

    line: int
    names: tuple[str, ...]  # of the services and actions of its clients
    call: str = ""  # `rclpy.spin(node)`, which only Ctrl-C ends; '' for a spin until a future is done

    def __str__(self) -> str:
        asked = " and ".join(self.names)
        if self.call:
            return (
                f"Line {self.line}, `{self.call}`, returns only after Ctrl-C, and no request to {asked} is pending "
                "any more, so this client never ends. Spin until the answer has arrived: "
                "`rclpy.spin_until_future_complete(node, future)`."
            )
        return (
            f"Line {self.line} spins until a future is done, and nothing completes it: no request to {asked} is "
            "pending. Is it the future that `call_async(...)` or `send_goal_async(...)` returned, and did the client "
            "wait for the server before it sent the request?"
        )


def endless_wait(stacks: str, path: Path, served: Mapping[str, Sequence[str]]) -> str:
    """Return why the program at `path`, with these `stacks` (output of `faulthandler`), waits without end; else ''.

    `served` are the services and actions that have a server, with their types.
    """
    source, found = text_at(path), list(threads(stacks))
    for thread in found:
        own = next((number for number, call in enumerate(thread) if is_own(call, path)), None)
        if own is None:
            continue
        line = thread[own][1]
        waiting = _waiting_call(source, line, [function for _, function in map(of_rclpy, thread[:own])])
        if waiting in SERVERS and (why := _no_server(source, line, waiting, served)):
            return why
        if any(_may_spin(each, path) for each in found if each is not thread):
            continue
        called = any(of_rclpy(call) == (EXECUTORS, CALLBACK) for call in thread[own:])
        if waiting in BLOCKING and called:
            return (
                f"`{waiting}(...)` in line {line} waits in a callback for a response that only this node's executor "
                f"can receive, and nothing else of it runs until that callback returns. Use `{waiting}_async(...)`, "
                "and do not wait for its future there: `future.add_done_callback(...)` runs a function once it is done."
            )
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
    return _left_threads(source, path, found)


def _left_threads(source: str, path: Path, found: Sequence[Sequence[Call]]) -> str:
    """Return why a program whose main part has ended does not end: its other threads wait or spin without a limit."""
    ended = [bool(thread) and Path(thread[-1][0]).name == THREADING and thread[-1][2] == ENDING for thread in found]
    others = [thread for thread, over in zip(found, ended, strict=True) if thread and not over]
    begun = next(calls(parse(source), "Thread"), None)
    if not (any(ended) and others and begun):
        return ""
    if all(map(_waits_without_limit, others)):
        return LEFT.format(begun.lineno, "waits") + "`Thread(..., daemon=True)` makes one that ends with the program."
    spins = any(map(_spins_on, others)) and all(_spins_on(each) or _waits_without_limit(each) for each in others)
    if spins and not _may_shut_down(source, path):
        return LEFT.format(begun.lineno, "spins") + (
            "`rclpy.shutdown()` at the end of the main part lets `spin` return, and `thread.join()` waits for that."
        )
    return ""


def _spins_on(thread: Sequence[Call]) -> bool:
    """Return True if a thread is in a `spin` of rclpy that only a shutdown ends, and in no callback."""
    spins = [of_rclpy(call) for call in thread if of_rclpy(call)[0] in (EXECUTORS, FOR_ITSELF)]
    return bool(spins) and spins[-1][1] == "spin" and (EXECUTORS, CALLBACK) not in spins


def _may_shut_down(source: str, path: Path) -> bool:
    """Return True if a function of a program, or a file beside it, may yet end what spins: a shutdown, an exception."""
    tree = parse(source)
    raised = [node for each in functions(tree) if each.name != "main" for node in walk(each)]
    return (
        any(next(calls(tree, name), None) for name in SHUT_DOWN)
        or any(isinstance(node, ast.Raise) for node in raised)
        or bool(exits(source))
        or _has_files_beside(source, path)
    )


def _waits_without_limit(thread: Sequence[Call]) -> bool:
    """Return True if a thread waits in Python's `threading`, at a line that has no time limit."""
    file, line, function = thread[0]
    if Path(file).name != THREADING or function != "wait":
        return False
    return text_at(Path(file)).splitlines()[line - 1 : line] == [NO_LIMIT]


def endless_spin(stacks: str, path: Path) -> EndlessSpin | None:
    """Return where the program at `path`, with these `stacks`, spins until a future is done or without end; else None.

    Only an answer from a service or an action can complete the future, or have the program do something, and their
    names are written out.
    """
    source = text_at(path)
    names = _asked(source, path)
    if not names or ANSWERS.search(source):
        return None
    for thread in threads(stacks):
        own = next((number for number, call in enumerate(thread) if is_own(call, path)), None)
        if own is None:
            continue
        line, inner, outer = thread[own][1], thread[:own], thread[own:]
        spins = any(of_rclpy(call)[0] == EXECUTORS for call in inner)
        if not spins or any(of_rclpy(call)[0] for call in outer):
            continue
        if _spins_without_limit(parse(source), line):
            return EndlessSpin(line, names)
        if call := next(_on_line(calls(parse(source), "spin"), line), None):
            return EndlessSpin(line, names, ast.unparse(call))
    return None


def is_at_rest(stacks: str, path: Path) -> bool:
    """Return True if the server at `path`, with these `stacks`, has nothing left to do until it is asked again."""
    source = text_at(path)
    if _acts_by_itself(source, path) or ASKS.search(source):
        return False
    found = list(threads(stacks))
    calling = (  # the program's own code, called by an executor
        is_own(call, path) and any(of_rclpy(each)[0] for each in thread[number:])
        for thread in found
        for number, call in enumerate(thread)
    )
    return any(of_rclpy(call)[0] == EXECUTORS for thread in found for call in thread) and not any(calling)


def _acts_by_itself(source: str, path: Path) -> bool:
    """Return True if a program may do something without being asked, or has code in other files of its folder."""
    return _has_files_beside(source, path) or BY_ITSELF.search(source) is not None


def _has_files_beside(source: str, path: Path) -> bool:
    """Return True if a program imports other files of its folder."""
    imported = re.findall(r"^\s*(?:from|import)\s+(\w+)", source, re.MULTILINE)
    return any((path.parent / name).is_dir() or (path.parent / f"{name}.py").is_file() for name in imported)


def _asked(source: str, path: Path) -> tuple[str, ...]:
    """Return the names of all services and actions that a program has clients of; () if one may be another."""
    tree = parse(source)
    given = [argument(call, 1, "srv_name") for call in calls(tree, "create_client")]
    given += [argument(call, 2, "action_name") for call in calls(tree, "ActionClient")]
    names = [each.value for each in given if isinstance(each, ast.Constant) and isinstance(each.value, str)]
    if len(names) != len(given) or any(name.startswith("~") for name in names) or _acts_by_itself(source, path):
        return ()
    return tuple(dict.fromkeys(f"/{name.lstrip('/')}" for name in names))


def _spins_without_limit(tree: ast.Module, line: int) -> bool:
    """Return True if a line spins until a future is done: by itself, or once in a loop that ends with the future."""
    for call in _on_line(calls(tree, "spin_until_future_complete"), line):
        of_rclpy_itself = isinstance(call.func, ast.Name) or name_of(getattr(call.func, "value", None)) == "rclpy"
        place = WAITS["spin_until_future_complete"] if of_rclpy_itself else 1  # else of an executor
        unpacked = any(isinstance(each, ast.Starred) for each in call.args) or any(
            not each.arg for each in call.keywords
        )
        return argument(call, place, "timeout_sec") is None and not unpacked
    loops = _on_line((node for node in walk(tree) if isinstance(node, ast.While)), line)
    once = any(True for _ in _on_line(calls(tree, "spin_once"), line))
    return once and any(map(_only_spins, loops))


def _on_line(nodes: Iterator[Placed], line: int) -> Iterator[Placed]:
    return (node for node in nodes if covers(node, line))


def _only_spins(loop: ast.While) -> bool:
    """Return True if a loop spins, and ends only with a future: `while not future.done()`, `if future.done():`."""
    tests = [loop.test, *(each.test for each in loop.body if isinstance(each, ast.If))]
    rest = [each for each in loop.body if not isinstance(each, (ast.If, ast.Pass))]
    called = {name_of(call.func) for test in tests for call in walk(test) if isinstance(call, ast.Call)}
    spins = all(
        isinstance(each, ast.Expr) and isinstance(each.value, ast.Call) and name_of(each.value.func) == "spin_once"
        for each in rest
    )
    plain = not any(isinstance(node, (ast.Compare, ast.NamedExpr)) for test in tests for node in walk(test))
    return (
        spins
        and plain
        and "done" in called
        and called <= {"done", "ok"}
        and not any(isinstance(each, ast.If) and each.orelse for each in loop.body)
    )


def threads(stacks: str) -> Iterator[list[Call]]:
    """Yield the frames of each thread, the innermost first."""
    for stack in re.split(r"^.*\(most recent call first\):$", stacks, flags=re.MULTILINE):
        found = re.findall(r'^  File "(.+)", line (\d+) in (.+)$', stack, re.MULTILINE)
        yield [(file, int(line), function) for file, line, function in found]


def of_rclpy(call: Call) -> tuple[str, str]:
    """Return rclpy's file of a frame, and its function; ('', '') for a frame in other code."""
    found = OF_RCLPY.search(call[0])
    return (found[1], call[2]) if found else ("", "")


def is_own(call: Call, path: Path) -> bool:
    """Return True for a frame in the program's own file."""
    return Path(call[0]).name == path.name and not OF_RCLPY.search(call[0])


def _may_spin(thread: Sequence[Call], path: Path) -> bool:
    """Return True if a thread runs an executor, or the program's own code, which may be about to."""
    return any(is_own(call, path) or of_rclpy(call)[0] == EXECUTORS for call in thread)


def _waiting_call(source: str, line: int, inner: Sequence[str]) -> str:
    """Return the function of rclpy that a line of the program calls, without a time limit, and that has not returned.

    `inner` are rclpy's functions that run there.
    """
    tree = parse(source)
    for name in (*BLOCKING, *SERVERS):
        for call in calls(tree, name) if {name, f"_{name}"} & {*inner} else ():
            if covers(call, line) and argument(call, WAITS.get(name, len(call.args)), "timeout_sec") is None:
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
    spins = [number for number, call in enumerate(thread) if of_rclpy(call)[0] == FOR_ITSELF and "spin" in call[2]]
    if "callback_group" in source or len(spins) < 2 or spins[0] > own:
        return 0
    between = thread[own : spins[-1]]
    if not any(of_rclpy(call) == (EXECUTORS, CALLBACK) for call in between):
        return 0
    return next((call[1] for call in thread[spins[-1] :] if is_own(call, path)), 0)
