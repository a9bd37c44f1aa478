"""The nodes that a session has started: starting, replacing, ending and restarting them, and their table."""

import contextlib
import difflib
import itertools
import os
import signal
import sys
import threading
import time
import traceback
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from rcl_interfaces.srv import ListParameters
from rclpy.exceptions import NotInitializedException
from rclpy.node import Node

from course.errors import CallTimeout, LiveError, NodeFailed
from course.explaining.doubts import doubts
from course.explaining.failure_report import Frame
from course.explaining.hangs import NOT_SPUN
from course.explaining.parameter_files import set_parameters, unread_files
from course.explaining.source import makes_one_node, running_cell, text_at
from course.foundation import processes
from course.foundation.processes import processor_time
from course.foundation.waiting import wait_until
from course.ros.names import PARAMETERS_OF_EVERY_NODE, base
from course.ros.rclpy_internals import GoalFault, NoResult, is_initialized, is_watched
from course.session.calls import Calls
from course.session.guards import say
from course.session.interface_usage import destructors
from course.session.live_node import LiveNode, Owner, in_context
from course.session.misuse import no_node
from course.session.node_process import NodeProcess
from course.session.outsiders import Outsider, Outsiders
from course.session.presence import Presence, difference
from course.session.publishing import Publishing
from course.session.requests import argument
from course.session.session_logs import SessionLogs
from course.session.spinner import Spinner, frames_in_cells
from course.session.table import Row
from course.session.watch import Handle, Watch

PATIENCE = 5.0  # s without a node, after which the reader is told what the program is doing
MAKING = 1.0  # s of a processor that a program may use, once its node is there, before it is said to run
USUAL = 20.0  # s that a program may take for its first node; more means that it computes for long
ASKED = 1.0  # s for a program to return its parameters
OF_NO_INTEREST = (*PARAMETERS_OF_EVERY_NODE, "qos_overrides.")  # prefixes of parameters that nobody sets by hand
ENDING = 5.0  # s that a program started elsewhere has to end after Ctrl-C
# Called before a file is started; their results are shown to the reader.  `course.notebook` checks here that the file
# equals its cell.
before_start: list[Callable[[Path], str]] = []


