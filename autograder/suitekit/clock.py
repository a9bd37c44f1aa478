"""The time left for a submission, and how long a single wait may be."""

import time


class Clock:
    """The time left for a submission, and how long a single wait may be."""

    def __init__(self, limit: float, patience: float = 1.0):
        """All tests together may take `limit` s; `patience` multiplies every single wait, for slow machines."""
        self._end = time.monotonic() + limit
        self.patience = patience

    @property
    def left(self) -> float:
        """Seconds until the end."""
        return self._end - time.monotonic()

    def allow(self, seconds: float) -> float:
        """Return how long (s) to wait for something that should take less than `seconds`."""
        return max(0.05, min(seconds * self.patience, self.left))
