"""The patches of rclpy in this repository, for a live session, the grader, and the programs that the grader forks.

Each names the version it was seen in; tests/ros/test_rclpy_patches.py fails when one is no longer needed.  This module
imports no part of rclpy: kept alive by a patched class, that would end later than rclpy's objects, and print an error
at the end of a program.
"""

import functools
import threading
import time
from collections.abc import Callable
from typing import Any

HANDED_OVER = 50e-6  # s
UNLOCKED = ("send_goal_async", "_cancel_goal_async", "_get_result_async", "take_data")
_patched = threading.Lock()


def patch() -> None:
    """Patch rclpy in this process; calling it again changes nothing."""
    from rclpy import executors
    from rclpy.action import ActionClient

    with _patched:
        if not hasattr(ActionClient.send_goal_async, "__wrapped__"):
            _lock_action_clients(ActionClient)
            _hand_over_to_workers(executors)


def _lock_action_clients(action_client: type) -> None:
    """Keep a spinning thread from taking an answer before the asking thread has recorded its request.

    Seen in 7.1.6: rclpy has this lock for a Client but not for an ActionClient, which then ignores an immediate answer,
    and the goal's future never ends.
    """
    lock = threading.RLock()

    def locked(method: Callable) -> Callable:
        @functools.wraps(method)
        def call(*args: Any, **kwargs: Any) -> Any:
            with lock:
                return method(*args, **kwargs)

        return call

    for name in UNLOCKED:
        setattr(action_client, name, locked(getattr(action_client, name)))


def _hand_over_to_workers(executors: Any) -> None:
    """Have a MultiThreadedExecutor wait a moment after each callback that it gives to a worker.

    Seen in 7.1.6: until the worker has begun it, the executor gives it the callback again and again.  Each round is
    shorter than Python's switch interval, and on an idle machine with several cores keeps the worker from beginning for
    up to half a second.
    """

    class Workers(executors.ThreadPoolExecutor):
        """The executor's threads."""

        def submit(self, *args: Any, **kwargs: Any) -> Any:
            """Give them a callback."""
            future = super().submit(*args, **kwargs)
            time.sleep(HANDED_OVER)
            return future

    executors.ThreadPoolExecutor = Workers
