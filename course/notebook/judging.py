"""Helpers of public checks: they start the files as they are on disk, and refuse other nodes with the same names."""

import ast
import contextlib
import math
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import IO, Any

from rclpy.action import ActionClient, get_action_names_and_types
from rclpy.context import Context
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription

from course.errors import ExerciseError, LiveError, NodeFailed
from course.explaining.doubts import endless_look, long_limit, short_result, short_wait
from course.explaining.failure_report import GUARDED, MARK, frame_at, of_program
from course.explaining.hangs import NOT_SPUN, THREADS, beginning
from course.explaining.interface_parts import type_name as field_type
from course.explaining.lines_that_wait import endless_look_at, executor_threads, remark
from course.explaining.outline import uncalled_main
from course.explaining.source import (
    CALLBACKS,
    ONE_AT_A_TIME,
    SLEEPS,
    argument,
    blocked,
    calls,
    functions,
    idle,
    made_at,
    made_in_a_callback,
    makes_one_node,
    name_of,
    named,
    one_at_a_time,
    parameter_callbacks,
    service_callbacks,
    spins_in_a_callback,
    text_at,
    without_global,
    written_number,
    wrong_guard,
)
from course.explaining.source import parse as parse_program
from course.foundation import processes
from course.foundation.syntax import walk
from course.foundation.waiting import wait_until
from course.interfaces.builder import build
from course.interfaces.definition import SECTIONS, parse
from course.interfaces.kept import packages
from course.notebook.command_line import lost_status, return_in_finally
from course.notebook.exercise_names import instead_of, left_behind
from course.notebook.file_differences import unwritten
from course.ros.names import split, type_name
from course.ros.rclpy_internals import NodeNameNonExistentError, action_name, take_request
from course.session.domains import claim_domain
from course.session.guards import interruptible
from course.session.live import current, live
from course.session.matching import served_services
from course.session.node_process import NodeProcess
from course.session.offered import other_names
from course.session.presence import Presence
from course.session.watch import Handle

# Python itself (`faulthandler`) reports where a program is, whatever it waits for, and ends: after some processor time,
# or when it gets the signal.
ASK = signal.SIGPROF
WATCHED = (
    "import faulthandler, signal; faulthandler.register(signal.SIGPROF, chain=True); "
    "signal.setitimer(signal.ITIMER_PROF, {limit}); stacks = open({stacks!r}, 'w'); "
    "signal.signal(signal.SIGUSR2, signal.SIG_IGN); "  # what Python restores when it ends, just as it is asked
    "faulthandler.register(signal.SIGUSR2, stacks); stacks.write('\\n'); stacks.flush()"
)
RHYTHM = re.compile(r"\b(?:while|Thread|Timer|Rate|create_rate|spin_once|create_timer)\b")  # may do without a timer
PERIOD = (0, "timer_period_sec")  # position and name of the argument of create_timer
EVERY = ("Exception", "BaseException")  # caught by name, a mistake in the program is caught as well
KNOWN = 1.0  # s after which a type or QoS that does not fit is told, because it will not change
BLOCKED = 3.0  # s after which a callback that may never answer, by its text, is not waited for
MOST = 30.0  # s that a program of `run` may take on a machine that is slow or busy
LOOK = 0.05  # s between two looks at it
EARLY = 10  # looks after which it is asked whether it is in an endless loop, and then after as many again
SETTING = ("set_parameters", "set_parameters_atomically")
ASKING = re.compile(r"^asking (.+)$", re.MULTILINE)  # what a program of `run` prints before it asks the file
PATIENT = 12.0  # s that a client is seen asleep without a server, of which it may wait 10
THREAD = "dds."  # begins the names of the threads with which a program sees others, from its first node on
LOOKS_FOR_A_SERVER = re.compile(r"wait_for_ser|_is_ready|count_|get_(?:service|node|client)|matched|sleep|spin_once")
LOOKS_ON = "Without a server, `{}` never ends: count the rounds, or wait once, with a limit, and give up then."
WAITS_ON = (
    "Line {} waits for the answer without a limit. `rclpy.spin_until_future_complete(node, future, timeout_sec=5.0)` "
    "returns after 5 s, also without an answer."
)
TAKES_IT_AWAY = (
    "This spins the node inside one of its own callbacks, and takes it away from the executor that spins it: then none "
    "of the node's callbacks runs any more. Leave it out; `time.sleep(seconds)` waits, and blocks only this thread."
)
BETWEEN = 0.3  # s between two looks at a wait that may be without a limit
ENDING = 1.0  # s for it to report where it is


def judge(
    file: str, *arguments: object, names: tuple[str, ...] = (), parameters: Mapping[str, object] | None = None
) -> Handle:
    """Start the program `file`, as it is on disk, for the check that follows.

    `names` are the services, actions and topics that the check uses.  Raises ExerciseError if the file differs from its
    cell, or by its text does nothing that it is asked for, LiveError while another node serves one of the names, and
    the errors of `ros.start`.
    """
    as_it_lies(file)
    if why := idle(file, text_at(Path(file))):
        raise ExerciseError(why)
    for line, module in left_behind(file):
        print(
            f"note: {file}, line {line} imports {module}.py, which is not handed in with it: copy what you need from "
            f"there into {file}.",
            file=sys.stderr,
        )
    session = live()
    if file in {row.started_as for row in session.rows()}:
        session.stop(file)
    for name in names:
        for who, ending in session.others(name):
            raise LiveError(f"{file} cannot be checked while {who} also uses {name}. To end it: {ending}.")
    session.meanwhile.uses(names)
    return session.meanwhile.judges(session.start(file, *arguments, parameters=parameters))


