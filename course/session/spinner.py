"""An executor in a background thread that spins one node, for every node of a live session and of the grader."""

import linecache
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from types import FrameType

from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor, ShutdownException, SingleThreadedExecutor
from rclpy.node import Node

from course.explaining.failure_report import FailureReport, Frame, cell_of, of_exception
from course.explaining.source import is_cell
from course.ros.rclpy_internals import cancel_pending_requests, destroy, end_thread_pool, pool_of

KEPT = 100  # exceptions of one node
REPORTS = 20  # exceptions that are shown to the reader: their texts may differ


class Spinner:
    """An executor in a background thread that spins one node."""

    def __init__(self, node: Node, threads: int = 1, changed: Callable[[], None] = lambda: None, who: str = ""):
        """Make one with `threads` threads, which does not spin yet; a callback that raises calls `changed`.

        `who` is what the reader calls the node, if not by its name.
        """
        self._changed = changed
        self._who = who or f"The node {node.get_name()}"
        context = node.context
        self.node, self.threads = node, threads
        self.errors: deque[BaseException] = deque(maxlen=KEPT)
        self.raised = 0  # exceptions so far, those included that are not kept any more
        self.reports: list[FailureReport] = []
        self._made: dict[tuple[object, ...], FailureReport] = {}  # by what was raised and where
        self._stopping = False
        self._left: list[threading.Thread] = []  # in callbacks that had not returned when it was stopped
        self.executor = (
            SingleThreadedExecutor(context=context)
            if threads == 1
            else MultiThreadedExecutor(num_threads=threads, context=context)
        )
        self.executor.add_node(node)
        self.thread = threading.Thread(target=self._spin, name=f"spin {node.get_name()}", daemon=True)

    def start(self) -> None:
        """Begin to spin."""
        self.thread.start()

    @property
    def alive(self) -> bool:
        """Return False once its thread has ended."""
        return self.thread.ident is None or self.thread.is_alive()

    def _spin(self) -> None:
        while True:
            try:
                self.executor.spin()
                return
            except (ExternalShutdownException, ShutdownException):
                return
            except Exception as error:  # raised by a callback: keep it for the reader, and go on
                if self._stopping:
                    return
                self.caught(error)

    def caught(self, error: BaseException, doing: str = "") -> None:
        """Keep an exception of a callback for the reader, once for each place; `doing` describes the callback."""
        self.errors.append(error)
        self.raised += 1
        self.tell(self._report(error, doing))

    def _report(self, error: BaseException, doing: str) -> FailureReport:
        """Return the report on an exception, made once for each place: a callback may raise it at each message."""
        places = ((frame.f_code, line) for frame, line in traceback.walk_tb(error.__traceback__))
        key = doing, *traceback.format_exception_only(error), *places
        if key in self._made:
            return self._made[key]
        cell = next(filter(None, map(cell_of, type(self.node).__mro__)), "")
        report = of_exception(self._who, error, self._service_callbacks(), doing, cell)
        if len(self._made) < REPORTS:
            self._made[key] = report
        return report

    def tell(self, report: FailureReport) -> None:
        """Keep a report for the reader, once for each place."""
        if len(self.reports) < REPORTS:
            known = {(known.error, known.frames) for known in self.reports}
            if (report.error, report.frames) not in known:
                self.reports.append(report)
            if len(self.reports) == REPORTS:
                self.reports[-1] = replace(report, hint="Its further exceptions are shown only in `ros.logs()`.")
        self.node.get_logger().error(report.line)
        self._changed()

    def doing(self) -> tuple[Frame, ...]:
        """Return the frames of a callback that a thread is in now, those in the reader's cells; () if none is."""
        return next((frames for _, frames in self.callbacks()), ())

    def callbacks(self) -> list[tuple[FrameType, tuple[Frame, ...]]]:
        """Return the callbacks, in the reader's cells, that threads are in now: Python's frame, and those to show."""
        threads = (self.thread, *pool_of(self.executor))
        stacks = [_stack_in_cells(thread.ident or 0) for thread in threads]
        return [(stack[0], tuple(map(_shown, stack))) for stack in stacks if stack]

    def goes_on(self) -> bool:
        """Return True if it was stopped, and a callback has still not returned."""
        return any(thread.is_alive() for thread in self._left)

    def _service_callbacks(self) -> list[Callable[..., object]]:
        return [service.callback for service in self.node.services]

    def stop(self, timeout: float = 2.0, *, destroy: bool = True) -> bool:
        """End the thread and destroy the node; False when a callback is still running after `timeout` s."""
        self._stopping = True
        self.executor.shutdown(timeout_sec=0.0)
        for client in self.node.clients:  # a callback that waits for an answer would wait forever
            cancel_pending_requests(client)
        deadline = time.monotonic() + timeout
        self.thread.join(timeout)
        threads = [self.thread]
        if isinstance(self.executor, MultiThreadedExecutor):
            threads += end_thread_pool(self.executor)
        for thread in threads:
            thread.join(max(0.0, deadline - time.monotonic()))
        self._left = [thread for thread in threads if thread.is_alive()]
        if self._left:
            return False
        if destroy:
            destroy_node(self.node)
        return True


def frames_in_cells(thread: int) -> tuple[Frame, ...]:
    """Return the frames, in the reader's cells, of the thread with this identifier."""
    return tuple(map(_shown, _stack_in_cells(thread)))


def _stack_in_cells(thread: int) -> list[FrameType]:
    found, frame = [], sys._current_frames().get(thread)
    while frame:
        if is_cell(frame.f_code.co_filename):
            found.append(frame)
        frame = frame.f_back
    return found[::-1]


def _shown(frame: FrameType) -> Frame:
    code = frame.f_code
    return Frame("the cell", frame.f_lineno, code.co_name, linecache.getline(code.co_filename, frame.f_lineno).strip())


def destroy_node(node: Node) -> None:
    """Destroy a node with its action servers and clients, which would keep it in the graph."""
    for waitable in list(node.waitables):
        destroy(waitable)
    node.destroy_node()
