"""A limit on the total memory of a student's processes, for machines without control groups.

Each process has a limit of its own (`box`), at which the kernel of a notebook gets a MemoryError.  A student with
several large processes loses the largest of them.
"""

import contextlib
import os
import signal
from collections.abc import Collection

from autograder.sandbox.usage import resident, takes_more, total


def bound(pids: Collection[int], most: int) -> int:
    """End the largest of some processes when they take more than `most` bytes together.

    Returns its process id, or 0 if none was ended.
    """
    if not takes_more(pids, most):
        return 0
    largest = max(pids, key=lambda pid: total([pid], resident))
    with contextlib.suppress(ProcessLookupError):
        os.kill(largest, signal.SIGKILL)
    return largest
