"""A network namespace for each ROS domain of a grading, so that no handed-in program can interfere with another's test.

A domain id alone separates only well-behaved programs: any other could join every domain, and a client could answer in
place of a server.  Processes, threads and sockets belong to the network namespace that they are made in: the launcher
enters a domain's network to start a program there, and the judging process has a thread in each, which makes its node
there.
"""

import contextlib
import ctypes
import fcntl
import os
import socket
import struct
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import TypeVar

CLONE_NEWNET = 0x40000000
# For `ip -batch`: the loopback device of a new network, ready for ROS 2 discovery, which needs multicast.
SET_UP = "link set lo up multicast on\nroute add 224.0.0.0/4 dev lo\n"
READ_FLAGS, SET_FLAGS, ADD_ROUTE = 0x8913, 0x8914, 0x890B  # SIOCGIFFLAGS, SIOCSIFFLAGS, SIOCADDRT; see netdevice(7)
UP, MULTICAST = 0x1, 0x1000  # a device's IFF_UP and IFF_MULTICAST, a route's RTF_UP
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


class _Route(ctypes.Structure):
    """A route, as struct rtentry of linux/route.h."""

    _fields_ = (
        ("pad1", ctypes.c_ulong),
        ("destination", ctypes.c_ubyte * 16),
        ("gateway", ctypes.c_ubyte * 16),
        ("mask", ctypes.c_ubyte * 16),
        ("flags", ctypes.c_ushort),
        ("pad2", ctypes.c_short),
        ("pad3", ctypes.c_ulong),
        ("pad4", ctypes.c_void_p),
        ("metric", ctypes.c_short),
        ("device", ctypes.c_char_p),
        ("mtu", ctypes.c_ulong),
        ("window", ctypes.c_ulong),
        ("round_trip_time", ctypes.c_ushort),
    )


def _set_up() -> None:
    """Do SET_UP in this thread's network, without a program: a worker has many networks."""
    nowhere, multicast, mask = (
        struct.pack("H2x4s8x", socket.AF_INET, socket.inet_aton(address))
        for address in ("0.0.0.0", "224.0.0.0", "240.0.0.0")
    )
    route = _Route(destination=(*multicast,), gateway=(*nowhere,), mask=(*mask,), flags=UP, device=b"lo")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as of_network:
        known = fcntl.ioctl(of_network, READ_FLAGS, struct.pack("16s24x", b"lo"))
        flags = struct.unpack_from("H", known, 16)[0] | UP | MULTICAST
        fcntl.ioctl(of_network, SET_FLAGS, struct.pack("16sH22x", b"lo", flags))
        fcntl.ioctl(of_network, ADD_ROUTE, bytes(route))


def _here() -> int:
    return os.open("/proc/thread-self/ns/net", os.O_RDONLY | os.O_CLOEXEC)


def check(result: int) -> None:
    """Raise OSError unless `result`, of a C function called by ctypes with `use_errno`, is 0."""
    if result:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
