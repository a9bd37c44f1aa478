"""Failure reports of nodes for their author: the error, the author's own lines, and the cause.

Most of a node's traceback is rclpy's: of thirty lines, three are the student's.  Only these are shown.
"""

import ast
import contextlib
import linecache
import os
import re
import reprlib
import signal
import time
import traceback
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any

from rclpy.exceptions import InvalidHandle, NotInitializedException

from course.explaining.clashes import other_type
from course.explaining.hints import hint
from course.explaining.mixups import class_for_response, idle_lambda
from course.explaining.nothing import silent_helper
from course.explaining.outline import (
    is_client,
    makes_a_node,
    makes_no_node,
    never_spins,
    returns_nothing,
    serves,
    spin,
    uncalled_main,
)
from course.explaining.overwritten import with_article
from course.explaining.source import (
    defined,
    ends_its_node,
    exits,
    functions,
    is_cell,
    no_list,
    no_result,
    parse,
    response_for_callback,
    spins_once,
    text_at,
    value_for_callback,
    wrong_guard,
    wrong_return,
)
from course.explaining.wrong_forms import part_for_type
from course.foundation.syntax import walk
from course.ros.rclpy_internals import GoalFault, NoResult

IN_A_CELL = (
    "A node of a notebook belongs to its session: write a class and start it with `ros.start(TheClass)`, or pass the "
    "session's context: `Node('name', context=ros.context)`."
)
GONE = (
    "What this line uses was destroyed, by itself or with its node: `ros.stop(...)`, `destroy_node()` and the next "
    "start of a node of the same name do so. Take it from the node that the newest `ros.start(...)` returns, as "
    "`.node`."
)
# Left out of an error: the path of a module, and what Python 3.13 adds.  Python 3.12 may suggest another name after it.
LATER = re.compile(r"( \(/\S+\)| and no __dict__ for setting new attributes)(?=$|\. Did you mean)")
MARK = "Traceback (most recent call last):"
GOAL_FAILED = "Error raised in execute callback"  # logged by rclpy's ActionServer, which prints the traceback
STATE_NOT_SET = "Goal state not set, assuming aborted"  # logged by it as well
NO_DECISION = "Goal request callback did not return a GoalResponse type"  # logged by it as well
NO_STATE = "returned a result without setting the state of the goal, so the goal counts as aborted"
ABOUT_GOALS = {  # the ending, and the hint
    GoalFault.NO_DECISION: (
        "rejected a goal, because its goal callback did not return a GoalResponse",
        "Return `GoalResponse.ACCEPT` or `GoalResponse.REJECT`, on every path through it.",
    ),
    GoalFault.NO_STATE: (
        NO_STATE,
        "Call `goal_handle.succeed()`, `canceled()` or `abort()` before you return the result.",
    ),
}
RETURN_A_RESULT = "End the execute callback with `return TheType.Result(...)`, on every path through it."
THREAD_ENDED = "Exception in thread "  # printed by Python, with the thread's name
LEFT = "called exit() in a callback, which ends that callback alone"
GOAL_ENDING = "raised an exception in an execute callback, so the goal was aborted"
NEVER_RETRIEVED = "The following exception was never retrieved"  # printed by rclpy about futures that nobody awaits
TERMINATED = "terminate called without an active exception"  # printed by C++
SPINNING = re.compile(r"\btarget=[\w.]+\.spin\b|\.submit\([\w.]+\.spin\b")  # a thread of its own that spins
THREAD = re.compile(r"\bThread\b|_thread\b|ThreadPoolExecutor")  # what starts one
FRAME = re.compile(r'^  File "(.+)", line (\d+)(?:, in (.+))?$')
COURSE = Path(__file__).resolve().parents[1]
MACHINERY = tuple(COURSE / name for name in ("foundation", "ros", "session"))  # code that students need not read
PRE_SET = "_call_pre_set_parameters_callback"  # rclpy's function that uses the list returned by a pre-set callback
NO_LIST = "The pre-set callback '{}' must return the list of parameters to set, even if it changes nothing."
OF_ANOTHER = " One that refuses values is registered with `add_on_set_parameters_callback`."
DESTROYED = "InvalidHandle: cannot use Destroyable because destruction was requested"
UNSENT = "failed to send response: publisher's context is invalid"
NODE_ENDED = (
    "'{0}' calls `{2}` in line {1}, which ends the node, so it no longer answers. A node must keep running: remove "
    "this line."
)
IGNORED = re.compile(rf"^Exception ignored in: .*\n{re.escape(MARK)}\n(?: .*\n)*\S.*\n?", re.MULTILINE)
GUARDED = "`{}` is false when the file is run, so main() does not run: write `if __name__ == '__main__':`."
MANY = 20  # calls of the reader's own functions: more are a recursion
MESSAGE_LINES = 6  # lines of an exception's message
RESULT_TYPE = "The 'result' field must be a sub message of type"
NO_RESPONSE = ("TypeError", "TypeError:")  # rclpy's only message about a callback that returned no response
LIBRARIES = ("site-packages", "dist-packages", f"{os.sep}lib{os.sep}python")  # in paths of other people's code


