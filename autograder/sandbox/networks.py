"""A network namespace for each ROS domain of a grading, so that no handed-in program can interfere with another's test.

A domain id alone separates only well-behaved programs: any other could join every domain, and a client could answer in
place of a server.  Processes, threads and sockets belong to the network namespace that they are made in: the launcher
enters a domain's network to start a program there, and the judging process has a thread in each, which makes its node
there.
"""

import contextlib
import ctypes
import os
import subprocess
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import TypeVar

CLONE_NEWNET = 0x40000000
# For `ip -batch`: the loopback device of a new network, ready for ROS 2 discovery, which needs multicast.
SET_UP = "link set lo up multicast on\nroute add 224.0.0.0/4 dev lo\n"
_libc = ctypes.CDLL(None, use_errno=True)

Result = TypeVar("Result")


def make(count: int) -> list[int]:
    """New networks, as descriptors; raises OSError.  Only root can make them, on the host or in a user namespace."""
    home = _here()
    made = []
    try:
        for _ in range(count):
            check(_libc.unshare(CLONE_NEWNET))
            made.append(_here())
            _set_up()
    finally:
        check(_libc.setns(home, CLONE_NEWNET))
        os.close(home)
    return made


@contextlib.contextmanager
def inside(network: int) -> Iterator[None]:
    """Move this thread into that network for the duration of the block; raises OSError."""
    home = _here()
    try:
        enter(network)
        try:
            yield
        finally:
            enter(home)
    finally:
        os.close(home)


def enter(network: int) -> None:
    """Move this thread into that network; raises OSError."""
    check(_libc.setns(network, CLONE_NEWNET))


def counter(network: int) -> int:
    """Return an open file that counts what is sent in that network, see `traffic`; raises OSError."""
    with inside(network):
        return os.open("/proc/thread-self/net/dev", os.O_RDONLY | os.O_CLOEXEC)


class Threads:
    """One thread in each network, for a process that will later not be allowed to move between them."""

    def __init__(self, networks: Mapping[int, int]):
        """Start a thread in each of `networks`, descriptors by ROS domain, which are closed here; raises OSError."""
        self._pools = {domain: ThreadPoolExecutor(1) for domain in networks}
        for domain, network in networks.items():
            self.run(domain, partial(enter, network))
            os.close(network)

    @property
    def domains(self) -> list[int]:
        """Return the ROS domains of the networks."""
        return list(self._pools)

    def run(self, domain: int, do: Callable[[], Result]) -> Result:
        """Call `do()` in the domain's network and return its result."""
        return self._pools[domain].submit(do).result()

    def everywhere(self, do: Callable[[], object]) -> None:
        """Call `do` once in each thread."""
        for domain in self._pools:
            self.run(domain, do)


def _set_up() -> None:
    """Prepare the loopback device of this thread's network for ROS 2 discovery, which needs multicast."""
    subprocess.run(["ip", "-batch", "-"], check=True, text=True, input=SET_UP)


def _here() -> int:
    return os.open("/proc/thread-self/ns/net", os.O_RDONLY | os.O_CLOEXEC)


def check(result: int) -> None:
    """Raise OSError unless `result`, of a C function called by ctypes with `use_errno`, is 0."""
    if result:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