class StartedNodes:
    """The nodes in `handles`, by name: those of this kernel, and those of files' programs.

    `owner` is the session, whose own node is `calls.node`; `prepare` is called before each start.
    """

    def __init__(
        self,
        owner: Owner,
        handles: dict[str, Handle],
        *,
        calls: Calls,
        logs: SessionLogs,
        outsiders: Outsiders,
        prepare: Callable[[], None],
        publishing: Publishing,
        watch: Watch,
    ):
        self._owner, self._handles = owner, handles
        self._calls, self._logs, self._prepare, self._publishing, self._watch = calls, logs, prepare, publishing, watch
        self._outsiders = outsiders
        self._presence = Presence(calls.node)
        self._again: dict[str, Callable[[], Handle]] = {}  # restarts each as it was started last
        self._changing = threading.RLock()  # held while a node is started or stopped
        self._leaving: list[Row] = []  # the rows of what is being stopped or replaced, which stay meanwhile
        self._starting = False
        self.introspecting = False  # whether services of started programs are introspected
        self.of_check: Collection[str] = ()  # the classes that the public check defines which is being run

    def start_class(
        self,
        cls: type[Node],
        args: tuple[object, ...],
        kwargs: dict[str, object],
        parameters: Mapping[str, object],
        threads: int,
    ) -> Handle:
        """Make a node in this kernel and spin it; raises the exceptions of its `__init__`."""
        cell = running_cell()

        def start() -> Handle:
            handle = self._start_class(cls, args, kwargs, _arguments(parameters), threads, cell)
            self._tell_undeclared(handle.name, parameters, Node.list_parameters(handle.node, [], 0).names)
            return handle

        return self._start_alone(start)

    def start_file(
        self, path: Path, args: tuple[object, ...], parameters: Mapping[str, object], timeout: float
    ) -> Handle:
        """Run a file in its own process; raises LiveError when it ends, or shows no node within `timeout` s."""

        def again() -> Handle:
            process = self._start_file(path, [*map(str, args), *_arguments(parameters)], timeout)
            for line in unread_files(list(map(str, args)), process.nodes):
                self._watch.notice(line)
            set_here = [*parameters, *set_parameters(list(map(str, args)))]
            if set_here and len(process.nodes) == 1 and makes_one_node(process.source):
                # it is busy, or has ended, which the next wait tells, but can be started all the same
                with contextlib.suppress(CallTimeout), self._watch.postponing():
                    service = f"{process.nodes[0]}/list_parameters"
                    names = self._calls.call(service, ListParameters, ListParameters.Request(), ASKED).result.names
                    self._tell_undeclared(path.name, set_here, names)
            return process

        if path.is_file():
            self._again[path.name] = again  # a program that fails at once can be restarted, too
        return self._start_alone(again)

    def restart(self, name: str) -> Handle:
        """Restart the node or the file called `name` as it was started last; raises LiveError for an unknown name."""
        found = self._called(name, self._again)
        if not found:
            raise LiveError(f"this session has no node or file called {name}: ros.nodes() lists what it has started")
        old = self._handles.get(found[0])
        if isinstance(old, LiveNode) and is_watched(old.node):
            self._watch.notice(
                f"A ParameterRecorder of '{old.name}' records the node before the restart, not the new one: create "
                "another recorder."
            )
        return self._start_alone(self._again[found[0]])

    def has_started(self, name: str) -> bool:
        """Return True if a node or a file called `name` was started here, or a node of that name exists."""
        nodes = (base(node) for handle in list(self._handles.values()) for node in handle.nodes)
        return name in self._again or name.lstrip("/") in {*self._handles, *nodes, *map(base, self.names())}

    def stop(self, name: str | None = None, *, wait: bool = True) -> None:
        """Stop the node or the file called `name`, or all of them; with `wait`, until they are gone from the graph.

        The reader is told of a node of that name which others have started, as it goes on running.
        """
        with self._changing:
            keys = self._called(name, self._handles) if name else list(self._handles)
            for key in keys:
                if handle := self._handles.get(key):
                    if isinstance(handle, NodeProcess):
                        self._logs.keep(handle)  # at first, because its log is read meanwhile, too
                    with self._shown_meanwhile(_rows(key, handle) if wait and handle.alive else []):
                        self._handles.pop(key, None)
                        self._stop(handle, wait)
        if name and not keys:
            for each in self._outsiders.nodes():
                if name.lstrip("/") in (base(each.node), each.node.lstrip("/")):
                    self._watch.notice(f"{each} was not started by this session. To end it: {each.ending}.")

    def stop_of_checks(self) -> None:
        """Stop the nodes of classes that a public check has defined."""
        for handle in list(self._handles.values()):
            if isinstance(handle, LiveNode) and handle.of_check:
                self.stop(handle.name)

    def stop_outsider(self, pid: int, born: int) -> None:
        """Stop a program that others have started, as Ctrl-C does; `born` is its `birth`.

        Raises LiveError if it may not be stopped from here, or does not end.
        """
        for each in self._outsiders.nodes():
            if each.process == (pid, born):
                _end(each, born)
                return
        raise LiveError(f"process {pid} has no node any more, or must not be stopped from here")

    def stop_users(self, package: str) -> None:
        """Stop the nodes of this kernel that use an interface of `package`, which is built again; tell the reader."""
        for handle in list(self._handles.values()):
            if isinstance(handle, LiveNode) and any(destructors(handle.node, package)):
                self.stop(handle.name)
                cls = handle.cls
                module = cls.__module__.partition(".")[0]
                first = (
                    f"import from {package} and define {cls.__name__}"
                    if module == "__main__"
                    else (f"write and import {module}.py")
                )
                self._watch.notice(
                    f"'{handle.name}' was ended: it uses {package}, which has been built again. Run the cells that "
                    f"{first}, and then start it again, with ros.start({cls.__name__})."
                )

    def goal_failed(self, node: Node, fault: Exception | GoalFault | NoResult) -> None:
        """Record what a callback of an action server in this kernel has raised, or done wrong otherwise."""
        for handle in list(self._handles.values()):
            if isinstance(handle, LiveNode) and handle.node is node:
                handle.goal_failed(fault)

    def names(self) -> list[str]:
        """Return the full names of the running nodes in the session's domain, without hidden ones."""
        return [name for name in self._presence.names() if not base(name).startswith("_")]

    def others(self, name: str) -> list[tuple[str, str]]:
        """Return the servers of the service or action `name`, or publishers of the topic, and how to end each."""
        outside = [(str(each), each.ending) for each in self._outsiders.serving(name)]
        return outside + [(f"{key} of this notebook", f"ros.stop('{key}')") for key in self._outsiders.own(name)]

    def server(self, name: str) -> tuple[str, bool]:
        """Return the server of the service `name`, and whether `restart_server` can restart it; '' if there is none."""
        if own := self._outsiders.own(name):
            return own[0], True
        return next(((str(each), each.program is not None) for each in self._outsiders.serving(name)), ("", False))

    def restart_server(self, name: str) -> Handle:
        """Restart the server of the service `name` in this session; a program that runs elsewhere is ended first.

        Raises LiveError if it does not end, or is not a Python file that can be started here.
        """
        if own := self._outsiders.own(name):
            return self.restart(own[0])
        for each in self._outsiders.serving(name):
            if program := each.program:
                _end(each, processes.birth(each.pid))
                return self.start_file(program[0], program[1], {}, USUAL)
        raise LiveError(f"no running server of {name} can be restarted in this notebook")

    def rows(self) -> list[Row]:
        """Return a row for each started node, and for each node started by others."""
        handles, leaving = dict(self._handles), list(self._leaving)
        rows = [row for row in leaving if row.started_as not in handles]
        for key, handle in handles.items():  # one that is started again has no nodes at first
            rows += _rows(key, handle, [row.name for row in leaving if row.started_as == key])
        known, own = {row.name for row in rows}, {row.pid for row in [*rows, *leaving]}
        for each in self._outsiders.nodes():  # it may have the same name as one of them
            if each.pid not in own:
                where = f"not started by this session: {each.where}"
                rows.append(Row(each.node, "running", None, where, process=each.process, pid=each.pid))
                known.add(each.node)
        rows += [
            Row(name, "running", None, "not started by this session") for name in self.names() if name not in known
        ]
        if self._presence.unreadable:
            rows.append(Row("(a name that is not text)", "running", None, "not started by this session"))
        return sorted(rows, key=lambda row: row.name)

    def _called(self, name: str, keys: Collection[str]) -> list[str]:
        """Return those of `keys` that `name` means: itself, or else the files of that stem, or with a node of it."""
        if name in keys:
            return [name]
        bare = name.lstrip("/")
        running = {
            key
            for key, handle in list(self._handles.items())
            if any(bare in (base(node), node.lstrip("/")) for node in handle.nodes)
        }
        return [key for key in list(keys) if key in running or key in (bare, f"{bare}.py")]

    def _start_alone(self, start: Callable[[], Handle]) -> Handle:
        """Call `start` while no other thread starts or stops a node, and keep it for `restart`."""
        with self._changing:
            self._prepare()
            self._starting = True
            try:
                handle = start()
            finally:
                self._starting, self._leaving = False, []
            self._again[handle.name] = start
            for each in self._outsiders.nodes():
                if each.node in handle.nodes:
                    self._watch.notice(
                        f"A program outside this session also has a node of this name: {each}. To end it: "
                        f"{each.ending}."
                    )
        return handle

    @contextlib.contextmanager
    def _shown_meanwhile(self, rows: list[Row]) -> Iterator[None]:
        """Keep rows in the table while their node is stopped, and until the one that replaces it is there."""
        self._leaving = self._leaving + rows
        try:
            yield
        finally:
            if not self._starting:
                self._leaving = []

    def _start_class(
        self,
        what: Any,
        args: tuple[object, ...],
        kwargs: dict[str, object],
        arguments: list[str],
        threads: int,
        cell: str,
    ) -> LiveNode:
        if not (isinstance(what, type) and issubclass(what, Node)):
            raise LiveError(no_node(what))
        earlier = {each: each.offers for each in self._of_class(what.__name__)} if what is not Node else {}
        for handle in earlier:
            if handle.cls is not what or handle.cell != cell or not cell:  # one cell may start several
                self._replace(handle.name)
        context, notice = self._calls.node.context, self._watch.notice
        cls = in_context(what, context, arguments, lambda name: self._replace(name, cls=what), notice)
        node, began = cls.__new__(cls), time.time()
        try:
            with _telling_of_a_long(what.__name__):
                type(node).__init__(node, *args, **kwargs)  # type: ignore[arg-type]
        except BaseException as error:
            if is_initialized(node):
                node.destroy_node()
            if isinstance(error, NotInitializedException):
                if node in (made := _made_in(error)):
                    raise LiveError(
                        f"{what.__name__} creates a node outside this session: in its __init__, write "
                        "super().__init__('name') instead of Node.__init__(self, 'name')"
                    ) from None
                if made:
                    raise LiveError(
                        f"{what.__name__} makes another node in its __init__, which belongs to no session: make "
                        "clients, publishers and the like of this node itself, as in self.create_client(...), or "
                        "start the other node by ros.start(...), too"
                    ) from None
            raise
        self._replace(node.get_name(), cls=what)  # arguments may have renamed it
        spinner = Spinner(node, threads, self._publishing.publish)
        handle = LiveNode(self._owner, spinner, cell, of_check=what.__name__ in self.of_check)
        self._handles[handle.name] = handle
        for other, offers in earlier.items():
            if other.cls is what and self._handles.get(other.name) is not other:
                self._tell_of_lost(other, handle, offers)
        spinner.start()  # not before its handle is kept: a first callback may already be a mistake to tell
        self._logs.forget(handle.name, began)  # of one that was stopped before
        self._publishing.publish()
        for service, count in Counter(each.service_name for each in node.services).items():
            if count > 1:
                self._watch.notice(
                    f"{handle.name} makes {count} services with the name {service}: any of them may answer. Give each "
                    "a name of its own."
                )
        return handle

    def _of_class(self, name: str) -> list[LiveNode]:
        handles = list(self._handles.values())
        return [each for each in handles if isinstance(each, LiveNode) and type(each.node).__name__ == name]

    def _tell_of_lost(self, old: LiveNode, new: LiveNode, offered: set[str]) -> None:
        """Tell the reader about a node that was ended by the start of another one of the very same class."""
        name = new.name
        if old.name != name:
            self._watch.notice(
                f"The start of '{name}' has ended '{old.name}': both are of the class {new.cls.__name__}, and a class "
                "that another cell starts again replaces its nodes. To run both, start both in one cell."
            )
        elif new.cls.__module__.startswith("course."):
            return  # its parameters, as those of a world, say what it offers
        elif (lost := offered - new.offers) and new.offers - offered:  # something else in its place
            self._watch.notice(
                f"A new '{name}' has replaced the one before, and with it {' and '.join(sorted(lost))}: the session "
                "keeps one node of each name. To run both, give each a name of its own in `super().__init__(...)`."
            )

    def _tell_undeclared(self, who: str, parameters: Iterable[str], declared: Collection[str]) -> None:
        """Tell the reader about parameters that were set but not declared by the node, which rclpy does not report."""
        own = sorted(name for name in declared if not name.startswith(OF_NO_INTEREST))
        for name in (name for name in parameters if name not in declared):
            near = [each for each in own if each.lower() == name.lower()] or difflib.get_close_matches(name, own, 1)
            has = f"Did you mean '{near[0]}'?" if near else f"It declares: {', '.join(own) or 'none'}."
            self._watch.notice(f"{who} does not declare a parameter '{name}', so the value has no effect. {has}")

    def _replace(self, name: str, new: NodeProcess | None = None, cls: type[Node] | None = None) -> None:
        """End an earlier node or file's process of this name; `new` already has the name, `cls` will get it."""
        for key, handle in list(self._handles.items()):
            if handle is not new and name in (key, *map(base, handle.nodes)):
                if isinstance(handle, LiveNode):
                    by_class = cls is not None and not handle.is_version_of(cls)
                    by_file = new is not None and not handle.of_check and name != new.path.stem
                    replaced = type(handle.node).__name__ if by_class or by_file else ""
                else:
                    replaced = key if new is not None and handle.alive else ""
                if replaced and (by := new.name if new else cls and cls.__name__):
                    self._watch.notice(
                        f"{by} replaces {replaced}: both name their node '{name}'. To run both, give one of them "
                        "another name in `super().__init__(...)`."
                    )
                self.stop(key)
                for node in handle.nodes:
                    self._logs.forget(base(node), *([new.started] if new else []))

    def _start_file(self, path: Path, arguments: list[str], timeout: float) -> NodeProcess:
        if not path.is_file():
            meant = next((each for each in (Path(f"{path}.py"), Path(path.name)) if each.is_file()), None)
            why = self._owner.elsewhere or (
                f"write ros.start('{meant}')" if meant else "run the cell that writes it, or check the name"
            )
            if isinstance(vars(sys.modules["__main__"]).get(str(path)), type):
                why = f"it is a class, so write ros.start({path}), without quotation marks"
            raise LiveError(f"there is no file {path}: {why}")
        for look in before_start:
            if line := look(path):
                self._watch.notice(line)
        for line in doubts(path.name, text_at(path)):
            self._watch.notice(line)
        self._replace(path.name)
        before, served = self._presence.names(), self._presence.served()
        process = NodeProcess(path, arguments, self._publishing.publish, introspecting=self.introspecting)
        self._handles[process.name] = process

        def found() -> list[str]:  # without nodes that others start or end meanwhile
            return self._presence.of_process(process.pid) or self._presence.new_of_nobody(before)

        loop: tuple[Frame, ...] = ()

        def settled() -> object:
            nonlocal loop
            return not process.alive or found() or (timeout <= USUAL and (loop := process.loop()))

        ready = wait_until(settled, min(timeout, PATIENCE), alert=False)
        at = "" if ready else "".join(f"\n{frame}" for frame in process.doing())
        if at:
            print(f"{path.name} has created no node after {PATIENCE:g} s. It is here:{at}", file=sys.stderr, flush=True)
        wait_until(settled, max(0.0, timeout - PATIENCE), alert=False)
        process.nodes = found() if process.alive else []
        while process.alive and not process.nodes and not loop and time.time() - process.started < timeout:
            wait_until(settled, timeout - (time.time() - process.started), alert=False)
            process.nodes = found() if process.alive else []  # a node of nobody may turn out to be another program's
        if not process.alive:
            raise self._failed(process)
        if not process.nodes:
            ran = time.time() - process.started
            at = "".join(f"\n{frame}" for frame in loop or process.doing())
            process.stop()
            why = (
                f"It was here:{at}"
                if at
                else "Does it wait for something before its `super().__init__('name')`, or is `main()` not reached?"
            )
            raise CallTimeout(f"{path.name} ran for {ran:.0f} s and created no node. {why}")
        for node in process.nodes:
            self._replace(base(node), process)
            self._logs.forget(base(node), process.started)  # of one that was stopped before
        self._presence.settle(process, served)

        spent = processor_time(process.pid)

        def made() -> bool:  # its node is there before the rest of its constructor has run, which may raise
            raises = "Traceback (most recent" in process.output
            return not process.alive or (process.asleep and not raises) or processor_time(process.pid) - spent > MAKING

        wait_until(made, PATIENCE, alert=False)
        self._publishing.publish()
        if process.died and process.returncode:
            raise self._failed(process)
        if frames := process.unspun():
            at = "".join(f"\n{frame}" for frame in frames)
            self._watch.notice(f"{path.name} is in a loop that does not end: {NOT_SPUN} It is here:{at}")
        return process

    def _failed(self, process: NodeProcess) -> NodeFailed:
        self._watch.mark_told(process)
        return NodeFailed("\n".join(map(str, process.reports)))

    def _stop(self, handle: Handle, wait: bool) -> None:
        self._calls.forget(handle.services)
        others = [node for other in self._handles.values() for node in other.nodes]
        if handle.alive and wait:  # a node of another session may have the same name
            others = difference(self._presence.names(), handle.nodes)
        left = handle._end()
        if left and wait and isinstance(handle, LiveNode) and not handle.of_check:
            at = "".join(f"\n{frame}" for frame in left)
            self._watch.notice(
                f"'{handle.name}' is stopped, but one of its callbacks has not returned, and its thread goes on until "
                "it does. If it never does, only a restart of the kernel (Kernel, Restart Kernel) ends it. It is "
                f"here:{at}",
                handle.goes_on,
            )
        if wait:
            self._presence.wait_until_gone(handle.nodes, others)
            self._publishing.publish()


