"""Grading many submissions at once, in worker processes of this machine or of a Dask cluster.

A submission, its exercise and its seed travel as bytes; a worker needs nothing but this package, installed.  When a
worker dies, its submission is graded again by another one; a submission that has killed two is given up.
"""

import contextlib
import itertools
import logging
import queue
import secrets
import signal
import tempfile
from collections.abc import Iterable, Iterator
from concurrent.futures import CancelledError
from functools import cache
from importlib.metadata import version

from distributed import Client, Future, KilledWorker, LocalCluster, Variable, get_client, get_worker
from distributed.security import Security

from . import exercises, grading, sandbox
from .records import Report, Submission

LIVES = 2  # workers that a submission may kill
HELLO = 10.0  # s until a scheduler answers
WELCOME = 30.0  # s until there is a worker, at first and whenever all have gone, or a lost scheduler is back
GLANCE = 1.0  # s between two looks whether they are there
KILLED_WORKERS = "killed_workers"  # the flag of a submission that was given up
DISTRIBUTION = "ros2-course"


class ClusterError(RuntimeError):
    """The cluster cannot be used, or is lost; the message says what to do."""


@contextlib.contextmanager
def local(jobs: int) -> Iterator[Client]:
    """So many worker processes on this machine.

    They are reached over TLS with keys that are made for the occasion: without it, everybody with an account on this
    machine could have them run what they like.
    """
    _silence()
    security = Security.temporary()
    with (tempfile.TemporaryDirectory(prefix="autograder-") as scratch,
          LocalCluster(n_workers=jobs, threads_per_worker=1, processes=True, memory_limit=0, dashboard_address="127.0.0.1:0",
                       local_directory=scratch, security=security, preload="autograder.cluster") as cluster,
          Client(cluster, security=security) as client):
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
            raise ClusterError(f"the scheduler at {address} has no workers: start some with `dask worker {address}`") from None
        mine = version(DISTRIBUTION)
        for worker, other in client.run(_version, on_error="return").items():
            if other != mine:
                found = f"version {other}" if isinstance(other, str) else other
                raise ClusterError(f"the worker {worker} needs {DISTRIBUTION} {mine} installed; it has: {found}")
        yield client


def grade(client: Client, submissions: Iterable[tuple[Submission, int]], patience: float, unsafe: bool) -> Iterator[Report]:
    """Grade submissions, each with the seed of its hidden inputs; the reports come as they are done.

    Submissions are taken one by one as workers are free.  Call it from the main thread.  Raises ClusterError when the
    cluster is lost, SandboxUnavailable when a worker cannot confine programs, and KeyboardInterrupt.
    """
    waiting = iter(submissions)
    batch = secrets.token_hex(8)
    names = (f"grading-{batch}-{number}" for number in itertools.count())
    running: dict[Future, tuple[Variable, Submission, int]] = {}
    done: queue.SimpleQueue[Future | None] = queue.SimpleQueue()
    # Python would raise KeyboardInterrupt anywhere, also where Dask only prints it.
    interrupted = signal.signal(signal.SIGINT, lambda *_: done.put(None))
    try:
        while True:
            for submission, seed in itertools.islice(waiting, max(0, max(1, _threads(client)) - len(running))):
                name = next(names)
                tries = Variable(name, client)
                tries.set(0)
                future = client.submit(_grade, name, submission, exercises.pack(submission.assignment), seed, patience, unsafe,
                                       key=name, pure=False)
                running[future] = tries, submission, seed
                future.add_done_callback(done.put)
            if not running:
                return
            future = _next(done, client)
            tries, submission, seed = running.pop(future)
            tries.delete()
            yield _result(future) or grading.given_up(submission, exercises.load(submission.assignment), seed, KILLED_WORKERS)
    finally:
        with contextlib.suppress(Exception):  # the cluster may be gone
            client.cancel([*running], force=True)
        signal.signal(signal.SIGINT, interrupted)


def _grade(name: str, submission: Submission, packed: exercises.Packed, seed: int, patience: float,
           unsafe: bool) -> Report | None:
    """On a worker: the report, or None when this submission has used up its lives."""
    tries = Variable(name, get_client())
    before = tries.get()
    if before >= LIVES:
        return None
    tries.set(before + 1)
    return grading.grade(submission, _box(unsafe), seed, patience, exercises.unpack(packed))


@cache
def _box(unsafe: bool) -> str:
    try:
        return sandbox.choose(unsafe)
    except sandbox.SandboxUnavailable as error:
        raise sandbox.SandboxUnavailable(f"on the worker {get_worker().address}, {error}") from None


def _version() -> str:
    return version(DISTRIBUTION)


def _threads(client: Client) -> int:
    """How many gradings the workers can run at once."""
    try:
        return sum(client.nthreads().values())
    except (OSError, TypeError, ValueError):
        raise ClusterError("the scheduler is lost") from None


def _next(done: "queue.SimpleQueue[Future | None]", client: Client) -> Future:
    """The next future that is done; raises ClusterError when the scheduler or all workers have gone."""
    missed = 0.0
    while missed < WELCOME:
        try:
            if future := done.get(timeout=GLANCE):
                return future
            raise KeyboardInterrupt
        except queue.Empty:
            missed = 0.0 if client.status == "running" and _threads(client) else missed + GLANCE
    raise ClusterError(f"for {WELCOME:.0f} s there was no worker")


def _result(future: Future) -> Report | None:
    try:
        return future.result(timeout=HELLO)
    except KilledWorker:
        return None
    except (CancelledError, TimeoutError):
        raise ClusterError("the scheduler is lost") from None
