"""A node in this kernel: spun in a background thread, and the handle that the reader gets on it."""

import functools
import threading
import time
from collections.abc import Callable

from rclpy.action import ActionClient
from rclpy.context import Context
from rclpy.executors import (
    ExternalShutdownException,
    MultiThreadedExecutor,
    ShutdownException,
    SingleThreadedExecutor,
)
from rclpy.node import Node
from rclpy.task import Future

from .logs import Logs


def _lock_action_clients() -> None:
    """Have a spinning thread take no answer before the thread that asks has noted its question.

    rclpy 7.1.6 locks a Client so but not an ActionClient, which then ignores the answer: the goal's future never ends.
    """
    lock = threading.RLock()

    def locked(method: Callable) -> Callable:
        @functools.wraps(method)
        def call(*args, **kwargs):
            with lock:
                return method(*args, **kwargs)
        return call

    for name in ("send_goal_async", "_cancel_goal_async", "_get_result_async", "take_data"):
        setattr(ActionClient, name, locked(getattr(ActionClient, name)))


_lock_action_clients()


class Spinner:
    """An executor in a background thread, spinning one node."""

    def __init__(self, node: Node, threads: int = 1):
        context = node.context
        self.node = node
        self.errors: list[BaseException] = []
        self._stopping = False
        self.executor = (SingleThreadedExecutor(context=context) if threads == 1
                         else MultiThreadedExecutor(num_threads=threads, context=context))
        self.executor.add_node(node)
        self.thread = threading.Thread(target=self._spin, name=f"spin {node.get_name()}", daemon=True)
        self.thread.start()

    def _spin(self) -> None:
        while True:
            try:
                self.executor.spin()
                return
            except (ExternalShutdownException, ShutdownException):
                return
            except Exception as error:  # a callback raised: keep it for the reader, and go on
                if self._stopping:
                    return
                self.errors.append(error)
                self.node.get_logger().error(f"{type(error).__name__} in a callback: {error}")

    def stop(self, timeout: float = 2.0, *, destroy: bool = True) -> bool:
        """End the thread and destroy the node; False when a callback is still running after `timeout` s."""
        self._stopping = True
        self.executor.shutdown(timeout_sec=0.0)
        for client in self.node.clients:  # a callback that waits for an answer would wait for ever
            for future in list(client._pending_requests.values()):
                future.cancel()
        deadline = time.monotonic() + timeout
        self.thread.join(timeout)
        threads = [self.thread]
        if isinstance(self.executor, MultiThreadedExecutor):
            self.executor._executor.shutdown(wait=False, cancel_futures=True)
            threads += self.executor._executor._threads
            for task in self.executor._futures:  # nobody asks how they end: rclpy would print that on stderr
                task._set_executor(None)
                task.add_done_callback(Future.exception)
        for thread in threads:
            thread.join(max(0.0, deadline - time.monotonic()))
        if any(thread.is_alive() for thread in threads):
            return False
        if destroy:
            _destroy(self.node)
        return True


def _destroy(node: Node) -> None:
    for waitable in list(node.waitables):  # action servers and clients, which would keep the node in the graph
        waitable.destroy()
    node.destroy_node()


class LiveNode:
    """A handle on a node that runs in this kernel; `node` is the rclpy node itself."""

    def __init__(self, session, spinner: Spinner):
        self._session, self._spinner = session, spinner
        self.node = spinner.node
        self.name = self.node.get_name()
        self.nodes = [self.node.get_fully_qualified_name()]

    @property
    def alive(self) -> bool:
        """Whether its executor is spinning."""
        return self._spinner.thread.is_alive()

    @property
    def errors(self) -> list[BaseException]:
        """The exceptions that its callbacks raised."""
        return list(self._spinner.errors)

    @property
    def logs(self) -> Logs:
        """What the node has logged so far."""
        return self._session.logs(self.name)

    def stop(self) -> None:
        """Stop spinning it and destroy it; stopping twice is no error."""
        self._session.stop(self.name)

    def _end(self) -> None:
        if self.alive and not self._spinner.stop():
            _destroy(self.node)

    def __repr__(self) -> str:
        return f"<{self.name}: {'running' if self.alive else 'stopped'} in this kernel>"


def in_context(cls: type[Node], context: Context, arguments: list[str], make_room: Callable[[str], None]) -> type[Node]:
    """`cls` with a last base before Node that hands Node the session's context, whatever the class's `__init__` takes.

    `make_room` is called with the node's name before the node is there.
    """

    class Injector(Node):
        def __init__(self, *args, **kwargs):
            kwargs.setdefault("context", context)
            kwargs["cli_args"] = [*(kwargs.get("cli_args") or []), *arguments]
            make_room(kwargs.get("node_name", *args[:1]))
            super().__init__(*args, **kwargs)

    return type(cls.__name__, (cls, Injector), {"__module__": cls.__module__, "__doc__": cls.__doc__})
