"""The time that a submission may take."""

import time


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
