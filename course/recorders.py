"""Recorders keep events in a plain table: the nodes' threads add rows, and the notebook reads them.

A table is a dict of columns, each a list, so that `plot(table["time"], table["front"])` plots one against another.
Times are in seconds since the recorder was made.
"""

import math
import sys
import threading
import time
from collections.abc import Callable, Mapping
from operator import attrgetter
from typing import Any, Protocol, Self, cast
from weakref import WeakSet

from action_msgs.msg import GoalStatus
from action_msgs.srv import CancelGoal
from rcl_interfaces.msg import SetParametersResult
from rclpy.action import ActionClient
from rclpy.action.client import ClientGoalHandle
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.task import Future

from course.errors import CourseError, NodeFailed
from course.foundation.waiting import Lasting, ask_lookouts, wait_until
from course.ros.rclpy_internals import action_name, action_type, keep_feedback, watch_parameters

STATUS = {
    GoalStatus.STATUS_SUCCEEDED: "succeeded",
    GoalStatus.STATUS_CANCELED: "canceled",
    GoalStatus.STATUS_ABORTED: "aborted",
}

Table = dict[str, list[Any]]

GONE = 0.7  # s without an action server, after which nothing more of a goal can come
LAST = 2.0  # s by which a feedback message may come after the end of its goal
LATE = 1.0  # s by which the report of an exception may come after the end of its goal
# Each makes a function that a wait for a goal calls again and again.  It is given the action's name, a limit (s), and
# when the last other goal was sent that may still go on (s, monotonic; -inf for none).  The function returns '', or
# lines that say where the server is, once a callback there will not return within the limit of its call.  A live
# session adds its own.
hanging: list[Callable[[str, float, float], Callable[[], str]]] = []


class Recorder:
    """A table of rows with a time; any thread may add rows."""

    def __init__(self, *columns: str) -> None:
        self.columns = ("time", *columns)
        self.start = time.monotonic()  # s
        self._rows: list[tuple[Any, ...]] = []
        self._lock = threading.Lock()

    def add(self, **values: object) -> None:
        """Add a row; a column that is not given holds None.  Raises TypeError for an unknown column."""
        if unknown := set(values) - set(self.columns):
            raise TypeError(f"no column {', '.join(sorted(unknown))}: the columns are {', '.join(self.columns)}")
        with self._lock:
            row = {"time": time.monotonic() - self.start, **values}
            self._rows.append(tuple(row.get(column) for column in self.columns))

    def table(self) -> Table:
        """Return all rows so far, as columns."""
        with self._lock:
            rows = list(self._rows)
        return {column: [row[number] for row in rows] for number, column in enumerate(self.columns)}

    def __len__(self) -> int:
        return len(self._rows)

    def wait_for(self, wanted: int | Callable[[Table], bool], timeout: float = 5.0) -> bool:
        """Wait until there are `wanted` rows, or until `wanted(table)` holds; False after `timeout` s."""

        def there() -> bool:  # called without the lock: a callback must not wait while the table is checked
            return len(self._rows) >= wanted if isinstance(wanted, int) else wanted(self.table())

        return wait_until(there, timeout)


class TopicRecorder(Recorder):
    """The messages of a topic.

    `fields` maps each column to a path in the message, `{"x": "pose.pose.position.x"}`, or to a function of the
    message.
    """

    def __init__(
        self, node: Node, msg_type: type, topic: str, fields: Mapping[str, str | Callable[[Any], object]], qos: int = 10
    ) -> None:
        super().__init__(*fields)
        self._fields: dict[str, Callable[[Any], object]] = {
            name: attrgetter(field) if isinstance(field, str) else field for name, field in fields.items()
        }
        self._node = node
        self._subscription = node.create_subscription(msg_type, topic, self._on_message, qos)

    def _on_message(self, message: object) -> None:
        self.add(**{name: field(message) for name, field in self._fields.items()})

    def close(self) -> None:
        """End the subscription; the table stays."""
        self._node.destroy_subscription(self._subscription)


