"""Every error that this package raises on purpose, in one tree.

AutograderError
    UsageError              the command cannot be carried out as given: one line for the person, exit status 2
        UnknownExercise     no exercise has that name
        BrokenExercise      the exercise is there, but cannot be read
        Leak                the student version would show an answer or a hidden test
        CannotExport        the grades cannot be exported as asked
        NotGradedHere       a notebook has no report of this grader
    RefusedFile             a handed-in file was refused: the message is for the student
    UnknownTime             the time of a hand-in is not known
    Unplaced                a hand-in cannot be placed, or a page cannot be returned: it is named, and left alone
    ClassroomError          the class's server cannot be set up, started or ended: one line, exit status 3
    SandboxUnavailable      this machine cannot confine a program: one line with what to do, exit status 2
    InfrastructureError     the grader itself failed: there is no verdict, exit status 3
        JudgeDied           the judging process died or had to be ended
        SandboxError        a program could not be started in the sandbox
        ClusterError        the workers cannot be reached, or are lost
            WorkerLost      one worker is gone: its submission is graded again
    Fault                   the student's program is at fault: a hidden test's verdict
        Wrong, Crashed, TimedOut
"""

from collections.abc import Sequence
from typing import ClassVar

from autograder.records import CRASHED, FAILED, TIMED_OUT, Verdict


class AutograderError(Exception):
    """The base of the errors that this package raises on purpose."""


class UsageError(AutograderError):
    """The command cannot be carried out as given; the message is one line for the person who gave it."""


class UnknownExercise(UsageError):
    """There is no exercise, and so no hidden suite, of that name."""


class BrokenExercise(UsageError):
    """The exercise is there, but cannot be read; the message says where."""


class Leak(UsageError):
    """The student version of a notebook would show an answer or a hidden test."""


class CannotExport(UsageError):
    """The grades cannot be exported as asked."""


class NotGradedHere(UsageError):
    """A notebook has no report of this grader, so no page can be made."""


class RefusedFile(AutograderError, ValueError):
    """A handed-in file was refused; the message is for the student."""


class UnknownTime(AutograderError, ValueError):
    """The time of a hand-in is not known; the message says why."""


class Unplaced(AutograderError):
    """A hand-in cannot be placed among the submissions, or a page cannot be returned; the message briefly says why."""


class ClassroomError(AutograderError):
    """The class's server cannot be set up, started or ended; the message is one line for whoever ran the command."""


class SandboxUnavailable(AutograderError):
    """This machine cannot confine a program; the message says why and what to do."""


class InfrastructureError(AutograderError):
    """The grader itself failed: there is no verdict on the submission."""

    def __init__(self, message: str, verdicts: Sequence[Verdict] = (), busy: float = 0.0):
        """`verdicts` are those that had been given before; `busy` is that of `records.Ended`."""
        super().__init__(message)
        self.verdicts, self.busy = verdicts, busy


class JudgeDied(InfrastructureError):
    """The judging process died or had to be ended."""

    def __init__(self, message: str, verdicts: list[Verdict], suspects: list[str], busy: float):
        """`verdicts` are those that it had given; `suspects` and `busy` are those of `records.Ended`."""
        super().__init__(message, verdicts, busy)
        self.suspects = suspects


class SandboxError(InfrastructureError):
    """The sandbox itself failed, not the student's program."""


class ClusterError(InfrastructureError):
    """The cluster cannot be used, or is lost; the message says what to do."""


class WorkerLost(ClusterError):
    """A grading was broken off: its worker has died or cannot be reached."""


class Fault(AutograderError):
    """The student's program is at fault; `message` is for the student, `detail` for the instructor."""

    outcome: ClassVar[str] = FAILED

    def __init__(self, message: str, detail: object = "", certain: bool = False):
        """`certain` means that a busy machine cannot have caused it."""
        super().__init__(message)
        self.message = message
        self.detail = str(detail)
        self.certain = certain


class Wrong(Fault):
    """The program did something other than the task asks for."""


class Crashed(Fault):
    """The program died."""

    outcome = CRASHED


class TimedOut(Fault):
    """The program did not answer in time."""

    outcome = TIMED_OUT
