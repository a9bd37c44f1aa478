"""Dispatch of gradings: sends submissions to free workers, and notices when a worker dies.

A submission is sent to one worker.  When that worker dies, another one grades the submission again; a submission that
has lost LIVES workers is given up, because it may be the cause.  A `Pool` knows how to reach the workers.
"""

import contextlib
import signal
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Protocol

from autograder.errors import ClusterError, WorkerLost
from autograder.grading.single import given_up
from autograder.records import KILLED_WORKERS, Report, Submission
from autograder.submissions import exercises

LIVES = 2  # workers that a submission may lose before it is given up
WELCOME = 30.0  # s without any worker, at the start or later, after which the cluster counts as lost
GLANCE = 0.5  # s between two looks at which workers are there
CTRL_C = object()  # put among the gradings that have ended


@dataclass(frozen=True)
class Task:
    """A submission on its way to a report."""

    submission: Submission
    seed: int  # of its hidden inputs
    lost: int = 0  # workers that died while grading it
    worker: str = ""  # the address of the worker that grades it


class Grading(Protocol):
    """A submission that a worker is grading."""

    def add_done_callback(self, callback: Callable[[Any], object], /) -> object:
        """Call `callback` with this grading, from any thread, when it has ended."""


class Pool(Protocol):
    """The workers, as the dispatcher needs them."""

    def workers(self) -> Mapping[str, int]:
        """Return how many submissions each worker can grade at once, by address; empty while none is reachable."""

    def send(self, task: Task) -> Grading:
        """Have `task.worker`, and no other worker, grade the task."""

    def report(self, grading: Grading) -> Report:
        """Return the report of an ended grading; raises WorkerLost, or what the worker raised."""

    def cancel(self, gradings: list[Grading]) -> None:
        """Cancel these gradings."""


class Inbox:
    """Things that other threads or a signal handler have put in; the first comes out first.

    `queue.Queue` may not be used in a signal handler, and `SimpleQueue.get` waits without end if its process is kept
    from running for its time limit (CPython 3.11).
    """

    def __init__(self) -> None:
        self._things: deque[Any] = deque()
        self._bell = threading.Lock()  # free: something has been put in
        self._bell.acquire()

    def put(self, thing: Any) -> None:
        """Put something in, from any thread or signal handler."""
        self._things.append(thing)
        with contextlib.suppress(RuntimeError):  # it is free already
            self._bell.release()

    def get(self, timeout: float) -> Any:
        """Take the first thing out; None if there is none for `timeout` s."""
        if not self._things:
            self._bell.acquire(timeout=timeout)
        return self._things.popleft() if self._things else None


class Dispatcher:
    """Grades tasks on the workers of a pool: `waiting` holds those to send again, `running` those that a worker has."""

    def __init__(self, pool: Pool, tasks: Iterable[Task]):
        """Take `tasks` one by one, as workers become free."""
        self.pool = pool
        self.waiting: list[Task] = []
        self.running: dict[Grading, Task] = {}
        self._new = iter(tasks)
        self._more = True  # until `_new` has ended
        self._ended = Inbox()
        self._last_seen = time.monotonic()  # when there was a worker

    def begin(self) -> None:
        """Give each worker a task; `run` does so, too."""
        self._send(self._look())

    def run(self) -> Iterator[Report]:
        """Yield the reports as they are finished.

        Iterate in the main thread: Ctrl-C becomes a KeyboardInterrupt at a safe moment.  Raises ClusterError when there
        has been no worker for WELCOME s, and the errors of workers.
        """
        with self._interruptible():
            while True:
                workers = self._look()
                self._take_back(workers)
                yield from self._give_up()
                self._send(workers)
                if not (self.running or self.waiting or self._more):
                    return
                if (grading := self._next_ended()) in self.running:
                    yield from self._finish(grading)

    @contextlib.contextmanager
    def _interruptible(self) -> Iterator[None]:
        # Python would raise KeyboardInterrupt anywhere, even where Dask only prints it.
        before = signal.signal(signal.SIGINT, lambda *_: self._ended.put(CTRL_C))
        try:
            yield
        finally:
            with contextlib.suppress(Exception):  # the cluster may be gone
                self.pool.cancel([*self.running])
            signal.signal(signal.SIGINT, before)

    def _look(self) -> Mapping[str, int]:
        """The workers that are there now."""
        workers = self.pool.workers()
        if workers:
            self._last_seen = time.monotonic()
        elif time.monotonic() > self._last_seen + WELCOME:
            raise ClusterError(f"there has been no worker for {WELCOME:.0f} s")
        return workers

    def _take_back(self, workers: Mapping[str, int]) -> None:
        """Put back the tasks of dead workers.  If no worker is left, the scheduler is unreachable and none has died."""
        for grading in [grading for grading, task in self.running.items() if workers and task.worker not in workers]:
            self._wait_again(self.running.pop(grading), died=True)
            self.pool.cancel([grading])

    def _give_up(self) -> Iterator[Report]:
        """Reports on the tasks that have lost too many workers."""
        for task in [task for task in self.waiting if task.lost >= LIVES]:
            self.waiting.remove(task)
            exercise = exercises.load(task.submission.assignment)
            yield given_up(task.submission, exercise, task.seed, KILLED_WORKERS)

    def _send(self, workers: Mapping[str, int]) -> None:
        """Give each free worker a task: first those put back, then new ones."""
        free = Counter(workers) - Counter(task.worker for task in self.running.values())
        for worker in free.elements():
            task = self._next_task()
            if task is None:
                return
            task = replace(task, worker=worker)
            grading = self.pool.send(task)
            self.running[grading] = task
            grading.add_done_callback(self._ended.put)

    def _next_task(self) -> Task | None:
        if self.waiting:
            return self.waiting.pop()
        task = next(self._new, None)
        self._more = self._more and task is not None
        return task

    def _next_ended(self) -> Grading | None:
        """A grading that has ended; None after GLANCE s without one.  Raises KeyboardInterrupt after Ctrl-C."""
        ended = self._ended.get(GLANCE)
        if ended is CTRL_C:
            raise KeyboardInterrupt
        return ended

    def _finish(self, grading: Grading) -> Iterator[Report]:
        """The report of a grading that has ended; none when its worker died."""
        task = self.running.pop(grading)
        try:
            report = self.pool.report(grading)
        except WorkerLost:
            # Without any worker the scheduler is gone: all gradings are then cancelled, though no worker may have died.
            self._wait_again(task, died=bool(self.pool.workers()))
        else:
            yield report

    def _wait_again(self, task: Task, died: bool) -> None:
        self.waiting.append(replace(task, lost=task.lost + died, worker=""))
