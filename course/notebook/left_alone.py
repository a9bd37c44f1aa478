"""A run of a program beside a check, to which nobody comes for some seconds: what a request has set must last."""

import contextlib
import threading
from pathlib import Path
from typing import Any

from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from course.errors import ExerciseError, LiveError
from course.foundation.waiting import wait_until
from course.session.domains import claim_domain
from course.session.live import live
from course.session.node_process import NodeProcess

STARTING = 20.0  # s for its service to be there
ANSWERING = 5.0  # s for one answer
LIMIT = 5.0  # s for which a check waits for it at its end


class LeftAlone:
    """A run of `file` in a ROS domain of its own, which is asked to change its state, and then left alone for a while.

    `changes` and `status` are each a type and the name of a service: the first is asked with data=True, the second
    `seconds` later.  It ends by itself, also when the check fails meanwhile.
    """

    def __init__(self, file: str, changes: tuple[type[Any], str], status: tuple[type[Any], str], seconds: float):
        self._path, self._changes, self._status, self._seconds = Path(file).absolute(), changes, status, seconds
        self._answers: list[Any] = []  # to the request, and then of the status
        self._over = threading.Event()
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self) -> None:
        with contextlib.suppress(LiveError, OSError):  # unless no domain is free: then this is left out
            claim, domain = claim_domain()
            with claim:
                process, context = NodeProcess(self._path, [], domain=domain), Context()
                context.init(domain_id=domain)
                try:
                    self._ask(process, context)
                finally:
                    context.try_shutdown()
                    process.stop()
        self._over.set()

    def _ask(self, process: NodeProcess, context: Context) -> None:
        executor, node = SingleThreadedExecutor(context=context), Node("left_alone", context=context)
        executor.add_node(node)

        def ask(kind: type[Any], name: str, **fields: object) -> None:
            client = node.create_client(kind, name)
            wait_until(lambda: client.service_is_ready() or process.ended, STARTING, alert=False)
            future = client.call_async(kind.Request(**fields))
            executor.spin_until_future_complete(future, ANSWERING if client.service_is_ready() else 0.0)
            self._answers.append(future.result() if future.done() else None)

        ask(*self._changes, data=True)
        if None not in self._answers:
            wait_until(lambda: process.ended, self._seconds, alert=False)
            ask(*self._status)

    def stays(self, state: str) -> None:
        """Raise ExerciseError if its status was another one than `state` in the end, though the request was obeyed."""
        if not live().until(self._over.is_set, LIMIT) or len(self._answers) < 2 or None in self._answers:
            return
        first, last = self._answers
        if state in first.message.lower() and state not in last.message.lower():
            raise ExerciseError(
                f"only a request changes the state: {self._changes[1]} with data=True was answered {first}, and "
                f"{self._seconds:g} s later, without a request meanwhile, {self._status[1]} says {last}"
            )
