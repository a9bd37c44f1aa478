"""The line of those who wait for their server: a few are started at a time, in the order of coming.

Thirty that start at once on two processors are all there after a minute; one after the other, the first is there after
two seconds, and the last no later.
"""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager


class Line:
    """The turns of those who wait."""

    def __init__(self, places: int):
        """At most so many have their turn at a time."""
        self._places = places
        self._turns: dict[object, asyncio.Event] = {}  # in the order of coming

    def before(self, who: object) -> int:
        """Return how many are before somebody and have not left; 0 for who does not stand in line."""
        return [*self._turns].index(who) if who in self._turns else 0

    @asynccontextmanager
    async def turn(self, who: object) -> AsyncIterator[None]:
        """Wait for somebody's turn, which lasts until the block has ended."""
        turn = self._turns[who] = asyncio.Event()
        try:
            self._tell()
            await turn.wait()
            yield
        finally:
            del self._turns[who]
            self._tell()

    def _tell(self) -> None:
        for turn in [*self._turns.values()][: self._places]:
            turn.set()
