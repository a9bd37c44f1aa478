"""The time left for a submission, and the limits of single waits."""

import time


class Clock:
    """The time left for a submission, and the limits of single waits."""

    def __init__(self, limit: float, patience: float = 1.0):
        """Start; all tests together may take `limit` s; `patience` multiplies every single wait, for slow machines."""
        self._end = time.monotonic() + limit
        self.patience = patience

    @property
    def left(self) -> float:
        """Return the seconds that are left."""
        return self._end - time.monotonic()

    def allow(self, seconds: float) -> float:
        """Return the time limit (s) for something that should take less than `seconds`."""
        return max(0.05, min(seconds * self.patience, self.left))
