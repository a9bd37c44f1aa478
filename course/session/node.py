"""A node in this kernel, and the handle that the reader gets on it."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rclpy.context import Context
from rclpy.node import Node

from course.session.logs import Logs
from course.session.spinner import Spinner, destroy_node

if TYPE_CHECKING:
    from course.session.live import Session


class LiveNode:
    """A handle on a node that runs in this kernel; `node` is the rclpy node itself."""

    def __init__(self, session: "Session", spinner: Spinner):
        self._session, self._spinner = session, spinner
        self.node = spinner.node
        self.name = self.node.get_name()
        self.nodes = [self.node.get_fully_qualified_name()]

    @property
    def alive(self) -> bool:
        """Whether its executor is spinning."""
        return self._spinner.thread.is_alive()

    @property
    def errors(self) -> list[BaseException]:
        """The exceptions that its callbacks raised."""
        return list(self._spinner.errors)

    @property
    def logs(self) -> Logs:
        """What the node has logged so far."""
        return self._session.logs(self.name)

    def stop(self) -> None:
        """Stop spinning it and destroy it; stopping twice is no error."""
        self._session.stop(self.name)

    def _end(self) -> None:
        if self.alive and not self._spinner.stop():
            destroy_node(self.node)

    def __repr__(self) -> str:
        return f"<{self.name}: {'running' if self.alive else 'stopped'} in this kernel>"


def in_context(cls: type[Node], context: Context, arguments: list[str], make_room: Callable[[str], None]) -> type[Node]:
    """`cls` with a last base before Node that hands Node the session's context, whatever the class's `__init__` takes.

    `make_room` is called with the node's name before the node is there.
    """

    class Injector(Node):
        def __init__(self, *args: Any, **kwargs: Any):
            kwargs.setdefault("context", context)
            kwargs["cli_args"] = [*(kwargs.get("cli_args") or []), *arguments]
            make_room(kwargs.get("node_name", *args[:1]))
            super().__init__(*args, **kwargs)

    return type(cls.__name__, (cls, Injector), {"__module__": cls.__module__, "__doc__": cls.__doc__})