class GoalRecorder(Recorder):
    """The events of one goal, seen from its client: rows of `event`, `message` and `sequence`.

    The events are goal, accepted or rejected, feedback, cancel (requested) and, at the end, succeeded, canceled or
    aborted.  `message` is the feedback or the result that came with the event, and `sequence` the first list in it.
    """

    END = ("rejected", *STATUS.values())

    def __init__(self, client: ActionClient) -> None:
        super().__init__("event", "sequence", "message")
        if not isinstance(client, ActionClient):
            raise CourseError(
                "GoalRecorder takes an action client, such as `ActionClient(ros.node, TheType, 'name')`, not "
                f"{client!r:.40}"
            )
        keep_feedback(client)
        self._client, self._name = client, action_name(client)
        self._sent = 0.0  # the time at which the goal was sent (s, monotonic)
        self._handle: ClientGoalHandle | None = None

    def send(self, goal: object) -> Self:
        """Send the goal, and record its events; raises CourseError for anything but a goal of the client's action."""
        kind: Any = action_type(self._client)
        if not isinstance(goal, kind.Goal):
            raise CourseError(
                f"`send` takes a goal with its values by name, `{kind.__name__}.Goal(...)`, not {goal!r:.40}"
            )
        if self._sent:
            raise CourseError(
                "this recorder has a goal: make a new one for each goal, `GoalRecorder(client).send(goal)`"
            )
        self.add(event="goal")
        self._sent = time.monotonic()
        _sent.add(self)
        self._client.send_goal_async(goal, feedback_callback=self._on_feedback).add_done_callback(self._on_answer)
        return self

    def cancel(self) -> Future:
        """Ask the server to cancel the goal, and return the future of its answer.

        Raises CourseError before a goal is sent, and before it has an answer.
        """
        self._expect_goal()
        if self._handle is None:
            raise CourseError("the goal has not been accepted yet: wait for that before you cancel it")
        self.add(event="cancel")
        answer = self._handle.cancel_goal_async()
        answer.add_done_callback(self._on_cancel)
        return answer

    def _expect_goal(self) -> None:
        if not self._sent:
            raise CourseError("no goal was sent: `GoalRecorder(client).send(goal)` sends one")

    def _on_cancel(self, future: Future) -> None:
        answer = future.result()
        ended = CancelGoal.Response.ERROR_GOAL_TERMINATED
        if answer is not None and not answer.goals_canceling and answer.return_code != ended:
            print(
                "The server refused the cancel: give its ActionServer a `cancel_callback` that returns "
                "CancelResponse.ACCEPT.",
                file=sys.stderr,
            )

    def _on_answer(self, future: Future) -> None:
        self._handle = handle = future.result()
        self.add(event="accepted" if handle.accepted else "rejected")
        if handle.accepted:
            handle.get_result_async().add_done_callback(self._on_result)

    def _on_feedback(self, message: Any) -> None:
        self._add("feedback", message.feedback)

    def _on_result(self, future: Future) -> None:
        response = future.result()
        self._add(STATUS.get(response.status, "unknown"), response.result)

    def _add(self, event: str, message: Any) -> None:
        fields = [getattr(message, name) for name in message.get_fields_and_field_types()]
        lists = [list(field) for field in fields if hasattr(field, "__len__") and not isinstance(field, str)]
        self.add(event=event, message=message, sequence=lists[0] if lists else None)

    def wait_for(self, wanted: int | Callable[[Table], bool], timeout: float = 5.0) -> bool:
        """Wait as for any recorder; raises NodeFailed once nothing more can come in time.

        That is so when the goal's server is gone, or is in a callback that does not return in time.
        """
        gone = Lasting(lambda: not self._client.server_is_ready(), GONE)
        name = self._name
        others = [each._sent for each in list(_sent) if each is not self and each._name == name and each._goes_on()]
        limit = time.monotonic() + timeout - self._sent if self._goes_on() else math.inf
        looks = [make(name, limit, max(others, default=-math.inf)) for make in hanging]
        at = ""

        def there() -> bool:
            return super(GoalRecorder, self).wait_for(wanted, 0.0)

        def over() -> bool:
            nonlocal at
            at = next(filter(None, (look() for look in looks)), "") if self._end() is None else ""
            return gone() or bool(at)

        if found := wait_until(there, timeout, unless=over):
            return found
        if self._end() is None and (at or gone()):
            before = self.table()["event"][-1:]
            last = f"its last event is '{before[0] if before else 'none'}'."
            if at:
                raise NodeFailed(f"this goal of the action {name} will get no further within {timeout:g} s: {last}{at}")
            served = "any more" if before and before[0] != "goal" else "now"
            raise NodeFailed(f"no node serves the action {name} {served}, so this goal has no end: {last}")
        return False

    def _goes_on(self) -> bool:
        """Return True once the goal was sent, until it has ended."""
        return self._sent > 0.0 and self._end() is None

    def count(self, event: str) -> int:
        """Return how often `event` has occurred."""
        return self.table()["event"].count(event)

    def wait_feedback(self, count: int, timeout: float = 10.0) -> bool:
        """Wait for `count` feedback messages; False after `timeout` s, or once the goal has ended with fewer."""
        self._expect_goal()
        ends = {*self.END}

        def there(table: dict[str, list[Any]]) -> bool:
            return table["event"].count("feedback") >= count

        if not self.wait_for(lambda table: there(table) or not ends.isdisjoint(table["event"]), timeout):
            return False
        return self.wait_for(there, min(timeout, LAST))

    @property
    def feedback(self) -> list[Any]:
        """The feedback messages so far, in the order in which they came."""
        table = self.table()
        rows = zip(table["event"], table["message"], strict=True)
        return [message for event, message in rows if event == "feedback"]

    @property
    def response(self) -> Any:
        """The result message; None before the end, and for a rejected goal."""
        return self._at_the_end("message")

    @property
    def result(self) -> list[Any] | None:
        """Return the list in the result; None before the end, and for a rejected goal.

        Feedback that was still on its way may be recorded after it.
        """
        return self._at_the_end("sequence")

    def _at_the_end(self, column: str) -> Any:
        table = self.table()
        rows = zip(table["event"], table[column], strict=True)
        return next((value for event, value in rows if event in self.END), None)

    def time_of(self, event: str) -> float | None:
        """Return when `event` was first seen (s since the recorder was made), or None if it was not."""
        table = self.table()
        return next((time for time, each in zip(table["time"], table["event"], strict=True) if each == event), None)

    def wait_end(self, timeout: float = 10.0) -> str | None:
        """Wait for the event that ends the goal, and return it; None after `timeout` s.

        Raises NodeFailed when the goal's server is gone, and in a live session when the goal was aborted because its
        server raised an exception.
        """
        self._expect_goal()
        self.wait_for(lambda table: any(event in self.END for event in table["event"]), timeout)
        end = self._end()
        if end == "aborted":
            wait_until(lambda: False, LATE)  # the exception is reported a little later
        else:
            ask_lookouts()
        return end

    def _end(self) -> str | None:
        return next((event for event in self.table()["event"] if event in self.END), None)


