"""Grading a folder of submissions: the reports as they come, and whether a result is still what grading would give."""

import contextlib
import os
import secrets
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from autograder.records import TIME_UNKNOWN, Report, Submission
from autograder.results import output
from autograder.results.output import Origin
from autograder.sandbox.box import choose
from autograder.submissions import exercises
from autograder.submissions.listing import digest, read
from autograder.submissions.reading import handed_in_at

if TYPE_CHECKING:
    from distributed import Client  # takes a second to load


@contextlib.contextmanager
def workers(count: int, jobs: int | None, scheduler: str | None, unsafe: bool) -> "Iterator[Client | None]":
    """A client of the workers for `count` submissions; None when there are none.

    The workers are those of the Dask scheduler at the address `scheduler`, or else `jobs` processes of this machine, by
    default more than there are cores: see `admission`.  Raises ClusterError and SandboxUnavailable.
    """
    if not count:
        yield None
        return
    if not scheduler:
        choose(unsafe)  # says what is missing before the workers do
    from autograder.grading import admission, cluster

    here = jobs or admission.WORKERS * admission.cores()
    with cluster.remote(scheduler) if scheduler else cluster.local(min(count, here)) as client:
        yield client


def run(
    client: "Client | None", submitted: Path, seeds: dict[tuple[str, str], int], patience: float, unsafe: bool
) -> Iterator[tuple[Report, Origin]]:
    """Grade the (student, assignment) pairs in `seeds`, each with its seed; reports come in the order they are done.

    `client` is what `workers` gives.
    """
    if not seeds:
        return
    assert client, "there are submissions, so there are workers"
    from autograder.grading import cluster

    origins = {}

    def handed_in() -> Iterator[tuple[Submission, int]]:
        for key, seed in seeds.items():
            found = read(submitted, *key)
            origins[key] = Origin(str(submitted.resolve()), exercises.pack(key[1]).digest, digest(found))
            yield found, seed

    for report in cluster.run(client, handed_in(), patience, unsafe):
        flags = [] if _time_is_known(submitted / report.student / report.assignment) else [TIME_UNKNOWN]
        yield replace(report, flags=[*report.flags, *flags]), origins.pop((report.student, report.assignment))


def _time_is_known(folder: Path) -> bool:
    try:
        handed_in_at(folder)
    except ValueError:
        return False
    return True


def changed(out: Path, keys: Iterable[tuple[str, str]]) -> list[tuple[str, str]]:
    """Of these results in the output folder `out`, those that are outdated."""
    known = output.origins(out, lost=True)
    return [key for key in keys if key in known and outdated(known[key], key)]


def outdated(origin: Origin, key: tuple[str, str]) -> bool:
    """Whether the suite or the files handed in have changed since a result; files that are gone have not changed."""
    now = current(origin, key)
    there = os.path.lexists(Path(origin.submitted, *key))
    return origin.suite != now.suite or (there and origin.files != now.files)


def current(origin: Origin, key: tuple[str, str]) -> Origin:
    """What a result would be made from now."""
    return Origin(origin.submitted, exercises.pack(key[1]).digest, digest(read(Path(origin.submitted), *key)))


def draw(found: Iterable[tuple[str, str]], seed: int | None) -> dict[tuple[str, str], int]:
    """A seed for each submission: the given one, or a new one."""
    return {key: secrets.randbits(32) if seed is None else seed for key in found}