class Beside(NodeProcess):
    """A program beside a check, which prints what the check looks at."""

    def stop(self) -> None:
        """End it; raises NodeFailed if an exception had ended it before it printed anything."""
        super().stop()
        if not self.stopped and self.returncode and self.output.lstrip().startswith(MARK):
            raise NodeFailed(str(self.reports[-1]))


def beside(file: str, *arguments: str) -> Beside:
    """Start the program `file` with these words, and return it while it runs: `output` has what it has printed so far.

    The session does not know it, and whoever calls this must stop it.
    """
    as_it_lies(file)
    return Beside(Path(file), list(arguments))


class Alone:
    """A run of the client `file` with these words where it finds no server, beside what a check does meanwhile.

    It has a ROS domain of its own, and is ended when it does not give up.  With `silent`, a type and the name of a
    service, that is served there, and never answered.
    """

    def __init__(self, file: str, *arguments: str, silent: tuple[type[Any], str] | None = None):
        as_it_lies(file)
        self._when, self._silent = "with a server that does not answer" if silent else "without a server", bool(silent)
        self._where = self._why = ""
        self._begun = self._over = 0.0  # when it could first see others, and when it had ended, s since boot
        self._waited = math.inf  # s from a request to a silent server until the end
        self._asked: list[float] = []  # when each request to a silent server was sent, s since 1970
        self._process: NodeProcess | None = None
        with contextlib.suppress(LiveError):  # no domain is free: then this is left out
            self._claim, domain = claim_domain()
            self._context = Context()
            if silent:  # nothing spins its node
                self._context.init(domain_id=domain)
                self._server = Node("silent_server", context=self._context)
                self._served = self._server.create_service(*silent, lambda _, response: response)
            self._process = NodeProcess(Path(file), list(arguments), domain=domain)
            self._watching = threading.Thread(target=self._watch, args=[self._process], daemon=True)
            self._watching.start()

    def _watch(self, process: NodeProcess) -> None:
        """End the program after it was seen asleep for longer than a client may wait; the looks are counted."""
        looks, asleep = 0, 0
        with self._claim:
            while not wait_until(lambda: process.ended, LOOK, alert=False):
                self._begun = self._begun or processes.threaded(process.pid, THREAD)
                looks += 1
                asleep += process.asleep
                if asleep * LOOK >= PATIENT or looks * LOOK >= MOST:
                    self._end(process)
            self._over, ended = time.clock_gettime(time.CLOCK_BOOTTIME), time.time()
            while self._silent and (request := take_request(self._served)) is not None:
                self._asked.append(request[1])
            self._waited = ended - min(self._asked, default=0.0)
            self._context.try_shutdown()

    def _endless(self, process: NodeProcess) -> str:
        """Return why the program waits without end, '' without a sign of that: no answer will complete a future."""
        spin = process.endless_spin() if self._silent else None
        return WAITS_ON.format(spin.line) if spin else process.endless_wait()

    def _end(self, process: NodeProcess, why: str = "") -> None:
        why = why or self._endless(process)
        self._where, self._why = busy(process), why and f"\n{why}"
        process.stop()

    def has_a_limit(self) -> None:
        """Raise ExerciseError at once if the program waits without a limit, so that it will not end by itself.

        Also if it waits in a line, or a function, with a limit of many minutes.
        """
        process = self._process
        at = process.doing()[-1:] if process and "timeout_sec" in process.source else ()
        if process and at and long_limit(process.source, at[0].line) and process.doing()[-1:] == at:
            self._end(process)
            self.gives_up()
        line = endless_look(process.source) if process else 0
        if process and line and line in [each.line for each in process.doing()[-1:]]:
            self._end(process, LOOKS_ON.format(process.source.splitlines()[line - 1].strip()))
            self.gives_up()
        why = self._endless(process) if process else ""
        if process is None or not why or THREADS.search(process.source):
            return
        if not live().until(lambda: process.ended, BETWEEN) and self._endless(process) == why:
            self._end(process, why)
            self.gives_up()

    def gives_up(self, usage: str = "", least: float = 0.0, *, plainly: bool = False, answered: str = "") -> None:
        """Wait for its end; raises ExerciseError if it did not end by itself, said nothing, or ended with status 0.

        Also if it said nothing but its `usage`, or nothing but what it says when it is `answered`, if it ended earlier
        than `least` s after it could first see a server, or after its request to a silent one, or with a traceback,
        where it must end `plainly`.
        """
        process, session, why = self._process, live(), ""
        if process is None:
            return
        while not session.until(lambda: process.ended, KNOWN):
            before, why = why, self._endless(process)
            if why and why == before and not THREADS.search(process.source):
                self._end(process, why)
        if process.stopped:
            raise ExerciseError(
                f"{self._when}, {process.name} must say so, and end after 10 s at most: it still waited"
                f"{self._where}{self._why}"
            )
        if not process.output.strip() or process.returncode == 0:
            raise ExerciseError(
                f"{self._when}, {process.name} must say so, and its exit status must not be 0; it was "
                f"{process.returncode}{lost_status(process.name, process.returncode or 0)}\n"
                f"{process.output.strip() or 'it printed nothing'}"
            )
        raised = process.output.lstrip().startswith(MARK) and "'NoneType' object" in process.output
        if raised or (plainly and MARK in process.output):
            raise ExerciseError(
                f"{self._when}, {process.name} must say so, but it ends with an exception:\n"
                f"{process.reports[-1] if process.reports else process.output.strip()}"
            )
        session.until(lambda: not self._watching.is_alive())
        if len(self._asked) > 1:
            raise ExerciseError(
                f"{self._when}, {process.name} must not ask again, but it has sent {len(self._asked)} requests."
            )
        if self._waited < least:
            raise ExerciseError(
                f"{process.name} must wait for an answer for {least:g} s at least, but it ended {self._waited:.1f} s "
                f"after it had sent its request:\n{process.output.strip()}"
            )
        if usage and not _said(process.output) - _said(usage):
            raise ExerciseError(
                f"{self._when}, {process.name} must say so, but it prints the same as with only one argument:\n"
                f"{process.output.strip()}"
            )
        if not _said(process.output) - _said(answered):
            raise ExerciseError(
                f"{self._when}, {process.name} must say so in a line that it prints in no other case, but each of "
                f"these it prints with an answer, too:\n{process.output.strip()}"
            )
        waited = self._over - self._begun
        if not self._silent and self._begun and self._over and waited < least:
            raise ExerciseError(
                f"{process.name} must wait for a server that is still starting for {least:g} s at least, but it ended "
                f"{waited:.1f} s after it had begun to look for one:\n{process.output.strip()}"
            )


