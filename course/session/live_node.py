"""A node in this kernel, and the reader's handle on it."""

import contextlib
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Mapping
from types import FrameType
from typing import Any, Protocol

from rcl_interfaces.msg import SetParametersResult
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.context import Context
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node
from rclpy.parameter import Parameter

from course.explaining.failure_report import (
    GOAL_ENDING,
    FailureReport,
    Frame,
    cell_of,
    frame_at,
    of_goal,
    of_no_result,
    place_of,
    text_of,
)
from course.explaining.source import argument, calls, class_text, parse
from course.ros.names import SEND, is_hidden
from course.ros.rclpy_internals import GoalFault, NodeNameNonExistentError, NoResult, is_executing
from course.session.logs import Logs
from course.session.spinner import Spinner, destroy_node


class Owner(Protocol):
    """The part of the session that a handle, or what starts it, needs."""

    @property
    def elsewhere(self) -> str:
        """Return a sentence if the kernel has left the notebook's folder, or ''."""

    def logs(self, name: str) -> Logs:
        """Return the log of the node called `name`."""

    def stop(self, name: str) -> None:
        """Stop the node called `name`."""


class LiveNode:
    """A handle on a node that runs in this kernel; `node` is the rclpy node itself."""

    def __init__(self, owner: Owner, spinner: Spinner, cell: str = "", *, of_check: bool = False):
        """Make one; `cell` names the code of the cell that has started it, if one has.

        One that is `of_check` is a part of a public check, which may hold its callbacks on purpose.
        """
        self._owner, self._spinner, self.cell, self.of_check = owner, spinner, cell, of_check
        self.node = spinner.node
        self.name = self.node.get_name()
        self.nodes = [self.node.get_fully_qualified_name()]
        self._namespace = self.node.get_namespace()
        self._destroy = self.node.destroy_node
        self.node.destroy_node = self._destroyed  # type: ignore[method-assign]
        self.started = time.time()
        self.over: float | None = None  # nobody asks: one that was stopped is in no table

    @property
    def threads(self) -> int:
        """Return the number of threads of its executor."""
        return self._spinner.threads

    @property
    def alive(self) -> bool:
        """Return False once its executor has stopped spinning."""
        return self._spinner.alive

    @property
    def errors(self) -> list[BaseException]:
        """Return the exceptions that its callbacks raised."""
        return list(self._spinner.errors)

    def goal_failed(self, fault: Exception | GoalFault | NoResult) -> None:
        """Record what a callback of its action server has raised, or done wrong otherwise."""
        if isinstance(fault, GoalFault):
            self._spinner.tell(of_goal(f"The node {self.name}", fault))
        elif isinstance(fault, NoResult):
            self._spinner.tell(of_no_result(f"The node {self.name}", fault))
        else:
            self._spinner.caught(fault, GOAL_ENDING)

    @property
    def source(self) -> str:
        """Return the text of the cells and files that define its services' callbacks."""
        return "".join(dict.fromkeys(text_of(service.callback) for service in self.node.services))

    def callback_of(self, service: str) -> tuple[str, str]:
        """Return the text of the cell or file of the callback of `service`, and its name; '' if unknown."""
        found = (each.callback for each in self.node.services if each.service_name == service)
        return next(((text_of(callback), getattr(callback, "__name__", "")) for callback in found), ("", ""))

    def one_group(self, service: str) -> bool:
        """Return True if a client of the node is in the exclusive callback group of `service`."""
        groups = {each.callback_group for each in self.node.services if each.service_name == service}
        exclusive = {group for group in groups if isinstance(group, MutuallyExclusiveCallbackGroup)}
        return any(client.callback_group in exclusive for client in self.node.clients)

    def keeps_callers_waiting(self, service: str) -> bool:
        """Return True if a call of `service` has begun, and keeps its exclusive callback group closed until it ends."""
        return any(is_executing(each) for each in self.node.services if each.service_name == service)

    @property
    def raised(self) -> int:
        """Return the number of exceptions that its callbacks have raised; the last ones are its `errors`."""
        return self._spinner.raised

    def has_raised_in(self, service: str, since: int) -> bool:
        """Return True if one of its kept exceptions after the first `since` was raised in the callback of `service`."""
        _, name = self.callback_of(service)
        raised, errors = self.raised, self.errors
        errors = errors[max(0, len(errors) - (raised - since)) :] if name and raised > since else []
        return any(
            frame.f_code.co_name == name for error in errors for frame, _ in traceback.walk_tb(error.__traceback__)
        )

    def doing(self) -> tuple[Frame, ...]:
        """Return the frames of a callback that it is in now; () if it only waits for callbacks."""
        return self._spinner.doing()

    def callbacks(self) -> list[tuple[FrameType, tuple[Frame, ...]]]:
        """Return the callbacks that it is in now, as `Spinner.callbacks` does."""
        return self._spinner.callbacks()

    def goes_on(self) -> bool:
        """Return True if it was stopped, and one of its callbacks has still not returned."""
        return self._spinner.goes_on()

    def is_held_here(self) -> bool:
        """Return True in the node's only thread for callbacks."""
        return self._spinner.thread is threading.current_thread()

    @property
    def reports(self) -> list[FailureReport]:
        """Return the reports on exceptions of its callbacks."""
        return list(self._spinner.reports)

    @property
    def services(self) -> set[str]:
        """Return its services, those of its actions included."""
        with contextlib.suppress(InvalidHandle, NodeNameNonExistentError):  # the node is being made or destroyed
            return {name for name, _ in self.node.get_service_names_and_types_by_node(self.name, self._namespace)}
        return set()

    @property
    def offers(self) -> set[str]:
        """Return the services, actions and topics that it offers to others."""
        return {
            *(name for each in self.services if not is_hidden(name := each.removesuffix(SEND))),
            *(publisher.topic_name for publisher in self.node.publishers),
        }

    @property
    def cls(self) -> type[Node]:
        """Return its class, as the reader has written it."""
        return type(self.node).__bases__[0]

    @property
    def state(self) -> str:
        """Return a line: running or stopped, and the last exception."""
        running = "running" if self.alive else "stopped"
        return f"{running}; {self.reports[-1].line}" if self.reports else running

    @property
    def where(self) -> str:
        """Return where it runs."""
        return f"this kernel, class {type(self.node).__name__}"

    @property
    def logs(self) -> Logs:
        """Return the node's log so far."""
        return self._owner.logs(self.name)

    def is_version_of(self, cls: type[Node]) -> bool:
        """Return True if this node's class is an earlier version of `cls`, or a base of it."""
        return type(self.node).__name__ == cls.__name__ or issubclass(cls, self.cls)

    @property
    def edited(self) -> bool:
        """Return True if the notebook has another version of its class by now, with another text."""
        began = self.cls
        now = vars(sys.modules["__main__"]).get(began.__name__)
        if began.__module__ != "__main__" or now is began or not (isinstance(now, type) and issubclass(now, Node)):
            return False
        before, after = (class_text(cell_of(each), began.__name__) for each in (began, now))
        return before != after and "" not in (before, after)

    def stop(self) -> None:
        """Stop spinning it and destroy it; stopping twice is not an error."""
        self._owner.stop(self.name)

    def _destroyed(self) -> None:
        """End it with its executor where the reader destroys the node, in a cell; elsewhere do as rclpy does."""
        if threading.current_thread() is threading.main_thread():
            self.stop()
        else:
            self._destroy()

    def _end(self) -> tuple[Frame, ...]:
        """Stop it; return where a callback still is that does not return, () if none is."""
        vars(self.node).pop("destroy_node", None)
        if not self.alive or self._spinner.stop():
            return ()
        left = self.doing()
        destroy_node(self.node)
        return left

    def __repr__(self) -> str:
        return f"<{self.name}: {'running' if self.alive else 'stopped'} in this kernel>"


