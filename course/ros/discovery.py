"""The DDS participants of this host: how many there are, and having them announce themselves at once.

Fast DDS answers the first announcement of a new participant with its own, within a millisecond.  Half the time that is
too early: the new participant does not listen yet, and without the course's profile the next announcement comes three
seconds later.  So the command asks a second time, once it listens: it announces a participant that does not exist, with
its own address (RTPS 2.5, 8.5.3 and 9.6.3).
"""

import contextlib
import os
import socket
import struct
from collections.abc import Iterable
from typing import NamedTuple

COUNTABLE = range(101)  # domains; from 101 on, Linux also gives their ports to other programs
LOOPBACK = "127.0.0.1"
LEASE = 1  # s until the others drop the participant that does not exist
VENDOR = bytes([1, 15])  # eProsima Fast DDS
VERSION = bytes([2, 3])  # of the RTPS protocol
# Identifiers of the specification: entities, parameters, and the two ends of participant discovery.
PARTICIPANT, WRITER, READER = (bytes.fromhex(identifier) for identifier in ("000001c1", "000100c2", "000100c7"))
PID_SENTINEL, PID_LEASE, PID_VERSION, PID_VENDOR, PID_GUID = 0x01, 0x02, 0x15, 0x16, 0x50
PID_DEFAULT_UNICAST, PID_METATRAFFIC_UNICAST, PID_BUILTIN_ENDPOINTS = 0x31, 0x32, 0x58
ANNOUNCES_AND_DETECTS = 0b11
DATA, LITTLE_ENDIAN_WITH_DATA = 0x15, 0b101


class Port(NamedTuple):
    """A UDP port on which a participant of this host (or network namespace) listens, and its socket's inode."""

    number: int
    inode: str


def ports(domain: int, tables: tuple[str, ...] = ("udp", "udp6")) -> list[Port]:
    """Return a port for each participant of `domain` on this host (RTPS 2.5, 9.6.2.3); none outside COUNTABLE."""
    if domain not in COUNTABLE:
        return []
    first = 7400 + 250 * domain
    found: dict[int, Port] = {}
    for table in tables:
        with contextlib.suppress(OSError), open(f"/proc/net/{table}") as file:
            for words in map(str.split, file.readlines()[1:]):
                number = int(words[1].rpartition(":")[2], 16)
                if number in range(first + 10, first + 250, 2):
                    found.setdefault(number, Port(number, words[9]))
    return list(found.values())


def participants_here(domain: int) -> int:
    """Return how many DDS participants of `domain` this host (or network namespace) has: it counts their UDP ports."""
    return len(ports(domain))


def ask_participants(domain: int) -> None:
    """Have the other participants of `domain` on this host announce themselves to this process's participant.

    Does nothing if this process has none, and never raises.
    """
    sockets = set()
    with contextlib.suppress(OSError):
        for descriptor in os.listdir("/proc/self/fd"):
            with contextlib.suppress(OSError):  # the port was closed meanwhile
                sockets.add(os.readlink(f"/proc/self/fd/{descriptor}"))
    listening = ports(domain, ("udp",))
    own = [port.number for port in listening if f"socket:[{port.inode}]" in sockets]
    if not own:
        return
    message = announcement(own[0])
    with contextlib.suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for port in listening:
            if port.number not in own:
                sender.sendto(message, (LOOPBACK, port.number))


def is_of_process(endpoint_gid: Iterable[int], pid: int) -> bool:
    """Return True if an endpoint of this host belongs to process `pid`, or to one whose id has the same low 16 bits.

    Fast DDS 2.14 puts the low 16 bits of the process id into the id of its participant (`GuidPrefix_t`).
    """
    return mark_in(endpoint_gid) == mark(pid)


def mark(pid: int) -> int:
    """Return what an endpoint's id tells of its process's id."""
    return pid & 0xFFFF


def mark_in(endpoint_gid: Iterable[int]) -> int:
    """Return the mark of an endpoint's process; 0 in an empty id."""
    return int.from_bytes(bytes(endpoint_gid)[4:6], "little")


def announcement(port: int) -> bytes:
    """Return the RTPS message that announces a new participant listening on a local UDP port."""
    prefix = VENDOR + os.urandom(10)
    address = struct.pack("<iI12x4s", 1, port, socket.inet_aton(LOOPBACK))
    parameters = (
        (PID_VERSION, VERSION + bytes(2)),
        (PID_VENDOR, VENDOR + bytes(2)),
        (PID_GUID, prefix + PARTICIPANT),
        (PID_METATRAFFIC_UNICAST, address),
        (PID_DEFAULT_UNICAST, address),
        (PID_LEASE, struct.pack("<iI", LEASE, 0)),
        (PID_BUILTIN_ENDPOINTS, struct.pack("<I", ANNOUNCES_AND_DETECTS)),
        (PID_SENTINEL, b""),
    )
    listed = b"".join(struct.pack("<HH", kind, len(value)) + value for kind, value in parameters)
    sample = struct.pack("<HH4s4siI", 0, 16, READER, WRITER, 0, 1) + bytes([0, 3, 0, 0]) + listed
    return (
        b"RTPS" + VERSION + VENDOR + prefix + struct.pack("<BBH", DATA, LITTLE_ENDIAN_WITH_DATA, len(sample)) + sample
    )