def _said(output: str) -> set[str]:
    """Return the lines that a program has printed, without the time that a logger writes before its text."""
    return {re.sub(r"\[\d+\.\d+\]", "", line).strip() for line in output.splitlines()}


def meet(*ends: Publisher | Subscription | ActionClient, timeout: float = 5.0) -> None:
    """Wait until each of these is matched by another node; raises LiveError that says why one is not.

    It does so early when the other end has another type or QoS, or when no running program can make it.
    """
    session = live()
    for end in ends:
        met, maker, name = _other_end(end)
        with interruptible():
            if wait_until(met, min(timeout, KNOWN)):  # `until` would tell of the QoS, too
                continue
        if not isinstance(end, ActionClient) and (why := session.misfit(end)):
            raise LiveError(why)
        if session.cannot_come(maker, name) or not session.until(met, timeout - KNOWN):
            raise LiveError(session.apart(end))


def hear(kind: type[Any], topic: str, callback: Callable[..., None]) -> Subscription:
    """Subscribe the session to `topic` for a check; what an earlier run of a check has left there is destroyed.

    A check that fails leaves its subscription, and its callback would go on with the names of the next run.
    """
    _end(_heard, topic)
    _heard[topic] = live().node.create_subscription(kind, topic, callback, 10)
    return _heard[topic]


def tell(kind: type[Any], topic: str) -> Publisher:
    """Let the session publish on `topic` for a check, in place of what an earlier run of a check has left."""
    _end(_telling, topic)
    _telling[topic] = live().node.create_publisher(kind, topic, 10)
    return _telling[topic]


_heard: dict[str, Subscription] = {}
_telling: dict[str, Publisher] = {}


def _end(left: "dict[str, Subscription] | dict[str, Publisher]", topic: str) -> None:
    """Destroy the end that a check has left for this topic, unless it was, or belongs to a session that has ended."""
    end, node = left.pop(topic, None), live().node
    if isinstance(end, Subscription) and end in node.subscriptions:
        node.destroy_subscription(end)
    elif isinstance(end, Publisher) and end in node.publishers:
        node.destroy_publisher(end)


def _other_end(end: Publisher | Subscription | ActionClient) -> tuple[Callable[[], object], str, str]:
    """Return a function that tells whether `end` is matched, what makes its other end, and the name."""
    if isinstance(end, ActionClient):
        return end.server_is_ready, "ActionServer", action_name(end)
    if isinstance(end, Publisher):
        return end.get_subscription_count, "create_subscription", end.topic_name
    return end.get_publisher_count, "create_publisher", end.topic_name


def action_client(kind: type[Any], name: str, timeout: float = 5.0) -> ActionClient:
    """Return an action client of the session that has met its server; raises LiveError that says why it has not.

    In a kernel that follows an action, rclpy fails to create a client of another type, without naming the reason.
    """
    session, wanted, end = live(), type_name(kind), time.monotonic() + timeout

    def types() -> list[str]:
        return next((kinds for each, kinds in get_action_names_and_types(session.node) if each == name), [])

    if not session.until(types, KNOWN) and not session.cannot_come("ActionServer", name):
        session.until(types, timeout - KNOWN)
    if (served := types()) and wanted not in served:
        raise LiveError(f"The action {name} is served with the type {served[0]}; it must be {wanted}.")
    client = ActionClient(session.node, kind, name)
    meet(client, timeout=max(KNOWN, end - time.monotonic()))
    return client