def in_context(
    cls: type[Node],
    context: Context,
    arguments: list[str],
    make_room: Callable[[str], None],
    notice: Callable[[str], None],
) -> type[Node]:
    """Return `cls` with a base before Node that passes the session's context to Node, whatever its `__init__` takes.

    `make_room` is called with the node's name before the node is made, and `notice` with messages to the reader.
    """

    class Injector(Node):
        def __init__(self, *args: Any, **kwargs: Any):
            kwargs.setdefault("context", context)
            kwargs["cli_args"] = [*(kwargs.get("cli_args") or []), *arguments]
            make_room(kwargs.get("node_name", *args[:1]))
            super().__init__(*args, **kwargs)

        def set_parameters(self, parameter_list: list[Parameter]) -> list[SetParametersResult]:
            """Tell the reader about refused sets in a cell, because few look at the results."""
            results = super().set_parameters(parameter_list)
            if threading.current_thread() is threading.main_thread():
                for asked, result in zip(parameter_list, results, strict=False):
                    if not result.successful:
                        reason = f": {result.reason}" if result.reason else ", without a reason"
                        notice(f"{self.get_name()} refused {asked.name} = {asked.value!r}{reason}")
            return results

    bases = (cls, Injector) if cls is not Node else (Injector,)
    return type(cls.__name__, bases, {"__module__": cls.__module__, "__doc__": cls.__doc__})


SLOW = 5.0  # s between two runs of a timer whose period may be meant in Hz or in milliseconds


def slow_timers(handles: Mapping[str, object]) -> list[str]:
    """Return a sentence on each node of this kernel with a timer that fires so seldom that a wait for it is in vain."""
    found = []
    for name, handle in list(handles.items()):
        with contextlib.suppress(InvalidHandle):  # it ends just now
            if not isinstance(handle, LiveNode):
                continue
            timers = list(handle.node.timers)
            if (slow := max((each.timer_period_ns / 1e9 for each in timers), default=0.0)) >= SLOW:
                made: Any = type(handle.node).__mro__[1].__init__  # type: ignore[misc]  # that of the reader's class
                at = next((f"\n{each}" for each in _timers_of(made, slow)), "")
                found.append(
                    f"A timer of {name} runs every {slow:g} s: `create_timer` takes the period in seconds.{at}"
                )
    return found


def _timers_of(method: Callable[..., object], period: float) -> Iterator[Frame]:
    """Yield the lines of a method's text that make a timer with this period (s), written out."""
    code, source = getattr(method, "__code__", None), text_of(method)
    for call in calls(parse(source), "create_timer") if code else ():
        if getattr(argument(call, 0, "timer_period_sec"), "value", None) == period:
            yield frame_at(place_of(code.co_filename), call.lineno, source)  # type: ignore[union-attr]
