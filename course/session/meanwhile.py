"""Those that use the names of a public check while it runs: a check takes what they send for its own."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from rclpy.action import ActionClient
from rclpy.client import Client
from rclpy.node import Node
from rclpy.task import Future
from rclpy.timer import Timer

from course.explaining.source import is_cell
from course.ros.rclpy_internals import ClientWatcher, action_name, owner, watch_clients
from course.session.live_node import LiveNode
from course.session.node_process import NodeProcess
from course.session.outsiders import Outsider, Outsiders
from course.session.watch import Handle


class Meanwhile(ClientWatcher):
    """A record of the requests and goals that the notebook's own nodes send while a check runs."""

    def __init__(self, node: Node, handles: Mapping[str, Handle], outsiders: Outsiders):
        """Prepare it for the session's own `node`, and its `handles`."""
        self._node, self._handles, self._outsiders = node, handles, outsiders
        self._names: set[str] = set()
        self._judged: list[Handle] = []
        self._sent: Counter[tuple[str, str]] = Counter()  # by the sender's node and the name
        self._clients: list[tuple[Outsider, str]] = []  # of programs outside, when the check began
        self._files: list[tuple[str, str]] = []  # the notebook's that have a client of a name, when the check began
        self._timers: list[Timer] = []  # of the session's node, made in cells, when the check began
        self._end: Callable[[], None] | None = None

    def begin(self) -> None:
        """Begin with nothing, as a check does."""
        self.end()
        self._names.clear()
        self._judged.clear()
        self._sent.clear()
        self._clients.clear()
        self._files.clear()
        self._timers = [each for each in self._node.timers if is_cell(_code(each))]
        self._end = watch_clients(self)

    @property
    def goes_on(self) -> bool:
        """Return True while a check runs."""
        return self._end is not None

    def end(self) -> None:
        """End the record, and keep it."""
        self._names |= self._services()
        if self._end:
            self._end()
        self._end = None

    def judges(self, started: Handle) -> Handle:
        """Note a file that the check has started, and return it."""
        self._judged.append(started)
        return started

    def uses(self, names: Iterable[str]) -> None:
        """Note that the check uses these services, actions and topics, and who has a client of one already."""
        new = {*names} - self._names
        self._names |= new
        for name in sorted(new):
            self._clients += [(each, name) for each in self._outsiders.calling(name)]
            self._files += [
                (key, name)
                for key in self._outsiders.own(name, calling=True)
                if isinstance(self._handles.get(key), NodeProcess)
            ]

    def called(self, client: Client, request: Any, future: Future, at: float) -> None:
        """Count a request."""
        self._sent[owner(client), client.service_name] += 1

    def goal_begins(self, client: ActionClient, goal: Any, goal_id: bytes, *, own: bool) -> None:
        """Count a goal."""
        self._sent[owner(client), action_name(client)] += 1

    def __str__(self) -> str:
        """Return who else has used a name of the check, and how to end it; '' for nobody."""
        return " ".join([*self._own(), *self._outside()])

    def _nodes(self) -> list[LiveNode]:
        return [handle for handle in list(self._handles.values()) if isinstance(handle, LiveNode)]

    def _services(self) -> set[str]:
        """Return the services of the check's own nodes and of the file that it judges, those for parameters, too."""
        judged = {name for each in self._judged for name in each.services}
        return judged | {
            service.service_name for node in self._nodes() if node.of_check for service in node.node.services
        }

    def _own(self) -> Iterator[str]:
        names = self._names | self._services()
        for (sender, name), count in self._sent.items():
            for each in self._nodes():
                if sender in each.nodes and name in names and not each.of_check:
                    times = "once" if count == 1 else f"{count} times"
                    yield (
                        f"{each.name} of this notebook has called {name} {times} meanwhile, which may be why. "
                        f"To end it: ros.stop('{each.name}')."
                    )
        for timer in self._timers:
            if not timer.is_canceled() and timer in self._node.timers:
                called = getattr(timer.callback, "__name__", "a function")
                yield (
                    f"A timer of `ros.node` calls `{called}` meanwhile, which may be why. To end all of them: "
                    "`for timer in ros.node.timers: timer.cancel()`."
                )
        for key, name in self._files:
            if key in self._outsiders.own(name, calling=True):
                yield (
                    f"{key} of this notebook has a client of {name}: it may have called it meanwhile. "
                    f"To end it: ros.stop('{key}')."
                )

    def _outside(self) -> Iterator[str]:
        for each, name in self._clients:
            if each.pid in {now.pid for now in self._outsiders.calling(name)}:  # its name may be known only now
                yield f"{each} has a client of {name}: it may have called it meanwhile. To end it: {each.ending}."


def _code(timer: Timer) -> str:
    """Return the file, or the cell, of a timer's callback; '' if it has none."""
    return getattr(getattr(timer.callback, "__code__", None), "co_filename", "")
