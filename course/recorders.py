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
from typing import Any, NoReturn, Protocol, Self, cast
from weakref import WeakSet

from action_msgs.msg import GoalStatus
from action_msgs.srv import CancelGoal
from rcl_interfaces.msg import SetParametersResult
from rclpy.action import ActionClient
from rclpy.action.client import ClientGoalHandle
from rclpy.exceptions import ParameterNotDeclaredException
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.task import Future

from course.errors import NodeFailed, RecorderError
from course.foundation.calls import fitting, is_whole, takes
from course.foundation.waiting import Lasting, ask_lookouts, tell_reader, time_limit, wait_until
from course.ros.rclpy_internals import (
    InvalidHandle,
    RCLError,
    action_name,
    action_type,
    keep_feedback,
    watch_parameters,
)

STATUS = {
    GoalStatus.STATUS_SUCCEEDED: "succeeded",
    GoalStatus.STATUS_CANCELED: "canceled",
    GoalStatus.STATUS_ABORTED: "aborted",
}

Table = dict[str, list[Any]]

GONE = 0.7  # s without an action server, after which nothing more of a goal can come
ENDING = 3.0  # s more that the program which served it may take to end, and its end tells why
LAST = 2.0  # s by which a feedback message may come after the end of its goal
USUAL = 10.0  # s that a wait for a goal lasts at most, unless another limit is given
NO_LOOK = 5.0  # s from which on the reader is told of a wait for a goal in vain; a shorter one is often a look
LATE = 1.0  # s by which the report of an exception may come after the end of its goal
# Each makes a function that a wait for a goal calls again and again.  It is given the action's name, a limit (s), and
# when the last other goal was sent that may still go on (s, monotonic; -inf for none).  The function returns '', or
# lines that say where the server is, once a callback there will not return within the limit of its call.  A live
# session adds its own.
hanging: list[Callable[[str, float, float], Callable[[], str]]] = []
# Each is given the name of an action, and returns True while a program that has served it runs.
serving: list[Callable[[str], bool]] = []
# Each is given the name of an action, and returns '', or lines that say in which line its server is now.
places: list[Callable[[str], str]] = []


class Recorder:
    """A table of rows with a time; any thread may add rows."""

    def __init__(self, *columns: str) -> None:
        if not all(isinstance(column, str) for column in columns):
            raise RecorderError("a recorder takes the names of its columns, such as `Recorder('angle', 'effort')`")
        self.columns = ("time", *columns)
        self.start = time.monotonic()  # s
        self._rows: list[tuple[Any, ...]] = []
        self._lock = threading.Lock()

    def add(self, *nameless: object, **values: object) -> None:
        """Add a row; a column that is not given holds None.

        Raises TypeError for an unknown column, and RecorderError for a value without the name of its column.
        """
        if nameless:
            columns = [column for column in self.columns[1:] if column not in values] or ["column"]
            named = [f"{column}={value!r:.40}" for column, value in zip(columns, nameless, strict=False)]
            raise RecorderError(f"each value has the name of its column: write `add({', '.join(named)})`")
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

    def __getitem__(self, column: object) -> NoReturn:
        """Raise RecorderError: the columns are in the table."""
        name = column if column in self.columns else self.columns[-1]
        raise RecorderError(f"the columns of a recorder are in its table: write `.table()[{name!r}]`")

    @fitting
    def wait_for(self, wanted: int | Callable[[Table], bool], timeout: float = 5.0) -> bool:
        """Wait until there are `wanted` rows, or until `wanted(table)` holds; False after `timeout` s.

        Raises RecorderError if `wanted` is neither.
        """
        _expect_wanted(wanted)

        def there() -> bool:  # called without the lock: a callback must not wait while the table is checked
            return wanted(self.table()) if callable(wanted) else len(self._rows) >= wanted

        return wait_until(there, timeout)


