"""The live session: how a notebook runs ROS 2 nodes inside its kernel, and as processes beside it.

One session serves one kernel.  It owns a private context on a ROS domain of its own, and every node that it starts is
spun in a background thread by an executor of its own, as if each ran in its own process: a node that blocks, blocks
only itself.  Callbacks run in those threads; cells run in the main thread.
"""

import atexit
import itertools
import os
import socket
import threading
import warnings
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from rclpy.context import Context
from rclpy.exceptions import NotInitializedException
from rclpy.node import Node
from rclpy.task import Future

from course import environment
from course.errors import CallTimeout, LiveError, NodeFailed
from course.foundation.waiting import lookouts, wait_until
from course.interfaces import builder, kept
from course.ros.names import base
from course.ros.rclpy_internals import is_initialized, patch, watch_goals
from course.session.calls import Calls
from course.session.domains import session_domain
from course.session.following import LogFollower
from course.session.guards import Guards
from course.session.interface_usage import destructors
from course.session.live_node import LiveNode, in_context
from course.session.logs import FLOOD, KEPT, NAME, Entry, LogBook, Logs, program_logs
from course.session.node_process import NodeProcess
from course.session.presence import Presence, difference
from course.session.publishing import Publishing
from course.session.requests import argument, fill
from course.session.spinner import Spinner
from course.session.started import sitecustomize
from course.session.table import Nodes, Row
from course.session.watch import Watch

FLOODS = 20  # nodes of which the reader is told that they log too much

# Asked before a file is started; what they return is told to the reader.  The notebook's part of the course looks here
# whether the file is what its cell says.
before_start: list[Callable[[Path], str]] = []