def meant(file: str, maker: str, name: str) -> None:
    """Raise ExerciseError if the program `file` passes other names, written out, to `maker`, and not `name`."""
    source = text_at(Path(file))
    if others := other_names(source, maker, name):
        text, line = others[0]
        raise ExerciseError(f"{frame_at(file, line, source)}\nThe name must be {name}, but here it is {text}.")


def of_type(kind: type[Any], service: str) -> None:
    """Raise LiveError at once if `service` is served, and with another type: a call would wait in vain."""
    wanted, served = type_name(kind), served_services(live().node).get(service)
    if served and wanted not in served:
        raise LiveError(f"{service} is served with the type {served[0]}; it must be {wanted}.")


def node_of(service: str, process: Handle) -> str:
    """Return the full name of the node of `process` that serves `service`; raises LiveError if none does within 10 s.

    Which of several nodes has an endpoint is published by their program apart from the endpoint: it may be known later.
    """
    if isinstance(process, NodeProcess) and len(process.nodes) == 1 and makes_one_node(process.source):
        return process.nodes[0]
    presence = Presence(live().node)
    found: list[str] = []

    def is_known() -> bool:
        found[:] = [name for name in presence.names() if service in presence.services(name)]
        return bool(found)

    if not live().until(is_known, timeout=10.0):
        raise LiveError(f"no node serves {service}")
    return found[0]


def busy(process: Handle, service: str = "") -> str:
    """Return lines that say where a program that makes no progress is; '' if it is waiting.

    With a `service`, also why its callback may never answer, if its text shows that.
    """
    if not isinstance(process, NodeProcess):
        return ""
    first, second = process.doing(), process.doing()
    stays = bool(first and second) and first[-1].function == second[-1].function
    looks = endless_look_at(second, process.source) if stays else []
    why = blocked(process.source, service) if service and not looks else ""
    found = ["", f"{process.name}: {why}"] if why else []
    if not why and not looks and service and (line := one_at_a_time(process.source, service)):
        found = ["", str(frame_at(process.name, line, process.source)), ONE_AT_A_TIME.format(service)]
    if stays:
        found += [*([] if found else [""]), f"{process.name} is here:", *dict.fromkeys(map(str, second))]
        if looks:
            found += looks
        elif process.unspun():
            found += [f"{NOT_SPUN[0].upper()}{NOT_SPUN[1:]}"]
        elif not why:
            found += remark(second, process.source)
        found += [limit] if (limit := long_limit(process.source, second[-1].line)) else []
        live().watch.forget(NOT_SPUN)  # the start has reported the same
    elif not found and (spins := spins_in_a_callback(process.source)):
        found = ["", str(frame_at(process.name, spins.lineno, process.source)), TAKES_IT_AWAY]
    return "\n".join(found)


def within(timeout: float, condition: Callable[[], object], process: Handle, service: str) -> bool:
    """Wait until `condition()` holds; False after `timeout` s.

    It gives up earlier if the text of `process` shows why its callback of `service` may never answer, unless that is a
    sleep, which ends, or the program has executors of its own: any of them may receive the response.  Callbacks of the
    session's own nodes that do not return meanwhile, such as those of a check's server, which holds its answers back,
    are not told of.
    """
    with interruptible():
        if wait_until(condition, min(timeout, BLOCKED)):
            return True
        source = process.source if isinstance(process, NodeProcess) else ""
        why = "" if "ThreadedExecutor(" in source else blocked(source, service)
        return (not why or why.endswith(SLEEPS)) and bool(wait_until(condition, timeout - BLOCKED))


def other_client(process: Handle, service: str, kind: type[Any]) -> str:
    """Return lines that say of which type a program's client of `service` is, if not of `kind`; '' otherwise."""
    node, wanted, source = live().node, type_name(kind), process.source if isinstance(process, NodeProcess) else ""
    line, written = written_type(source, service)
    types = [written] if written else []
    for each in process.nodes if isinstance(process, NodeProcess) and not written else ():
        with contextlib.suppress(NodeNameNonExistentError):  # it has ended
            found = dict(node.get_client_names_and_types_by_node(*split(each))).get(service, [])
            types = types if wanted in types else found
    if not types or wanted in types:
        return ""
    line = line or made_at(source, "create_client", service)
    at = f"\n{frame_at(process.name, line, source)}" if line else ""
    return f"{at}\nIts client of {service} has the type {types[0]}; it must be {wanted}."


