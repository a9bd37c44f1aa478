"""The patches of rclpy in this repository, for a live session, the grader, and the programs that either of them starts.

Each names the version it was seen in; tests/ros/test_rclpy_patches.py fails when one is no longer needed.  This module
imports no part of rclpy: kept alive by a patched class, that would end later than rclpy's objects, and print an error
at the end of a program.
"""

import functools
import importlib
import os
import sys
import threading
import time
import warnings
from collections.abc import Callable
from types import FrameType, ModuleType, SimpleNamespace
from typing import Any

HANDED_OVER = 50e-6  # s
UNDISCOVERED = "client will not receive response"  # rmw_fastrtps
REPEATED = 10.0  # s for which a response is sent again
REST = 0.1  # s between two attempts; each keeps Python's threads from running for as long
UNLOCKED = ("send_goal_async", "_cancel_goal_async", "_get_result_async", "take_data")
RESPONSES = {
    "Service": ["service_send_response"],
    "ActionServer": ["send_goal_response", "send_cancel_response", "send_result_response"],
}
PLACES = 1000  # names of files whose path is kept
GENERATOR = "rosidl_generator_py.generate_py_impl"
OF_EACH_SERVICE = "service_msgs.msg"  # has the one message that every program with a node loads, and no node makes
_patched = threading.Lock()
_repeating = threading.Lock()  # one attempt at a time


def patch() -> None:
    """Patch rclpy in this process; calling it again changes nothing."""
    load_generator_later()
    from rclpy import executors
    from rclpy.action import ActionClient
    from rclpy.impl import rcutils_logger
    from rclpy.impl.implementation_singleton import rclpy_implementation

    with _patched:
        if not hasattr(ActionClient.send_goal_async, "__wrapped__"):
            lock_action_clients(ActionClient)
            _hand_over_to_workers(executors)
            repeat_lost_responses(rclpy_implementation)
            find_callers_by_name(rcutils_logger)


def load_generator_later() -> None:
    """Keep the first message of a process from loading the parser of interface definitions, which only a build uses.

    Seen in rosidl_generator_py 0.22: the package from which each message has `import_type_support` imports its
    generator, too, and with it lark: a tenth of the time in which a node starts.
    """
    if GENERATOR in sys.modules:
        return
    later = ModuleType(GENERATOR, load_generator_later.__doc__)

    def generator() -> ModuleType:
        if sys.modules.get(GENERATOR) is later:
            del sys.modules[GENERATOR]
        return importlib.import_module(GENERATOR)

    def other(name: str) -> Any:
        if name.startswith("__"):  # Python's own questions at an import
            raise AttributeError(name)
        return getattr(generator(), name)

    vars(later).update(generate_py=lambda *args, **kwargs: generator().generate_py(*args, **kwargs), __getattr__=other)
    sys.modules[GENERATOR] = later


def load_numpy_later() -> None:
    """Keep the first node of a process from loading numpy, unless the program does so itself.

    Seen in service_msgs 2.0: the message that introspects services has an array of fixed size, and so its module loads
    numpy: half of the time in which a node starts.  Only a program that makes such a message needs it.
    """
    if "numpy" in sys.modules or OF_EACH_SERVICE in sys.modules:
        return

    def other(name: str) -> Any:
        if name.startswith("__"):  # Python's own questions at an import
            raise AttributeError(name)
        return getattr(importlib.import_module("numpy"), name)

    later = ModuleType("numpy", load_numpy_later.__doc__)
    vars(later).update(__getattr__=other)
    sys.modules["numpy"] = later
    try:
        importlib.import_module(OF_EACH_SERVICE)
    finally:
        if sys.modules.get("numpy") is later:
            del sys.modules["numpy"]


def lock_action_clients(action_client: type) -> None:
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


def find_callers_by_name(logger: Any) -> None:
    """Have rclpy's module of loggers find the line that logs something by the names of files alone.

    Seen in 7.1.6: for each line that is logged, rclpy has Python look for the sources of five frames on the disk.  That
    is nine tenths of the time which a line takes, and more in a notebook: a cell is in no file, and is looked for among
    all modules.
    """

    def place(frame: FrameType) -> SimpleNamespace:
        return SimpleNamespace(filename=frame.f_code.co_filename)

    path = SimpleNamespace(abspath=os.path.abspath, realpath=functools.lru_cache(PLACES)(os.path.realpath))
    logger.inspect = SimpleNamespace(currentframe=sys._getframe, getframeinfo=place)
    logger.os = SimpleNamespace(path=path)


def repeat_lost_responses(implementation: Any) -> None:
    """Have a server send a response again if its client's reader of responses has not been discovered yet.

    Seen in 7.1.6 with rmw_fastrtps 8.4: who has found a server may ask it before the server has discovered where the
    response goes.  The server waits for 0.1 s, and then the response is lost, and the future of the call never ends.
    A busy machine is slow enough for that, and so is one whose receive buffer has overflown.  Here the response is sent
    again, in another thread, for REPEATED s.
    """
    for kind, names in RESPONSES.items():
        server = getattr(implementation, kind)
        for name in names:
            setattr(server, name, _repeated(getattr(server, name)))


def _repeated(send: Callable) -> Callable:
    @functools.wraps(send)
    def call(*args: Any) -> None:
        if _is_lost(send, args):
            threading.Thread(target=_send_again, args=(send, args), daemon=True).start()

    return call


def _send_again(send: Callable, args: tuple) -> None:
    end = time.monotonic() + REPEATED
    try:
        while time.monotonic() < end:
            with _repeating:
                time.sleep(REST)
                with args[0]:  # raises once it is destroyed
                    if not _is_lost(send, args):
                        return
    except Exception:  # it has been destroyed, or rclpy is shut down: nobody waits for a response any more
        return
    warnings.warn(
        f"a response was given up: its client was not discovered within {REPEATED:.0f} s, or has gone",
        RuntimeWarning,
        stacklevel=1,
    )


def _is_lost(send: Callable, args: tuple) -> bool:
    """Send a response; return True if nobody receives it: a service warns then, an action server raises RCLError."""
    if not any(each[0] == "error" and UNDISCOVERED in getattr(each[1], "pattern", "") for each in warnings.filters):
        warnings.filterwarnings("error", message=f".*{UNDISCOVERED}", category=RuntimeWarning)
    try:
        send(*args)
    except Exception as error:
        # The warning that became an exception was raised by C++ code that looks for none, hence a SystemError.
        if UNDISCOVERED not in f"{error} {error.__cause__}":
            raise
        return True
    return False
