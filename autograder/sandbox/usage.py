"""The processes of a program, and their numbers of threads and memory, from proc(5)."""

import contextlib
import os
import re
from collections.abc import Callable, Iterable
from pathlib import Path

from course.foundation.processes import stat


def of_user(user: int) -> dict[int, int]:
    """Return all visible processes of a host user, zombies included, with the number of threads of each."""
    found = {}
    for pid in _numbers():
        with contextlib.suppress(OSError):  # it has ended meanwhile
            if os.stat(f"/proc/{pid}").st_uid == user:
                found[pid] = len(os.listdir(f"/proc/{pid}/task"))
    return found


def of_sandbox(root: int) -> dict[int, int]:
    """Return all processes in the namespaces made by bubblewrap, process `root`, with the number of threads of each.

    Parents do not matter: a process can be adopted by another one, and a list of children may be incomplete while they
    come and go (proc(5)).
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
    """Return process `root` and all its descendants, with the number of threads of each."""
    tree, found = [root], {}
    for pid in tree:
        with contextlib.suppress(OSError):  # it has ended meanwhile
            found[pid] = len(os.listdir(f"/proc/{pid}/task"))
            tree += children(pid)
    return found


def parent(pid: int) -> int:
    """Return the parent of process `pid`; raises OSError when `pid` is gone."""
    return int(stat(pid)[1])


def children(pid: int) -> list[int]:
    """Return the children of process `pid`, adopted ones included; raises OSError when it is gone."""
    found: list[int] = []
    for task in os.listdir(f"/proc/{pid}/task"):
        # A thread that has just ended is skipped; the children of the others are still found.
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
    """Return True if processes together take more than `most` bytes; tries the quick overestimate first."""
    pids = list(pids)
    return total(pids, resident) > most and total(pids, proportional) > most


def total(pids: Iterable[int], measure: Callable[[int], int]) -> int:
    """Return the total memory (bytes) of some processes, each by `measure`."""
    found = 0
    for pid in pids:
        with contextlib.suppress(OSError, IndexError):  # it has ended meanwhile
            found += measure(pid)
    return found


def resident(pid: int) -> int:
    """Return the memory (bytes) of a process; quick, but shared pages are counted for each process."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def proportional(pid: int) -> int:
    """Return the memory (bytes) of a process, shared pages counted proportionally; slow for a large process."""
    found = re.search(r"^Pss:\s+(\d+) kB", Path(f"/proc/{pid}/smaps_rollup").read_text(), re.MULTILINE)
    return int(found[1]) << 10 if found else 0
