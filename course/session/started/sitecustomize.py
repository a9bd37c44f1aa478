"""Lets the session ask a started program for its stacks, and see the messages of its services.

Python loads this module by its name, from PYTHONPATH, before the program begins (see the module `site`).

Stacks: at the signal SIGUSR2, Python itself writes the stack of each thread (`faulthandler`) into a file from the
session, even in an endless loop.

Services: if they are recorded, every service of the program is introspected by rclpy: requests and responses are
published on the hidden topic SERVICE/_service_event, and the last ones are kept for late subscribers.

Introspection is switched on when a service is made, by the same thread, and not later: rclpy does not promise that
another thread may do it while an executor works.
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
STACKS = "COURSE_STACKS"  # the descriptor of the file for the stacks
ASK = signal.SIGUSR2
HERE = os.path.dirname(os.path.abspath(__file__))
DEPTH = 100  # events that are kept
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


def begin() -> None:
    """Set this up in the program, and remove its variables from the environment."""
    others = [folder for folder in os.environ.pop("PYTHONPATH", "").split(os.pathsep) if folder not in ("", HERE)]
    if others:
        os.environ["PYTHONPATH"] = os.pathsep.join(others)
    sys.path[:] = [folder for folder in sys.path if folder != HERE]
    with contextlib.suppress(OSError, ValueError):  # the program runs without stacks
        stacks = int(os.environ.pop(STACKS, ""))
        os.set_inheritable(stacks, False)
        faulthandler.register(ASK, file=stacks, all_threads=True)
    if os.environ.pop(WANTED, ""):
        with contextlib.suppress(Exception):  # the program itself will raise it when it imports rclpy
            from rclpy.node import Node

            Node.create_service = introspected(Node.create_service)  # type: ignore[method-assign]
    # The system may have a module of this name, too, which this one has hidden.
    if (spec := importlib.machinery.PathFinder.find_spec("sitecustomize", sys.path)) and spec.loader:
        spec.loader.exec_module(importlib.util.module_from_spec(spec))


if __name__ == "sitecustomize" and STACKS in os.environ:
    begin()
