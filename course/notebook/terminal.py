"""Runs commands at the same time, each as in its own terminal, and returns their output."""

import contextlib
import math
import os
import re
import shlex
import signal
import subprocess
import threading
import time
from collections.abc import Collection
from concurrent.futures import Future, ThreadPoolExecutor, wait
from html import escape
from pathlib import Path

from course.errors import ExerciseError, NodeFailed
from course.explaining import ros_1
from course.explaining.endless_waits import EndlessSpin
from course.explaining.failure_report import MARK, Frame, frame_at, left_thread, of_program, without_ignored
from course.explaining.lines_that_wait import remark
from course.explaining.parameter_files import unparsed, unread_files, unread_words, with_tabs
from course.explaining.source import text_at
from course.foundation import processes
from course.foundation.waiting import lookouts, wait_until
from course.session.guards import say
from course.session.live import Session, current
from course.session.logs import node_of_line
from course.session.offered import strangers
from course.session.stacks import Stacks

STYLE = (
    "background: #1e2430; color: #e6e6e6; padding: .8em 1em; border-radius: 4px; font-size: 13px; line-height: 1.45; "
    "white-space: pre-wrap; overflow-wrap: anywhere;"
)
PROMPT = "color: #7fc8a9;"
USUAL = 30.0  # s for a command; a longer limit means that it is expected to compute for long
LOOK = 0.2  # s between two checks whether a program loops, or a node has failed
IN_VAIN = 3.0  # s that a silent program may wait after a node of the session has failed
HELD = 2.0  # s without output, after which a program is asked whether it waits for what cannot come
SLEPT = 5  # looks at which all programs sleep, after which it is asked, twice, whether it spins for nothing: 1 s
AGAIN = 1.0  # s until it is asked again, because a passing wait looks the same
TELLING = 5.0  # s after which the reader is told that a node does not end by itself
WITHOUT = 4.0  # s after which the reader is told that no line had the text that a command is waited for
LAST = 100  # characters of the last line that are shown
SOON = 0.5  # s until a node's failure is known, after a program got no answer from it
CHUNK = 65536  # bytes
FLOOD = 1_000_000  # bytes printed, after which a program is stopped
SHOWN = 2000  # bytes of these that are shown
FLOODED = f": it had printed {FLOOD:,} characters, of which only the first are shown"
GRACE = 10.0  # s for a program to end after Ctrl-C
OF_A_SHELL = ("cd", "source", ".", "export", "alias", "unset")  # commands of a shell, not programs
JOINED = ("&&", "||", "|", ";", "&", ">", ">>", "2>", "<")
WAITS = b"still waiting; "  # printed by the `ros2` command for a name without a server
CLIENT = re.compile(r"create_client\(|ActionClient\(")
GOES_ON = re.compile(r"create_service\(|ActionServer\(|create_timer\(|create_subscription\(")
ENDLESS = re.compile(r"\b(rclpy|\w*executor)\.spin\(")


class Terminal:
    """The output of commands: `runs` holds each command, its output and its exit status.

    `failures` are reports of the session's nodes that ended or raised an exception meanwhile.
    """

    def __init__(self, runs: list[tuple[str, str, int]], failures: Collection[str] = ()):
        self.runs = runs
        self.failures = failures

    @property
    def lines(self) -> list[str]:
        """Return the transcript: each command after a `$`, its output, and its exit status if that was not 0."""
        lines = []
        for command, output, status in self.runs:
            lines += [f"$ {command}", *output.rstrip("\n").splitlines()]
            if status:
                lines.append(f"[exit status {status}]")
        return lines + [line for failure in self.failures for line in failure.splitlines()]

    def __repr__(self) -> str:
        return "\n".join(self.lines)

    def _repr_html_(self) -> str:
        commands = {f"$ {command}" for command, _, _ in self.runs}
        lines = (f'<b style="{PROMPT}">{escape(line)}</b>' if line in commands else escape(line) for line in self.lines)
        return f'<pre style="{STYLE}">{chr(10).join(lines)}</pre>'


def terminal(*commands: str, timeout: float = USUAL, until: str = "") -> Terminal:
    """Run the commands at the same time (no shell), each for at most `timeout` s, and return the transcript.

    A Python file that computes without output is stopped earlier, unless `timeout` is longer than usual; so is one that
    waits after a node of the session that it may need has failed, and a `ros2` command that waits for a name without a
    server. With `until`, a command is ended with Ctrl-C once it has printed a line with that text; its later output is
    left out of the transcript.
    """
    if not commands or not all(isinstance(each, str) for each in commands):
        raise ExerciseError("`terminal` takes each command as one text, such as terminal('ros2 service list -t')")
    failed: list[NodeFailed] = []
    with ThreadPoolExecutor(len(commands)) as pool:
        begun = [pool.submit(_run, command, timeout, until, failed) for command in commands]
        _note_failures(begun, failed)
        runs = [each.result() for each in begun]
    if until and not any(until in output for _, output, _ in runs):
        ended = f"(it has ended; no line contained {until!r})\n"
        runs = [(command, output if status else _below(output, ended), status) for command, output, status in runs]
    return Terminal(runs, [*map(str, failed)])


