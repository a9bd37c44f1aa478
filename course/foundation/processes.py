"""Identifying processes: a process id (pid) is reused, so a process is identified by pid and start time."""

import os
from pathlib import Path

MOST = 1 << 22  # process ids (proc(5), pid_max)


def stat(pid: int | str) -> list[str]:
    """Return the fields of /proc/PID/stat from the third (the state) on; raises OSError if there is no such process.

    For a thread, `pid` is `PID/task/TID`.
    """
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()


def birth(pid: int) -> int:
    """Return when a process started, in clock ticks since boot (proc(5), `starttime`); 0 if it does not run.

    A zombie does not run.  It may stay forever: in a container, the first process often does not reap orphans.  (psutil
    counts a zombie as running, and its times change when the clock is set.)
    """
    try:
        fields = stat(pid)
        return 0 if fields[0] in ("Z", "X") else int(fields[19])
    except (OSError, IndexError, ValueError):
        return 0


def command_line(pid: int) -> list[str]:
    """Return the command line of a process, program first; raises OSError if there is no such process."""
    return Path(f"/proc/{pid}/cmdline").read_text(errors="replace").rstrip("\0").split("\0")


def session(pid: int) -> int:
    """Return the id of the session that a process belongs to (setsid(2)); 0 if it is gone."""
    try:
        return os.getsid(pid)
    except OSError:
        return 0


def in_session(session_id: int, low: int) -> bool:
    """Return True if the low 16 bits of the id of one of the session's processes are `low`."""
    return any(session(pid) == session_id for pid in range(low, MOST, 1 << 16))


def user(pid: int) -> int:
    """Return the id of the user that a process runs as (the real one); -1 if it is gone."""
    try:
        lines = Path(f"/proc/{pid}/status").read_text().splitlines()
        return int(next(line.split()[1] for line in lines if line.startswith("Uid:")))
    except (OSError, StopIteration, IndexError, ValueError):
        return -1


def ancestors(pid: int) -> list[int]:
    """Return the ids of the parent of a process, of the parent's parent, and so on."""
    found: list[int] = []
    try:
        while (pid := int(stat(pid)[1])) > 0:
            found.append(pid)
    except (OSError, IndexError, ValueError):
        pass
    return found


def processor_time(pid: int, *, ended: bool = False) -> float:
    """Return the processor time (s) of a process, with that of its `ended` children if asked for; 0 if it is gone."""
    try:
        return sum(map(int, stat(pid)[11 : 15 if ended else 13])) / os.sysconf("SC_CLK_TCK")
    except (OSError, ValueError):
        return 0.0


def threaded(pid: int, name: str) -> float:
    """Return when a process started the first of its threads whose name begins so, in s since boot; 0 if unknown."""
    try:
        born = [
            int(stat(f"{pid}/task/{each}")[19])
            for each in os.listdir(f"/proc/{pid}/task")
            if Path(f"/proc/{pid}/task/{each}/comm").read_text().startswith(name)
        ]
        return min(born, default=0) / os.sysconf("SC_CLK_TCK")
    except (OSError, IndexError, ValueError):
        return 0.0


def stopped(pid: int) -> bool:
    """Return True if a process was stopped, as by Ctrl-Z in its terminal, and has not gone on since."""
    try:
        return stat(pid)[0] == "T"
    except (OSError, IndexError):
        return False


def sleeping(pid: int) -> bool:
    """Return True if every thread of a process waits (state S), and none runs, is about to run or is stopped.

    On a busy machine a process that only lacks a processor is not sleeping.
    """
    try:
        threads = os.listdir(f"/proc/{pid}/task")
        return bool(threads) and all(stat(f"{pid}/task/{each}")[0] == "S" for each in threads)
    except (OSError, IndexError):
        return False


def catches(pid: int, signal: int) -> bool:
    """Return True if a process has its own handler for a signal (proc(5), `SigCgt`); otherwise it may end."""
    try:
        lines = Path(f"/proc/{pid}/status").read_text().splitlines()
        mask = next(line.split()[1] for line in lines if line.startswith("SigCgt:"))
        return bool(int(mask, 16) >> (signal - 1) & 1)
    except (OSError, StopIteration, IndexError, ValueError):
        return False


def alive(pid: int, born: int) -> bool:
    """Return True while the process with this `birth` runs, and not a later one with the same pid."""
    return born != 0 and birth(pid) == born
