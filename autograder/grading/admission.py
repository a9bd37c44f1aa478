"""Admission of the next grading on this machine: if there is a core for it, or spare processor time.

Much of a grading is waiting: for a program that must give up, for an answer that must take its time.  So there are more
workers than cores, and an extra one begins when the processor has room for it: by what gradings of the exercises took
before, as soon as that is known, and until then when the others leave enough of it idle.  On a machine that
is too busy, what a submission loses is in doubt, and it is judged again.  All gradings of a user on a machine, whatever
their batch, are counted together.
"""

import contextlib
import os
import threading
import time
from collections import Counter, deque
from collections.abc import Iterator
from pathlib import Path

from filelock import FileLock, Timeout

from course.foundation.folders import runtime_folder

WORKERS = 3  # per core
SPARE = 0.7  # of a core must be idle: the start of a grading takes more than the rest of it
LITTLE = 0.3  # of a core must be idle where the exercise is known: others may use the machine, too
FULL = 0.9  # of the cores may be taken by gradings whose exercises are known
WINDOW = 0.4  # s over which idle time is measured
LONGER = 3.0  # s over which it is measured, too: gradings that compute and wait by turns have short pauses

_looks: deque[tuple[float, float]] = deque()  # of the last LONGER s, while a grading waits: a time, and the idle time
_first = threading.Lock()  # held by the grading of this process that is the next to begin
_running: Counter[str] = Counter()  # gradings of this process, by exercise
_taken: dict[str, tuple[float, float]] = {}  # by exercise: processor time and duration of its gradings so far, s


def cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0))


def learn(exercise: str, used: float, seconds: float) -> None:
    """Note that a grading of this exercise used so much processor time (s) in so many seconds."""
    before, lasted = _taken.get(exercise, (0.0, 0.0))
    _taken[exercise] = before + used, lasted + seconds


@contextlib.contextmanager
def turn(exercise: str) -> Iterator[None]:
    """Wait until a grading of the exercise may begin; the block is the grading.

    Only one grading per process waits for the machine; the others wait for that one.  So a single submission soon has
    its turn beside a class that another command grades.
    """
    folder = runtime_folder()
    with contextlib.ExitStack() as held:
        with _first:
            while not (_take_core(folder, held) or _find_spare(folder, exercise)):
                pass
            _running[exercise] += 1
        try:
            yield
        finally:
            _running[exercise] -= 1


def _fits(exercise: str) -> bool | None:
    """Return whether the cores have room for one more grading of the exercise; None if that is not known."""
    names = [exercise, *_running.elements()]
    if any(_taken.get(name, (0.0, 0.0))[0] <= 0.0 for name in names):
        return None
    return sum(used / lasted for used, lasted in map(_taken.__getitem__, names)) <= FULL * cores()


def _take_core(folder: Path, held: contextlib.ExitStack) -> bool:
    """Return True if there are fewer gradings than cores; then this one counts until `held` is closed."""
    for number in range(cores()):
        with contextlib.suppress(Timeout):
            held.enter_context(FileLock(folder / f"grading-{number}.lock", blocking=False))
            return True
    return False


def _find_spare(folder: Path, exercise: str) -> bool:
    """Return True if enough of the processor is idle, the load of the last grading included; takes WINDOW s."""
    fits = _fits(exercise)
    with FileLock(folder / "grading-spare.lock"):  # one after the other: each must see the load of the one before
        start, before = _look()
        time.sleep(WINDOW)
        now, idle = _look()
    if fits is not None:
        return fits and (idle - before) / (now - start) >= LITTLE
    first, at_first = _looks[0]
    return min((idle - before) / (now - start), (idle - at_first) / (now - first)) >= SPARE


def _look() -> tuple[float, float]:
    """Take the time and the idle time (s), and remember them; what is older than LONGER is forgotten.

    Two looks are always left: this process may be stopped for longer, by Ctrl-Z or by a busy machine.
    """
    _looks.append((time.monotonic(), _idle()))
    while len(_looks) > 2 and _looks[-1][0] - _looks[0][0] > LONGER:
        _looks.popleft()
    return _looks[-1]


def _idle() -> float:
    """Return the seconds for which the cores together were idle or ran nicer processes (proc(5), /proc/stat)."""
    _, _, niced, _, idle, _ = Path("/proc/stat").read_text().split(None, 5)
    spare = int(idle) + (int(niced) if os.nice(0) <= 0 else 0)
    return spare / os.sysconf("SC_CLK_TCK")