def _below(output: str, line: str) -> str:
    """Return a program's output with a line below it."""
    return f"{output}\n{line}" if output and not output.endswith("\n") else f"{output}{line}"


def _note_failures(begun: "Collection[Future[tuple[str, str, int]]]", failed: list[NodeFailed]) -> None:
    """Wait for the commands, and add the failures of the session's nodes meanwhile to `failed`."""

    def look() -> bool:
        failed.extend(_untold())
        return bool(failed)

    while wait(begun, LOOK).not_done:
        look()
    if any(each.result()[2] for each in begun):
        wait_until(look, SOON, alert=False)
    look()


def _untold() -> list[NodeFailed]:
    """Return reports on nodes of the session that ended or raised an exception, if not shown yet."""
    found = []
    for look in lookouts:
        more = True
        while more:
            try:
                look()
                more = False
            except NodeFailed as failure:
                found.append(failure)
    return found


def _run(command: str, timeout: float, until: str, failed: Collection[NodeFailed]) -> tuple[str, str, int]:
    try:
        words = shlex.split(command)
    except ValueError as error:
        return command, f"A quotation mark is missing, or there is one too many ({error}).", 2
    if why := _unread_parameter(words):
        return command, why, 2
    shell = [word for word in words[:1] if word in OF_A_SHELL] + [word for word in words if word in JOINED]
    if shell or not words:
        return command, _no_shell(command, shell), 127
    try:
        output, status = _run_until(words, timeout, until) if until else _run_to_its_end(words, timeout, failed)
    except FileNotFoundError:
        how = ros_1.command(command) or _by_python(command, words[0])
        return command, "\nHint: ".join(filter(None, (f"{words[0]}: command not found", how))), 127
    except PermissionError:
        how = _by_python(command, words[0])
        return command, "\nHint: ".join(filter(None, (f"{words[0]}: permission denied", how))), 126
    if "can't open file" in output and (session := current()) and (why := session.elsewhere):
        output = f"{output.rstrip()}\nHint: {why}\n"
    if (how := unparsed(output)) and how not in output:  # a folded traceback has it
        output = f"{output.rstrip()}\nHint: {how}\n"
    if "Cannot have a value before ros__parameters" in output:
        output = (
            f"{output.rstrip()}\nHint: In a parameter file each value is `name: value`, with a space after the colon, "
            "below `ros__parameters:`, with two underscores.\n"
        )
    path = _program(words)
    if status < 0 and path and (left := left_thread(output, text_at(path))):
        output = f"{output.rstrip()}\nHint: {left}\n"
    unreadable = "Couldn't parse params file" in output  # and then no node has begun, and rcl itself writes the log
    for why in with_tabs(words) if unreadable else unread_files(words, _logging(output)):
        output = f"{output.rstrip()}\nHint: {why}\n"
    return command, output, status


def _logging(output: str) -> set[str]:
    """Return the names of the nodes that have written lines of a log."""
    return {part for line in output.splitlines() for part in (node_of_line(line) or "").split(".") if part}


def _by_python(command: str, word: str) -> str:
    """Return the hint on a file of Python that a command line begins with; '' for another word."""
    is_one = word.endswith(".py") and Path(word).is_file()
    return f"Python runs this file: `python3 {command.strip()}`." if is_one else ""


def _unread_parameter(words: list[str]) -> str:
    """Return why a parameter on a command line would not be read, or ''."""
    path = _program(words)
    given = unread_words(words, text_at(path) if path else "")
    if not given or (path is None and words[:2] != ["ros2", "run"]):
        return ""
    return f"This was not run: the program would not read `{given}`. Write `--ros-args {given}`."


def _no_shell(command: str, words: list[str]) -> str:
    """Return why a command that needs a shell is not run here."""
    what = f"`{words[0]}` needs a shell" if words else "it names no program"
    lasts = len(words) == 1 and words[0] in OF_A_SHELL  # with `!` it would act on a shell that ends at once
    return (
        f"This was not run: {what}, and `terminal(...)` runs each line as one program, without a shell. Type it in a "
        "terminal (File, New, Terminal)"
        + (f", or write `!{command}` in a cell of its own." if command and not lasts else ".")
    )