def _made_in(error: BaseException) -> list[object]:
    """Return the nodes whose construction has raised an error."""
    frames = (frame for frame, _ in traceback.walk_tb(error.__traceback__))
    return [frame.f_locals["self"] for frame in frames if frame.f_code is Node.__init__.__code__]


def _rows(key: str, handle: Handle, before: Collection[str] = ()) -> list[Row]:
    """Return a row for each node of what was started as `key`; without any, for those `before`, or for itself."""
    reports, over = tuple(map(str, handle.reports)), handle.over
    pid = handle.pid if isinstance(handle, NodeProcess) else os.getpid()
    return [
        Row(name, handle.state, handle.started, handle.where, key, handle.alive, reports, over=over, pid=pid)
        for name in handle.nodes or (before if handle.alive else ()) or [handle.name]
    ]


@contextlib.contextmanager
def _telling_of_a_long(cls: str) -> Iterator[None]:
    """Tell the reader, after `PATIENCE` s, in which line of a cell the constructor of a class still is."""
    thread = threading.get_ident()

    def tell() -> None:
        at = "".join(f"\n{frame}" for frame in frames_in_cells(thread) if frame.function != "<module>")
        if at:
            say(f"The `__init__` of {cls} has not returned after {PATIENCE:g} s, so nothing spins the node yet. It is "
                f"here:{at}")  # fmt: skip

    timer = threading.Timer(PATIENCE, tell)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def _arguments(parameters: Mapping[str, object]) -> list[str]:
    """Return the command line that overrides declared parameters."""
    overrides = [["-p", f"{name}:={argument(value)}"] for name, value in parameters.items()]
    return ["--ros-args", *itertools.chain.from_iterable(overrides)] if overrides else []


def _end(outsider: Outsider, born: int) -> None:
    """Send a program with this `birth` SIGINT, and wait until it has ended; raises LiveError if it still runs."""
    if processes.alive(outsider.pid, born):
        with contextlib.suppress(ProcessLookupError):
            os.kill(outsider.pid, signal.SIGINT)
    if not wait_until(lambda: not processes.alive(outsider.pid, born), ENDING):
        raise LiveError(f"{outsider} still runs {ENDING:g} s after Ctrl-C. To end it: `!kill {outsider.pid}`")
