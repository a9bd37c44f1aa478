"""A control group for programs that belong together, where this machine gives one (cgroups(7), v1 and v2): those of
one grading, or all that a student of a classroom runs.

The limits of a process (`sandbox.LIMITS`) are not enough: programs of one grading may each take what one may, and the
kernel's own memory, of sockets and empty files, counts for no process.  In a group of their own all of it counts,
and a program with many busy processes gets no more of the processor than the one of another grading.  Where there is no
such group, the other limits hold alone.
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
MEMORY = 2 << 30  # bytes of all programs of a grading together, with what the kernel keeps for them
TASKS = 400  # processes and threads, the same
CONTROLLERS = ("memory", "pids", "cpu")
PERIOD = 100_000  # us in which a group gets its share of the processor
ENTER = 'for group in $GROUPS_; do echo 0 > "$group/cgroup.procs" || exit 125; done; unset GROUPS_; exec "$@"'
STALE = 3600.0  # s after which an empty group was left behind by a grading that was killed
EMPTY = 5.0  # s until the processes of a group that were killed are gone


class Group:
    """The folders of one group: one in each hierarchy of v1, or one in all."""

    def __init__(self, folders: list[Path]):
        self.folders = folders

    def command(self, command: list[str]) -> list[str]:
        """A command line that runs `command` in this group."""
        groups = " ".join(map(str, self.folders))
        return ["env", f"GROUPS_={groups}", "sh", "-c", ENTER, "sh", *command]

    @property
    def doors(self) -> list[Path]:
        """The files that a process writes 0 to, to go into this group."""
        return [folder / "cgroup.procs" for folder in self.folders]

    @property
    def out_of_memory(self) -> bool:
        """Return True if the kernel has ended a process of the group because of its memory."""
        for folder in self.folders:
            for name in ("memory.oom_control", "memory.events"):
                with contextlib.suppress(OSError):
                    words = (folder / name).read_text().split()
                    if "oom_kill" in words and int(words[words.index("oom_kill") + 1]):
                        return True
        return False

    def close(self) -> None:
        """End what is left in the group, and remove it."""
        for folder in self.folders:
            wait_until(partial(_ended, folder), EMPTY, alert=False)
            with contextlib.suppress(OSError):
                folder.rmdir()


def make(memory: int = MEMORY, tasks: int = TASKS, cores: float | None = None, name: str = "") -> Group | None:
    """A new group below this process's own, with limits; None where this machine gives none.

    All its processes together get at most `memory` bytes, `tasks` processes and threads, and the time of `cores`
    processors.  A group that has a `name` already, and is left from before, is taken again.
    """
    limits = {  # what is written to which file, of v1 and of v2
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
    """The folders to make a group in, each with its controllers; empty unless memory and processes can be limited."""
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
    """Of v2: the nearest group around this process's own, or itself, that gives memory and pids to groups in it."""
    own = root / path.lstrip("/")
    for folder in (own, *own.parents):
        with contextlib.suppress(OSError):
            if {"memory", "pids"} <= set((folder / "cgroup.subtree_control").read_text().split()):
                return folder
        if folder == root:
            break
    return None


def _ended(folder: Path) -> bool:
    """Return True if no process is in the group; those that are get SIGKILL."""
    try:
        left = [int(number) for number in (folder / "cgroup.procs").read_text().split()]
    except OSError:
        return True
    for process in left:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            if process:  # 0: of another process namespace
                os.kill(process, signal.SIGKILL)
    return not left


def _remove_stale(parent: Path) -> None:
    for folder in parent.glob(f"{NAME}*"):
        with contextlib.suppress(OSError):
            if time.time() - folder.stat().st_mtime > STALE:
                folder.rmdir()  # which an occupied one refuses