def written_type(source: str, service: str) -> tuple[int, str]:
    """Return the line of a program's only client of `service`, and its type as the program imports it; or 0 and ''."""
    tree = parse_program(source)
    named_so = ((call, getattr(argument(call, 1, "srv_name"), "value", "")) for call in calls(tree, "create_client"))
    made = [call for call, name in named_so if str(name).lstrip("/~") == service.lstrip("/")]
    kind = argument(made[0], 0, "srv_type") if len(made) == 1 else None
    imports = [node for node in walk(tree) if isinstance(node, ast.ImportFrom) and node.module]
    types = [f"{node.module}.{alias.name}".replace(".", "/") for node in imports for alias in node.names
             if isinstance(kind, ast.Name) and (alias.asname or alias.name) == kind.id]  # fmt: skip
    other = any(each.name == name_of(kind) for each in walk(tree) if isinstance(each, ast.ClassDef))
    if len(types) != 1 or other or not re.fullmatch(r"\w+/srv/\w+", types[0]):
        return 0, ""
    return made[0].lineno, types[0]


def why_silent(file: str) -> str:
    """Return lines that say why a client prints no answer: main() does not run to its end, or nothing spins; or ''."""
    source = text_at(Path(file))
    if guard := wrong_guard(source):
        return f"\n{frame_at(file, guard[1], source)}\n{GUARDED.format(guard[0])}"
    if uncalled := uncalled_main(source):
        line, why = uncalled
        return f"\n{frame_at(file, line, source)}\n{why}" if line else f"\n{file}: {why}"
    tree = parse_program(source)
    spins = any("spin" in str(getattr(node, "attr", getattr(node, "id", ""))) for node in walk(tree))
    sent = next(calls(tree, "call_async"), None)
    if spins or sent is None:
        return return_in_finally(file) or unmet(file)
    return (
        f"\n{file}, line {sent.lineno}, sends the request, but nothing in the file spins the node, so the response "
        "is never received: `rclpy.spin_until_future_complete(node, future, timeout_sec=...)`."
    )


def unmet(file: str) -> str:
    """Return lines about a client that sends without a look for the server, or waits for it less than 1 s.

    '' if it may wait long enough.
    """
    source = text_at(Path(file))
    if (short := short_wait(source, least=1.0)) is not None:
        return f"\n{frame_at(file, short[0], source)}\nHere it waits {short[1]:g} s."
    waits = {"call_async": "wait_for_service", "send_goal_async": "wait_for_server"}
    found = ((call, waits[name]) for name in waits for call in calls(parse_program(source), name))
    sent, wait = next(found, (None, ""))
    if sent is None or LOOKS_FOR_A_SERVER.search(source):
        return ""
    return (
        f"\n{frame_at(file, sent.lineno, source)}\nNothing in the file waits for the server before this. A program "
        "needs a moment to find it, and what it sends earlier is lost: wait with "
        f"`{ast.unparse(sent.func).rpartition('.')[0]}.{wait}(timeout_sec=...)`, which returns False if no server "
        "comes."
    )


def no_feedback(file: str) -> str:
    """Return lines about a client that sends goals without a `feedback_callback`; '' if it may hear feedback."""
    source = text_at(Path(file))
    sent = list(calls(parse_program(source), "send_goal_async"))
    given = (argument(call, 1, "feedback_callback") or any(not each.arg for each in call.keywords) for call in sent)
    if not sent or any(given) or "/feedback" in source:
        return ""
    return (
        f"\n{frame_at(file, sent[0].lineno, source)}\nFeedback comes to the function that is given here: "
        "`send_goal_async(goal, feedback_callback=...)`."
    )


def early_end(file: str) -> str:
    """Return lines about a client that waits for the result of a goal for a few seconds alone; '' if it may not."""
    source = text_at(Path(file))
    if (short := short_result(source)) is None:
        return ""
    return (
        f"\n{frame_at(file, short[0], source)}\nThis waits for {short[1]:g} s, after which the result is None. Many "
        "goals take longer: leave the limit out here."
    )


def hidden(file: str) -> str:
    """Return lines about an `except` of `file` that catches every exception; '' without one.

    It is a place to look at: whether anything was raised there is not known.
    """
    source = text_at(Path(file))
    for node in walk(parse_program(source)):
        if isinstance(node, ast.ExceptHandler) and (node.type is None or ast.unparse(node.type) in EVERY):
            return (
                f"\n{frame_at(file, node.lineno, source)}\nThis catches every exception, also that of a misspelt name, "
                "so none would be seen. Catch only those that you expect."
            )
    return ""


def slow_timer(file: str, most: float) -> str:
    """Return lines about a timer above `most` s, if all are so by their text, or about a missing one; '' otherwise."""
    source, slow = text_at(Path(file)), ""
    tree = parse_program(source)
    made = list(calls(tree, "create_timer"))
    if not made and not RHYTHM.search(source):
        return f"\n{file} has no timer: `create_timer(period, callback)` calls a method regularly."
    periods = [value_of(argument(call, *PERIOD), tree) for call in made]
    for call, period in zip(made, periods, strict=True):
        if period is None or period <= most:
            return ""  # this one may be fast
        at = frame_at(file, call.lineno, source)
        slow = slow or f"\n{at}\nThe period of a timer is in seconds: this one fires every {period:g} s."
    return slow