@dataclass(frozen=True)
class Frame:
    """A stack frame in the student's own code."""

    place: str  # the file, or the notebook's cell
    line: int
    function: str  # '' outside of functions
    code: str

    def __str__(self) -> str:
        where = f", in {self.function}" if self.function and self.function != "<module>" else ""
        return f"  {self.place}, line {self.line}{where}\n    {self.code}"


def frame_at(place: str, line: int, source: str) -> Frame:
    """Return the frame of a line of a file's text, outside of functions."""
    return Frame(place, line, "", source.splitlines()[line - 1].strip())


def left_thread(output: str, source: str) -> str:
    """Return the hint on a program that C++ has ended because one of its threads still ran at its end; else ''."""
    if TERMINATED not in output or not THREAD.search(source):
        return ""
    if serves(source) and SPINNING.search(source) and never_spins(source) and ".join(" not in source:
        return (
            "main() ended while one of its threads still spun the node. A server must run until it is stopped: call "
            "`rclpy.spin(node)` in main() itself, not in a thread."
        )
    return (
        "One of its threads, such as one that spins, still ran when the program ended. End it first: "
        "`executor.shutdown()`, or `rclpy.shutdown()`, lets it return, and `thread.join()` waits for that."
    )


def _fatal(path: Path, output: str, source: str) -> tuple[Frame, ...]:
    """Return the frames in a program's file of the stack that faulthandler has printed at a signal such as SIGSEGV."""
    _, mark, stack = output.rpartition("Fatal Python error: ")
    lines = source.splitlines()
    found = [
        Frame(path.name, int(line), function, lines[int(line) - 1].strip())
        for file, line, function in re.findall(r'File "(.+?)", line (\d+) in (\S+)', stack if mark else "")
        if Path(file).name == path.name and int(line) <= len(lines)
    ]
    return tuple(found[:1])


@dataclass(frozen=True)
class FailureReport:
    """The report on how a node or a program ended."""

    who: str
    ending: str  # how it ended: "ended with exit status 1"
    error: str = ""  # the last line of the traceback
    frames: tuple[Frame, ...] = ()
    hint: str = ""
    at: float = field(default_factory=time.time, compare=False)  # the time at which it was known

    @property
    def line(self) -> str:
        """Return the report in one line, for a table."""
        last = f" ({self.frames[-1].place}, line {self.frames[-1].line})" if self.frames else ""
        return self.ending + (f": {self.error.splitlines()[0]}{last}" if self.error else "")

    def __str__(self) -> str:
        head = f"{self.who} {self.ending}" + (f": {self.error}" if self.error else ".")
        return "\n".join([head, *map(str, self.frames), *([f"Hint: {self.hint}"] if self.hint else [])])


def without_ignored(output: str) -> str:
    """Return a program's output without the exceptions that Python ignores, which follow another one."""
    return IGNORED.sub("", output)


