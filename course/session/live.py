"""The live session: how a notebook runs ROS 2 nodes inside its kernel, and as processes beside it.

One session serves one kernel.  It owns a private context on a ROS domain of its own, and every node that it starts is
spun in a background thread by an executor of its own, as if each ran in its own process: a node that blocks, blocks
only itself.  Callbacks run in those threads; cells run in the main thread.
"""

import atexit
import functools
import itertools
import os
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from rclpy.client import Client
from rclpy.context import Context
from rclpy.exceptions import NotInitializedException
from rclpy.node import Node
from rclpy.task import Future

from course.errors import CallTimeout, LiveError
from course.interfaces import builder
from course.rclpy_internals import action_type, destroy, is_initialized, patch
from course.session.domains import claim_domain
from course.session.logs import LogBook, Logs
from course.session.node import LiveNode, in_context
from course.session.process import NodeProcess
from course.session.requests import argument, fill
from course.session.spinner import Spinner
from course.waiting import wait_until

FORGOTTEN = 15.0  # s; a node that was killed is in the graph for 5 (discovery.xml), on a busy machine for longer


class Session:
    """A private ROS 2 context on its own domain, and the nodes that were started in it.

    `domain_id`: the domain to use; by default $ROS_DOMAIN_ID if set, else one that no other session on this machine
    has.  `node` is the session's own node (hidden, spun in the background) for clients, publishers and subscriptions.
    """

    def __init__(self, domain_id: int | None = None):
        if domain_id is None and "ROS_DOMAIN_ID" in os.environ:
            domain_id = int(os.environ["ROS_DOMAIN_ID"])
        self._claim = None
        if domain_id is None:
            self._claim, domain_id = claim_domain()
        self.domain_id = domain_id
        # Children (`!ros2 ...`, `!python ...`) must meet these nodes, and nobody else's.
        os.environ["ROS_DOMAIN_ID"] = str(domain_id)
        os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        os.environ.setdefault("RCUTILS_CONSOLE_OUTPUT_FORMAT", "[{severity}] [{name}]: {message}")  # as in the book
        patch()
        self.context = Context()
        # The book shows the logs, from /rosout: on stderr they would litter the cells.
        self.context.init(
            args=["--ros-args", "--disable-stdout-logs", "--disable-external-lib-logs"], domain_id=domain_id
        )
        self.node = Node("_course_session", context=self.context, enable_rosout=False, start_parameter_services=False)
        self._book = LogBook(self.node)
        self._spinner = Spinner(self.node)
        self._handles: dict[str, LiveNode | NodeProcess] = {}
        self._clients: dict[tuple[str, type], Client] = {}
        self._closed = False
        atexit.register(self.close)
        builder.on_replace.append(self._drop_types)

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
        self._check_open()
        overrides = list(
            itertools.chain.from_iterable(
                ("-p", f"{name}:={argument(value)}") for name, value in (parameters or {}).items()
            )
        )
        arguments = ["--ros-args", *overrides] if overrides else []
        if isinstance(what, (str, Path)):
            return self._start_file(Path(what), [str(arg) for arg in args] + arguments, timeout)
        if not (isinstance(what, type) and issubclass(what, Node)):
            raise LiveError(f"start() takes a Node class or the path of a Python file, not {type(what).__name__}")
        for handle in list(self._handles.values()):
            if isinstance(handle, LiveNode) and type(handle.node).__name__ == what.__name__:
                self._replace(handle.name)
        cls = in_context(what, self.context, arguments, self._replace)
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
        self._replace(node.get_name())  # it may have been renamed by its arguments
        handle = LiveNode(self, Spinner(node, threads))
        self._handles[handle.name] = handle
        return handle

    def _replace(self, name: str, new: NodeProcess | None = None) -> None:
        """Make room for a node, or a file's process, of this name; `new` already has it."""
        for key, handle in list(self._handles.items()):
            if handle is not new and name in (key, *map(_base, handle.nodes)):
                self.stop(key)
                for node in handle.nodes:
                    self._book.forget(_base(node), *([new.started] if new else []))

    def _start_file(self, path: Path, arguments: list[str], timeout: float) -> NodeProcess:
        if not path.is_file():
            raise LiveError(f"there is no file {path}")
        self._replace(path.name)
        before = self._all_nodes()
        process = NodeProcess(path, arguments)
        self._handles[process.name] = process
        self.until(lambda: not process.alive or len(self._all_nodes()) > len(before), timeout)
        if not process.alive:
            raise LiveError(
                f"{path.name} ended with exit status {process.returncode} before its node was there"
                + (f":\n{process.output}" if process.output else "")
            )
        process.nodes = sorted(_difference(self._all_nodes(), before))
        if not process.nodes:
            process.stop()
            raise CallTimeout(f"{path.name} ran for {timeout:g} s and created no node")
        for node in process.nodes:
            self._replace(_base(node), process)
        return process

    def stop(self, name: str | None = None) -> None:
        """Stop the node (or the file's process) called `name`, or all of them; one that is not there is no error."""
        for key in [name] if name else list(self._handles):
            handle = self._handles.pop(key, None)
            if handle is None:
                continue
            handle._end()
            if not self._closed:  # a call made next must not meet the old one
                others = [node for other in self._handles.values() for node in other.nodes]
                self.until(functools.partial(self._gone, handle.nodes, others), FORGOTTEN)

    def _gone(self, nodes: list[str], others: list[str]) -> bool:
        """Whether the graph has forgotten `nodes`; `others`, perhaps of the same names, are still there."""
        return not set(nodes) & set(_difference(self._all_nodes(), others))

    def nodes(self) -> list[str]:
        """The full names of the nodes in this session's domain, hidden ones left out."""
        return sorted(name for name in self._all_nodes() if not _base(name).startswith("_"))

    def logs(self, name: str | None = None, *, until: str | None = None, timeout: float = 5.0) -> Logs:
        """What the node called `name`, or every node, has logged since it was started.

        A log line travels on its own, and may come after the response it tells of: with `until` this waits, at most
        `timeout` s, for a line that contains that text.
        """
        if until is not None:
            self._book.wait_for(until, name, timeout)
        return self._book.read(name)

    # Calls

    def wait_for_service(self, service: str, srv_type: type[Any], timeout: float = 5.0) -> None:
        """Wait until a server for `service` is there; raises CallTimeout after `timeout` s."""
        self._ready(self._client(service, srv_type), timeout)

    def call(
        self, service: str, srv_type: type[Any], request: object = None, *, timeout: float = 5.0, **fields: object
    ) -> Any:
        """Call `service` and return its response.

        The request is `request`, or one made of `fields`.  Raises CallTimeout when no server is there, or none answers,
        within `timeout` s, and LiveError for a field that the request has not or that cannot hold the value.
        """
        self._check_open()
        if request is None:
            request = fill(srv_type, fields)
        client = self._client(service, srv_type)
        deadline = time.monotonic() + timeout
        self._ready(client, timeout)
        future = client.call_async(request)
        try:
            return self.wait(future, deadline - time.monotonic())
        except CallTimeout:
            client.remove_pending_request(future)
            raise CallTimeout(
                f"{service} did not answer within {timeout:g} s: is its server busy or blocked?"
            ) from None

    def wait(self, future: Future, timeout: float = 5.0) -> Any:
        """Wait for a future in the main thread and return its result; raises CallTimeout after `timeout` s."""
        done = threading.Event()
        future.add_done_callback(lambda _: done.set())
        if not future.done() and not done.wait(max(0.0, timeout)):
            raise CallTimeout(f"nothing came within {timeout:g} s")
        return future.result()

    def until(self, condition: Callable[[], object], timeout: float = 5.0) -> bool:
        """Wait in the main thread until `condition()` holds; False after `timeout` s."""
        return bool(wait_until(condition, timeout))

    def _client(self, service: str, srv_type: type[Any]) -> Client:
        self._check_open()
        key = (service, srv_type)
        if key not in self._clients:
            self._clients[key] = self.node.create_client(srv_type, service)
        return self._clients[key]

    def _ready(self, client: Client, timeout: float) -> None:
        if not self.until(client.service_is_ready, timeout):
            raise CallTimeout(
                f"no server for {client.service_name} within {timeout:g} s: has its node been started, "
                "and with this type?"
            )

    # The session itself

    def close(self) -> None:
        """Stop every node and process, the threads and the context; closing twice is no error."""
        if self._closed:
            return
        self._closed = True
        atexit.unregister(self.close)
        builder.on_replace.remove(self._drop_types)
        self.stop()
        self._spinner.stop()
        self.context.try_shutdown()
        if self._claim:
            self._claim.close()
            os.environ.pop("ROS_DOMAIN_ID", None)

    @property
    def ok(self) -> bool:
        """Whether the session can be used: not closed, and its context not shut down by other code."""
        return not self._closed and self.context.ok()

    def _drop_types(self, package: str) -> None:
        """Stop the nodes of this kernel that use an interface of `package`, and drop the session's own uses."""
        for handle in list(self._handles.values()):
            if isinstance(handle, LiveNode) and any(_uses(handle.node, package)):
                self.stop(handle.name)
        self._spinner.stop(destroy=False)  # what an executor waits on is not destroyed before it looks up
        for end in list(_uses(self.node, package)):
            end()
        self._clients = {key: client for key, client in self._clients.items() if not _of(key[1], package)}
        self._spinner = Spinner(self.node)

    def _check_open(self) -> None:
        if not self.ok:
            raise LiveError("this session has ended: get a new one with `ros = course.live()`")

    def _all_nodes(self) -> list[str]:
        return [f"{namespace.rstrip('/')}/{name}" for name, namespace in self.node.get_node_names_and_namespaces()]

    def __repr__(self) -> str:
        return f"<live session: {len(self._handles)} started>"


