"""Grading on this machine: a thread for each submission, which waits for the worker process that grades it.

These threads run and parse nothing that a student has handed in, see `worker` and `launcher`.
"""

import threading
from collections.abc import Mapping
from concurrent.futures import Future

from autograder.grading import admission, single
from autograder.grading.dispatch import Grading, Task
from autograder.records import Report
from autograder.sandbox.sandbox import choose
from autograder.submissions import exercises

ADDRESS = "here"


class ThisMachine:
    """Up to `jobs` gradings at once, as a `dispatch.Pool`.

    Gradings that are unfinished when this process ends are broken off: a worker ends with its coordinator.
    """

    def __init__(self, jobs: int, patience: float, unsafe: bool):
        """Start with no gradings; raises SandboxUnavailable when programs cannot be confined here."""
        self._jobs, self._patience = jobs, patience
        self._box = choose(unsafe)

    def workers(self) -> Mapping[str, int]:
        """Return how many submissions can be graded at once."""
        return {ADDRESS: self._jobs}

    def send(self, task: Task) -> "Future[Report]":
        """Grade the task in a new thread."""
        grading: Future[Report] = Future()
        exercise = exercises.unpack(exercises.pack(task.submission.assignment))
        # A daemon thread: the process can end after Ctrl-C without waiting for it.
        threading.Thread(target=self._grade, args=(task, exercise, grading), daemon=True).start()
        return grading

    def report(self, grading: Grading) -> Report:
        """Return the report of an ended grading; raises what the grading raised."""
        assert isinstance(grading, Future)
        return grading.result()

    def cancel(self, gradings: list[Grading]) -> None:
        """Do nothing: the gradings end with this process."""

    def _grade(self, task: Task, exercise: exercises.Exercise, grading: "Future[Report]") -> None:
        try:
            with admission.turn(exercise.name):
                report = single.grade(task.submission, self._box, task.seed, self._patience, exercise)
        except BaseException as error:
            grading.set_exception(error)
        else:
            grading.set_result(report)
