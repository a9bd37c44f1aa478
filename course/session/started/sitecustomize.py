"""Lets the session ask a program that it has started where it is, and see what passes through its services.

Python loads this module by its name, from PYTHONPATH, before the program begins (see the module `site`).

Where it is: at the signal SIGUSR2, Python itself writes what each thread is doing (`faulthandler`) into a file that the
session has given it, also amid a loop that never ends.

What passes: where it is recorded, every service that the program makes is introspected, as rclpy offers it: requests
and responses are published on the hidden topic SERVICE/_service_event, and the last of them are kept there for who
subscribes later.

It is switched on where a service is made, by the thread that makes it, and never later: nothing of rclpy promises that
it may be switched by another thread while an executor works.
"""

import contextlib
import faulthandler
import importlib.machinery
import importlib.util
import os
import signal
import sys
from collections.abc import Callable, Mapping
from typing import Any

WANTED = "COURSE_INTROSPECTION"
STACKS = "COURSE_STACKS"  # the number of the open file for what the threads do
ASK = signal.SIGUSR2
HERE = os.path.dirname(os.path.abspath(__file__))
DEPTH = 100  # events that are kept
# Every node has services of these packages; one of them is not of rclpy's making, and cannot be introspected.
OF_EVERY_NODE = ("rcl_interfaces", "type_description_interfaces")


def environment(variables: "Mapping[str, str]", stacks: int, *, introspecting: bool) -> "dict[str, str]":
    """Return the variables that a program needs, beside its `variables`, to load this; `stacks` is its open file."""
    path = os.pathsep.join([HERE, *filter(None, [variables.get("PYTHONPATH")])])
    return {"PYTHONPATH": path, STACKS: str(stacks)} | ({WANTED: "1"} if introspecting else {})


def introspected(original: "Callable[..., Any]") -> "Callable[..., Any]":
    """A `Node.create_service` in the place of the `original` one, whose services are introspected."""
    clocks: list[Any] = []  # Seen in rclpy 7.1.6: the service does not keep its clock, and crashes when it has gone

    def create_service(*args: Any, **kwargs: Any) -> Any:
        service = original(*args, **kwargs)
        # A service that cannot be seen is no reason to disturb its node.
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


def begin() -> None:
    """Do it in this program, and leave no trace in what it and its children see of their environment."""
    others = [folder for folder in os.environ.pop("PYTHONPATH", "").split(os.pathsep) if folder not in ("", HERE)]
    if others:
        os.environ["PYTHONPATH"] = os.pathsep.join(others)
    sys.path[:] = [folder for folder in sys.path if folder != HERE]
    with contextlib.suppress(OSError, ValueError):  # the program runs without being asked
        stacks = int(os.environ.pop(STACKS, ""))
        os.set_inheritable(stacks, False)
        faulthandler.register(ASK, file=stacks, all_threads=True)
    if os.environ.pop(WANTED, ""):
        with contextlib.suppress(Exception):  # the program will say it when it imports rclpy
            from rclpy.node import Node

            Node.create_service = introspected(Node.create_service)  # type: ignore[method-assign]
    # The system may have such a module, too, which this one has hidden.
    if (spec := importlib.machinery.PathFinder.find_spec("sitecustomize", sys.path)) and spec.loader:
        spec.loader.exec_module(importlib.util.module_from_spec(spec))


if __name__ == "sitecustomize" and STACKS in os.environ:
    begin()
