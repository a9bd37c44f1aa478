"""Lets the session ask a started program for its stacks, and see the messages of its services.

Python loads this module by its name, from PYTHONPATH, before the program begins (see the module `site`).

Stacks: at the signal SIGUSR2, Python itself writes the stack of each thread (`faulthandler`) into a file from the
session, even in an endless loop.

Services: if they are recorded, every service of the program is introspected by rclpy: requests and responses are
published on the hidden topic SERVICE/_service_event, and the last ones are kept for late subscribers.

Leaving: a program that does not end by Ctrl-C, because one of its threads goes on, is told by a signal to destroy its
nodes before it is killed. Else others would see them, and ask them, until their lease is over.

Exits: a program that calls `exit()` notes in the same file where it did, because Python says nothing.

Exceptions: rclpy 7.1.6 raises an exception of a callback that ran in a thread of a MultiThreadedExecutor only once the
next callback is due.  Here that is at once.  It also gives the callback to its threads again and again until one has
begun it, and keeps them from beginning while it does; here it waits a moment.  A response that its client cannot
receive yet is sent again, an action's client waits with an answer until its request is noted, and what is logged reads
no file (see course/ros/rclpy_patches.py, which is loaded without the rest of the course).

Introspection is switched on when a service is made, by the same thread, and not later: rclpy does not promise that
another thread may do it while an executor works.
"""

import builtins
import contextlib
import faulthandler
import gc
import importlib.machinery
import importlib.util
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Mapping
from types import FrameType
from typing import Any

WANTED = "COURSE_INTROSPECTION"
STACKS = "COURSE_STACKS"  # the descriptor of the file for the stacks
ASK = signal.SIGUSR2
LEAVE = signal.SIGRTMIN + 7  # which no program uses for itself
EXIT = "Exit"  # begins a note on a call that ends the program
HERE = os.path.dirname(os.path.abspath(__file__))
DEPTH = 100  # events that are kept
PATCHES = os.path.join(os.path.dirname(os.path.dirname(HERE)), "ros", "rclpy_patches.py")
# Every node has services of these packages; one of them is not made by rclpy, and cannot be introspected.
OF_EVERY_NODE = ("rcl_interfaces", "type_description_interfaces")


def environment(variables: "Mapping[str, str]", stacks: int, *, introspecting: bool) -> "dict[str, str]":
    """Return `variables` with those that make a program load this module; `stacks` is its open file."""
    path = os.pathsep.join([HERE, *filter(None, [variables.get("PYTHONPATH")])])
    return {"PYTHONPATH": path, STACKS: str(stacks)} | ({WANTED: "1"} if introspecting else {})


def introspected(original: "Callable[..., Any]") -> "Callable[..., Any]":
    """Return a replacement of `Node.create_service`, the `original`, that introspects its services."""
    clocks: list[Any] = []  # Seen in rclpy 7.1.6: the service does not keep its clock, and crashes without it

    def create_service(*args: Any, **kwargs: Any) -> Any:
        service = original(*args, **kwargs)
        # Failing introspection must not disturb the node.
        with contextlib.suppress(Exception):
            from rclpy.clock import Clock
            from rclpy.qos import DurabilityPolicy, QoSProfile
            from rclpy.service_introspection import ServiceIntrospectionState

            if service.srv_type.__module__.partition(".")[0] not in OF_EVERY_NODE:
                clocks[:] = clocks or [Clock()]
                kept = QoSProfile(depth=DEPTH, durability=DurabilityPolicy.TRANSIENT_LOCAL)
                service.configure_introspection(clocks[0], kept, ServiceIntrospectionState.CONTENTS)
        return service

    return create_service


def noted(original: "Callable[..., Any]", stacks: int) -> "Callable[..., Any]":
    """Return a replacement of a function that ends the program, which notes first where it is called."""

    def end(*args: Any, **kwargs: Any) -> Any:
        with contextlib.suppress(Exception):
            where = "main thread" if threading.current_thread() is threading.main_thread() else "other thread"
            lines = [f"{EXIT} in the {where} (most recent call first):"]
            frame: FrameType | None = sys._getframe(1)
            while frame is not None:
                lines.append(f'  File "{frame.f_code.co_filename}", line {frame.f_lineno} in {frame.f_code.co_name}')
                frame = frame.f_back
            os.write(stacks, "\n".join([*lines, ""]).encode(errors="replace"))
        return original(*args, **kwargs)

    return end


