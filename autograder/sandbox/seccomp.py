"""A seccomp filter that denies system calls which no ROS 2 program needs, in addition to the namespaces.

A kernel bug in one of these calls could be a way out of the sandbox.  The filter is a classic BPF program (Linux,
Documentation/userspace-api/seccomp_filter.rst), built here for the machine's own architecture, and given to bubblewrap
(`--seccomp`), which sets it before the program starts.  All calls are allowed except those listed; a denied call fails
with an error, so that a library that merely tries it goes on.
"""

import errno
import platform
import struct
from functools import cache
from pathlib import Path

# By machine: the kernel's name for its ABI (AUDIT_ARCH_*), and the column of its numbers in DENIED.
MACHINES = {"x86_64": (0xC000003E, 0), "aarch64": (0xC00000B7, 1)}
# Numbers on x86_64 and on aarch64; None where the call does not exist.
DENIED = {
    # other processes' memory and descriptors
    "ptrace": (101, 117),
    "process_vm_readv": (310, 270),
    "process_vm_writev": (311, 271),
    "kcmp": (312, 272),
    "pidfd_getfd": (438, 438),
    "process_madvise": (440, 440),
    "move_pages": (279, 239),
    "migrate_pages": (256, 238),
    # file systems and namespaces
    "mount": (165, 40),
    "umount2": (166, 39),
    "pivot_root": (155, 41),
    "chroot": (161, 51),
    "unshare": (272, 97),
    "setns": (308, 268),
    "open_tree": (428, 428),
    "move_mount": (429, 429),
    "fsopen": (430, 430),
    "fsconfig": (431, 431),
    "fsmount": (432, 432),
    "fspick": (433, 433),
    "mount_setattr": (442, 442),
    "name_to_handle_at": (303, 264),
    "open_by_handle_at": (304, 265),
    "fanotify_init": (300, 262),
    "quotactl": (179, 60),
    "quotactl_fd": (443, 443),
    # moving to other cores than the one that a grading was given
    "sched_setaffinity": (203, 122),
    # memory that no limit counts
    "memfd_create": (319, 279),
    "memfd_secret": (447, 447),
    "shmget": (29, 194),
    "msgget": (68, 186),
    "semget": (64, 190),
    "mq_open": (240, 180),
    # parts of the kernel with a history of holes
    "keyctl": (250, 219),
    "add_key": (248, 217),
    "request_key": (249, 218),
    "bpf": (321, 280),
    "perf_event_open": (298, 241),
    "userfaultfd": (323, 282),
    "io_uring_setup": (425, 425),
    "io_uring_enter": (426, 426),
    "io_uring_register": (427, 427),
    "personality": (135, 92),
    "modify_ldt": (154, None),
    "uselib": (134, None),
    # the machine itself
    "init_module": (175, 105),
    "finit_module": (313, 273),
    "delete_module": (176, 106),
    "kexec_load": (246, 104),
    "kexec_file_load": (320, 294),
    "reboot": (169, 142),
    "swapon": (167, 224),
    "swapoff": (168, 225),
    "acct": (163, 89),
    "syslog": (103, 116),
    "vhangup": (153, 58),
    "ioperm": (173, None),
    "iopl": (172, None),
    "settimeofday": (164, 170),
    "clock_settime": (227, 112),
    "adjtimex": (159, 171),
    "clock_adjtime": (305, 266),
    "sethostname": (170, 161),
    "setdomainname": (171, 162),
}
# Denied in a grading, not to the servers of a class, which watch and lock files.
IN_A_GRADING = {
    # what the kernel counts for the user in all
    "inotify_init": (253, None),
    "inotify_init1": (294, 26),
    "timer_create": (222, 107),
    # locks on the files of the system, which all sandboxes and the host share: a channel between two programs
    "flock": (73, 32),
}
CLONE, SOCKET, IOCTL, CLONE3, FCNTL = (56, 220), (41, 198), (16, 29), (435, 435), (72, 25)
LOCKS = (6, 7, 37, 38, 1024)  # F_SETLK, F_SETLKW, F_OFD_SETLK, F_OFD_SETLKW, F_SETLEASE
NAMESPACES = 0x7E020000 | 0x80  # CLONE_NEW*: a process may have children, but no new namespaces,
PARENT = 0x8000  # CLONE_PARENT: nor siblings, which would be children of the process that forked it
FAMILIES = (1, 2, 10, 16)  # AF_UNIX, AF_INET, AF_INET6, AF_NETLINK (to list interfaces); not AF_VSOCK, AF_ALG, ...
TIOCSTI, TIOCLINUX = 0x5412, 0x541C  # insert input into a terminal
X32 = 0x40000000  # x86_64: the bit that marks a second ABI with different numbers

