"""Counting what is sent in the networks of a grading: no program may send more than the judging process can hold."""

import os
import time
from collections.abc import Iterable, Mapping

MOST = 48 << 20  # bytes sent at once in one network, far more than any right answer sends in its whole life
SUSPICIOUS = 12 << 20  # bytes sent at once, of which the judging process may have died
DRAINED = 16 << 20  # bytes a second that are no burden: what is sent all the time is read all the time
COUNTED = "counting what is sent to several programs, or again, each time"
WHY = f"it sent more than {MOST >> 20} MiB at once to other programs, {COUNTED}; send only what the task asks for"


class Traffic:
    """The bytes sent in some networks and not yet forgotten; call `look` every 0.1 s, for those where programs run."""

    def __init__(self, counters: Mapping[int, int]):
        """Begin; `counters` are open files /proc/net/dev, by ROS domain, see `networks.counter`."""
        self._counters = counters
        self._seen = {domain: _received(counter) for domain, counter in counters.items()}
        self._held = dict.fromkeys(counters, 0.0)
        self._peaks = dict.fromkeys(counters, 0.0)
        self._last = dict.fromkeys(counters, time.monotonic())

    def look(self, domains: Iterable[int]) -> list[int]:
        """Return those of `domains` in which more than MOST was sent at once, until now."""
        now, looked = time.monotonic(), self._counters.keys() & {*domains}
        for domain in looked:
            drained, self._last[domain] = DRAINED * (now - self._last[domain]), now
            seen, self._seen[domain] = self._seen[domain], _received(self._counters[domain])
            self._held[domain] = max(0.0, self._held[domain] - drained) + self._seen[domain] - seen
            self._peaks[domain] = max(self._peaks[domain], self._held[domain])
        return [domain for domain in looked if self._held[domain] > MOST]

    @property
    def suspicious(self) -> list[int]:
        """Return the domains in which more than SUSPICIOUS was ever sent at once."""
        return [domain for domain, peak in self._peaks.items() if peak > SUSPICIOUS]


def _received(counter: int) -> int:
    """Return the bytes ever received on the loopback device, which are those sent on it (proc(5), /proc/net/dev)."""
    for line in os.pread(counter, 1 << 16, 0).decode().splitlines():
        device, _, numbers = line.partition(":")
        if device.strip() == "lo":
            return int(numbers.split()[0])
    return 0