def of_program(
    path: Path, output: str, status: int, *, before_its_node: bool = False, exited: tuple[Frame, ...] = ()
) -> FailureReport:
    """Return the report on the program at `path` that printed `output` and ended with `status` (negative: a signal).

    `exited` are the frames of the call of `exit()` that has ended it, if known.
    """
    source = text_at(path)
    output = _up_to_its_end(without_ignored(output), path)
    error, frames = _last_traceback(output, path)
    ending = f"ended with exit status {status}" if status >= 0 else f"was ended by the signal {_signal(-status)}"
    callback: tuple[str, int, str] | tuple[str, int] | None = defined(error, source)
    if uncallable := re.match(r"TypeError: '(\w+)' object is not callable", error):
        callback = value_for_callback(source, uncallable[1]) or response_for_callback(source, uncallable[1])
    pre_set = no_list(source) if "not iterable" in error and f"in {PRE_SET}" in output else None
    if error in NO_RESPONSE or RESULT_TYPE in error or pre_set:
        callback = pre_set or (
            no_result(source)
            if RESULT_TYPE in error
            else class_for_response(source) or idle_lambda(source) or wrong_return(source) or silent_helper(source)
        )
    ended_there = DESTROYED in error or UNSENT in error
    destroyed = ended_there and not frames and ends_its_node(source)
    if destroyed:
        frames = (frame_at(path.name, destroyed[1], source),)
    calls_it = frames and re.search(rf"\.{callback[0]}\(", frames[-1].code) if callback else None  # main does
    if callback and not _inside(frames) and not calls_it:  # the error is raised in rclpy, after the callback
        frames = (frame_at(path.name, callback[1], source),)
    if error:
        if destroyed:
            why = NODE_ENDED.format(*destroyed)
        else:
            why = _no_list(pre_set[0], error) if pre_set else _hint_on_program(error, frames, path)
        return FailureReport(path.name, ending, error, frames, why)
    if status == 0 and (guard := wrong_guard(source)):
        frames = (frame_at(path.name, guard[1], source),)
        why = GUARDED.format(guard[0])
        return FailureReport(path.name, ending, "", frames, why)
    if exited and status == 0:
        return FailureReport(path.name, ending, "", exited, ends_the_program(exited[-1]))
    if uncalled := uncalled_main(source):
        line, why = uncalled
        exited = (frame_at(path.name, line, source),) if line else exited
    elif status < 0 and (left := left_thread(output, source)):
        why = left
    elif status == 0 and (idle := makes_no_node(source)):
        why = idle
    elif status == 0 and output.strip() and is_client(source):
        why = f"{path.name} is a client, and a client ends by itself. As a command: `python3 {path.name}`."
    elif status == 0 and never_spins(source):
        why = f"It ended because nothing spins its node: main() must call `{spin(source)}`."
    elif before_its_node and status == 0 and not makes_a_node(source):
        why = "It created no node: is `super().__init__('name')` reached?"
    elif status == 0 and (once := spins_once(source)):
        exited = (frame_at(path.name, once.lineno, source),)
        why = f"`{ast.unparse(once.func)}` handles one callback at most and returns: `rclpy.spin(node)` goes on."
    elif status == 0 and (ended := ends_its_node(source)):
        exited, why = (frame_at(path.name, ended[1], source),), NODE_ENDED.format(*ended)
    elif status == 0:
        why = f"A server must run until it is stopped: is `{spin(source)}` reached?"
    elif name := exits(source):
        why = (
            f"'{name}' ends the program on purpose. A server must keep running: if it cannot do what is asked, say so "
            "in the response."
        )
    else:
        why = ""
    said = output.strip().splitlines()[-MESSAGE_LINES:] if status > 0 or is_client(source) else []
    if status < 0:
        exited = exited or _fatal(path, output, source)
        why = why or (part_for_type(exited[-1].line, source) if exited else "")
    return FailureReport(path.name, ending, "\n  ".join(["it printed", *said]) if said else "", exited, why)


def _no_list(callback: str, error: str) -> str:
    """Return the hint on a pre-set callback that has returned something else than a list."""
    return NO_LIST.format(callback) + (OF_ANOTHER if "SetParametersResult" in error else "")


def ends_the_program(frame: Frame) -> str:
    """Return the hint on a call of `exit()` in a function of a node."""
    return (
        f"Line {frame.line} ends the whole program, not only '{frame.function}'. A node must keep running: to leave a "
        "function, write `return`."
    )


def of_exit(who: str, frames: tuple[Frame, ...]) -> FailureReport:
    """Return the report on a program that called `exit()` in a thread of its executor."""
    hint = (
        f"'{frames[-1].function}' never returns after that, but the program keeps running, so nobody receives its "
        "answer or result. To leave a function, write `return`, in an execute callback with the result."
    )
    return FailureReport(who, LEFT, "", frames, hint)