_current: list[Session] = []  # the kernel's one, once it was asked for


def live() -> Session:
    """The kernel's session, made at the first call, and made anew when it has ended."""
    if not _current or not _current[0].ok:
        for session in _current:
            session.close()
        _current[:] = [Session()]
    return _current[0]


def _of(interface: object, package: str) -> bool:
    return str(getattr(interface, "__module__", "")).split(".")[0] == package


def _uses(node: Node, package: str) -> Iterator[Callable[[], object]]:
    """For each client, server, publisher, ... of `node` whose type is of `package`, what destroys it."""
    for client in node.clients:
        if _of(client.srv_type, package):
            yield functools.partial(node.destroy_client, client)
    for service in node.services:
        if _of(service.srv_type, package):
            yield functools.partial(node.destroy_service, service)
    for publisher in node.publishers:
        if _of(publisher.msg_type, package):
            yield functools.partial(node.destroy_publisher, publisher)
    for subscription in node.subscriptions:
        if _of(subscription.msg_type, package):
            yield functools.partial(node.destroy_subscription, subscription)
    for waitable in node.waitables:
        if _of(action_type(waitable) or object, package):
            yield functools.partial(destroy, waitable)


def _base(node: str) -> str:
    return node.rpartition("/")[2]


def _difference(after: list[str], before: list[str]) -> list[str]:
    rest = list(before)
    new = []
    for name in after:
        if name in rest:
            rest.remove(name)
        else:
            new.append(name)
    return new
