"""Callbacks of this kernel's nodes that do not return during a wait that is in vain."""

import time
from collections.abc import Mapping
from types import FrameType

from course.explaining.lines_that_wait import of_an_action
from course.session.live_node import LiveNode
from course.session.watch import Handle

LONG = 2.0  # s in one callback, after which the reader is told
LOOK = 0.3  # s between two looks


class LongCallbacks:
    """The callbacks in which one wait finds the nodes in `handles`."""

    def __init__(self, handles: Mapping[str, Handle]):
        self._handles = handles
        self._looked = 0.0
        self._seen: list[tuple[FrameType, float]] = []  # each, and when it was seen first

    def look(self) -> None:
        """Note the callbacks; to be called again and again."""
        if (now := time.monotonic()) - self._looked < LOOK:
            return
        self._looked = now
        frames = [frame for node in self._nodes() for frame, _ in node.callbacks()]
        kept = [(frame, since) for frame, since in self._seen if any(frame is each for each in frames)]
        self._seen = kept + [(each, now) for each in frames if all(each is not frame for frame, _ in kept)]

    def told(self, service: str = "") -> list[str]:
        """Return where each node is that has been in one callback for `LONG` s.

        Without the nodes that serve `service`, of which the reader learns in another way, and those of a public check.
        """
        now, found = time.monotonic(), []
        for node in self._nodes():
            for frame, at in node.callbacks():
                lasted = next((now - since for known, since in self._seen if known is frame), 0.0)
                if lasted >= LONG and service not in node.services:
                    head = f"'{node.name}' is in a callback that has not returned for {lasted:.0f} s:"
                    found.append("\n".join([head, *map(str, at), *of_an_action(at)]))
        return found

    def _nodes(self) -> list[LiveNode]:
        return [each for each in list(self._handles.values()) if isinstance(each, LiveNode) and not each.of_check]
