"""Guards for calls that are wrong in a kernel: `rclpy.spin`, `rclpy.init`, `main()`, waiting inside a callback.

In a kernel with a live session they say what to do instead, can be interrupted within a second, and leave the session
alone.  In threads other than the main one, and for spinning another node with a time limit, nothing changes.
"""

import contextlib
import linecache
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any

import rclpy
import rclpy.executors
from IPython import get_ipython
from rclpy.action import ActionClient
from rclpy.client import Client
from rclpy.exceptions import InvalidHandle
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from rclpy.utilities import get_default_context

from course.explaining.source import AWAIT, is_cell, running_cell
from course.foundation.waiting import wait_until
from course.ros.rclpy_internals import busy_receiver, client_of, is_served, is_shut_down, owner, replace_in_rclpy

GO_ON = " Leave it out, and go on in a callback of its own: `future.add_done_callback(self.FUNCTION)`."
TELLING = 3.0  # s that a cell waits for a server before the reader is told why there is none
EXECUTORS = rclpy.executors.__file__
SLICE = 0.2  # s between two looks at Ctrl-C
SPUN = "the session already spins this node, in the background"

OF_A_THREAD = (
    "This thread uses a node that has been stopped, or has been replaced by a new start. A thread that a node begins "
    "goes on until its function returns: keep a `threading.Event` that its loop looks at, and set it in the node's "
    "`destroy_node(self)` before `super().destroy_node()`."
)


class Interrupted(KeyboardInterrupt):
    """An interruption (■) while a cell spun or waited; shown in one line, without rclpy's frames."""

    def _render_traceback_(self) -> list[str]:
        return ["KeyboardInterrupt: the cell was interrupted. The session goes on."]


@contextlib.contextmanager
def interruptible() -> Iterator[None]:
    """Show an interruption (■) of this block in one line."""
    try:
        yield
    except KeyboardInterrupt:
        raise Interrupted from None