def _expect_wanted(wanted: object) -> None:
    """Raise RecorderError for what a recorder cannot wait for."""
    if not (is_whole(wanted) or takes(wanted, {})):
        raise RecorderError(
            "`wait_for` waits for a number of rows, as in `wait_for(3)`, or until a function of the table is true, as "
            f"in `wait_for(lambda table: 7 in table['angle'])`, not for {wanted!r:.40}"
        )


def _expect_node(node: object, recorder: str) -> None:
    """Raise RecorderError for anything but a node."""
    if not isinstance(node, Node):
        raise RecorderError(
            f"{recorder} takes a node, such as `ros.node`, or `ros.start(TheNode).node`, not {node!r:.40}"
        )
    try:
        node.get_name()
    except InvalidHandle:
        raise RecorderError(
            f"this node has been ended: give {recorder} a node that runs, such as `ros.start(TheNode).node`"
        ) from None


def _expect_client(client: ActionClient) -> None:
    """Raise RecorderError for an action client that cannot be used any more."""
    try:
        client.server_is_ready()
    except (InvalidHandle, RCLError):
        raise RecorderError(
            "this action client has been destroyed, or its node has been ended: make a new one"
        ) from None


class TopicRecorder(Recorder):
    """The messages of a topic.

    `fields` maps each column to a path in the message, `{"x": "pose.pose.position.x"}`, or to a function of the
    message.  Raises RecorderError for arguments of another kind, and for a path that the message does not have.
    """

    @fitting
    def __init__(
        self, node: Node, msg_type: type, topic: str, fields: Mapping[str, str | Callable[[Any], object]], qos: int = 10
    ) -> None:
        _expect_node(node, "TopicRecorder")
        if not (hasattr(msg_type, "get_fields_and_field_types") and isinstance(topic, str)):
            raise RecorderError(
                "TopicRecorder takes the type of a message, and then the name of a topic, as in "
                f"`TopicRecorder(ros.node, Twist, 'cmd_vel', ...)`, not {msg_type!r:.40} and {topic!r:.40}"
            )
        if not isinstance(fields, Mapping):
            raise RecorderError(
                "the fields are a dict of columns and what each holds of a message, such as {'linear': 'linear.x'}, "
                f"not {fields!r:.40}"
            )
        super().__init__(*fields)
        self._node = node
        self._fields = {name: _field(msg_type, field) for name, field in fields.items()}
        self._subscription = node.create_subscription(msg_type, topic, self._on_message, qos)

    def _on_message(self, message: object) -> None:
        self.add(**{name: field(message) for name, field in self._fields.items()})

    def close(self) -> None:
        """End the subscription; the table stays."""
        self._node.destroy_subscription(self._subscription)


def _field(msg_type: type, field: object) -> Callable[[Any], object]:
    """Return the function that reads a field of a message; raises RecorderError if the message does not have it."""
    name = msg_type.__name__
    if callable(field) and takes(field, None):
        return field
    if not isinstance(field, str):
        raise RecorderError(
            f"a column holds a field of {name} by its name, or what a function of the message returns, such as "
            f"`lambda message: ...`, not {field!r:.40}"
        )
    value: Any = msg_type()
    for word in field.split("."):
        if word not in getattr(value, "get_fields_and_field_types", dict)():
            has: Mapping[str, str] = getattr(type(value), "get_fields_and_field_types", dict)()
            told = f"{type(value).__name__} has {', '.join(has)}" if has else "a function can: `lambda message: ...`"
            raise RecorderError(f"{name} has no field {field!r}: {told}")
        value = getattr(value, word)
    return attrgetter(field)