def _run_to_its_end(words: list[str], timeout: float, failed: Collection[NodeFailed]) -> tuple[str, int]:
    """Run a command; return its output and exit status.

    A Python program that hangs is stopped, and the line shown where it was; one that loops, or waits after a node has
    `failed` that it may need, is stopped early.
    """
    path = _program(words)
    stacks = Stacks()
    program = subprocess.Popen(
        words,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        env={**os.environ, **stacks.environment(os.environ)} if path else None,
        pass_fds=[stacks.descriptor] if path else (),
    )
    printed = bytearray()
    reader = threading.Thread(target=_read, args=(program, printed), daemon=True)
    reader.start()
    end = time.monotonic() + timeout
    text = text_at(path) if path else ""
    client = bool(CLIENT.search(text)) and not GOES_ON.search(text)  # it must end, and is no node to start
    endless = words[:2] == ["ros2", "run"] or (ENDLESS.search(text) is not None and not client)
    told_of_end = False
    told, spent, at = 0, 0.0, ""
    wait = _Wait(stacks, program.pid, path) if path else None
    in_vain = math.inf  # the time at which it has waited long enough
    while (left := min(end, in_vain) - time.monotonic()) > 0 and not at and len(printed) < FLOOD:
        reader.join(min(left, LOOK))
        if not reader.is_alive():
            output, status = printed.decode(errors="replace"), program.wait()
            return (_folded(path, output, status) if path and status else output), status
        if endless and not told_of_end and timeout - left > TELLING:
            told_of_end = True
            say(
                f"`{shlex.join(words)}` still runs after {TELLING:g} s, and this cell waits for it to end, at most "
                f"{timeout:g} s. A node does not end by itself: `terminal(..., until='some words')` ends it"
                " once it has printed a line with these words."
            )
        if path and len(printed) > told:
            told, spent, in_vain = len(printed), processes.processor_time(program.pid), math.inf
            wait = _Wait(stacks, program.pid, path)
        elif path and timeout <= USUAL:
            at = _lines(stacks.loop(program.pid, path, spent))
            lost = any("--ros-args" in words or not strangers(text, each.source) for each in [*failed])
            if lost:
                in_vain = min(in_vain, time.monotonic() + IN_VAIN)
            at = at or (wait.found(lost) if wait else "")
        elif WAITS in printed and timeout <= USUAL:
            in_vain = min(in_vain, time.monotonic() + IN_VAIN)
    ran = time.monotonic() - end + timeout
    why = ", because a node of this notebook has failed" if path and time.monotonic() >= in_vain else ""
    if path:
        at = at or _lines_of(stacks.doing(program.pid, path), path)
    else:  # `ros2 run` ends its program, too
        program.terminate()
        with contextlib.suppress(subprocess.TimeoutExpired):
            program.wait(GRACE)
    program.kill()
    program.wait()
    where = f". {path.name} was here:{at}" if path and at.startswith("\n  ") else f". {at.strip()}" if at else ""
    if client and not at:
        where = ". A client ends by itself: once its answer has come, or when none can come."
    if endless and not at:
        start = f"start it with `ros.start({path.name!r})`, or end" if path else "end"
        where = (
            f". A node runs until it is stopped: {start} it here once it has printed a certain line: "
            "`terminal(..., until='some words of that line')`."
        )
    if len(printed) >= FLOOD:
        why = FLOODED
        del printed[SHOWN:]
    return f"{printed.decode(errors='replace')}\n(stopped after {ran:.0f} s{why}){where}".lstrip("\n"), 124


class _Wait:
    """Looks, now and then, whether a silent program waits for something that cannot come."""

    def __init__(self, stacks: Stacks, pid: int, path: Path):
        self._stacks, self._pid, self._path = stacks, pid, path
        self._next = time.monotonic() + HELD  # the time of the next look for a wait
        self._seen = ""  # what the last look has found
        self._loop: tuple[Frame, ...] = ()  # where it has found a loop that cannot end
        self._asleep = 0  # looks in succession at which it and all programs of the session slept
        self._spin: EndlessSpin | None = None  # what was found meanwhile

    def found(self, failed: bool) -> str:
        """Return the lines where the program waits and why that never ends, once two looks have found the same.

        If a node of the session that it may need has `failed`, that is why a future is not done.
        """
        session = current()
        at = self._waits(session) if session and time.monotonic() >= self._next else ""
        return (at or ("" if failed else self._spins(session))) if session else ""

    def _waits(self, session: Session) -> str:
        self._next, before, loop = time.monotonic() + AGAIN, self._seen, self._loop
        self._loop = self._stacks.beginning(self._pid, self._path, endless=True)
        if self._loop and loop and self._loop[-1].function == loop[-1].function:
            return _lines_of(self._loop, self._path)
        self._seen = self._stacks.endless_wait(self._pid, self._path, session.served())
        if not self._seen or self._seen != before:
            return ""
        return f"{_lines(self._stacks.doing(self._pid, self._path))}\n{self._seen}"

    def _spins(self, session: Session) -> str:
        """Return the lines where the program spins for a future, and why nothing completes that.

        Looks are counted, not seconds: on a busy machine a program that has something to do may be late, but it does
        not sleep.
        """
        if not (processes.sleeping(self._pid) and session.is_at_rest()):
            self._asleep, self._spin = 0, None
            return ""
        self._asleep += 1
        if self._asleep % SLEPT:
            return ""
        before, self._spin = self._spin, self._stacks.endless_spin(self._pid, self._path)
        if self._spin is None or not session.is_at_rest(self._spin.names):
            self._spin = None
            return ""
        if self._spin != before and not self._spin.call:  # a spin until a future is done may be a passing one
            return ""
        spun = frame_at(self._path.name, self._spin.line, text_at(self._path))
        return f"{_lines(self._stacks.doing(self._pid, self._path) or (spun,))}\n{self._spin}"


