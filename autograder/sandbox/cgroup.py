"""A control group (cgroups(7), v1 and v2) for all programs of a grading, or all processes of a student's server.

Limits per process (`sandbox.LIMITS`) are not enough: each program of a grading may use them up, and kernel memory, such
as for sockets and empty files, is counted for no process.  A group counts everything, and shares the processor fairly
between gradings, however many processes each has.  Without a group, only the other limits hold.
"""

import contextlib
import os
import secrets
import signal
import time
from functools import partial
from pathlib import Path

from course.foundation.waiting import wait_until

ROOT = Path("/sys/fs/cgroup")
NAME = "ros2-autograder-"
MEMORY = 2 << 30  # bytes of all programs of a grading together, their kernel memory included
TASKS = 400  # processes and threads of all programs of a grading together
CONTROLLERS = ("memory", "pids", "cpu")
PERIOD = 100_000  # us: the period of a group's processor quota
ENTER = 'for group in $GROUPS_; do echo 0 > "$group/cgroup.procs" || exit 125; done; unset GROUPS_; exec "$@"'
STALE = 3600.0  # s after which an empty group counts as left by a killed grading
EMPTY = 5.0  # s to wait until a group's killed processes are gone


class Group:
    """The folders of one group: one per hierarchy in v1, a single one in v2."""

    def __init__(self, folders: list[Path]):
        self.folders = folders

    def command(self, command: list[str]) -> list[str]:
        """Return a command line that runs `command` in this group."""
        groups = " ".join(map(str, self.folders))
        return ["env", f"GROUPS_={groups}", "sh", "-c", ENTER, "sh", *command]

    @property
    def doors(self) -> list[Path]:
        """Return the files that a process must write 0 to in order to enter this group."""
        return [folder / "cgroup.procs" for folder in self.folders]

    @property
    def out_of_memory(self) -> bool:
        """Return True if the kernel's OOM killer has ended a process of the group."""
        for folder in self.folders:
            for name in ("memory.oom_control", "memory.events"):
                with contextlib.suppress(OSError):
                    words = (folder / name).read_text().split()
                    if "oom_kill" in words and int(words[words.index("oom_kill") + 1]):
                        return True
        return False

    def close(self) -> None:
        """Kill the processes left in the group, and remove it."""
        for folder in self.folders:
            wait_until(partial(_ended, folder), EMPTY, alert=False)
            with contextlib.suppress(OSError):
                folder.rmdir()


def make(memory: int = MEMORY, tasks: int = TASKS, cores: float | None = None, name: str = "") -> Group | None:
    """Make a group below this process's own, with limits; return None if this machine does not allow it.

    All its processes together get at most `memory` bytes, `tasks` processes and threads, and the time of `cores`
    processors.  An existing group called `name` is used again.
    """
    limits = {  # by controller: the files of v1 and v2, and the values to write
        "memory": {"memory.limit_in_bytes": str(memory), "memory.max": str(memory)},
        "pids": {"pids.max": str(tasks)},
        "cpu": {},
    }
    if cores:
        quota = round(cores * PERIOD)
        limits["cpu"] = {"cpu.cfs_quota_us": str(quota), "cpu.max": f"{quota} {PERIOD}"}
    again = bool(name)
    name = name or NAME + secrets.token_hex(8)
    made: list[Path] = []
    try:
        for parent, controllers in _parents():
            _remove_stale(parent)
            (parent / name).mkdir(exist_ok=again)
            made.append(parent / name)
            for controller in controllers:
                for file, value in limits[controller].items():
                    if (parent / name / file).exists():
                        (parent / name / file).write_text(value)
    except OSError:
        Group(made).close()
        return None
    return Group(made) if made else None


def _parents() -> list[tuple[Path, list[str]]]:
    """Return the folders to make a group in, with their controllers; empty if memory or processes cannot be limited."""
    found: list[tuple[Path, list[str]]] = []
    for line in Path("/proc/self/cgroup").read_text().splitlines():
        number, names, path = line.split(":", 2)
        controllers = [name for name in names.split(",") if name in CONTROLLERS]
        if number == "0":
            parent = _giving(ROOT, path)
            if parent:
                given = (parent / "cgroup.subtree_control").read_text().split()
                found.append((parent, [name for name in given if name in CONTROLLERS]))
        elif controllers:
            found.append((ROOT / names / path.lstrip("/"), controllers))
    limited = {name for _, controllers in found for name in controllers}
    return found if {"memory", "pids"} <= limited else []


def _giving(root: Path, path: str) -> Path | None:
    """Return, for v2, this process's group or the nearest one above it that delegates memory and pids."""
    own = root / path.lstrip("/")
    for folder in (own, *own.parents):
        with contextlib.suppress(OSError):
            if {"memory", "pids"} <= set((folder / "cgroup.subtree_control").read_text().split()):
                return folder
        if folder == root:
            break
    return None


def _ended(folder: Path) -> bool:
    """Kill the processes in the group; return True if there are none."""
    try:
        left = [int(number) for number in (folder / "cgroup.procs").read_text().split()]
    except OSError:
        return True
    for process in left:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            if process:  # 0: a process of another namespace
                os.kill(process, signal.SIGKILL)
    return not left


def _remove_stale(parent: Path) -> None:
    for folder in parent.glob(f"{NAME}*"):
        with contextlib.suppress(OSError):
            if time.time() - folder.stat().st_mtime > STALE:
                folder.rmdir()  # fails if a process is in the group
