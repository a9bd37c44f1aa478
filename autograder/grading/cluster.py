"""Grading many submissions at once, in worker processes of this machine or of a Dask cluster.

A submission, its exercise and its seed travel as bytes; a worker needs nothing but this package, installed.  Each
submission is sent to one worker.  When that dies, it is graded again by another one; a submission that has killed two is
given up.
"""

import contextlib
import logging
import queue
import signal
import tempfile
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from concurrent.futures import CancelledError
from dataclasses import dataclass, replace
from functools import cache
from importlib.metadata import version

from distributed import Client, Future, KilledWorker, LocalCluster, get_worker
from distributed.security import Security

from autograder.errors import ClusterError, SandboxUnavailable
from autograder.grading.single import given_up
from autograder.grading.single import grade as grade_one
from autograder.records import Report, Submission
from autograder.sandbox.box import choose
from autograder.submissions import exercises

LIVES = 2  # workers that a submission may kill until it is given up
HELLO = 10.0  # s until a scheduler answers
WELCOME = 30.0  # s until there is a worker, at first and whenever all have gone, or a lost scheduler is back
GLANCE = 0.5  # s between two looks whether they are there
KILLED_WORKERS = "killed_workers"  # the flag of a submission that was given up
DISTRIBUTION = "ros2-course"


@contextlib.contextmanager
def local(jobs: int) -> Iterator[Client]:
    """So many worker processes on this machine.

    They are reached over TLS with keys that are made for the occasion: without it, everybody with an account on this
    machine could have them run what they like.
    """
    _silence()
    security = Security.temporary()
    with (
        tempfile.TemporaryDirectory(prefix="autograder-") as scratch,
        LocalCluster(
            n_workers=jobs,
            threads_per_worker=1,
            processes=True,
            memory_limit=0,
            dashboard_address="127.0.0.1:0",
            local_directory=scratch,
            security=security,
            preload=__name__,
        ) as cluster,
        Client(cluster, security=security) as client,
    ):
        yield client


def dask_setup(worker) -> None:
    """What Dask calls in each local worker: Ctrl-C in the terminal is for the coordinator, which ends its workers."""
    _silence()
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _silence() -> None:
    """Keep Dask from writing to the terminal: what matters of a worker's death is in the results."""
    logger = logging.getLogger("distributed")
    logger.handlers[:] = [logging.NullHandler()]
    logger.propagate = False


@contextlib.contextmanager
def remote(address: str) -> Iterator[Client]:
    """The cluster of the scheduler at `address`, for example tcp://HOST:8786; raises ClusterError."""
    _silence()
    try:
        client = Client(address, timeout=HELLO)
    except (OSError, ValueError) as error:
        raise ClusterError(f"no Dask scheduler answers at {address} ({error})") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=WELCOME)
        except TimeoutError:
            raise ClusterError(
                f"the scheduler at {address} has no workers: start some with `dask worker {address}`"
            ) from None
        mine = version(DISTRIBUTION)
        for worker, other in client.run(_version, on_error="return").items():
            if other != mine:
                found = f"version {other}" if isinstance(other, str) else other
                raise ClusterError(f"the worker {worker} needs {DISTRIBUTION} {mine} installed; it has: {found}")
        yield client


@dataclass(frozen=True)
class _Job:
    """A submission on its way."""

    submission: Submission
    seed: int
    killed: int = 0  # workers that died of it, or beside it
    worker: str = ""  # that has it


def grade(
    client: Client, submissions: Iterable[tuple[Submission, int]], patience: float, unsafe: bool
) -> Iterator[Report]:
    """Grade submissions, each with the seed of its hidden inputs; the reports come as they are done.

    Submissions are taken one by one as workers are free.  Call it from the main thread.  Raises ClusterError when the
    cluster is lost, SandboxUnavailable when a worker cannot confine programs, and KeyboardInterrupt.
    """
    waiting = (_Job(submission, seed) for submission, seed in submissions)
    more, again = True, []
    running: dict[Future, _Job] = {}
    done: queue.SimpleQueue[Future | None] = queue.SimpleQueue()
    seen = time.monotonic()  # when there was a worker
    # Python would raise KeyboardInterrupt anywhere, also where Dask only prints it.
    interrupted = signal.signal(signal.SIGINT, lambda *_: done.put(None))
    try:
        while True:
            workers = _workers(client)
            if workers:
                seen = time.monotonic()
            elif time.monotonic() > seen + WELCOME:
                raise ClusterError(f"for {WELCOME:.0f} s there was no worker")
            for future in [future for future, job in running.items() if workers and job.worker not in workers]:
                again.append(_killed(running.pop(future)))
                future.cancel(force=True)
            for job in [job for job in again if job.killed >= LIVES]:
                again.remove(job)
                yield given_up(job.submission, exercises.load(job.submission.assignment), job.seed, KILLED_WORKERS)
            free = Counter(workers) - Counter(job.worker for job in running.values())
            for worker in free.elements():
                job = again.pop() if again else next(waiting, None)
                more = more and job is not None
                if job is None:
                    break
                future = client.submit(
                    _grade,
                    job.submission,
                    exercises.pack(job.submission.assignment),
                    job.seed,
                    patience,
                    unsafe,
                    pure=False,
                    workers=[worker],
                    allow_other_workers=False,
                )
                running[future] = replace(job, worker=worker)
                future.add_done_callback(done.put)
            if not (running or again or more):
                return
            try:
                future = done.get(timeout=GLANCE)
            except queue.Empty:
                continue
            if future is None:
                raise KeyboardInterrupt
            job = running.pop(future, None)
            if job is None:
                continue  # it was taken for lost
            try:
                report = future.result(timeout=HELLO)
            except (KilledWorker, CancelledError, TimeoutError):
                again.append(_killed(job) if _workers(client) else job)  # without the scheduler all are cancelled
            else:
                yield report
    finally:
        with contextlib.suppress(Exception):  # the cluster may be gone
            client.cancel([*running], force=True)
        signal.signal(signal.SIGINT, interrupted)


def _killed(job: _Job) -> _Job:
    return replace(job, killed=job.killed + 1, worker="")


def _grade(submission: Submission, packed: exercises.Packed, seed: int, patience: float, unsafe: bool) -> Report:
    """On a worker."""
    return grade_one(submission, _box(unsafe), seed, patience, exercises.unpack(packed))


@cache
def _box(unsafe: bool) -> str:
    try:
        return choose(unsafe)
    except SandboxUnavailable as error:
        raise SandboxUnavailable(f"on the worker {get_worker().address}, {error}") from None


def _version() -> str:
    return version(DISTRIBUTION)


def _workers(client: Client) -> dict[str, int]:
    """How many gradings each worker can run at once, by its address; none while the scheduler is not there."""
    try:
        return client.nthreads() if client.status == "running" else {}
    except (OSError, TypeError, ValueError):
        return {}