def of_exception(
    who: str, error: BaseException, callbacks: list[Callable[..., object]], doing: str = "", cell: str = ""
) -> FailureReport:
    """Return the report on an exception in a node of this kernel.

    `callbacks` are those of its services, and `cell` is the text of the cell that defines its class.
    """
    last = "".join(traceback.format_exception_only(error)).strip()
    frames = _own_frames(error.__traceback__)
    source = _source(error.__traceback__) or cell or next(filter(None, map(text_of, callbacks)), "")
    why = other_type(error) or _hint(last, source, frames)
    silent = [callback for callback in callbacks if returns_nothing(callback)]
    if not frames and silent and last in NO_RESPONSE:
        why = f"The service callback '{silent[0].__name__}' returns nothing: end it with `return response`."
        frames = (_defined_at(silent[0]),)
    if (
        not frames
        and source == cell
        and last in NO_RESPONSE
        and (wrong := wrong_return(source) or silent_helper(source))
    ):
        frames = (frame_at("the cell", wrong[1], source),)
    if not frames and (callback := _pre_set(error.__traceback__)):
        why, frames = _no_list(callback.__name__, last), (_defined_at(callback),)
    return FailureReport(who, doing or "raised an exception in a callback", last, frames, why)


def of_goal(who: str, fault: GoalFault) -> FailureReport:
    """Return the report on a goal whose callback returned wrongly."""
    ending, why = ABOUT_GOALS[fault]
    return FailureReport(who, ending, hint=why)


def of_no_result(who: str, fault: NoResult) -> FailureReport:
    """Return the report on an execute callback that returned something else than a result, with its line."""
    ending = "ended an execute callback without returning a result"
    frames: tuple[Frame, ...] = ()
    if fault.returned is not None:
        value = ""
        with contextlib.suppress(ValueError):  # a number with too many digits
            value = f"{reprlib.repr(fault.returned)}, "
        kind = with_article(type(fault.returned).__name__)
        ending = f"returned {value}{kind}, and no result from an execute callback"
    code = getattr(fault.callback, "__code__", None)
    if code and _is_own(code.co_filename):
        made = [each for each in functions(parse(text_of(fault.callback))) if each.name == code.co_name]
        returns = [node for each in made for node in walk(each) if isinstance(node, ast.Return) and node.value]
        line = returns[0].lineno if len(returns) == 1 and fault.returned is not None else code.co_firstlineno
        text = linecache.getline(code.co_filename, line).strip()
        frames = (Frame(place_of(code.co_filename), line, "", text),)
    return FailureReport(who, ending, "", frames, RETURN_A_RESULT)


def hint_on(error: Exception) -> str:
    """Return the hint on an error in a cell's own code, as a line; '' for none."""
    frames = _own_frames(error.__traceback__)
    last = "".join(traceback.format_exception_only(error)).strip()
    if "\nHint: " in last:  # of a program or a node that it tells of
        return ""
    why = IN_A_CELL if isinstance(error, NotInitializedException) else ""
    why = GONE if isinstance(error, InvalidHandle) else why
    why = why or other_type(error) or _hint(last, _source(error.__traceback__), frames)
    return f"Hint: {why}" if why else ""


def failed_goals(path: Path, output: str) -> list[FailureReport]:
    """Return reports on a program's failed goals from its output, one for each place of an exception."""
    output = _up_to_its_end(output, path)
    reports = [of_goal(path.name, GoalFault.NO_DECISION)] if NO_DECISION in output else []
    rest = re.sub(f"{GOAL_FAILED}.*?{STATE_NOT_SET}", "", output, flags=re.DOTALL)  # it follows each
    if STATE_NOT_SET in rest.partition(MARK)[0]:  # the goals of a program that is ending have no state of their own
        reports.append(of_goal(path.name, GoalFault.NO_STATE))
    for part in output.split(GOAL_FAILED)[1:]:
        error, frames = _last_traceback(part.partition("\n")[2], path, first=True)
        report = FailureReport(path.name, GOAL_ENDING, error, frames, _hint_on_program(error, frames, path))
        if error and report not in reports:
            reports.append(report)
    return reports


