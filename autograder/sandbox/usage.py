"""The processes of a program, and what they take: their number, threads and memory, as proc(5) tells."""

import contextlib
import os
import re
from collections.abc import Callable, Iterable
from pathlib import Path

from course.foundation.processes import stat


def of_user(user: int) -> dict[int, int]:
    """All processes that this one sees of a host user, with the number of threads of each; zombies, too."""
    found = {}
    for pid in _numbers():
        with contextlib.suppress(OSError):  # it has ended meanwhile
            if os.stat(f"/proc/{pid}").st_uid == user:
                found[pid] = len(os.listdir(f"/proc/{pid}/task"))
    return found


def of_sandbox(root: int) -> dict[int, int]:
    """All processes in the namespaces that bubblewrap, process `root`, has made, with the number of threads of each.

    Whatever their parents are: a process can have itself left to another, and a list of children is not complete while
    they come and go (proc(5)).
    """
    namespaces: set[str] = set()
    with contextlib.suppress(OSError):
        namespaces = {os.readlink(f"/proc/{pid}/ns/pid") for pid in children(root)}
        namespaces.discard(os.readlink(f"/proc/{root}/ns/pid"))
    found = processes(root) if not namespaces else {}
    for pid in _numbers() if namespaces else []:
        with contextlib.suppress(OSError):
            if os.readlink(f"/proc/{pid}/ns/pid") in namespaces:
                found[pid] = len(os.listdir(f"/proc/{pid}/task"))
    return found


def _numbers() -> list[int]:
    return [int(name) for name in os.listdir("/proc") if name.isdigit()]


def processes(root: int) -> dict[int, int]:
    """Process `root` and all its descendants, with the number of threads of each."""
    tree, found = [root], {}
    for pid in tree:
        with contextlib.suppress(OSError):  # it has ended meanwhile
            found[pid] = len(os.listdir(f"/proc/{pid}/task"))
            tree += children(pid)
    return found


def parent(pid: int) -> int:
    """The process that has started process `pid`; raises OSError when that is gone."""
    return int(stat(pid)[1])


def children(pid: int) -> list[int]:
    """The processes that process `pid` has started, and those that were left to it; raises OSError when it is gone."""
    found: list[int] = []
    for task in os.listdir(f"/proc/{pid}/task"):
        # A thread that has ended meanwhile is passed over: the others' children are seen all the same.
        with contextlib.suppress(OSError):
            found += map(int, Path(f"/proc/{pid}/task/{task}/children").read_text().split())
    return found


def running(pids: Iterable[int]) -> int:
    """Return how many threads of some processes run, or could (proc(5), state R)."""
    found = 0
    for pid in pids:
        with contextlib.suppress(OSError):  # it has ended meanwhile
            for task in os.listdir(f"/proc/{pid}/task"):
                found += Path(f"/proc/{pid}/task/{task}/stat").read_text().rpartition(")")[2].split()[0] == "R"
    return found


def takes_more(pids: Iterable[int], most: int) -> bool:
    """Return True if processes together take more than `most` bytes: the quick measure first, which overestimates."""
    pids = list(pids)
    return total(pids, resident) > most and total(pids, proportional) > most


def total(pids: Iterable[int], measure: Callable[[int], int]) -> int:
    """The memory of some processes together, in bytes, by `measure` of one."""
    found = 0
    for pid in pids:
        with contextlib.suppress(OSError, IndexError):  # it has ended meanwhile
            found += measure(pid)
    return found


def resident(pid: int) -> int:
    """Bytes of a process's memory; quick, but forks share pages and each counts them."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def proportional(pid: int) -> int:
    """Bytes of a process's memory, shared pages divided by the number of their users; slow for a large process."""
    found = re.search(r"^Pss:\s+(\d+) kB", Path(f"/proc/{pid}/smaps_rollup").read_text(), re.MULTILINE)
    return int(found[1]) << 10 if found else 0