class Session:
    """A private ROS 2 context on its own domain, and the nodes that were started in it.

    `domain_id`: the domain to use; by default $ROS_DOMAIN_ID if the user has set it, else that of the current folder,
    which no other session on this machine has.  `node` is the session's own node (hidden, spun in the background) for
    clients, publishers and subscriptions.
    """

    def __init__(self, domain_id: int | None = None):
        self._folder = Path.cwd()
        if domain_id is None and "ROS_DOMAIN_ID" in os.environ and "COURSE_SHELL" not in os.environ:  # the user's
            domain_id = int(os.environ["ROS_DOMAIN_ID"])
        self._claim: socket.socket | None = None
        self._own_domain = domain_id is None
        if domain_id is None:
            self._claim, domain_id = session_domain(self._folder)
        os.environ.pop("COURSE_SHELL", None)  # what a course's terminal started has a domain of its own
        self.domain_id = domain_id
        # Children (`!ros2 ...`, `!python ...`) must meet these nodes, and nobody else's.
        os.environ.update(environment.session_variables(domain_id))
        patch()
        # Of a client that has died while it waited: its own report says so.
        warnings.filterwarnings("ignore", "failed to send response", RuntimeWarning)
        self.context = Context()
        # The book shows the logs, from /rosout: on stderr they would litter the cells.
        self.context.init(
            args=["--ros-args", "--disable-stdout-logs", "--disable-external-lib-logs"], domain_id=domain_id
        )
        self.node = Node("_course_session", context=self.context, enable_rosout=False, start_parameter_services=False)
        self._presence = Presence(self.node)
        self._handles: dict[str, LiveNode | NodeProcess] = {}
        self.watch = Watch(self._handles)
        self._flooding: set[str] = set()  # nodes of which the reader was told that they log without measure
        self._book = LogBook(self.node, self._flooded)
        self._spinner = Spinner(self.node)
        self.introspecting = False  # whether the services of programs that are started publish what passes
        self._calls = Calls(self.node, self._handles, self.watch)
        self._closed = False
        self._again: dict[str, Callable[[], LiveNode | NodeProcess]] = {}  # how each was started last
        self._changing = threading.RLock()  # held while a node is started or stopped
        self._publishing = Publishing(domain_id, str(self._folder), self._handles)
        self._find_packages()
        atexit.register(self.close)
        builder.on_replace.append(self._drop_types)
        lookouts.append(self.watch.look)
        self._guards = Guards(self.watch.notice)
        self._guards.install()
        self._unwatch_goals = watch_goals(self._goal_failed)
        self._publishing.publish()

    # Nodes

    def start(
        self,
        what: type[Node] | str | Path,
        *args: object,
        parameters: Mapping[str, object] | None = None,
        threads: int = 1,
        timeout: float = 20.0,
        **kwargs: object,
    ) -> "LiveNode | NodeProcess":
        """Start a node and return a handle on it; an earlier one of the same name is stopped, be it a class or a file.

        A Node subclass is made (with `args` and `kwargs`) and spun in this kernel by an executor with `threads`
        threads.  A file is run in its own process with the command line `args`; this waits until its node is there, at
        most `timeout` s.  `parameters` overrides declared parameters, as `--ros-args -p name:=value` does.

        Raises LiveError when a file's program ends or shows no node in time, and whatever a class's `__init__` raises.
        """
        overrides = [["-p", f"{name}:={argument(value)}"] for name, value in (parameters or {}).items()]
        arguments = ["--ros-args", *itertools.chain.from_iterable(overrides)] if overrides else []
        if isinstance(what, (str, Path)):
            again = partial(self._start_file, Path(what), [*map(str, args), *arguments], timeout)
            self._again[Path(what).name] = again  # a program that fails at once can be restarted, too
            return self._alone(again)
        return self._alone(partial(self._start_class, what, args, kwargs, arguments, threads))

    def _alone(self, start: "Callable[[], LiveNode | NodeProcess]") -> "LiveNode | NodeProcess":
        """Call `start` while nobody else starts or stops a node, and keep it for `restart`."""
        self._check_open()
        with self._changing:
            self._find_packages()
            handle = start()
            self._again[handle.name] = start
        return handle

    def _start_class(
        self, what: Any, args: tuple[object, ...], kwargs: dict[str, object], arguments: list[str], threads: int
    ) -> LiveNode:
        if not (isinstance(what, type) and issubclass(what, Node)):
            raise LiveError(f"start() takes a Node class or the path of a Python file, not {type(what).__name__}")
        for handle in list(self._handles.values()):
            if isinstance(handle, LiveNode) and type(handle.node).__name__ == what.__name__:
                self._replace(handle.name)
        cls = in_context(what, self.context, arguments, lambda name: self._replace(name, cls=what))
        node = cls.__new__(cls)
        try:
            type(node).__init__(node, *args, **kwargs)  # type: ignore[arg-type]
        except BaseException as error:
            if is_initialized(node):
                node.destroy_node()
            if isinstance(error, NotInitializedException):
                raise LiveError(
                    f"{what.__name__} makes a node that is not in this session: in its __init__, write "
                    "super().__init__('name') instead of Node.__init__(self, 'name')"
                ) from None
            raise
        self._replace(node.get_name(), cls=what)  # it may have been renamed by its arguments
        handle = LiveNode(self, Spinner(node, threads, self._publishing.publish))
        self._handles[handle.name] = handle
        self._publishing.publish()
        return handle

    def _replace(self, name: str, new: NodeProcess | None = None, cls: type[Node] | None = None) -> None:
        """Make room for a node, or a file's process, of this name; `new` already has it, and `cls` is to have it."""
        for key, handle in list(self._handles.items()):
            if handle is not new and name in (key, *map(base, handle.nodes)):
                if cls is not None and isinstance(handle, LiveNode) and not handle.is_version_of(cls):
                    self.watch.notice(
                        f"{cls.__name__} takes the place of {type(handle.node).__name__}: both call their node "
                        f"'{name}'. Give one of them another name in `super().__init__(...)` to run both."
                    )
                self.stop(key)
                for node in handle.nodes:
                    self._book.forget(base(node), *([new.started] if new else []))

    def _start_file(self, path: Path, arguments: list[str], timeout: float) -> NodeProcess:
        if not path.is_file():
            raise LiveError(f"there is no file {path}: run the cell that writes it, or check the name")
        for look in before_start:
            if line := look(path):
                self.watch.notice(line)
        self._replace(path.name)
        before, served = self._presence.names(), self._presence.served()
        variables = sitecustomize.environment(os.environ) if self.introspecting else {}
        process = NodeProcess(path, arguments, self._publishing.publish, variables)
        self._handles[process.name] = process
        wait_until(lambda: not process.alive or len(self._presence.names()) > len(before), timeout, alert=False)
        process.nodes = difference(self._presence.names(), before) if process.alive else []
        if not process.alive:
            raise self._failed(process)
        if not process.nodes:
            process.stop()
            raise CallTimeout(
                f"{path.name} ran for {timeout:g} s and created no node: does it wait for something before its "
                "`super().__init__('name')`, or is `main()` not reached?"
            )
        for node in process.nodes:
            self._replace(base(node), process)
        self._presence.settle(process, served)
        self._publishing.publish()
        if process.died and process.returncode:
            raise self._failed(process)
        return process

    def _failed(self, process: NodeProcess) -> NodeFailed:
        self.watch.mark_told(process)
        return NodeFailed("\n".join(map(str, process.reports)))

    def stop(self, name: str | None = None) -> None:
        """Stop the node (or the file's process) called `name`, or all of them; one that is not there is no error."""
        with self._changing:
            for key in [name] if name else list(self._handles):
                if handle := self._handles.pop(key, None):
                    self._stop(handle)

    def _stop(self, handle: LiveNode | NodeProcess) -> None:
        self._calls.forget(handle.services)
        others = [node for other in self._handles.values() for node in other.nodes]
        if handle.alive and not self._closed:  # another session's node may have the same name
            others = difference(self._presence.names(), handle.nodes)
        handle._end()
        if not self._closed:
            self._presence.wait_until_gone(handle.nodes, others)
            self._publishing.publish()

    def nodes(self) -> Nodes:
        """The full names of the nodes that run in this session's domain, hidden ones left out.

        A notebook shows them as a table, with the started nodes that have ended, and why.
        """
        for handle in list(self._handles.values()):
            self.watch.mark_told(handle)
        return Nodes(self._names(), self.rows())

    def _names(self) -> list[str]:
        return [name for name in self._presence.names() if not base(name).startswith("_")]

    def rows(self) -> list[Row]:
        """Return the rows of the table of `nodes`; the nodes' reports do not count as told."""
        names = self._names()
        rows, known = [], set()
        for key, handle in list(self._handles.items()):
            reports = tuple(map(str, handle.reports))
            for name in handle.nodes or [handle.name]:
                rows.append(Row(name, handle.state, handle.started, handle.where, key, handle.alive, reports))
                known.add(name)
        rows += [Row(name, "running", None, "not started by this session") for name in names if name not in known]
        return sorted(rows, key=lambda row: row.name)

    def restart(self, name: str) -> "LiveNode | NodeProcess":
        """Start the node or the file called `name` again, as it was started last; it may have been stopped since.

        Raises LiveError when this session has started none of that name, and otherwise as `start` does.
        """
        if name not in self._again:
            raise LiveError(f"this session has started no node and no file {name}: ros.nodes() shows those that it has")
        return self._alone(self._again[name])

    def follow_logs(self, wanted: Callable[[Entry], bool] | None = None) -> LogFollower:
        """Return a follower of what `logs` shows, as it grows; only the entries that are `wanted`."""
        return LogFollower(self._book, self._handles, wanted)

    def logs(self, name: str | None = None, *, until: str | None = None, timeout: float = 5.0) -> Logs:
        """Return what the node or the file called `name`, or every node, has logged since it was started.

        Of a file's program this is all that it printed, too, and how it ended.  A log line travels on its own, and may
        come after the response it tells of: with `until` this waits, at most `timeout` s, for a line that contains
        that text.
        """
        if until is not None:
            wait_until(lambda: any(until in entry.text for entry in self._logs(name)), timeout)
        return self._logs(name)

    def _logs(self, name: str | None) -> Logs:
        """Of programs what they wrote on their terminal, where it is in order; of the others what is on /rosout."""
        wanted = name and name.lstrip("/")
        programs = [handle for handle in self._handles.values() if isinstance(handle, NodeProcess)]
        printed = {node for program in programs for node in program.names if program.output}
        entries = [entry for entry in self._book.read() if entry.node not in printed and wanted in (None, entry.node)]
        for program in programs:
            if wanted in (None, program.name, *map(base, program.nodes)):
                entries += program_logs(program.name, program.output, [report.line for report in program.reports])
        return Logs(entries)

    # Calls

    def wait_for_service(self, service: str, srv_type: type[Any], timeout: float = 5.0) -> None:
        """Wait until a server for `service` is there; raises CallTimeout after `timeout` s."""
        self._check_open()
        self._calls.wait_for_service(service, srv_type, timeout)

    def call(
        self, service: str, srv_type: type[Any], request: object = None, *, timeout: float = 5.0, **fields: object
    ) -> Any:
        """Call `service` and return its response.

        The request is `request`, or one made of `fields`.  Raises CallTimeout when no server is there, or none answers,
        within `timeout` s, and LiveError for a field that the request has not or that cannot hold the value.
        """
        self._check_open()
        return self._calls.call(service, srv_type, fill(srv_type, fields) if request is None else request, timeout)

    def wait(self, future: Future, timeout: float = 5.0) -> Any:
        """Wait for a future in the main thread and return its result; raises CallTimeout after `timeout` s.

        Raises NodeFailed when one of the session's nodes dies, or raises an exception, meanwhile.
        """
        return self._calls.wait(future, timeout)

    def until(self, condition: Callable[[], object], timeout: float = 5.0) -> bool:
        """Wait in the main thread until `condition()` holds; False after `timeout` s."""
        return bool(wait_until(condition, timeout))

    # The session itself

    def close(self) -> None:
        """Stop every node and process, the threads and the context; closing twice is no error."""
        if self._closed:
            return
        self._closed = True
        atexit.unregister(self.close)
        builder.on_replace.remove(self._drop_types)
        lookouts.remove(self.watch.look)
        self._unwatch_goals()
        self._guards.remove()
        self.stop()
        self._publishing.end()
        self._spinner.stop()
        self.context.try_shutdown()
        if self._claim:
            self._claim.close()
        if self._own_domain:
            os.environ.pop("ROS_DOMAIN_ID", None)

    @property
    def ok(self) -> bool:
        """Return True if the session can be used: not closed, and its context not shut down by other code."""
        return not self._closed and self.context.ok()

    def _find_packages(self) -> None:
        """Make the interface packages of the folder importable, and build again what has changed on the disk."""
        for line in kept.refresh(self._folder):
            self.watch.notice(line)
        kept.use(self._folder)

    def _flooded(self, node: str) -> None:
        """A node logs so much that most of it is lost: tell who does, and how to end it, once."""
        if node in self._flooding or len(self._flooding) == FLOODS:
            return
        self._flooding.add(node)
        key = next((key for key, handle in list(self._handles.items()) if node in map(base, handle.nodes)), "")
        end = (
            f"To end it: ros.stop('{key}')."
            if key
            else "This session has not started it: end its program where it was started (Ctrl-C in its terminal)."
        )
        self.watch.notice(
            f"The node {node[:NAME]!r} logs more than {FLOOD:,.0f} lines a second. Only the newest {KEPT:,} lines of "
            f"all nodes are kept. {end}"
        )

    def _goal_failed(self, node: Node, error: Exception | None, result: bool) -> None:
        """An execute callback in this kernel has raised, or returned no result, or set no state of its goal."""
        for handle in list(self._handles.values()):
            if isinstance(handle, LiveNode) and handle.node is node:
                handle.goal_failed(error, result=result)

    def _drop_types(self, package: str) -> None:
        """Stop the nodes of this kernel that use an interface of `package`, and drop the session's own uses."""
        for handle in list(self._handles.values()):
            if isinstance(handle, LiveNode) and any(destructors(handle.node, package)):
                self.stop(handle.name)
        self._spinner.stop(destroy=False)  # what an executor waits on is not destroyed before it looks up
        self._calls.forget_types(package)
        for end in list(destructors(self.node, package)):
            end()
        self._spinner = Spinner(self.node)

    def _check_open(self) -> None:
        if not self.ok:
            raise LiveError("this session has ended: get a new one with `ros = course.live()`")

    def __repr__(self) -> str:
        return f"<live session: {len(self._handles)} started>"


_current: list[Session] = []  # the kernel's one, once it was asked for


def current() -> Session | None:
    """The kernel's session, if it has one that can be used."""
    return _current[0] if _current and _current[0].ok else None


def live() -> Session:
    """The kernel's session, made at the first call, and made anew when it has ended."""
    if not _current or not _current[0].ok:
        for session in _current:
            session.close()
        _current[:] = [Session()]
    return _current[0]
