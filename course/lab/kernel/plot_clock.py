"""The plot's clock: it follows the simulation while a world of this kernel runs, otherwise the wall clock.

A world may run faster or slower than real time.  Over its own time, the slope of a position is the speed.  While a
world is paused, the clock stands still.
"""

import threading
import time
import weakref
from typing import Any

from course.world.node import World, latest


class PlotClock:
    """A clock that never goes back; it begins with the time of day."""

    def __init__(self) -> None:
        """Begin now."""
        self._lock = threading.Lock()
        self._id = time.time_ns()
        self._world: weakref.ReferenceType[World] | None = None  # the one that it follows
        self._at = time.time()  # s since 1970, when the last change between world and wall clock was seen
        self._from = time.monotonic()  # s of the world's time, or of time.monotonic, at that change
        self._last = self._at

    def now(self) -> float:
        """Return the time, in s."""
        with self._lock:
            world = self._world() if self._world else None
            if world or not self._world:
                self._last = self._at + (world.elapsed if world else time.monotonic()) - self._from
            present = latest()
            if present is not None and not (present.simulates or present.paused):
                present = None
            if present is not world or (self._world and not world):
                self._world = weakref.ref(present) if present else None
                self._at, self._from = self._last, present.elapsed if present else time.monotonic()
            return self._last

    def told(self) -> dict[str, Any]:
        """Return the time for a page: `now` (s), `rate` (s per s), and whether it is simulated.

        `id` differs between the clocks of two kernels, which do not agree.
        """
        now, world = self.now(), self._world() if self._world else None
        rate = (0.0 if world.paused else world.speed) if world else 1.0
        return {"id": str(self._id), "now": round(now, 3), "rate": rate, "simulated": world is not None}


CLOCK = PlotClock()  # the kernel's
