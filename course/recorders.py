"""What happened, as a plain table: recorders collect in the nodes' threads, the notebook reads in its own.

A table is a dict of columns, each a list, so that `plot(table["time"], table["front"])` is all it takes.  Times are
seconds since the recorder was made.
"""

import threading
import time
from collections.abc import Callable, Mapping
from operator import attrgetter

from action_msgs.msg import GoalStatus
from rcl_interfaces.msg import SetParametersResult
from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.parameter import Parameter

from course.rclpy_internals import watch_parameters
from course.waiting import wait_until

STATUS = {
    GoalStatus.STATUS_SUCCEEDED: "succeeded",
    GoalStatus.STATUS_CANCELED: "canceled",
    GoalStatus.STATUS_ABORTED: "aborted",
}


class Recorder:
    """Rows with a time, added in any thread."""

    def __init__(self, *columns: str):
        self.columns = ("time", *columns)
        self._start = time.monotonic()
        self._rows: list[tuple] = []
        self._lock = threading.Lock()

    def add(self, **values: object) -> None:
        """Add a row; a column that is not given holds None.  Raises TypeError for a column that there is not."""
        if unknown := set(values) - set(self.columns):
            raise TypeError(f"no column {', '.join(sorted(unknown))}: the columns are {', '.join(self.columns)}")
        with self._lock:
            row = {"time": time.monotonic() - self._start, **values}
            self._rows.append(tuple(row.get(column) for column in self.columns))

    def table(self) -> dict[str, list]:
        """All rows so far, as columns."""
        with self._lock:
            rows = list(self._rows)
        return {column: [row[number] for row in rows] for number, column in enumerate(self.columns)}

    def __len__(self) -> int:
        return len(self._rows)

    def wait_for(self, wanted: int | Callable[[dict[str, list]], bool], timeout: float = 5.0) -> bool:
        """Wait until there are `wanted` rows, or until `wanted(table)` holds; False after `timeout` s."""
        condition = (lambda: len(self._rows) >= wanted) if isinstance(wanted, int) else (lambda: wanted(self.table()))
        return bool(wait_until(condition, timeout))  # without the lock: a callback must not wait for a table


class TopicRecorder(Recorder):
    """The messages of a topic.

    `fields` maps columns to where they are in the message: `{"x": "pose.pose.position.x"}`, or to a function of it.
    """

    def __init__(self, node: Node, msg_type: type, topic: str, fields: Mapping[str, str | Callable], qos: int = 10):
        super().__init__(*fields)
        self._fields = {name: attrgetter(field) if isinstance(field, str) else field for name, field in fields.items()}
        self._node = node
        self._subscription = node.create_subscription(msg_type, topic, self._on_message, qos)

    def _on_message(self, message) -> None:
        self.add(**{name: field(message) for name, field in self._fields.items()})

    def close(self) -> None:
        """Subscribe no longer; what was recorded stays."""
        self._node.destroy_subscription(self._subscription)


class GoalRecorder(Recorder):
    """The life of one goal, seen from its client: rows of `event` and `sequence`.

    The events are goal, accepted or rejected, feedback, cancel (requested) and, at the end, succeeded, canceled or
    aborted.  `sequence` is what came with the event, from the field `feedback_field` of the feedback.
    """

    END = ("rejected", *STATUS.values())

    def __init__(self, client: ActionClient, feedback_field: str = "partial_sequence"):
        super().__init__("event", "sequence")
        self._client, self._field = client, feedback_field
        self._handle = None

    def send(self, goal: object) -> "GoalRecorder":
        """Send the goal; the rest comes by itself."""
        self.add(event="goal")
        self._client.send_goal_async(goal, feedback_callback=self._on_feedback).add_done_callback(self._on_answer)
        return self

    def cancel(self) -> None:
        """Ask the server to cancel the goal."""
        self.add(event="cancel")
        self._handle.cancel_goal_async()

    def _on_answer(self, future) -> None:
        self._handle = future.result()
        self.add(event="accepted" if self._handle.accepted else "rejected")
        if self._handle.accepted:
            self._handle.get_result_async().add_done_callback(self._on_result)

    def _on_feedback(self, message) -> None:
        self.add(event="feedback", sequence=list(getattr(message.feedback, self._field)))

    def _on_result(self, future) -> None:
        response = future.result()
        self.add(event=STATUS.get(response.status, "unknown"), sequence=list(response.result.sequence))

    def count(self, event: str) -> int:
        """How often `event` has been seen."""
        return self.table()["event"].count(event)

    def wait_feedback(self, count: int, timeout: float = 10.0) -> bool:
        """Wait for `count` feedback messages; False after `timeout` s."""
        return self.wait_for(lambda table: table["event"].count("feedback") >= count, timeout)

    @property
    def result(self) -> list | None:
        """The sequence in the result; None before the end, and for a rejected goal.  Late feedback may come after it."""
        table = self.table()
        return next(
            (sequence for event, sequence in zip(table["event"], table["sequence"], strict=True) if event in self.END),
            None,
        )

    def wait_end(self, timeout: float = 10.0) -> str | None:
        """Wait for the end, and return it (see the class); None after `timeout` s."""
        self.wait_for(lambda table: any(event in self.END for event in table["event"]), timeout)
        return next((event for event in self.table()["event"] if event in self.END), None)


class DecisionRecorder(Recorder):
    """Each decision of a `course.nodes.ai_robot_controller.AIRobotController`: state, action, sectors and latency (s)."""

    def __init__(self, controller: Node):
        super().__init__("stamp", "state", "linear", "angular", "front", "left", "right", "latency")
        controller.observers.append(lambda decision: self.add(**decision))


class ParameterRecorder(Recorder):
    """Every attempt to set a parameter of a node in this kernel, whoever makes it: `name`, `value`, `accepted`, `reason`.

    It begins with the node's declared parameters as they are.
    """

    def __init__(self, node: Node):
        super().__init__("name", "value", "accepted", "reason")
        self._node = node
        for name, parameter in sorted(node.get_parameters_by_prefix("").items()):
            if name not in ("use_sim_time", "start_type_description_service"):  # rclpy's own
                self.add(name=name, value=parameter.value, accepted=True, reason="")
        self._end = watch_parameters(node, self._on_set)

    def _on_set(self, parameters: list[Parameter], result: SetParametersResult) -> None:
        for parameter in parameters:
            self.add(name=parameter.name, value=parameter.value, accepted=result.successful, reason=result.reason)

    def range(self, name: str) -> tuple[float, ...]:
        """The least and the greatest value that the descriptor of `name` allows; () when it sets no limits."""
        descriptor = self._node.describe_parameter(name)
        for limits in (*descriptor.floating_point_range, *descriptor.integer_range):
            return limits.from_value, limits.to_value
        return ()

    def close(self) -> None:
        """Record no longer; what was recorded stays."""
        self._end()