def _read(program: "subprocess.Popen[bytes]", printed: bytearray) -> None:
    """Collect the output of a program until its end."""
    assert program.stdout is not None
    while chunk := os.read(program.stdout.fileno(), CHUNK):
        printed += chunk
    program.wait()


def _program(words: list[str]) -> Path | None:
    """Return the Python file that a command runs, or None."""
    named = Path(words[1]) if len(words) > 1 and re.fullmatch(r"python[\d.]*", Path(words[0]).name) else None
    return named.absolute() if named and named.suffix == ".py" and named.is_file() else None


def _lines(frames: tuple[Frame, ...]) -> str:
    return "".join(f"\n{frame}" for frame in frames)


def _lines_of(frames: tuple[Frame, ...], path: Path) -> str:
    """Return the lines where the program at `path` waits, and why that is in vain, if it is certain."""
    return "\n".join([_lines(frames), *remark(frames, text_at(path))])


def _folded(path: Path, output: str, status: int) -> str:
    """Return a program's output without the libraries' lines of its traceback."""
    before, mark, rest = without_ignored(output).rpartition(MARK)
    report = of_program(path, output, status)
    if not (mark and report.error and (report.frames or report.hint)):
        return output
    lines = [*map(str, report.frames), report.error, *([f"Hint: {report.hint}"] if report.hint else [])]
    return "\n".join([f"{before}Traceback (its {rest.count('  File ')} calls, folded):", *lines, ""])


def _run_until(words: list[str], timeout: float, until: str) -> tuple[str, int]:
    """Run a command until it prints a line with `until`, or ends; return output and exit status."""
    program = subprocess.Popen(
        words,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
        start_new_session=True,  # a process group of its own, as for a terminal's Ctrl-C
    )
    assert program.stdout is not None
    late = threading.Event()

    def end() -> None:
        late.set()
        _signal(program, signal.SIGKILL)

    def tell() -> None:
        last = f" Its last line is:\n  {line.strip()[:LAST]}" if line.strip() else ""
        say(
            f"`{shlex.join(words)}` has printed no line with {until!r} for {WITHOUT:g} s. This cell waits for it, at "
            f"most {timeout:g} s.{last}" + "".join(f"\nHint: {why}" for why in unread_files(words, _logging(line)))
        )

    printed, line = "", ""
    alarm, notice = threading.Timer(timeout, end), threading.Timer(WITHOUT, tell)
    notice.daemon = True
    alarm.start()
    if timeout > 2 * WITHOUT:
        notice.start()
    began = time.monotonic()
    try:
        while part := program.stdout.readline(CHUNK):
            printed += part
            line = part if line.endswith("\n") else line + part
            if until in line:
                return f"{printed}^C", 0
            if len(printed) >= FLOOD:
                ran = time.monotonic() - began
                return _below(
                    printed[:SHOWN], f"(stopped after {ran:.0f} s{FLOODED}; no line contained {until!r})"
                ), 124
        status = program.wait()
        late_line = f"(stopped after {timeout:g} s: no line contained {until!r})"
        return (f"{printed}{late_line}", 124) if late.is_set() else (printed, status)
    finally:
        alarm.cancel()
        notice.cancel()
        _end(program)


def _end(program: subprocess.Popen[str]) -> None:
    """End a program as Ctrl-C in its terminal does, and by force if it does not react."""
    try:
        _signal(program, signal.SIGINT)
        program.communicate(timeout=GRACE)
    except subprocess.TimeoutExpired:
        _signal(program, signal.SIGKILL)
        program.communicate()


def _signal(program: subprocess.Popen[str], number: int) -> None:
    """Send a signal to a program's process group."""
    with contextlib.suppress(ProcessLookupError):  # they have ended by themselves
        os.killpg(program.pid, number)
