"""Grading again what a change to a hidden suite, or a new hand-in, touches: who moves is shown before a result is replaced.

The new results are first kept in `OUTPUT/regrade`, so that looking and writing cost one grading, and a regrading that was
killed goes on.
"""

import os
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from autograder.errors import UsageError
from autograder.grading import batch
from autograder.records import INFRASTRUCTURE_ERROR, Report
from autograder.results.output import Output, origins
from autograder.submissions import exercises

PENDING = "regrade"


@dataclass(frozen=True)
class Move:
    """A submission's result before and after."""

    old: Report
    new: Report
    why: list[str]  # the tests that end differently

    @property
    def moved(self) -> bool:
        """Whether the score is another one."""
        old, new = self.old, self.new
        return (old.status, old.score, old.max_score) != (new.status, new.score, new.max_score)


class Regrading:
    """What is to be graded again in an output folder that is open, and the new results so far.

    A context: the new results that are not applied are kept for the next regrading.
    """

    def __init__(self, results: Output, assignment: str | None, students: list[str], everything: bool):
        """With `everything`, results by the suite and of the files as they are, are graded again too.

        Raises UsageError when it is not known where the results are from, or a submission is no longer there, and
        UnknownExercise.
        """
        name = assignment and exercises.load(assignment).name
        known = origins(results.folder)
        if missing := sorted(results.done.keys() - known.keys()):
            raise UsageError(
                f"it is not known what {'/'.join(missing[0])} was graded from: grade it with --resume first"
            )
        if absent := {*students} - {student for student, _ in results.done}:
            raise UsageError(f"no result of student {min(absent)!r} in {results.folder}")
        self.results = results
        self.pending = Output(results.folder / PENDING, resume=True)
        self._fresh = origins(self.pending.folder)
        self.origins = {
            key: origin
            for key, origin in known.items()
            if key in results.done
            and name in (None, key[1])
            and (not students or key[0] in students)
            and (everything or batch.outdated(origin, key))
        }
        for key, origin in self.origins.items():
            if not os.path.lexists(Path(origin.submitted, *key)):
                raise UsageError(f"{'/'.join(key)} is no longer in {origin.submitted}: its result would be lost")
        # A pending result counts as long as neither the suite nor what was handed in has changed again.
        self.waiting = {
            key
            for key in self.origins
            if not (
                key in self.pending.done
                and self.pending.done[key].status != INFRASTRUCTURE_ERROR
                and self._fresh[key] == batch.current(self.origins[key], key)
            )
        }

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        self.pending.__exit__(*exception)

    def grade(self, client, patience: float, unsafe: bool) -> Iterator[Report]:
        """Grade what waits, with the seed that it had; the reports as they come."""
        for folder in {self.origins[key].submitted for key in self.waiting}:
            seeds = {
                key: self.results.done[key].seed
                for key in sorted(self.waiting)
                if self.origins[key].submitted == folder
            }
            for report, origin in batch.grade(client, Path(folder), seeds, patience, unsafe):
                self.pending.write(report, origin)
                self._fresh[report.student, report.assignment] = origin
                yield report

    def moves(self) -> list[Move]:
        """Before and after of all that were graded again."""
        return [Move(self.results.done[key], self.pending.done[key], self._why(key)) for key in sorted(self.origins)]

    def apply(self, scores) -> None:
        """Put the new results in the place of the old ones, which go to the history; `scores`: the gradebook, or None."""
        for key in sorted(self.origins):
            if self.pending.done[key].status != INFRASTRUCTURE_ERROR:
                self.results.write(self.pending.done[key], self._fresh[key])
                if scores:
                    scores.write(self.pending.done[key])
        shutil.rmtree(self.pending.folder)

    def _why(self, key: tuple[str, str]) -> list[str]:
        old, new = self.results.done[key], self.pending.done[key]
        before = {test.id: test for test in old.tests}
        why = [] if self._fresh[key].files == self.origins[key].files else ["other files were handed in since"]
        for test in new.tests:
            was = before.pop(test.id, None)
            said = f" ({test.message})" if test.message and not (was and was.message == test.message) else ""
            if was is None:
                why.append(f"new: {test.title}: {test.outcome}, {test.points:g} of {test.max_points:g}{said}")
            elif (was.outcome, was.points) != (test.outcome, test.points):
                why.append(f"{test.title}: {was.outcome}, {was.points:g} -> {test.outcome}, {test.points:g}{said}")
        return why + [f"gone: {test.title}: {test.outcome}, {test.points:g}" for test in before.values()]