def value_of(node: ast.expr | None, tree: ast.Module) -> float | None:
    """Return the value of a number, or of a quotient or product of numbers, or of a constant of the file; or None."""
    if isinstance(node, ast.Constant):
        return written_number(node)
    if isinstance(node, ast.Name):
        set_to = [each for each in walk(tree) if isinstance(each, ast.Name) and each.id == node.id]
        stored = [each for each in set_to if not isinstance(each.ctx, ast.Load)]
        made = [each for each in tree.body if isinstance(each, ast.Assign) and node.id in map(name_of, each.targets)]
        known = len(stored) == len(made) == 1 and isinstance(made[0].value, (ast.BinOp, ast.Constant))
        return value_of(made[0].value, tree) if known else None
    if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Div, ast.Mult)):
        left, right = value_of(node.left, tree), value_of(node.right, tree)
        if left is None or right is None or (right == 0 and isinstance(node.op, ast.Div)):
            return None
        return left / right if isinstance(node.op, ast.Div) else left * right
    return None


def rate_in_a_timer(file: str) -> str:
    """Return lines about a callback of a timer that sleeps by a rate of its own thread's; '' if none does."""
    source = text_at(Path(file))
    tree = parse_program(source)
    if "ThreadedExecutor(" in source or not list(calls(tree, "create_rate")):
        return ""
    names = {name_of(argument(call, *CALLBACKS["create_timer"])) for call in calls(tree, "create_timer")}
    rates = {ast.unparse(target) for node in walk(tree) if isinstance(node, ast.Assign)
             for target in node.targets if list(calls(node.value, "create_rate"))}  # fmt: skip
    for function in functions(tree):
        for call in calls(function, "sleep") if function.name in names else ():
            if isinstance(call.func, ast.Attribute) and ast.unparse(call.func.value) in rates:
                return (
                    f"\n{frame_at(file, call.lineno, source)}\nA rate needs a thread of its own that spins the node, "
                    "and here the only one waits for it. The timer alone gives the callback its rate: leave this out."
                )
    return ""


PAUSES = re.compile(r"sleep|wait|spin|join|get$|read")  # calls that may pause a loop


def _ends(loop: ast.While) -> bool:
    """Return True if a loop has a condition of its own, or leaves by itself."""
    always = isinstance(loop.test, ast.Constant) or ast.unparse(loop.test) == "rclpy.ok()"
    return not always or any(isinstance(node, (ast.Break, ast.Return)) for node in walk(loop))


def more_timers(file: str) -> str:
    """Return lines about what publishes beside the timer; '' if the text does not show that.

    That is a callback that makes one more timer at each call, one that publishes for each message, or a loop without a
    pause.
    """
    source = text_at(Path(file))
    tree = parse_program(source)
    sending = {each.name for each in functions(tree) if next(calls(each, "publish"), None)} | {"publish"}
    heard = {name_of(argument(call, *CALLBACKS["create_subscription"])) for call in calls(tree, "create_subscription")}
    for function in named(tree, heard):
        for call in (each for name in sorted(sending - {function.name}) for each in calls(function, name)):
            return (
                f"\n{frame_at(file, call.lineno, source)}\nThis publishes once more for each message that "
                f"'{function.name}' gets: the timer alone gives the commands their rate."
            )
    for function in functions(tree):
        for loop in (each for each in walk(function) if isinstance(each, ast.While)):
            called = {name_of(node.func) for node in walk(loop) if isinstance(node, ast.Call)}
            if sending & called and not any(PAUSES.search(each) for each in called) and not _ends(loop):
                return (
                    f"\n{frame_at(file, loop.lineno, source)}\nThis loop publishes without a pause. A timer, "
                    "`create_timer(0.1, callback)`, calls a method ten times a second."
                )
    if more := made_in_a_callback(source):
        line, why = more
        return f"\n{frame_at(file, line, source)}\n{why}"
    return ""


def one_thread(file: str) -> str:
    """Return lines about a node that `rclpy.spin(node)` spins with one thread, which no action awaits; '' otherwise."""
    source = text_at(Path(file))
    tree = parse_program(source)
    names = {name_of(argument(call, *CALLBACKS["ActionServer"])) for call in calls(tree, "ActionServer")}
    if any(isinstance(each, ast.AsyncFunctionDef) and each.name in names for each in functions(tree)):
        return ""
    for call in calls(tree, "spin"):
        if ast.unparse(call.func) == "rclpy.spin" and len(call.args) + len(call.keywords) == 1:
            return (
                f"\n{frame_at(file, call.lineno, source)}\nThis spins the node with one thread: while one callback "
                "runs, no other one does. A MultiThreadedExecutor that has the node, and is spun itself, has several."
            )
    return ""


def few_threads(file: str, callers: int) -> str:
    """Return lines about an executor that has not more threads than so many callers can block; '' otherwise."""
    source = text_at(Path(file))
    line, count, given = executor_threads(source)
    if not 0 < count <= callers:
        return ""
    return (
        f"\n{frame_at(file, line, source)}\n"
        f"This has {count} threads{'' if given else ', one for each processor'}. A callback that blocks while it waits "
        f"occupies one of them, so {callers} callers at once leave none to receive an answer."
    )