class Guards:
    """The replaced functions, from `install` to `remove`."""

    def __init__(self, notice: Callable[[str], None], apart: Callable[[Any], str]):
        """Prepare; `notice` is called with messages to the reader from a callback's thread.

        `apart` returns why a client, or an action client, finds no server.
        """
        self._notice, self._apart = notice, apart
        self._undo: list[Callable[[], None]] = []
        self._spun_once: tuple[str, int] | None = None  # the cell that was told so last, and its number

    def install(self) -> None:
        """Install the guards in this process."""
        self._undo = [
            replace_in_rclpy(self._init, rclpy, "init"),
            replace_in_rclpy(self._spin, rclpy, "spin"),
            replace_in_rclpy(self._spin_once, rclpy, "spin_once"),
            replace_in_rclpy(self._spin_until, rclpy, "spin_until_future_complete"),
            replace_in_rclpy(self._executor_spin, Executor, "spin"),
            replace_in_rclpy(self._wait_for_server, Client, "wait_for_service"),
            replace_in_rclpy(self._wait_for_server, ActionClient, "wait_for_server"),
            replace_in_rclpy(self._call, Client, "call"),
            self._explain_threads(),
        ]

    def remove(self) -> None:
        """Restore rclpy's functions."""
        for undo in reversed(self._undo):
            undo()
        self._undo.clear()

    def _explain_threads(self) -> Callable[[], None]:
        """Have a hint follow the error of a reader's thread that uses a node which has ended; return what ends this."""
        before = threading.excepthook

        def hook(args: Any) -> None:
            before(args)
            if isinstance(args.exc_value, InvalidHandle) and any(
                is_cell(frame.f_code.co_filename) for frame, _ in traceback.walk_tb(args.exc_traceback)
            ):
                say(f"Hint: {OF_A_THREAD}")

        threading.excepthook = hook
        return lambda: setattr(threading, "excepthook", before)

    def _init(self, original: Callable[..., None]) -> Callable[..., None]:
        def init(
            *,
            args: list[str] | None = None,
            context: Any = None,
            domain_id: int | None = None,
            signal_handler_options: SignalHandlerOptions | None = None,
        ) -> None:
            if context is not None:
                original(args=args, context=context, domain_id=domain_id, signal_handler_options=signal_handler_options)
            elif rclpy.ok():
                say("rclpy.init() has already been called in this kernel. A notebook does not need it at all.")
            else:
                if is_cell(sys._getframe(1).f_code.co_filename):
                    say(
                        "A notebook needs no rclpy.init(): start a node with `ros.start(TheClass)`, and the session "
                        "spins it. A node that you make in another way does nothing until you spin it yourself."
                    )
                # rclpy's own handlers would shut down every context of this process at Ctrl-C, including the session's.
                original(args=args, domain_id=domain_id, signal_handler_options=SignalHandlerOptions.NO)

        return init

    def _spin(self, original: Callable[..., None]) -> Callable[..., None]:
        def spin(node: Node, executor: Executor | None = None) -> None:
            name = getattr(node, "get_name", lambda: "node")()
            if _is_spun(node) and executor is None and not in_main_thread() and not in_callback():
                self._notice(f"rclpy.spin('{name}') in a thread does nothing here: {SPUN}.")
            elif not in_main_thread():
                where = "inside a callback" if in_callback() else "in a thread of your own"
                runs = "The executor" if in_callback() else "The session, if it has started the node,"
                self._notice(
                    f"rclpy.spin('{name}') {where} never returns. {runs} already runs the node's callbacks: remove the "
                    "line."
                )
                original(node, executor)
            elif _is_spun(node) and executor is None:
                say(f"rclpy.spin('{name}') does nothing here: {SPUN}.")
            else:
                say(
                    f"rclpy.spin('{name}') blocks this cell until you interrupt it (the ■ button). In a notebook, "
                    f"write ros.start({type(node).__name__}) instead: it creates the node and spins it in the "
                    f"background.{for_a_file()}"
                )
                executor = executor or SingleThreadedExecutor(context=node.context)
                executor.add_node(node)
                try:
                    while executor.context.ok():
                        executor.spin_once(timeout_sec=SLICE)
                except KeyboardInterrupt:
                    raise Interrupted from None
                finally:
                    executor.remove_node(node)

        return spin

    def _spin_once(self, original: Callable[..., None]) -> Callable[..., None]:
        def spin_once(node: Node, *, executor: Executor | None = None, timeout_sec: float | None = None) -> None:
            if not _is_spun(node) or executor is not None or not in_main_thread():
                original(node, executor=executor, timeout_sec=timeout_sec)
                return
            if (cell := (running_cell(), getattr(get_ipython(), "execution_count", 0))) != self._spun_once:
                self._spun_once = cell  # it is usually in a loop
                say(f"rclpy.spin_once is not needed here: {SPUN}.")
            wait_until(lambda: False, SLICE if timeout_sec is None else min(max(timeout_sec, 0.0), SLICE), alert=False)

        return spin_once

    def _spin_until(self, original: Callable[..., None]) -> Callable[..., None]:
        def spin_until_future_complete(
            node: Node, future: Future, executor: Executor | None = None, timeout_sec: float | None = None
        ) -> None:
            limit = float("inf") if timeout_sec is None or timeout_sec < 0 else timeout_sec
            spun = _is_spun(node) and executor is None
            if spun and in_main_thread():
                say(f"spin_until_future_complete is not needed here: {SPUN}. Write ros.wait(future).")
                client = client_of(node, future)
                done = wait_until(future.done, min(limit, TELLING), alert=False)
                if not done and client is not None and not is_served(client):
                    say(f"The future is still not done. {self._apart(client)} The ■ button ends this.")
                wait_until(future.done, limit - TELLING)
                return
            if spun:
                of_action = isinstance(client_of(node, future), ActionClient)
                self._notice(
                    f"spin_until_future_complete inside a callback of '{node.get_name()}' waits for an executor that "
                    f"is busy with this callback.{GO_ON if of_action else AWAIT}"
                )
                # No other executor spins it, so this waits, as it would in a program.
                wait_until(lambda: future.done() or not _is_spun(node) or not node.context.ok(), limit)
                return
            own = None
            if executor is None and node.context is not get_default_context():
                # For a node that is still being made: rclpy's own executor is one of the default context.
                executor = own = SingleThreadedExecutor(context=node.context)
            end = time.monotonic() + limit
            while not future.done() and (left := end - time.monotonic()) > 0 and node.context.ok():
                original(node, future, executor, min(SLICE, left))
            if own:
                own.shutdown()

        return spin_until_future_complete

    def _wait_for_server(self, original: Callable[..., bool]) -> Callable[..., bool]:
        def wait(self_: Any, timeout_sec: float | None = None) -> bool:
            if not in_main_thread():
                return original(self_, timeout_sec)
            with interruptible():
                if timeout_sec is not None:
                    return original(self_, timeout_sec)
                if original(self_, TELLING):
                    return True
                say(
                    f"still waiting for a server. {self._apart(self_)} The ■ button ends this; "
                    f"`{original.__name__}(timeout_sec=5.0)` returns False after 5 s."
                )
                return original(self_, None)

        return wait

    def _call(self, original: Callable[..., Any]) -> Callable[..., Any]:
        def call(self_: Client, request: Any, timeout_sec: float | None = None) -> Any:
            if not in_main_thread():
                if timeout_sec is None and (why := busy_receiver(self_)):
                    self._notice(
                        f"`call(...)` inside a callback of '{owner(self_).lstrip('/')}' waits for a response of "
                        f"{self_.service_name} that only its own executor can receive, and {why} is busy with this "
                        f"callback.{AWAIT}"
                    )
                return original(self_, request, timeout_sec)

            def tell() -> None:
                if not self_.service_is_ready():
                    say(
                        f"`call(...)` still waits for an answer from {self_.service_name}. {self._apart(self_)} The ■ "
                        "button ends this; a server that starts later does not get this request."
                    )

            timer = threading.Timer(TELLING, tell)
            timer.daemon = True
            timer.start()
            try:
                with interruptible():
                    return original(self_, request, timeout_sec)
            finally:
                timer.cancel()

        return call

    def _executor_spin(self, original: Callable[..., None]) -> Callable[..., None]:
        def spin(self: Executor) -> None:
            if not in_main_thread():
                original(self)
                return
            say(
                "executor.spin() blocks this cell until you interrupt it (the ■ button). In a notebook, write "
                "ros.start(YourNode, threads=2) instead: it creates the node and spins it in the background."
                f"{for_a_file()}"
            )
            try:
                while self.context.ok() and not is_shut_down(self):
                    self.spin_once(timeout_sec=SLICE)
            except KeyboardInterrupt:
                raise Interrupted from None

        return spin


def for_a_file() -> str:
    """Return the advice for a cell whose code belongs into a file of its own."""
    frame = sys._getframe()
    while frame.f_back is not None:
        frame = frame.f_back
        if is_cell(frame.f_code.co_filename):
            if any(line.startswith("if __name__ ==") for line in linecache.getlines(frame.f_code.co_filename)):
                return "\nIf this cell should write a file, its first line is missing: `%%exercise FILE.py`."
            break
    return ""


def in_callback() -> bool:
    """Return True if an executor has called the code that runs in this thread."""
    frame: FrameType | None = sys._getframe()
    while frame is not None:
        if frame.f_code.co_filename == EXECUTORS:
            return True
        frame = frame.f_back
    return False


def in_main_thread() -> bool:
    """Return True in the main thread, in which cells run."""
    return threading.current_thread() is threading.main_thread()


def _is_spun(node: Node) -> bool:
    """Return True if an executor has this node; rclpy's node keeps the executor that it was removed from."""
    executor = getattr(node, "executor", None)
    return executor is not None and node in executor.get_nodes()


def say(text: str) -> None:
    """Print a message below the cell."""
    print(text, file=sys.stderr, flush=True)
