"""Grading many submissions at once, in worker processes of this machine or of a Dask cluster.

A submission, its exercise and its seed travel as bytes; a worker needs nothing but this package, installed.
"""

import contextlib
import logging
import signal
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import CancelledError
from functools import cache

import dask
from distributed import Client, Future, KilledWorker, LocalCluster, Worker, get_worker
from distributed.security import Security

from autograder.errors import ClusterError, SandboxUnavailable, WorkerLost
from autograder.grading import admission, installed, single
from autograder.grading.dispatch import WELCOME, Dispatcher, Grading, Task
from autograder.records import Report, Submission
from autograder.sandbox.box import choose
from autograder.submissions import exercises

HELLO = 10.0  # s until a scheduler answers


@contextlib.contextmanager
def local(jobs: int) -> Iterator[Client]:
    """A client of `jobs` worker processes on this machine.

    They are reached over TLS with keys that are made for the occasion: otherwise everybody with an account on this
    machine could have them run any code.
    """
    _silence()
    security = Security.temporary()
    with (
        # Workers are forked from one process that has loaded Dask, instead of loading it each for themselves.
        dask.config.set({"distributed.worker.multiprocessing-method": "forkserver"}),
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


def dask_setup(worker: Worker) -> None:
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
    """A client of the Dask scheduler at `address`, for example tcp://HOST:8786.

    Raises ClusterError when the scheduler does not answer, has no workers, or has one with other code than here.
    """
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
        check_code(client.run(installed.digests, on_error="return"))
        yield client


def check_code(found: Mapping[str, dict[str, str] | Exception]) -> None:
    """Compare the workers' code, by address, with this process's; raises ClusterError for the first that differs.

    What is found is a worker's `installed.digests()`, or what asking it for them raised.
    """
    mine = installed.digests()
    for worker, theirs in found.items():
        if isinstance(theirs, Exception):
            raise ClusterError(
                f"the worker {worker} cannot grade ({theirs}): install the course on its machine, as it is on this one"
            )
        if difference := installed.difference(mine, theirs):
            raise ClusterError(
                f"the worker {worker} has another version of the course ({difference}): "
                "install the same one on both machines, then start the worker again"
            )


def run(
    client: Client, submissions: Iterable[tuple[Submission, int]], patience: float, unsafe: bool
) -> Iterator[Report]:
    """Grade submissions, each with the seed of its hidden inputs; the reports come as they are done.

    Submissions are taken one by one as workers are free.  Call it from the main thread.  Raises ClusterError when the
    cluster is lost, SandboxUnavailable when a worker cannot confine programs, and KeyboardInterrupt.
    """
    tasks = (Task(submission, seed) for submission, seed in submissions)
    return Dispatcher(DaskPool(client, patience, unsafe), tasks).run()


class DaskPool:
    """The workers of a Dask client, as a `dispatch.Pool`."""

    def __init__(self, client: Client, patience: float, unsafe: bool):
        self._client, self._patience, self._unsafe = client, patience, unsafe

    def workers(self) -> Mapping[str, int]:
        """How many submissions each worker can grade at once; none while the scheduler cannot be reached."""
        try:
            return self._client.nthreads() if self._client.status == "running" else {}
        except (OSError, TypeError, ValueError):
            return {}

    def send(self, task: Task) -> Future:
        """Have the task's worker grade it."""
        return self._client.submit(
            _grade,
            task.submission,
            exercises.pack(task.submission.assignment),
            task.seed,
            self._patience,
            self._unsafe,
            pure=False,
            workers=[task.worker],
            allow_other_workers=False,
        )

    def report(self, grading: Grading) -> Report:
        """What came of it; raises WorkerLost, or what the worker raised."""
        assert isinstance(grading, Future)
        try:
            return grading.result(timeout=HELLO)
        except (KilledWorker, CancelledError, TimeoutError) as error:
            raise WorkerLost(str(error)) from None

    def cancel(self, gradings: list[Grading]) -> None:
        """Break these off."""
        self._client.cancel(gradings, force=True)


def _grade(submission: Submission, packed: exercises.Packed, seed: int, patience: float, unsafe: bool) -> Report:
    """Grade a submission; called on a worker."""
    with admission.turn():
        return single.grade(submission, _box(unsafe), seed, patience, exercises.unpack(packed))


@cache
def _box(unsafe: bool) -> str:
    try:
        return choose(unsafe)
    except SandboxUnavailable as error:
        raise SandboxUnavailable(f"on the worker {get_worker().address}, {error}") from None
