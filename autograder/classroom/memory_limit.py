"""A limit on the memory of a student's processes together, where no control group holds it.

Each process has a limit of its own (`box`), at which the kernel of a notebook gets a MemoryError.  A student with
several large processes loses the largest of them.
"""

import contextlib
import os
import signal

from autograder.sandbox.usage import processes, resident, takes_more, total


def bound(root: int, most: int) -> int:
    """End the largest of process `root` and its descendants when they take more than `most` bytes together.

    Its number is returned, or 0 when none was ended.
    """
    tree = list(processes(root))
    if not takes_more(tree, most):
        return 0
    largest = max(tree, key=lambda pid: total([pid], resident))
    with contextlib.suppress(ProcessLookupError):
        os.kill(largest, signal.SIGKILL)
    return largest
