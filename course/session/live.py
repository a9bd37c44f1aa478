"""The live session: runs a notebook's ROS 2 nodes inside its kernel, and as processes beside it.

A kernel has one session, with its own context and ROS domain.  Every node that it starts is spun in a background thread
by its own executor, as if each ran in its own process: a node that blocks does not block the others.  Callbacks run in
those threads; cells run in the main thread.
"""

import ast
import atexit
import contextlib
import os
import socket
import warnings
from collections.abc import Callable, Collection, Iterator, Mapping
from linecache import getlines
from pathlib import Path
from shutil import which
from types import LambdaType
from typing import Any

from rclpy.action import ActionClient
from rclpy.client import Client
from rclpy.context import Context
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription
from rclpy.task import Future

from course import environment, recorders
from course.errors import LiveError
from course.explaining.cell_loops import CellLoop, cell_loop
from course.explaining.doubts import doubts
from course.explaining.failure_report import FailureReport, cell_of
from course.explaining.source import is_cell, parse
from course.foundation.waiting import in_vain, lookouts, tellers, time_limit, wait_until
from course.interfaces import builder, kept
from course.ros.fast_dds import ignore_discovery
from course.ros.onlooker import Onlooker
from course.ros.rclpy_internals import action_name, watch_goals
from course.ros.rclpy_patches import patch
from course.session.beginnings import begun
from course.session.calls import Calls
from course.session.domains import domain_number, session_domain
from course.session.following import LogFollower
from course.session.guards import Guards, interruptible, say
from course.session.interface_usage import destructors
from course.session.live_node import LiveNode, slow_timers
from course.session.logs import Entry, Logs
from course.session.long_callbacks import LongCallbacks
from course.session.matching import (
    misfit,
    misspelt_topics,
    served_actions,
    served_services,
    unfit_topics,
    unlike_clients,
    unmatched,
    unserved,
)
from course.session.meanwhile import Meanwhile
from course.session.misuse import (
    condition_of,
    expect_name,
    expect_of_a_class,
    expect_of_a_file,
    expect_parameters,
    expect_request,
    expect_service,
    expect_words,
)
from course.session.no_world import no_world
from course.session.offered import none_will_offer
from course.session.outsiders import Outsiders
from course.session.publishing import Publishing
from course.session.requests import fill, service_type
from course.session.session_logs import SessionLogs
from course.session.spinner import Spinner
from course.session.started_nodes import USUAL, StartedNodes
from course.session.table import Nodes, Row
from course.session.watch import Handle, Watch

WORLDLESS = 1.0  # s of waiting, after which the reader is told that no world sends scans
UNKNOWN = 0.3  # s of waiting for a node that this session has not started, before its name is taken to be wrong
RMW, PATH = "RMW_IMPLEMENTATION", "PATH"  # variables that programs need as they were when the session began
START = "setpriv"  # the program by which a file's program is started
TELLING = 0.5  # s that a failed wait must have lasted before a possible reason is shown


