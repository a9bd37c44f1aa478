"""A network of its own for each ROS domain of a grading, so that no handed-in program can speak into another's test.

A domain number alone keeps apart only programs that behave well: any other could join every domain, and a client could
answer in the place of a server.  The worker's thread steps into a domain's network to start a program or to make a node
there: processes, threads and sockets belong to the network that they are made in.
"""

import contextlib
import ctypes
import os
import subprocess
from collections.abc import Iterator

CLONE_NEWNET = 0x40000000
_libc = ctypes.CDLL(None, use_errno=True)


def set_up() -> None:
    """Prepare the loopback device of this thread's network for ROS 2 discovery, which needs multicast."""
    subprocess.run(
        ["ip", "-batch", "-"],
        check=True,
        text=True,
        input="link set lo up multicast on\nroute add 224.0.0.0/4 dev lo\n",
    )


class Networks:
    """The networks, by domain.  Only root can make them, on the host or in a user namespace."""

    def __init__(self) -> None:
        self._home = _here()
        self._by_domain: dict[int, int] = {}

    @contextlib.contextmanager
    def inside(self, domain: int) -> Iterator[None]:
        """This thread is in the domain's network meanwhile; raises OSError."""
        known = self._by_domain.get(domain)
        _check(_libc.unshare(CLONE_NEWNET) if known is None else _libc.setns(known, CLONE_NEWNET))
        try:
            if known is None:
                self._by_domain[domain] = _here()
                set_up()
            yield
        finally:
            _check(_libc.setns(self._home, CLONE_NEWNET))


def _here() -> int:
    return os.open("/proc/thread-self/ns/net", os.O_RDONLY | os.O_CLOEXEC)


def _check(result: int) -> None:
    if result:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