# Offsets in struct seccomp_data; those of 64-bit arguments are of the low half, on little-endian machines.
NUMBER, ARCHITECTURE, ARGUMENT = 0, 4, (16, 24)
LOAD, EQUAL, NOT_LESS, ANY_BIT, RETURN = 0x20, 0x15, 0x35, 0x45, 0x06  # BPF operations
ALLOW, KILL = 0x7FFF0000, 0x80000000


def available() -> bool:
    """Return True if there is a filter for this machine, and its kernel supports seccomp."""
    return platform.machine() in MACHINES and Path("/proc/sys/kernel/seccomp/actions_avail").exists()


@cache
def program(machine: str | None = None, *, server: bool = False) -> bytes:
    """Return the filter as an array of struct sock_filter; raises KeyError for an unsupported machine.

    It is that for a grading, or, with `server`, that for a student's server.
    """
    abi, column = MACHINES[machine or platform.machine()]
    code = [_do(LOAD, ARCHITECTURE), *_unless(EQUAL, abi, KILL), _do(LOAD, NUMBER)]
    if column == 0:
        code += _when(NOT_LESS, X32, _error(errno.ENOSYS))
    # glibc falls back to clone, whose flags a filter can check; clone3's are in memory, which a filter cannot read.
    code += _when(EQUAL, CLONE3[column], _error(errno.ENOSYS))
    for numbers in (DENIED if server else DENIED | IN_A_GRADING).values():
        number = numbers[column]
        if number is not None:
            code += _when(EQUAL, number, _error(errno.EPERM))
    code += _arguments(CLONE[column], ARGUMENT[0], _when(ANY_BIT, NAMESPACES | PARENT, _error(errno.EPERM)))
    code += _arguments(
        IOCTL[column],
        ARGUMENT[1],
        [word for request in (TIOCSTI, TIOCLINUX) for word in _when(EQUAL, request, _error(errno.EPERM))],
    )
    if not server:
        locks = [word for command in LOCKS for word in _when(EQUAL, command, _error(errno.EPERM))]
        code += _arguments(FCNTL[column], ARGUMENT[1], locks)
    families = [word for family in FAMILIES for word in _when(EQUAL, family, ALLOW)]
    code += _arguments(SOCKET[column], ARGUMENT[0], [*families, _do(RETURN, _error(errno.EAFNOSUPPORT))])
    return b"".join([*code, _do(RETURN, ALLOW)])


def _do(operation: int, value: int, then: int = 0, otherwise: int = 0) -> bytes:
    """Return one instruction; `then` and `otherwise` are how many of the next ones it skips."""
    return struct.pack("HBBI", operation, then, otherwise, value)


def _when(test: int, value: int, verdict: int) -> list[bytes]:
    return [_do(test, value, 0, 1), _do(RETURN, verdict)]


def _unless(test: int, value: int, verdict: int) -> list[bytes]:
    return [_do(test, value, 1, 0), _do(RETURN, verdict)]


def _arguments(number: int, argument: int, judged: list[bytes]) -> list[bytes]:
    """Return instructions for the system call `number`: load an argument, let `judged` decide, and allow the rest."""
    return [_do(EQUAL, number, 0, len(judged) + 2), _do(LOAD, argument), *judged, _do(RETURN, ALLOW)]


def _error(number: int) -> int:
    return 0x00050000 | number