_sent: WeakSet[GoalRecorder] = WeakSet()  # all whose goal was sent


class Observable(Protocol):
    """A node that calls its observers with each of its decisions."""

    observers: list[Callable[[dict[str, Any]], None]]


class DecisionRecorder(Recorder):
    """Each decision of an AIRobotController (course.nodes.ai_robot_controller).

    The columns are the scan's stamp (s), the state, the action (m/s, rad/s), the sectors (m) and the latency (s).
    """

    def __init__(self, controller: Observable) -> None:
        super().__init__("stamp", "state", "linear", "angular", "front", "left", "right", "latency")
        controller.observers.append(lambda decision: self.add(**decision))


class ParameterRecorder(Recorder):
    """Every attempt to set a parameter of a node in this kernel, by anybody.

    The columns are `name`, `value`, `accepted` and `reason`; the first `at_start` rows are the parameters' values at
    the recorder's start, which nobody has set meanwhile.
    """

    def __init__(self, node: Node) -> None:
        super().__init__("name", "value", "accepted", "reason")
        self._node = node
        # rclpy 7.1.6 declares that this returns values, but it returns Parameters.
        parameters = cast(dict[str, Parameter], node.get_parameters_by_prefix(""))
        for name, parameter in sorted(parameters.items()):
            if name not in ("use_sim_time", "start_type_description_service"):  # rclpy's own
                self.add(name=name, value=parameter.value, accepted=True, reason="")
        self.at_start = len(self)
        self._end = watch_parameters(node, self._on_set)

    def _on_set(self, parameters: list[Parameter], result: SetParametersResult) -> None:
        for parameter in parameters:
            self.add(name=parameter.name, value=parameter.value, accepted=result.successful, reason=result.reason)

    def range(self, name: str) -> tuple[float, ...]:
        """The lowest and the highest value that the descriptor of `name` allows; () when it sets no limits."""
        descriptor = self._node.describe_parameter(name)
        for limits in (*descriptor.floating_point_range, *descriptor.integer_range):
            return limits.from_value, limits.to_value
        return ()

    def close(self) -> None:
        """Stop recording; the table stays."""
        self._end()
