"""Regrading after a change to a hidden suite, or a new hand-in: the new scores are first shown, then written.

New results are first kept in `OUTPUT/regrade`, so that showing and then writing them grades only once, and an
interrupted regrading can go on.
"""

import os
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from autograder.errors import UsageError
from autograder.grading import batch
from autograder.grading.dispatch import Pool
from autograder.records import INFRASTRUCTURE_ERROR, Report
from autograder.results import text
from autograder.results.output import Basis, Output, bases
from autograder.submissions import exercises, listing

PENDING = "regrade"


@dataclass(frozen=True)
class Move:
    """A submission's result before and after."""

    old: Report
    new: Report
    why: list[str]  # the differences: tests with another outcome, new or removed tests, other files

    @property
    def moved(self) -> bool:
        """Return True if the score has changed."""
        old, new = self.old, self.new
        return (old.status, old.score, old.max_score) != (new.status, new.score, new.max_score)

    def describe(self) -> str:
        """Return the change as text for a terminal."""
        who = text.one_line(f"{self.old.student}/{self.old.assignment}")
        head = f"{who}: {text.score(self.old)} -> {text.score(self.new)}"
        return "\n".join([head, *(f"    {reason}" for reason in self.why)])


class Regrading:
    """The submissions of an open output folder to grade again, and the new results so far.

    A context manager: new results that are not applied are kept for the next regrading.
    """

    def __init__(self, results: Output, assignment: str | None, students: list[str], everything: bool):
        """Choose the results whose suite or files have changed; with `everything`, all results.

        Raises UsageError when the origin of the results is unknown or a submission is gone, and UnknownExercise.
        """
        self.results = results
        asked = _asked(results, assignment, students)
        self.bases = {key: basis for key, basis in asked.items() if everything or batch.outdated(basis, key)}
        self._asked = asked
        self.pending = Output(results.folder / PENDING, resume=True)
        self._fresh = bases(self.pending.folder)
        for key, basis in self.bases.items():
            if not os.path.lexists(Path(basis.submitted, *key)):
                raise UsageError(f"{'/'.join(key)} is no longer in {basis.submitted}: its result would be lost")
        self.waiting = {key for key in self.bases if not self._is_pending(key)}

    def __enter__(self) -> "Regrading":
        return self

    def __exit__(self, *exception: object) -> None:
        self.pending.__exit__(*exception)

    def run(self, pool: Pool) -> Iterator[Report]:
        """Grade the chosen submissions; yield the reports as they come.

        Unchanged files keep their seed.  Changed ones get a new seed, because a student who has seen the last inputs
        could have hard-coded the answers.
        """
        for folder in {self.bases[key].submitted for key in self.waiting}:
            keys = [key for key in sorted(self.waiting) if self.bases[key].submitted == folder]
            same = {key for key in keys if batch.current(self.bases[key], key).files == self.bases[key].files}
            seeds = batch.draw(keys, None) | {key: self.results.done[key].seed for key in same}
            for report, basis in batch.run(pool, Path(folder), seeds):
                self.pending.write(report, basis)
                self._fresh[report.student, report.assignment] = basis
                yield report

    def moves(self) -> list[Move]:
        """Return the results before and after, for all submissions graded again."""
        return [Move(self.results.done[key], self.pending.done[key], self._why(key)) for key in sorted(self.bases)]

    @property
    def folders(self) -> list[Path]:
        """Return the folders of the submissions, each to be applied."""
        return sorted({Path(basis.submitted) for basis in self._asked.values()})

    def apply(self, submitted: Path, enter: Callable[[Report], object]) -> None:
        """Replace the old results of a folder, moving them to the history, and `enter` each into the gradebook.

        So are those that were not graded again: a written answer or the time of handing in may have changed.
        """
        for key, basis in sorted(self._asked.items()):
            if Path(basis.submitted) != submitted or not listing.is_handed_in(submitted, *key):
                continue
            if key in self.bases and self.pending.done[key].status != INFRASTRUCTURE_ERROR:
                self.results.write(self.pending.done[key], self._fresh[key])
            enter(self.results.done[key])

    def forget(self) -> None:
        """Remove the new results that were kept until they are applied."""
        shutil.rmtree(self.pending.folder)

    def _is_pending(self, key: tuple[str, str]) -> bool:
        """Return True if there is a new result that is not itself outdated by a later change."""
        return (
            key in self.pending.done
            and self.pending.done[key].status != INFRASTRUCTURE_ERROR
            and self._fresh[key] == batch.current(self.bases[key], key)
        )

    def _why(self, key: tuple[str, str]) -> list[str]:
        old, new = self.results.done[key], self.pending.done[key]
        before = {test.id: test for test in old.tests}
        why = [] if self._fresh[key].files == self.bases[key].files else ["other files were handed in since"]
        for test in new.tests:
            was = before.pop(test.id, None)
            said = f" ({test.message})" if test.message and not (was and was.message == test.message) else ""
            if was is None:
                why.append(f"new: {test.title}: {test.outcome}, {test.points:g} of {test.max_points:g}{said}")
            elif (was.outcome, was.points) != (test.outcome, test.points):
                why.append(f"{test.title}: {was.outcome}, {was.points:g} -> {test.outcome}, {test.points:g}{said}")
        return why + [f"removed: {test.title}: {test.outcome}, {test.points:g}" for test in before.values()]


def _asked(results: Output, assignment: str | None, students: list[str]) -> dict[tuple[str, str], Basis]:
    """Return the results of an exercise, or all, and of some students, or all, each with what it was made from."""
    name = assignment and exercises.load(assignment).name
    known = bases(results.folder)
    if missing := sorted(results.done.keys() - known.keys()):
        raise UsageError(f"the files of the result of {'/'.join(missing[0])} are unknown: grade it with --resume first")
    if absent := {*students} - {student for student, _ in results.done}:
        raise UsageError(f"no result of student {min(absent)!r} in {results.folder}")
    return {
        key: basis
        for key, basis in known.items()
        if key in results.done and name in (None, key[1]) and (not students or key[0] in students)
    }
