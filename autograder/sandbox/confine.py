"""Confining the calling process for good: its user, capabilities, limits, and the filter of system calls.

The judging process does this before it receives anything from a student's program, and so does a forked program
(`forkserver`).  Their view of the file system was set before, by bubblewrap (`view`).
"""

import ctypes
import os
import resource
import struct
from collections.abc import Callable, Mapping

from autograder.sandbox import seccomp
from autograder.sandbox.networks import check

PR_CAPBSET_DROP, PR_SET_NO_NEW_PRIVS = 24, 38  # prctl(2)
CAP_LAST = 63
CAPABILITIES_V3 = 0x20080522  # capset(2)
SET_MODE_FILTER, ALL_THREADS = 1, 1  # seccomp(2)
SECCOMP_CALL = {"x86_64": 317, "aarch64": 277}

_libc = ctypes.CDLL(None, use_errno=True)


def confine(
    user: int | None,
    limits: Mapping[str, int],
    everywhere: Callable[[Callable[[], object]], object] = lambda do: None,
    group: int | None = None,
    server: bool = False,
) -> None:
    """Confine this process; it becomes the host user `user`, if given, with the group `group` or of the same id.

    Raises OSError.

    `limits` are named as for prlimit(1); `nproc`, which counts all processes of a user, is set only with `user`.
    `everywhere` calls a function in each of the process's other threads, because capabilities are kept per thread.
    A class's `server` may do more than a program that is graded, see `seccomp.program`.
    """
    for name, most in limits.items():
        if name != "nproc" or user is not None:
            resource.setrlimit(getattr(resource, f"RLIMIT_{name.upper()}"), (most, most))
    if user is not None:
        everywhere(_drop_bounding_set)
        _drop_bounding_set()
        os.setgroups([])
        group = user if group is None else group
        os.setresgid(group, group, group)  # glibc applies both to all threads
        os.setresuid(user, user, user)
    everywhere(_drop_capabilities)
    _drop_capabilities()
    _set_filter(server)


def _drop_bounding_set() -> None:
    for capability in range(CAP_LAST + 1):
        _libc.prctl(PR_CAPBSET_DROP, capability, 0, 0, 0)  # fails for capabilities that this kernel does not know


def _drop_capabilities() -> None:
    header = struct.pack("Ii", CAPABILITIES_V3, 0)
    check(_libc.capset(header, bytes(24)))
    check(_libc.prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0))


def _set_filter(server: bool) -> None:
    if not seccomp.available():
        return
    rules = seccomp.program(server=server)
    code = ctypes.create_string_buffer(rules, len(rules))
    program = struct.pack("HxxxxxxP", len(rules) // 8, ctypes.addressof(code))  # struct sock_fprog
    number = SECCOMP_CALL[os.uname().machine]
    check(_libc.syscall(number, SET_MODE_FILTER, ALL_THREADS, program))
