"""A way round a fault of Fast DDS 2.14: now and then, a process that leaves its ROS domain hangs for good.

rmw_fastrtps takes the listener away from a participant before it destroys it, without a limit of time.  Fast DDS adds
that limit to the present time, which overflows, so the wait for a callback that runs at this moment fails at once, each
time, and keeps the mutex which the callback needs.  That happens when others enter or leave the domain meanwhile:
about once in two thousand times with four busy processes.
"""

import contextlib
import ctypes
import os

LIBRARY = "libfastrtps.so.2.14"
PARTICIPANT, FACTORY = (
    f"8eprosima7fastdds3dds{name}" for name in ("17DomainParticipant", "24DomainParticipantFactory")
)
SET_LISTENER = (
    f"_ZN{PARTICIPANT}12set_listenerEPNS1_25DomainParticipantListenerENSt6chrono8durationIlSt5ratioILl1ELl1EEEE"
)
LIMIT = 2  # s to wait for a callback that runs


class Participants(ctypes.Structure):
    """A std::vector of pointers to participants."""

    _fields_ = (("first", ctypes.POINTER(ctypes.c_void_p)), ("end", ctypes.c_void_p), ("capacity", ctypes.c_void_p))


def ignore_discovery(domain: int) -> bool:
    """Tell this process nothing more of the others in `domain`, before its last node there is destroyed.

    Returns whether that is so: not with another middleware or another version of Fast DDS, and not if this process has
    several participants in the domain, of which only one may be about to go.
    """
    with contextlib.suppress(OSError, AttributeError):
        fast_dds = ctypes.CDLL(LIBRARY, mode=os.RTLD_NOLOAD | os.RTLD_LAZY)
        factory, look_up, set_listener = (
            fast_dds[name]
            for name in (f"_ZN{FACTORY}12get_instanceEv", f"_ZNK{FACTORY}19lookup_participantsEj", SET_LISTENER)
        )
        factory.restype = ctypes.c_void_p
        look_up.restype, look_up.argtypes = Participants, (ctypes.c_void_p, ctypes.c_uint32)
        set_listener.argtypes = (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64)
        found = look_up(factory(), domain)
        if (found.end or 0) - (ctypes.cast(found.first, ctypes.c_void_p).value or 0) == ctypes.sizeof(ctypes.c_void_p):
            return set_listener(found.first[0], None, LIMIT) == 0
    return False