def of_thread(path: Path, output: str) -> FailureReport | None:
    """Return the report on the last thread of a running program that an exception has ended; None without one."""
    _, mark, rest = output.rpartition(THREAD_ENDED)
    error, frames = _last_traceback(rest, path, first=True) if mark else ("", ())
    if not error:
        return None
    return FailureReport(
        path.name, "has lost a thread to an exception", error, frames, _hint_on_program(error, frames, path)
    )


def where(stacks: str, path: Path) -> tuple[Frame, ...]:
    """Return the frames of the program at `path`, and of files beside it, in the output of `faulthandler`.

    They are in order of the calls, of a thread in a callback, or else of the main part; () if that only waits for
    callbacks.
    """
    files: dict[str, list[str]] = {}  # the lines of each file that is the student's, none of the others
    found: list[list[Frame]] = []
    for stack in re.split(r"^.*\(most recent call first\):$", stacks, flags=re.MULTILINE):
        frames = []
        for file, line, function in re.findall(r'^  File "(.+)", line (\d+) in (.+)$', stack, re.MULTILINE):
            if file not in files:
                own = Path(file).name == path.name or _is_beside(file, path)
                files[file] = text_at(path.parent / Path(file).name).splitlines() if own else []
            if int(line) <= len(files[file]):
                frames.append(Frame(Path(file).name, int(line), function, files[file][int(line) - 1].strip()))
        found.append(frames[::-1])
    inside = sorted((_inside(frames) for frames in found), key=lambda each: (_waits_for_lock(each), len(each)))[-1:]
    main = [frame for frames in found for frame in frames[-1:] if not re.search(r"\bspin\w*\(", frame.code)]
    return tuple(inside[0] if inside and inside[0] else main[:1])


def _waits_for_lock(frames: list[Frame]) -> bool:
    return bool(frames) and re.search(r"^with (?!.*\()|\.acquire\(", frames[-1].code) is not None


def _up_to_its_end(output: str, path: Path) -> str:
    """Return a program's output up to the traceback that ended it.

    What its other threads raise after that is a consequence: main() has perhaps destroyed what they use.
    """
    lines = output.splitlines()
    starts = [number for number, line in enumerate(lines) if line.rstrip().endswith(MARK)]
    first_frames = [FRAME.match(line) for number in starts for line in [*lines[number + 1 :], ""][:1]]
    ends = [
        number
        for number, frame in zip(starts, first_frames, strict=True)
        if frame and Path(frame[1]).name == path.name and frame[3] == "<module>"
    ]
    for number in range(ends[-1] + 1 if ends else len(lines), len(lines)):
        if any(mark in lines[number] for mark in (MARK, GOAL_FAILED, STATE_NOT_SET)):
            return "\n".join(lines[:number])
    return output


def _last_traceback(output: str, path: Path, *, first: bool = False) -> tuple[str, tuple[Frame, ...]]:
    """Return error and student's frames of the last (or `first`) traceback in `output`; ('', ()) without one.

    The student's are those in the program at `path` and in files beside it.
    """
    lines = output.splitlines()
    # Output without a newline (`input("name? ")`) may precede it.
    starts = [number for number, line in enumerate(lines) if line.rstrip().endswith(MARK)]
    if not starts and not re.search(r"^\w*Error: ", output, re.MULTILINE):
        return "", ()
    rest = lines[starts[0 if first else -1] + 1 :] if starts else lines
    frames: list[Frame] = []
    own = False
    for number, line in enumerate(rest):
        if found := FRAME.match(line):
            own = Path(found[1]).name == path.name or _is_beside(found[1], path)
            code = rest[number + 1].strip() if number + 1 < len(rest) else ""
            if own:
                frames.append(Frame(Path(found[1]).name, int(found[2]), found[3] or "", code))
        elif line and not line.startswith(" ") and re.match(r"[\w.]+", line):
            first_line = LATER.sub("", line)
            first_line = first_line.removesuffix(" The following argument types are supported:")
            many = "incompatible function arguments" in line  # followed by all signatures in C++
            message = [first_line] if many else [first_line, *_continued(rest[number + 1 :])]
            return "\n".join(message), _without_repeats(list(_without_main(frames)))
    return "", ()


def _is_beside(file: str, path: Path) -> bool:
    """Return True for a file, as a traceback names it, in the folder of the program at `path`."""
    return file.endswith(".py") and Path(file).parent.resolve() == path.parent.resolve()