class GoalRecorder(Recorder):
    """The events of one goal, seen from its client: rows of `event`, `message` and `sequence`.

    The events are goal, accepted or rejected, feedback, cancel (requested) and, at the end, succeeded, canceled or
    aborted.  `message` is the feedback or the result that came with the event, and `sequence` the first list in it.
    """

    END = ("rejected", *STATUS.values())
    EVENTS = ("goal", "accepted", "feedback", "cancel", *END)

    @fitting
    def __init__(self, client: ActionClient) -> None:
        super().__init__("event", "sequence", "message")
        if not isinstance(client, ActionClient):
            raise RecorderError(
                "GoalRecorder takes an action client, such as `ActionClient(ros.node, TheType, 'name')`, not "
                f"{client!r:.40}"
            )
        _expect_client(client)
        keep_feedback(client)
        self._client, self._name = client, action_name(client)
        self._sent = 0.0  # the time at which the goal was sent (s, monotonic)
        self._handle: ClientGoalHandle | None = None

    def send(self, goal: object = None, *more: object, **fields: object) -> Self:
        """Send the goal, and record its events; raises RecorderError for anything but a goal of the client's action."""
        kind: Any = action_type(self._client)
        if fields:
            given = ", ".join(f"{name}={value!r:.40}" for name, value in fields.items())
            raise RecorderError(f"`send` takes a goal: write `send({kind.__name__}.Goal({given}))`")
        if more or not isinstance(goal, kind.Goal):
            raise RecorderError(
                f"`send` takes a goal with its values by name, `{kind.__name__}.Goal(...)`, not "
                f"{', '.join(f'{each!r:.40}' for each in (goal, *more))}"
            )
        if self._sent:
            raise RecorderError(
                "this recorder has a goal: make a new one for each goal, `GoalRecorder(client).send(goal)`"
            )
        _expect_client(self._client)
        self.add(event="goal")
        self._sent = time.monotonic()
        _sent.add(self)
        self._client.send_goal_async(goal, feedback_callback=self._on_feedback).add_done_callback(self._on_answer)
        return self

    def cancel(self) -> Future:
        """Ask the server to cancel the goal, and return the future of its answer.

        Raises RecorderError before a goal is sent, before it has an answer, and when it was rejected.
        """
        self._expect_goal()
        if self._handle is None:
            raise RecorderError("the goal has not been accepted yet: wait for that before you cancel it")
        if not self._handle.accepted:
            raise RecorderError("the goal was rejected: there is nothing to cancel")
        self.add(event="cancel")
        answer = self._handle.cancel_goal_async()
        answer.add_done_callback(self._on_cancel)
        return answer

    def _expect_goal(self) -> None:
        if not self._sent:
            raise RecorderError("no goal was sent: `GoalRecorder(client).send(goal)` sends one")

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

    @fitting
    def wait_for(self, wanted: int | Callable[[Table], bool], timeout: float = 5.0) -> bool:
        """Wait as for any recorder; raises NodeFailed once nothing more can come in time.

        That is so when the goal's server is gone, or is in a callback that does not return in time.
        """
        _expect_wanted(wanted)
        name = self._name
        gone = Lasting(
            lambda: not self._client.server_is_ready(),
            GONE,
            unless=lambda: any(runs(name) for runs in serving),
            more=ENDING,
        )
        others = [each._sent for each in list(_sent) if each is not self and each._name == name and each._goes_on()]
        limit = time.monotonic() + time_limit(timeout) - self._sent if self._goes_on() else math.inf
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
            ask_lookouts()  # that it has died is the better reason
            served = "any more" if before and before[0] != "goal" else "now"
            raise NodeFailed(f"no node serves the action {name} {served}, so this goal will not finish: {last}")
        return False

    def _goes_on(self) -> bool:
        """Return True once the goal was sent, until it has ended."""
        return self._sent > 0.0 and self._end() is None

    @fitting
    def count(self, event: str) -> int:
        """Return how often `event` has occurred; raises RecorderError if there is no such event."""
        return self._events(event).count(event)

    def _events(self, event: object) -> list[str]:
        """Return all events so far; raises RecorderError unless `event` is one that there may be."""
        events = self.table()["event"]
        if event not in self.EVENTS and event not in events:
            raise RecorderError(f"a goal has no event {event!r:.40}: its events are {', '.join(self.EVENTS)}")
        return events

    @fitting
    def wait_feedback(self, count: int, timeout: float = USUAL) -> bool:
        """Wait for `count` feedback messages; False after `timeout` s, or once the goal has ended with fewer.

        The reader is told of the latter, and of a wait of `NO_LOOK` s or more that was in vain.
        """
        if not is_whole(count):
            raise RecorderError(f"`wait_feedback` takes a number of feedback messages, not {count!r:.40}")
        self._expect_goal()
        ends = {*self.END}

        def there(table: dict[str, list[Any]]) -> bool:
            return table["event"].count("feedback") >= count

        if not self.wait_for(lambda table: there(table) or not ends.isdisjoint(table["event"]), timeout):
            self._tell_of_time(timeout, f"only {self.count('feedback')} of {count} feedback messages have come")
            return False
        if self.wait_for(there, min(time_limit(timeout), LAST)):
            return True
        came = self.count("feedback")
        tell_reader(
            f"This goal has ended as {self._end()}, after {came} feedback message{'s' * (came != 1)}: "
            f"wait_feedback({count}) stopped waiting."
        )
        return False

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

    @fitting
    def time_of(self, event: str) -> float | None:
        """Return when `event` was first seen (s since the recorder was made), or None if it was not.

        Raises RecorderError if there is no such event.
        """
        events, times = self._events(event), self.table()["time"]
        return times[events.index(event)] if event in events else None

    @fitting
    def wait_end(self, timeout: float = USUAL) -> str | None:
        """Wait for the event that ends the goal, and return it; None after `timeout` s, told if that is long.

        Raises NodeFailed when the goal's server is gone, and in a live session when the goal was aborted because its
        server raised an exception.
        """
        self._expect_goal()
        self.wait_for(lambda table: any(event in self.END for event in table["event"]), timeout)
        end = self._end()
        if end is None:
            self._tell_of_time(timeout, f"the goal has not ended: its last event is '{self.table()['event'][-1]}'")
        if end == "aborted":
            wait_until(lambda: False, LATE)  # the exception is reported a little later
        else:
            ask_lookouts()
        return end

    def _tell_of_time(self, timeout: float, what: str) -> None:
        if timeout >= NO_LOOK:
            at = "".join(f"\n{where}" for place in places if (where := place(self._name)))
            tell_reader(f"The wait for a goal of {self._name} ended after {timeout:g} s: {what}.{at}")

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

    @fitting
    def __init__(self, controller: Observable) -> None:
        if not hasattr(controller, "observers"):
            raise RecorderError(
                "DecisionRecorder takes the controller itself, such as `ros.start(AIRobotController).node`, not "
                f"{controller!r:.40}"
            )
        super().__init__("stamp", "state", "linear", "angular", "front", "left", "right", "latency")
        controller.observers.append(lambda decision: self.add(**decision))


class ParameterRecorder(Recorder):
    """Every attempt to set a parameter of a node in this kernel, by anybody.

    The columns are `name`, `value`, `accepted` and `reason`; the first `at_start` rows are the parameters' values at
    the recorder's start, which nobody has set meanwhile.
    """

    @fitting
    def __init__(self, node: Node) -> None:
        _expect_node(node, "ParameterRecorder")
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
        """The lowest and the highest value that the descriptor of `name` allows; () when it sets no limits.

        Raises RecorderError if the node has no such parameter.
        """
        try:
            descriptor = self._node.describe_parameter(name)
        except (KeyError, ParameterNotDeclaredException):
            raise RecorderError(f"the node has no parameter {name!r:.40}") from None
        for limits in (*descriptor.floating_point_range, *descriptor.integer_range):
            return limits.from_value, limits.to_value
        return ()

    def close(self) -> None:
        """Stop recording; the table stays."""
        self._end()
