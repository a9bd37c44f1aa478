"""What a hidden test can hold against a student's program, and the time that it may take."""

import time

from .records import CRASHED, FAILED, TIMED_OUT


class Fault(Exception):
    """The student's program is at fault; `message` is for the student, `detail` for the instructor."""

    outcome = FAILED

    def __init__(self, message: str, detail: object = ""):
        super().__init__(message)
        self.message = message
        self.detail = str(detail)


class Wrong(Fault):
    """It did something else than the task says."""


class Crashed(Fault):
    """It died."""

    outcome = CRASHED


class TimedOut(Fault):
    """It did not answer."""

    outcome = TIMED_OUT


class Clock:
    """The time that a submission may take, and how long a single wait may be."""

    def __init__(self, limit: float, patience: float = 1.0):
        """`limit` s for all tests together; `patience` stretches every single wait, for slow machines."""
        self._end = time.monotonic() + limit
        self.patience = patience

    @property
    def left(self) -> float:
        """Seconds until the end."""
        return self._end - time.monotonic()

    def allow(self, seconds: float) -> float:
        """How long a wait that should take less than `seconds` may be."""
        return max(0.05, min(seconds * self.patience, self.left))
