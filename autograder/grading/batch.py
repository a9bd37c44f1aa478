"""Grading a folder of submissions: the reports as they come, and whether a result is still what grading would give."""

import os
import secrets
from collections.abc import Iterable, Iterator
from pathlib import Path

from autograder.records import Report, Submission
from autograder.results.output import Origin
from autograder.submissions import exercises
from autograder.submissions.listing import digest, read


def grade(
    client, submitted: Path, seeds: dict[tuple[str, str], int], patience: float, unsafe: bool
) -> Iterator[tuple[Report, Origin]]:
    """Grade the (student, assignment) pairs in `seeds`, each with its seed; reports come in the order they are done.

    `client` is what `cluster.local` or `cluster.remote` gives; None will do when there is nothing to grade.
    """
    if not seeds:
        return
    from autograder.grading import cluster  # takes a second to load

    origins = {}

    def handed_in() -> Iterator[tuple[Submission, int]]:
        for key, seed in seeds.items():
            found = read(submitted, *key)
            origins[key] = Origin(str(submitted.resolve()), exercises.pack(key[1]).digest, digest(found))
            yield found, seed

    for report in cluster.grade(client, handed_in(), patience, unsafe):
        yield report, origins.pop((report.student, report.assignment))


def outdated(origin: Origin, key: tuple[str, str]) -> bool:
    """Whether a result is by another suite or of other files than there are now; what is gone was not handed in again."""
    now = current(origin, key)
    return origin.suite != now.suite or origin.files != now.files and os.path.lexists(Path(origin.submitted, *key))


def current(origin: Origin, key: tuple[str, str]) -> Origin:
    """What a result would be made from now."""
    return Origin(origin.submitted, exercises.pack(key[1]).digest, digest(read(Path(origin.submitted), *key)))


def draw(found: Iterable[tuple[str, str]], seed: int | None) -> dict[tuple[str, str], int]:
    """A seed for each submission: the given one, or a new one."""
    return {key: secrets.randbits(32) if seed is None else seed for key in found}
