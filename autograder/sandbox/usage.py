"""The processes of a program, and their numbers of threads and memory, from proc(5)."""

import contextlib
import os
import re
import threading
import time
from collections.abc import Callable, Iterable

from course.foundation.processes import stat

PAGE = os.sysconf("SC_PAGE_SIZE")  # bytes
MOST = 1 << 16  # bytes of a file of /proc, which is read many times a second, and so at once


def of_user(user: int) -> dict[int, int]:
    """Return all visible processes of a host user, zombies included, with the number of threads of each."""
    return of_users().get(user, {})


class Glance:
    """The answers of `of_user` for many who ask again and again: they share each look at the processes."""

    def __init__(self, age: float) -> None:
        """Look again when the last look was more than `age` s ago."""
        self._age, self._lock = age, threading.Lock()
        self._seen: dict[int, dict[int, int]] = {}
        self._until = 0.0  # s of time.monotonic

    def of_user(self, user: int) -> dict[int, int]:
        """Return the processes of a host user, as `of_user` does, that were there up to `age` s ago."""
        with self._lock:
            if time.monotonic() >= self._until:
                self._seen, self._until = of_users(), time.monotonic() + self._age
            return self._seen.get(user, {})


def of_users() -> dict[int, dict[int, int]]:
    """Return all visible processes by host user, each with its number of threads."""
    found: dict[int, dict[int, int]] = {}
    for pid in visible():
        with contextlib.suppress(OSError):  # it has ended meanwhile
            tasks = _tasks(pid)
            found.setdefault(tasks.st_uid, {})[pid] = _threads(tasks)
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
    for pid in visible() if namespaces else []:
        with contextlib.suppress(OSError):
            if os.readlink(f"/proc/{pid}/ns/pid") in namespaces:
                found[pid] = _threads(_tasks(pid))
    return found


def visible() -> list[int]:
    """Return all processes of the namespace whose /proc this is."""
    return [int(name) for name in os.listdir("/proc") if name.isdigit()]


def _tasks(pid: int) -> os.stat_result:
    """Look at the folder of a process's threads, which belongs to its user; raises OSError when it is gone."""
    return os.stat(f"/proc/{pid}/task")


def _threads(tasks: os.stat_result) -> int:
    """Return the number of folders in the folder of a process's threads: its links without its own two."""
    return tasks.st_nlink - 2


def processes(root: int) -> dict[int, int]:
    """Return process `root` and all its descendants, with the number of threads of each."""
    tree, found = [root], {}
    for pid in tree:
        with contextlib.suppress(OSError):  # it has ended meanwhile
            found[pid] = _threads(_tasks(pid))
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
            found += map(int, read(f"/proc/{pid}/task/{task}/children").split())
    return found


def running(pids: Iterable[int]) -> int:
    """Return how many threads of some processes run, or could (proc(5), state R)."""
    found = 0
    for pid in pids:
        with contextlib.suppress(OSError):  # it has ended meanwhile
            for task in os.listdir(f"/proc/{pid}/task"):
                found += read(f"/proc/{pid}/task/{task}/stat").rpartition(b") ")[2].startswith(b"R")
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
    return int(read(f"/proc/{pid}/statm").split()[1]) * PAGE


def proportional(pid: int) -> int:
    """Return the memory (bytes) of a process, shared pages counted proportionally; slow for a large process."""
    found = re.search(rb"^Pss:\s+(\d+) kB", read(f"/proc/{pid}/smaps_rollup"), re.MULTILINE)
    return int(found[1]) << 10 if found else 0


def read(path: str) -> bytes:
    """Return a small file of /proc, quickly; raises OSError when its process is gone."""
    file = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    try:
        return os.read(file, MOST)
    finally:
        os.close(file)
