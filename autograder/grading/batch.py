"""Grading a folder of submissions, and finding results that are outdated."""

import contextlib
import secrets
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from autograder.errors import UnknownTime
from autograder.grading import admission
from autograder.grading.dispatch import Dispatcher, Pool, Task
from autograder.grading.this_machine import ThisMachine
from autograder.records import TIME_UNKNOWN, Report
from autograder.results import output
from autograder.results.output import Basis
from autograder.submissions import exercises, provenance
from autograder.submissions.listing import digest, read
from autograder.submissions.reading import handed_in_at


@contextlib.contextmanager
def workers(jobs: int | None, scheduler: str | None, patience: float, unsafe: bool) -> Iterator[Pool]:
    """The pool of workers: those of the Dask scheduler at the address `scheduler`, or else `jobs` on this machine.

    By default, `jobs` is more than the number of cores, see `admission`.  `patience` and `unsafe` apply to every
    grading, see `single.grade` and `sandbox.sandbox.choose`.  Raises ClusterError and SandboxUnavailable.
    """
    if not scheduler:
        yield ThisMachine(jobs or admission.WORKERS * admission.cores(), patience, unsafe)
        return
    from autograder.grading import cluster  # Dask takes a second to load

    with cluster.connect(scheduler, patience, unsafe) as pool:
        yield pool


def run(pool: Pool, submitted: Path, seeds: dict[tuple[str, str], int]) -> Iterator[tuple[Report, Basis]]:
    """Grade the (student, assignment) pairs in `seeds`, each with its seed; reports come in the order they are done.

    The first begin at once; the others when a worker is free and a report is asked for.  Iterate in the main thread.
    Raises ClusterError when the cluster is lost, SandboxUnavailable when a worker cannot confine programs, and
    KeyboardInterrupt.
    """
    bases: dict[tuple[str, str], Basis] = {}

    def handed_in() -> Iterator[Task]:
        for key, seed in seeds.items():
            found = read(submitted, *key)
            bases[key] = Basis(str(submitted.resolve()), exercises.pack(key[1]).digest, digest(found))
            yield Task(found, seed)

    def reports() -> Iterator[tuple[Report, Basis]]:
        for report in dispatcher.run():
            flags = [] if _time_is_known(submitted, report.student, report.assignment) else [TIME_UNKNOWN]
            yield replace(report, flags=[*report.flags, *flags]), bases.pop((report.student, report.assignment))

    dispatcher = Dispatcher(pool, handed_in())
    dispatcher.begin()
    return reports()


def _time_is_known(submitted: Path, student: str, assignment: str) -> bool:
    try:
        at = handed_in_at(submitted / student / assignment)
    except UnknownTime:
        return False
    return bool(at) or provenance.time_of(submitted, student, assignment) != provenance.UNKNOWN


def changed(out: Path, keys: Iterable[tuple[str, str]]) -> list[tuple[str, str]]:
    """Return those of the results in the output folder `out` that are outdated."""
    known = output.bases(out, lost=True)
    return [key for key in keys if key in known and outdated(known[key], key)]


def of_other_folders(
    bases: Mapping[tuple[str, str], Basis], submitted: Path, keys: Iterable[tuple[str, str]]
) -> dict[tuple[str, str], Basis]:
    """Return those of the results that were made from another folder than `submitted`, with their inputs moved there.

    Such a result counts for `submitted`, too, unless the moved inputs are replaced: then that folder has other files.
    """
    here = str(submitted.resolve())
    return {key: replace(bases[key], submitted=here) for key in keys if key in bases and bases[key].submitted != here}


def outdated(basis: Basis, key: tuple[str, str]) -> bool:
    """Return True if the suite or the handed-in files have changed since a result; missing files count as unchanged."""
    return not is_of_present_suite(basis, key) or basis.is_replaced(key)


def is_of_present_suite(basis: Basis, key: tuple[str, str]) -> bool:
    """Return True if the exercise of a result has not changed since."""
    return basis.suite == exercises.pack(key[1]).digest


def current(basis: Basis, key: tuple[str, str]) -> Basis:
    """Return the inputs of a result as they are now."""
    return Basis(basis.submitted, exercises.pack(key[1]).digest, digest(read(Path(basis.submitted), *key)))


def draw(found: Iterable[tuple[str, str]], seed: int | None) -> dict[tuple[str, str], int]:
    """A seed for each submission: the given one, or a new one."""
    return {key: secrets.randbits(32) if seed is None else seed for key in found}