def own_variable(file: str) -> str:
    """Return lines about a callback of a service that sets a variable of its own for one of the file; '' if none does.

    It is a place to look at: the file's variable may be meant to stay as it is.
    """
    source = text_at(Path(file))
    tree = parse_program(source)
    callbacks = service_callbacks(tree)
    for function, name, line, _ in without_global(tree):
        if function.name in callbacks:
            return (
                f"\n{frame_at(file, name.lineno, source)}\nThis sets a variable of '{function.name}' alone, not that "
                f"of line {line}. To set that one, begin '{function.name}' with `global {name.id}`, or keep it in "
                f"`self.{name.id}`."
            )
    for cls in (node for node in walk(tree) if isinstance(node, ast.ClassDef)):
        attributes = [node for node in walk(cls) if isinstance(node, ast.Attribute)]
        kept = {node.attr for node in attributes if name_of(node.value) == "self"}
        for function in functions(cls):
            unread = _unread(function) if function.name in callbacks else []
            for name in (each for each in unread if each.id in kept):
                return (
                    f"\n{frame_at(file, name.lineno, source)}\nNothing reads this variable of '{function.name}'. "
                    f"`self.{name.id}` is another one: to set that, write it with `self.`."
                )
    return ""


def _unread(function: ast.AST) -> list[ast.Name]:
    """Return the places where a function sets a variable that it never reads."""
    names = [node for node in walk(function) if isinstance(node, ast.Name)]
    known = {node.id for node in names if not isinstance(node.ctx, ast.Store)}
    outside = [node.names for node in walk(function) if isinstance(node, (ast.Global, ast.Nonlocal))]
    return [node for node in names if node.id not in known.union(*outside)]


def shared_response(file: str) -> str:
    """Return lines about a callback of a service that returns an attribute of its node; '' if none does."""
    source = text_at(Path(file))
    tree = parse_program(source)
    callbacks = service_callbacks(tree)
    for function in (each for each in functions(tree) if each.name in callbacks):
        for node in (each for each in walk(function) if isinstance(each, ast.Return)):
            if isinstance(node.value, ast.Attribute) and ast.unparse(node.value.value) == "self":
                at = frame_at(file, node.lineno, source)
                return (
                    f"\n{at}\nAll calls share `{ast.unparse(node.value)}`: a call that runs meanwhile changes it. Fill "
                    "in the response that the callback is given, and return that."
                )
    return ""


def sets_in_a_check(file: str) -> str:
    """Return lines about a parameter or an attribute that an on-set callback, which only checks, sets; else ''."""
    source = text_at(Path(file))
    tree = parse_program(source)
    for function in named(tree, parameter_callbacks(tree, "add_on_set_parameters_callback")):
        for call in (each for name in SETTING for each in calls(function, name)):
            if isinstance(call.func, ast.Attribute) and name_of(call.func.value) == "self":
                return (
                    f"\n{frame_at(file, call.lineno, source)}\nThis sets a parameter while another change is only "
                    "being checked, and this one remains when that one is refused. An on-set callback must only "
                    f"check: a pre-set callback may change what is set, and a post-set callback acts."
                )
        for node in walk(function):
            if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store) and name_of(node.value) == "self":
                return (
                    f"\n{frame_at(file, node.lineno, source)}\nThis changes `{ast.unparse(node)}` while a change is "
                    "only being checked, also when it is refused. An on-set callback must only check: a post-set "
                    "callback acts."
                )
    return ""


def sleeps(file: str, maker: str) -> str:
    """Return the first line of a program's callbacks, those passed to `maker`, that sleeps, and why that is wrong.

    '' if none does.
    """
    source = text_at(Path(file))
    tree = parse_program(source)
    names = {name_of(argument(call, *CALLBACKS[maker])) for call in calls(tree, maker)}
    awaited = {node.value for node in walk(tree) if isinstance(node, ast.Await)}
    for function in functions(tree):
        for call in calls(function, "sleep") if function.name in names else ():
            where = ", also in an `async def`" if isinstance(function, ast.AsyncFunctionDef) else ""
            why = (
                ""
                if call in awaited or "ThreadedExecutor(" in source
                else (f"\nA sleep blocks the only thread that runs callbacks{where}: leave it out.")
            )
            return f"\n{frame_at(file, call.lineno, source)}{why}"
    return ""


def fields(section: type) -> dict[str, str]:
    """Return the fields of a request, a response or a message, with types as in a definition."""
    return {name: field_type(kind) for name, kind in section.get_fields_and_field_types().items()}  # type: ignore[attr-defined]


def unlike(has: Mapping[str, str], wanted: Mapping[str, str]) -> str:
    """Return how the fields of a definition, with their types, differ from those that a task asks for."""
    found = [f"`{name}` is one too many" for name in has if name not in wanted]
    found += [f"`{name}` is missing" for name in wanted if name not in has]
    found += [
        f"`{name}` is a {kind} and must be a {wanted[name]}"
        for name, kind in has.items()
        if wanted.get(name, kind) != kind
    ]
    return ", ".join(found) or f"the order must be {', '.join(wanted)}"