def leave(*_: object) -> None:
    """Destroy the nodes of this program, so that they leave the graph, and end it."""
    # No other thread sees what is destroyed; one that was about to run, and works without end, is waited for as long.
    sys.setswitchinterval(0.25)  # s
    with contextlib.suppress(Exception):
        cls = sys.modules["rclpy.node"].Node
        for node in [each for each in gc.get_objects() if issubclass(type(each), cls)]:
            for waitable in list(node.waitables):  # the servers and clients of actions keep it in the graph
                with contextlib.suppress(Exception):
                    waitable.destroy()
            with contextlib.suppress(Exception):
                node.destroy_node()
    os.kill(os.getpid(), signal.SIGKILL)


def patch(executors: Any) -> None:
    """Patch rclpy as soon as its executors are there."""
    from rclpy.impl import rcutils_logger
    from rclpy.impl.implementation_singleton import rclpy_implementation

    patches = load_patches()
    patches.load_generator_later()
    patches.load_numpy_later()
    patches.repeat_lost_responses(rclpy_implementation)
    patches.find_callers_by_name(rcutils_logger)
    begin_and_raise_at_once(executors, patches.HANDED_OVER)


def lock_clients(client: Any) -> None:
    """Patch rclpy's clients of actions as soon as their module is there."""
    load_patches().lock_action_clients(client.ActionClient)


def load_patches() -> Any:
    """Load the patches, without the rest of the course."""
    spec: Any = importlib.util.spec_from_file_location("rclpy_patches", PATCHES)
    patches = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(patches)
    return patches


def begin_and_raise_at_once(executors: Any, handed_over: float) -> None:
    """Have rclpy's MultiThreadedExecutor begin a callback, and raise its exception, at once."""

    def make(original: "Callable[..., Any]") -> "Callable[..., Any]":
        def init(self: Any, *args: Any, **kwargs: Any) -> None:
            original(self, *args, **kwargs)
            submit = self._executor.submit

            def submitted(task: Any) -> Any:
                def look(_: Any) -> None:
                    if getattr(task, "_exception", None) is not None:
                        self.create_task(lambda: None)  # before the executor runs it, it looks for exceptions

                future = submit(task)
                future.add_done_callback(look)
                time.sleep(handed_over)
                return future

            self._executor.submit = submitted

        return init

    executors.MultiThreadedExecutor.__init__ = make(executors.MultiThreadedExecutor.__init__)


class AfterImport:
    """A finder of modules that calls a function with the module `name` once the program has imported it."""

    def __init__(self, name: str, call: "Callable[[Any], None]"):
        self._name, self._call = name, call

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> Any:
        """Return the spec of the module as the other finders do."""
        if name != self._name:
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(name)
        if spec and spec.loader:
            load = spec.loader.exec_module

            def loaded(module: Any) -> None:
                load(module)
                with contextlib.suppress(Exception):
                    self._call(module)

            spec.loader.exec_module = loaded  # type: ignore[method-assign]
        return spec


def begin() -> None:
    """Set this up in the program, and remove its variables from the environment."""
    others = [folder for folder in os.environ.pop("PYTHONPATH", "").split(os.pathsep) if folder not in ("", HERE)]
    if others:
        os.environ["PYTHONPATH"] = os.pathsep.join(others)
    sys.path[:] = [folder for folder in sys.path if folder != HERE]
    with contextlib.suppress(OSError, ValueError):  # the program runs without stacks
        stacks = int(os.environ.pop(STACKS, ""))
        os.set_inheritable(stacks, False)
        signal.signal(ASK, signal.SIG_IGN)  # what Python restores when it ends, just as it is asked
        faulthandler.register(ASK, file=stacks, all_threads=True)
        signal.signal(LEAVE, leave)
        for owner, name in ((builtins, "exit"), (builtins, "quit"), (sys, "exit"), (os, "_exit")):
            setattr(owner, name, noted(getattr(owner, name), stacks))
        sys.meta_path.insert(0, AfterImport("rclpy.executors", patch))
        sys.meta_path.insert(0, AfterImport("rclpy.action.client", lock_clients))
    if os.environ.pop(WANTED, ""):
        with contextlib.suppress(Exception):  # the program itself will raise it when it imports rclpy
            from rclpy.node import Node

            Node.create_service = introspected(Node.create_service)  # type: ignore[method-assign]
    # The system may have a module of this name, too, which this one has hidden.
    if (spec := importlib.machinery.PathFinder.find_spec("sitecustomize", sys.path)) and spec.loader:
        spec.loader.exec_module(importlib.util.module_from_spec(spec))


if __name__ == "sitecustomize" and STACKS in os.environ:
    begin()