def _continued(lines: list[str]) -> list[str]:
    """Return the further lines of an exception's message, up to an empty line or a log line."""
    found = []
    for line in lines[: MESSAGE_LINES - 1]:
        if (
            not line.strip()
            or line.startswith(NEVER_RETRIEVED)
            or re.match(r"(\x1b\[\d*m)?\[(DEBUG|INFO|WARN|ERROR|FATAL)\]|\[ros2run\]", line)
        ):
            break
        found.append(line)
    return found


def _inside(frames: Iterable[Frame]) -> list[Frame]:
    """Return the frames in the student's functions other than `main`."""
    return [frame for frame in frames if frame.function not in ("main", "<module>")]


def _without_main(frames: list[Frame]) -> tuple[Frame, ...]:
    """Return the frames without `main`, if it called another function of the student's."""
    return tuple(_inside(frames) or [frame for frame in frames[-1:] if not re.search(r"\bspin\(\s*[^)\s]", frame.code)])


def _hint(error: str, source: str, frames: tuple[Frame, ...]) -> str:
    return hint(error, source, frames[-1].code if frames else "")


def _hint_on_program(error: str, frames: tuple[Frame, ...], path: Path) -> str:
    """Return the hint on an error in the program at `path`, or in a file beside it that it uses, or ''."""
    last = frames[-1:]
    beside = _hint(error, text_at(path.parent / last[0].place), last) if last and last[0].place != path.name else ""
    own = tuple(frame for frame in frames if frame.place == path.name)
    return beside or _hint(error, text_at(path), own)


def _source(trace: TracebackType | None) -> str:
    """Return the text of the file or cell of the reader's last frame."""
    own = [each.filename for each in traceback.extract_tb(trace) if _is_own(each.filename)]
    return "".join(linecache.getlines(own[-1])) if own else ""


def text_of(callback: Callable[..., object]) -> str:
    """Return the text of the file or cell that defines a callback."""
    code = getattr(callback, "__code__", None)
    return "".join(linecache.getlines(code.co_filename)) if code else ""


def cell_of(cls: type) -> str:
    """Return the text of the cell that defines a class; '' if no cell does."""
    codes = (getattr(each, "__code__", None) for each in vars(cls).values())
    name = next((code.co_filename for code in codes if code and is_cell(code.co_filename)), "")
    return "".join(linecache.getlines(name)) if name else ""


def _defined_at(callback: Callable[..., object]) -> Frame:
    """Return the frame of a function's `def`."""
    code = callback.__code__
    text = linecache.getline(code.co_filename, code.co_firstlineno).strip()
    return Frame(place_of(code.co_filename), code.co_firstlineno, "", text)


def _pre_set(trace: TracebackType | None) -> Any:
    """Return the pre-set callback whose return value rclpy could not use, if the error was raised there."""
    while trace and trace.tb_next:
        trace = trace.tb_next
    if trace and trace.tb_frame.f_code.co_name == PRE_SET:
        callback = trace.tb_frame.f_locals.get("callback")
        return callback if hasattr(callback, "__code__") else None
    return None


def _is_own(filename: str) -> bool:
    path = Path(filename)
    if filename.startswith("<frozen") or any(part in filename for part in LIBRARIES):
        return False
    return path.parent != COURSE and not any(path.is_relative_to(folder) for folder in MACHINERY)


def _own_frames(trace: TracebackType | None) -> tuple[Frame, ...]:
    """Return the frames that are in the student's cells and files."""
    found = []
    for summary in traceback.extract_tb(trace):
        if summary.lineno is None or not _is_own(summary.filename):
            continue
        place = place_of(summary.filename)
        code = linecache.getline(summary.filename, summary.lineno).strip()
        found.append(Frame(place, summary.lineno, summary.name, code))
    return _without_repeats(found)


def _without_repeats(frames: list[Frame]) -> tuple[Frame, ...]:
    """Return the frames without repeated ones of a recursion."""
    return tuple(frames) if len(frames) < MANY else tuple(dict.fromkeys(frames))


def place_of(filename: str) -> str:
    """Return how a reader calls the file of some code: `the cell`, or its name."""
    return "the cell" if is_cell(filename) else Path(filename).name


def _signal(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return str(number)
