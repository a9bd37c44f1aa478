"""Grading on the machines of a Dask cluster.

A submission, its exercise and its seed are sent as bytes; a worker only needs this package installed.
"""

import contextlib
import logging
from collections.abc import Iterator, Mapping
from concurrent.futures import CancelledError
from functools import cache

from distributed import Client, Future, KilledWorker, get_worker

from autograder.errors import ClusterError, SandboxUnavailable, WorkerLost
from autograder.grading import admission, installed_code, single
from autograder.grading.dispatch import WELCOME, Grading, Task
from autograder.records import Report, Submission
from autograder.sandbox.sandbox import choose
from autograder.submissions import exercises

HELLO = 10.0  # s until a scheduler answers


@contextlib.contextmanager
def connect(address: str, patience: float, unsafe: bool) -> "Iterator[DaskPool]":
    """The workers of the Dask scheduler at `address`, for example tcp://HOST:8786.

    Raises ClusterError when the scheduler does not answer, has no workers, or has one whose code differs.
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
        check_code(client.run(installed_code.digests, on_error="return"))
        yield DaskPool(client, patience, unsafe)


def _silence() -> None:
    """Keep Dask from writing to the terminal: the results say what a worker's death means."""
    logger = logging.getLogger("distributed")
    logger.handlers[:] = [logging.NullHandler()]
    logger.propagate = False


def check_code(found: Mapping[str, dict[str, str] | Exception]) -> None:
    """Compare the workers' code, by address, with this process's; raises ClusterError for the first that differs.

    `found` has each worker's `installed_code.digests()`, or the exception that asking for them raised.
    """
    mine = installed_code.digests()
    for worker, theirs in found.items():
        if isinstance(theirs, Exception):
            raise ClusterError(
                f"the worker {worker} cannot grade ({theirs}): install the course on its machine, as it is on this one"
            )
        if difference := installed_code.difference(mine, theirs):
            raise ClusterError(
                f"the worker {worker} has another version of the course ({difference}): "
                "install the same one on both machines, then start the worker again"
            )


class DaskPool:
    """The workers of a Dask client, as a `dispatch.Pool`."""

    def __init__(self, client: Client, patience: float, unsafe: bool):
        self._client, self._patience, self._unsafe = client, patience, unsafe

    def workers(self) -> Mapping[str, int]:
        """Return how many submissions each worker can grade at once; none while the scheduler cannot be reached."""
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
        """Return the report of an ended grading; raises WorkerLost, or what the worker raised."""
        assert isinstance(grading, Future)
        try:
            return grading.result(timeout=HELLO)
        except (KilledWorker, CancelledError, TimeoutError) as error:
            raise WorkerLost(str(error)) from None

    def cancel(self, gradings: list[Grading]) -> None:
        """Cancel these gradings."""
        self._client.cancel(gradings, force=True)


def _grade(submission: Submission, packed: exercises.Packed, seed: int, patience: float, unsafe: bool) -> Report:
    """Grade a submission; called on a worker."""
    with admission.turn(submission.assignment):
        return single.grade(submission, _box(unsafe), seed, patience, exercises.unpack(packed))


@cache
def _box(unsafe: bool) -> str:
    try:
        return choose(unsafe)
    except SandboxUnavailable as error:
        raise SandboxUnavailable(f"on the worker {get_worker().address}, {error}") from None