def plain_fields(name: str) -> None:
    """Raise ExerciseError for a default or a constant in the definition `name`: the task asks only for fields."""
    for section in parse(Path(name).read_text(encoding="utf-8", errors="replace"), name).sections:
        for field in section:
            if field.value is not None:
                what = "a constant" if field.name.isupper() else "a default"
                raise ExerciseError(
                    f"{name}: `{field.type} {field.name}` has the value {field.value!r}, which makes it {what}; "
                    "the task asks for plain fields."
                )


def run(source: str, *arguments: str, file: str, limit: float = 3.0) -> str:
    """Run Python `source` in a separate process, and return its output.

    It uses `file`, the file to check.  Raises NodeFailed, with the lines of that file where it failed, or where it was
    after `limit` s of work or of sleep, and what it was asked then, if `source` prints lines "asking ..." before.  A
    program that only lacks a processor is given more time.
    """
    as_it_lies(file)
    began = time.monotonic()
    with tempfile.NamedTemporaryFile("r", errors="replace") as stacks:
        program = subprocess.Popen(
            [sys.executable, "-c", f"{WATCHED.format(limit=limit, stacks=stacks.name)}\n{source}", *arguments],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
        )
        try:
            output, errors, killed = _communicate(program, limit, _Loops(program, Path(file), stacks))
        finally:
            program.kill()
            program.wait()
    if killed or program.returncode == -ASK:
        late = re.search(rf'File ".*{re.escape(file)}", line (\d+) in (.+)', errors)
        number, function = (int(late[1]), late[2]) if late else (0, "")
        code = Path(file).read_text(errors="replace").splitlines()[number - 1 : number] if late else []
        question = "".join(f" {what}" for what in ASKING.findall(output)[-1:])
        raise NodeFailed(
            f"{file} had not answered{question} after {time.monotonic() - began:.0f} s."
            + (f" It was here:\n  {file}, line {number}, in {function}\n    {''.join(code).strip()}" if late else "")
        )
    if program.returncode:
        raise NodeFailed(str(of_program(Path(file), errors, program.returncode)))
    return output


class _Loops:
    """Looks at a program of `run` that find the file in a loop that cannot end."""

    def __init__(self, program: "subprocess.Popen[str]", path: Path, stacks: IO[str]):
        self._program, self._path, self._stacks = program, path, stacks
        self._looks, self._asked, self._found = 0, False, 0

    def found(self) -> bool:
        """Return True once two stacks in a row show it; to be called at each look."""
        self._looks += 1
        if self._looks % EARLY:
            return False
        said = self._stacks.read()  # what was asked for the last time
        if self._asked and said:
            self._found = self._found + 1 if beginning(said, self._path, endless=True) else 0
        self._asked |= bool(said)  # it can be asked: it has written its first line
        if self._asked and self._found < 2 and self._program.poll() is None:
            self._program.send_signal(signal.SIGUSR2)
        return self._found == 2


def _communicate(program: "subprocess.Popen[str]", limit: float, loops: _Loops) -> tuple[str, str, bool]:
    """Return what a program prints, and True if it had to be killed.

    It is ended after it was seen asleep for `limit` s, or in an endless loop, or after `MOST` s, and killed if it does
    not say where it is.  The looks are counted, and not the seconds, because a busy machine may let neither this
    process nor that one run.
    """
    looks, asleep = 0, 0
    while True:
        try:
            return *program.communicate(timeout=LOOK), False
        except subprocess.TimeoutExpired:
            looks += 1
            asleep += processes.sleeping(program.pid)
        if asleep * LOOK >= limit or looks * LOOK >= MOST or loops.found():
            program.send_signal(ASK)
            with contextlib.suppress(subprocess.TimeoutExpired):
                return *program.communicate(timeout=ENDING), False
            program.kill()
            return *program.communicate(), True


def as_it_lies(*files: str, package: str = "") -> None:
    """Raise ExerciseError if one of the files differs from its cell as last run.

    An interface is built again when its file has changed, as part of the `package` that its task names; raises
    InterfaceError when it cannot be built.
    """
    for name in files:
        path = Path(name)
        if why := unwritten(path):
            raise ExerciseError(
                f"{name} {'is unchanged' if path.exists() else 'was not written'}, because the last run of its cell "
                f"was {why}\n"
                f"{'Run it' if why == 'interrupted' else 'Correct the cell and run it'}, then check again."
            )
        if not path.is_file():
            raise ExerciseError(_missing(name))
        if path.suffix[1:] in SECTIONS:
            _build(name, package)


def _missing(name: str) -> str:
    """Return why a file is not there: the kernel is elsewhere, or the file was not written or has another name."""
    session = current()
    if session and (why := session.elsewhere):
        return f"{name} is not in the kernel's folder: {why}"
    return f"{name} is not in the notebook's folder: run its cell, then check again.{instead_of(name)}"


def _build(name: str, package: str) -> None:
    known = next((kept for kept in packages(Path()) if name in kept.files), None)
    if known is None:
        raise ExerciseError(f"{name} was not built here: run its cell, then check again.")
    if package and known.package != package:
        raise ExerciseError(
            f"{name} was built into the package {known.package}, but belongs to {package}: begin its cell with "
            f"`%%exercise {name} --package {package}`, run it, then check again."
        )
    build(known.package, [Path(file) for file in known.files])
