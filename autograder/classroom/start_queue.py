"""The queue of members who wait for their server: a few are started at a time, first come, first served.

Thirty servers that start at once on two cores are all ready after a minute; one after the other, the first is ready
after two seconds, and the last no later than before.
"""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager


class StartQueue:
    """A queue in which a limited number have their turn at a time."""

    def __init__(self, places: int):
        """Let at most `places` have their turn at a time."""
        self._places = places
        self._turns: dict[object, asyncio.Event] = {}  # in order of arrival

    def ahead_of(self, who: object) -> int:
        """Return how many are ahead of `who` in the queue; 0 if `who` is not in it."""
        return [*self._turns].index(who) if who in self._turns else 0

    @asynccontextmanager
    async def turn(self, who: object) -> AsyncIterator[None]:
        """Wait for the turn of `who`, which lasts until the block has ended."""
        turn = self._turns[who] = asyncio.Event()
        try:
            self._begin_turns()
            await turn.wait()
            yield
        finally:
            del self._turns[who]
            self._begin_turns()

    def _begin_turns(self) -> None:
        for turn in [*self._turns.values()][: self._places]:
            turn.set()