class Session:
    """A private ROS 2 context on its own domain, and the nodes that were started in it.

    `domain_id`: the domain to use; by default $ROS_DOMAIN_ID if the user has set it, else one that no other session on
    this machine has, if possible that of a terminal in the current folder.  `node` is the session's own node (hidden,
    spun in the background) for clients, publishers and subscriptions.
    """

    def __init__(self, domain_id: int | None = None):
        self._folder = Path.cwd()
        if domain_id is None and (chosen := environment.chosen_domain()):
            domain_id = domain_number(chosen)
        self._claim: socket.socket | None = None
        self._own_domain = domain_id is None
        if domain_id is None:
            self._claim, domain_id = session_domain(self._folder)
        os.environ.pop(environment.DOMAIN, None)  # ROS_DOMAIN_ID is this session's from now on
        self.domain_id = domain_id
        # Child processes (`!ros2 ...`, `!python ...`) must find these nodes, and no others.
        os.environ.update(environment.session_variables(domain_id))
        self._began_with = {name: os.environ.get(name, "") for name in (environment.RANGE, RMW, PATH)}
        patch()
        # About a client that died while it waited: its own report says so.
        warnings.filterwarnings("ignore", "failed to send response", RuntimeWarning)
        self.context = Context()
        # The log book collects the logs from /rosout; on stderr they would clutter the cells.
        self.context.init(
            args=["--ros-args", "--disable-stdout-logs", "--disable-external-lib-logs"], domain_id=domain_id
        )
        self.node = Onlooker(
            "_course_session", context=self.context, enable_rosout=False, start_parameter_services=False
        )
        self.node.destroy_node = self._keep  # type: ignore[method-assign]
        self._handles: dict[str, Handle] = {}
        self.watch = Watch(self._handles)
        self._logs = SessionLogs(self.node, self._handles, self.watch.notice)
        self._spinner = self._spin()
        self.outsiders = Outsiders(self.node, domain_id, self._handles)
        self._calls = Calls(self.node, self._handles, self.watch, self.outsiders)
        self.meanwhile = Meanwhile(self.node, self._handles, self.outsiders)
        self._told_unfit: set[str] = set()  # topics with incompatible QoS that the reader knows about
        self._closed = False
        self._publishing = Publishing(domain_id, str(self._folder), self._handles)
        self._nodes = StartedNodes(
            self,
            self._handles,
            calls=self._calls,
            logs=self._logs,
            prepare=self._find_packages,
            outsiders=self.outsiders,
            publishing=self._publishing,
            watch=self.watch,
        )
        self._find_packages()
        atexit.register(self.close)
        builder.on_replace.append(self._drop_types)
        lookouts.append(self.watch.look)
        in_vain.append(self._waited_in_vain)
        tellers.append(say)
        recorders.hanging.append(self._calls.hanging)
        recorders.places.append(self._calls.doing)
        recorders.serving.append(self._calls.serving)
        self._guards = Guards(self.watch.notice, self.apart)
        self._guards.install()
        self._unwatch_goals = watch_goals(self._nodes.goal_failed)
        self._publishing.publish()

    # Nodes

    @interruptible()
    def start(
        self,
        what: type[Node] | str | Path,
        *args: object,
        parameters: Mapping[str, object] | None = None,
        threads: int = 1,
        timeout: float = USUAL,
        **kwargs: object,
    ) -> Handle:
        """Start a node (a class or a file) and return a handle on it; an earlier one of the same name is stopped.

        A Node class is made (with `args` and `kwargs`) and spun in this kernel by an executor with `threads`
        threads.  A file is run in its own process with the command line `args`; this waits at most `timeout` s for its
        node.  A program that only computes is stopped earlier, unless `timeout` is longer than usual.  `parameters`
        overrides declared parameters, as `--ros-args -p name:=value` does.

        Raises LiveError if a file's program ends or has no node in time, or `threads` is not a whole number from 1 on,
        and the exceptions of a class's `__init__`.
        """
        self._check_open()
        if type(threads) is not int or threads < 1:
            raise LiveError(
                f"`threads` is a whole number from 1 on, such as `threads=4`, not {threads!r}: nothing was started"
            )
        expect_parameters(parameters)
        time_limit(timeout)
        if isinstance(what, (str, Path)):
            expect_of_a_file(str(what), threads, kwargs)
            expect_words(str(what), args)
            return self._nodes.start_file(Path(what), args, parameters or {}, timeout)
        try:
            handle = self._nodes.start_class(what, args, kwargs, parameters or {}, threads)
        except TypeError as error:
            expect_of_a_class(what, kwargs, error)
            raise
        given = [each.__code__ for each in kwargs.values() if isinstance(each, LambdaType)]
        lambdas = [code.co_filename for code in given if code.co_name == "<lambda>" and is_cell(code.co_filename)]
        for text in dict.fromkeys([cell_of(what), *("".join(getlines(cell)) for cell in lambdas)]):
            for line in doubts("the cell", text):
                say(line)  # now, not at the end of the cell, which may wait in vain
        return handle

    def stop(self, name: str | None = None) -> None:
        """Stop the node (or the file's process) called `name`, or all of them.

        A name that this session has never started is not an error, but the reader is told.
        """
        expect_name(name, "stop", self._handles)
        self._look_up(name)
        self._nodes.stop(name)

    @contextlib.contextmanager
    def checking(self, source: str) -> Iterator[None]:
        """Run the public check with this text; if it fails, the nodes of its own classes are stopped."""
        self.begin_check(source)
        try:
            yield
        except BaseException:
            self.end_check(passed=False)
            raise
        self.end_check(passed=True)

    def begin_check(self, source: str) -> None:
        """Note that the public check with this text begins: nodes of the classes that it defines are a part of it."""
        self._nodes.of_check = [each.name for each in parse(source).body if isinstance(each, ast.ClassDef)]
        self.meanwhile.begin()

    def end_check(self, *, passed: bool) -> None:
        """Note that a public check is over; unless it has `passed`, its own nodes are stopped."""
        self._nodes.of_check = ()
        self.meanwhile.end()
        if not passed:
            self._nodes.stop_of_checks()

    def stop_outsider(self, pid: int, born: int) -> None:
        """Stop a program that others have started, as Ctrl-C does; `born` is the `birth` of its process.

        Raises LiveError if it may not be stopped from here, or does not end.
        """
        self._nodes.stop_outsider(pid, born)

    def nodes(self) -> Nodes:
        """Return the full names of the running nodes in this session's domain, without hidden ones.

        A notebook shows a table, which includes started nodes that have ended, and why.
        """
        for handle in list(self._handles.values()):
            self.watch.mark_told(handle)
        return Nodes(self._nodes.names(), self.rows())

    def others(self, name: str) -> list[tuple[str, str]]:
        """Return the servers of the service or action `name`, or publishers of the topic, and how to end each.

        They include nodes of this session, and those of programs outside of it.
        """
        return self._nodes.others(name)

    def rows(self) -> list[Row]:
        """Return the rows of the table of `nodes`, without marking the nodes' reports as told."""
        return self._nodes.rows()

    @interruptible()
    def restart(self, name: str) -> Handle:
        """Start the node or the file called `name` again, as it was started last, even if it was stopped since.

        Raises LiveError if this session has not started it, and otherwise as `start` does.
        """
        self._check_open()
        expect_name(name, "restart", self._handles)
        return self._nodes.restart(name)

    def server(self, service: str) -> tuple[str, bool]:
        """Return the server of `service`, and whether `restart_server` can restart it; ('', False) if there is none."""
        return self._nodes.server(service)

    def restart_server(self, service: str) -> Handle:
        """Restart the server of `service` in this session; a Python file that runs elsewhere is ended first.

        Raises LiveError if it does not end, or cannot be started here.
        """
        self._check_open()
        return self._nodes.restart_server(service)

    def follow_logs(self, wanted: Callable[[Entry], bool] | None = None) -> LogFollower:
        """Return a follower of new log entries, only those that are `wanted`."""
        return self._logs.follow(wanted)

    def logs(self, name: str | None = None, *, until: str | None = None, timeout: float = 5.0) -> Logs:
        """Return the log of the node or the file called `name`, or of every node, since its start.

        For a file's program it includes all output, and how it ended.  A log line may arrive later than the response
        that it is about: with `until` this waits, at most `timeout` s, for a line that contains that text, and tells
        the reader if none comes.
        """
        expect_name(name, "logs", self._handles)
        time_limit(timeout)
        if until is not None and not isinstance(until, str):
            raise LiveError("`until` is a text that a line of the log has, such as until='sum'")
        known = name is None or until is None or wait_until(lambda: self._nodes.has_started(name), UNKNOWN)
        if until is not None and known and not self._logs.wait(name, until, timeout):
            say(self._logs.without(name, until))
        found = self._logs.read(name)
        if not found:
            self._look_up(name)
        return found

    # Calls

    @interruptible()
    def wait_for_service(self, service: str, srv_type: type[Any], timeout: float = 5.0) -> None:
        """Wait until a server for `service` is there; raises CallTimeout after `timeout` s."""
        self._check_open()
        expect_service(service, srv_type, "wait_for_service")
        time_limit(timeout)
        self._calls.wait_for_service(service, service_type(srv_type), timeout)

    @interruptible()
    def call(
        self, service: str, srv_type: Any, request: object = None, *, timeout: float = 5.0, **fields: object
    ) -> Any:
        """Call `service` and return its response.

        The request is `request`, or one made of `fields`.  Raises CallTimeout if there is no server or no answer within
        `timeout` s, and LiveError for an unknown field or an unfit value.
        """
        self._check_open()
        expect_service(service, srv_type, "call")
        time_limit(timeout)
        srv_type = service_type(srv_type)
        if request is not None:
            expect_request(request, service, srv_type)
        return self._calls.call(service, srv_type, fill(srv_type, fields) if request is None else request, timeout)

    @interruptible()
    def wait(self, future: Future, timeout: float = 5.0) -> Any:
        """Wait for a future in the main thread and return its result; raises CallTimeout after `timeout` s.

        Raises CallTimeout before that once there is no server that could answer, and NodeFailed when one of the
        session's nodes dies, or raises an exception, meanwhile.
        """
        time_limit(timeout)
        for handle in list(self._handles.values()):
            if isinstance(handle, LiveNode) and handle.is_held_here():
                self.watch.notice(
                    f"ros.wait inside a callback of '{handle.name}' blocks the only thread that runs its callbacks, so "
                    "what you wait for cannot arrive. Add a callback to the future instead "
                    "(`future.add_done_callback(...)`), or make this callback `async def` and `await` the future."
                )
        return self._calls.wait(future, timeout)

    @interruptible()
    def until(self, condition: Callable[[], object], timeout: float = 5.0) -> bool:
        """Wait in the main thread until `condition()` holds; False after `timeout` s.

        The reader is told, once, about topics with unfit QoS or a misspelt name, and about scans without a world.
        """
        condition = condition_of(condition)
        time_limit(timeout)
        if wait_until(condition, min(timeout, WORLDLESS)):
            return True
        if timeout > WORLDLESS:
            for why in (no_world(self.node, self._folder), *misspelt_topics(self.node)):
                if why and why not in self._told_unfit:
                    self._told_unfit.add(why)
                    say(why)
            long = LongCallbacks(self._handles)
            if wait_until(condition, timeout - WORLDLESS, unless=long.look):
                return True
            for text in long.told():
                self.watch.notice(text)
        if timeout >= TELLING:
            self._waited_in_vain()
        return False

    def _waited_in_vain(self) -> None:
        """Tell the reader, once, of slow timers, of topics with unfit QoS or a misspelt name, and of unlike clients."""
        node, handles = self.node, self._handles
        for text in slow_timers(handles):
            if text not in self._told_unfit:
                self._told_unfit.add(text)
                say(text)
        for text in (*misspelt_topics(node), *unfit_topics(node, handles), *unlike_clients(node)):
            if text not in self._told_unfit:
                self._told_unfit.add(text)
                self.watch.notice(text)

    def tell_of_a_loop(self, thread: int, lasted: float, before: CellLoop | None) -> CellLoop | None:
        """Return the loop in which the cell of this thread only waits; tell the reader if it was there `before`, too.

        `lasted` is the time (s) since the cell began.
        """
        loop = cell_loop(thread)
        if loop is not None and loop == before:
            topics = [*misspelt_topics(self.node), *unfit_topics(self.node, self._handles)]
            known = [each for each in (no_world(self.node, self._folder), *topics) if each]
            why = [self.apart(loop.client)] if loop.client else known[:1]
            head = f"After {lasted:.0f} s this cell still waits in {loop}."
            say(" ".join([head, *why, "The ■ button ends this;", loop.instead]))
        return loop

    def apart(self, end: Publisher | Subscription | Client | ActionClient) -> str:
        """Return why a publisher, a subscription, a client or an action client is not matched by another node."""
        if isinstance(end, ActionClient):
            why, name = unserved(self.node, end), action_name(end)
            return why if name in served_actions(self.node) else why + self._calls.beginning("ActionServer", name)
        if isinstance(end, Client):
            return self._calls.apart(end)
        return unmatched(self.node, end, self._handles)

    def doing(self, name: str, *, groups: bool = True) -> str:
        """Return lines that say in which callback the server of the service or action `name` is; '' if in none.

        Or, with `groups`, why its callback group lets no other call of the service begin.
        """
        return self._calls.doing(name, groups=groups)

    def cannot_come(self, maker: str, name: str) -> bool:
        """Return True if programs of this session run, and none can make `name` by `maker` (`create_service`)."""
        return none_will_offer(self._handles, maker, name)

    def is_at_rest(self, names: Collection[str] = ()) -> bool:
        """Return True if all programs sleep, and no answer or result of these services and actions is under way."""
        return self._calls.is_at_rest(names)

    def served(self) -> dict[str, list[str]]:
        """Return the services and actions that nodes serve, with their types."""
        return served_services(self.node) | served_actions(self.node)

    def misfit(self, end: Publisher | Subscription) -> str:
        """Return why the other ends of a topic do not fit `end`: their type or QoS; '' if one fits."""
        return misfit(self.node, end, self._handles)

    def look(self) -> None:
        """Raise NodeFailed if a node has died or raised an exception that was not reported yet.

        All waits of the session do so; this is for code that waits in other ways.
        """
        self.watch.look()

    # The session itself

    def close(self) -> None:
        """Stop every node and process, the threads and the context; closing twice is not an error."""
        if self._closed:
            return
        self._closed = True
        atexit.unregister(self.close)
        builder.on_replace.remove(self._drop_types)
        lookouts.remove(self.watch.look)
        in_vain.remove(self._waited_in_vain)
        tellers.remove(say)
        recorders.hanging.remove(self._calls.hanging)
        recorders.places.remove(self._calls.doing)
        recorders.serving.remove(self._calls.serving)
        self._unwatch_goals()
        self._guards.remove()
        self._nodes.stop(wait=False)
        self._publishing.end()
        vars(self.node).pop("destroy_node", None)
        ignore_discovery(self.context.get_domain_id())
        self._spinner.stop()
        self.context.try_shutdown()
        if self._claim:
            self._claim.close()
        if self._own_domain:
            os.environ.pop("ROS_DOMAIN_ID", None)

    @property
    def elsewhere(self) -> str:
        """Return a sentence if the kernel has left the notebook's folder (`os.chdir`), or ''."""
        if (here := Path.cwd()) == self._folder:
            return ""
        if not self._folder.is_dir():
            return (
                f"the notebook's folder {self._folder} was renamed, moved or deleted since the session began, and this "
                f"kernel is in {here}. Rename it back, or restart the kernel (Kernel, Restart)."
            )
        return (
            f"os.chdir moved this kernel to {here}, but its notebook is in {self._folder}: files are "
            f"written and looked for in the wrong folder. Go back with os.chdir({str(self._folder)!r})."
        )

    @property
    def introspecting(self) -> bool:
        """Return True if services of started programs are introspected."""
        return self._nodes.introspecting

    @introspecting.setter
    def introspecting(self, wanted: bool) -> None:
        self._nodes.introspecting = wanted

    @property
    def ok(self) -> bool:
        """Return True if the session is open and its context was not shut down by other code."""
        return not self._closed and self.context.ok()

    def _find_packages(self) -> None:
        """Make the interface packages of the folder importable, and rebuild those that have changed on the disk.

        Raises LiveError if programs of the kernel would no longer find the session's nodes.
        """
        if (now := os.environ.get("ROS_DOMAIN_ID")) != str(self.domain_id):
            raise LiveError(
                f"this session is in the ROS domain {self.domain_id}, but ROS_DOMAIN_ID has been changed to {now} "
                f"since: a program started now could not reach it. Undo it with os.environ['ROS_DOMAIN_ID'] = "
                f"'{self.domain_id}'. To choose a domain, set it before the first course.live()"
            )
        for name, before in self._began_with.items():
            now = os.environ.get(name, "")
            if name == PATH and not (which(START, path=before) and not which(START)):
                continue  # it may well have grown
            if now != before:
                why = "a program could not be started" if name == PATH else "a program started now might not be seen"
                undo = f"os.environ['{name}'] = '{before}'" if before else f"os.environ.pop('{name}')"
                raise LiveError(
                    f"{name} has been changed to {now or 'nothing'} since this session began"
                    f"{f' with {before}' if before and name != PATH else ''}: {why}. Undo it with {undo}"
                )
        for line in kept.refresh(self._folder):
            self.watch.notice(line)
        kept.use(self._folder)

    def _drop_types(self, package: str) -> None:
        """Stop the nodes of this kernel that use an interface of `package`, and drop the session's own uses."""
        self._nodes.stop_users(package)
        self._calls.package_replaced(package)
        self._spinner.stop(destroy=False)  # an executor must notice before its waitables are destroyed
        self._calls.forget_types(package)
        for end in list(destructors(self.node, package)):
            end()
        self._spinner = self._spin()

    def _keep(self) -> None:
        raise LiveError(
            "ros.node is the session's own node, and nothing was destroyed: without it, nothing in this notebook could "
            "call or wait. `ros.stop()` ends the nodes that you have started"
        )

    def _spin(self) -> Spinner:
        """Begin to spin the session's own node; the reader is told what its callbacks raise."""

        def tell() -> None:
            if len(spinner.reports) > len(told):
                told.append(spinner.reports[-1])
                if told[-1].frames:  # of the reader's code
                    self.watch.notice(str(told[-1]))

        told: list[FailureReport] = []
        spinner = Spinner(self.node, changed=tell, who="ros.node")
        spinner.start()
        return spinner

    def _look_up(self, name: str | None) -> None:
        """Tell the reader about a name that is unknown in this session."""
        if name and not self._nodes.has_started(name):
            known = ", ".join(self._handles)
            self.watch.notice(
                f"This session has no node or file called '{name}'." + (f" It has: {known}." if known else "")
            )

    def _check_open(self) -> None:
        if not self.ok:
            raise LiveError("this session has ended: get a new one with `ros = course.live()`")

    def __repr__(self) -> str:
        return f"<live session: {len(self._handles)} started>"


_current: list[Session] = []  # the kernel's session, once it was made


def current() -> Session | None:
    """Return the kernel's session if there is a usable one, or None."""
    return _current[0] if _current and _current[0].ok else None


def live() -> Session:
    """Return the kernel's session; makes it at the first call, and again after it has ended."""
    if not _current or not _current[0].ok:
        for session in _current:
            session.close()
        _current[:] = [Session()]
        for follow in begun:
            follow()
    return _current[0]
