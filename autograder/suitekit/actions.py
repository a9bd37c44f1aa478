"""The grader's ends of an action: a client that keeps all that it receives, and a server that follows a script."""

import functools
import threading
import time
import uuid
from collections.abc import Callable
from typing import Any, cast

from action_msgs.msg import GoalStatus
from action_msgs.srv import CancelGoal
from rclpy.action import (
    ActionClient,
    ActionServer,
    CancelResponse,
    GoalResponse,
    get_action_client_names_and_types_by_node,
    get_action_server_names_and_types_by_node,
)
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.qos import QoSProfile
from unique_identifier_msgs.msg import UUID

from autograder.errors import Fault
from autograder.suitekit.ros import Ros, graph, published, sensible
from autograder.suitekit.topics import Heard
from course.foundation.waiting import wait_until
from course.ros.names import type_name
from course.ros.rclpy_internals import before_each_answer

DEPTH = 200  # feedback messages that may wait to be read
LISTENED = 5.0  # s to wait until a client has subscribed to the feedback
MATCHED = 0.2  # s more until the client receives it: Fast DDS does not report when the client's side has matched
STATUS = {
    GoalStatus.STATUS_SUCCEEDED: "SUCCEEDED",
    GoalStatus.STATUS_CANCELED: "CANCELED",
    GoalStatus.STATUS_ABORTED: "ABORTED",
}


class Goal:
    """A goal that was sent, and its answers so far; all times are of time.monotonic (s)."""

    def __init__(self, alive: Callable[[], bool]):
        """Wait for answers; `alive` returns whether the program that got the goal still runs."""
        self.sent = time.monotonic()
        self.accepted: bool | None = None  # None: no answer yet
        self.answered = 0.0
        self.heard: list[Heard] = []  # all feedback
        self.surplus: Callable[[list[Heard]], bool] = lambda heard: False  # whether `feedback` leaves out the first
        self.cancel_sent = 0.0
        self.cancel_accepted: bool | None = None  # None: no answer yet
        self.cancel_answered = 0.0
        self.refusals = 0  # answers that it cannot be cancelled, though it is known and has not ended
        self.status = ""  # its final status, a word of STATUS; empty while it runs
        self.result: Any = None
        self.ended = 0.0
        self.fault: Fault | None = None  # the reason for giving it up without a result
        self._alive, self._news = alive, threading.Condition()
        self._handle: Any = None

    @property
    def feedback(self) -> list[Heard]:
        """Return the feedback, without a first message that is `surplus`."""
        return self.heard[self.surplus(self.heard) :]

    def wait(self, condition: Callable[["Goal"], object], timeout: float) -> bool:
        """Wait until `condition(goal)` is true; False after `timeout` s, or when the program is no longer alive."""
        return bool(wait_until(lambda: condition(self), timeout, news=self._news, unless=lambda: not self._alive()))

    def wait_for_news(self, timeout: float) -> bool:
        """Wait until more feedback or the result has come; False after `timeout` s, or when no longer alive."""
        heard = len(self.feedback)
        return self.wait(lambda goal: goal.status or len(goal.feedback) > heard, timeout)

    def cancel(self) -> None:
        """Ask the server to cancel it; does not wait for the answer."""
        self.cancel_sent, self.cancel_accepted = time.monotonic(), None
        self._handle.cancel_goal_async().add_done_callback(self._on_cancel)

    @property
    def phase(self) -> str:
        """Return the progress of the goal, in words for the student."""
        if self.accepted is None:
            return "was neither accepted nor rejected"
        if not self.accepted:
            return "was rejected"
        if self.status:
            return f"ended as {self.status}"
        if self.feedback:
            return "was accepted and sent feedback, but no result came"
        return "was accepted, but neither feedback nor a result came"

    def on_answer(self, future: Any) -> None:
        """Note that the server has accepted or rejected the goal."""
        handle = future.result()
        with self._news:
            self._handle, self.accepted, self.answered = handle, handle.accepted, time.monotonic()
            self._news.notify_all()
        if handle.accepted:
            handle.get_result_async().add_done_callback(self._on_end)

    def on_feedback(self, message: Any, published: float = 0.0) -> None:
        """Note feedback that its server published at `published` (s of the server's clock)."""
        with self._news:
            self.heard.append(Heard(time.monotonic(), sensible(message.feedback), published))
            self._news.notify_all()

    def _on_cancel(self, future: Any) -> None:
        with self._news:
            response = future.result()
            self.cancel_accepted, self.cancel_answered = bool(response.goals_canceling), time.monotonic()
            self.refusals += not self.cancel_accepted and response.return_code == CancelGoal.Response.ERROR_NONE
            self._news.notify_all()

    def _on_end(self, future: Any) -> None:
        with self._news:
            self.result, self.ended = sensible(future.result().result), time.monotonic()
            self.status = STATUS.get(future.result().status, "UNKNOWN")
            self._news.notify_all()


class ActionCaller:
    """A client of an action.

    It receives feedback by a separate subscription: rclpy 7.1.6 drops a goal's feedback callback as soon as the result
    has come, so feedback still on its way would be lost.
    """

    def __init__(self, ros: Ros, action: str, kind: Any):
        self._ros, self._topic = ros, f"{action}/_action/feedback"
        self._type = f"{type_name(kind)}_FeedbackMessage"
        self._goals: dict[bytes, Goal] = {}
        qos = QoSProfile(depth=DEPTH)
        self._feedback = ros.node.create_subscription(
            # rclpy 7.1.6 declares callbacks of one argument, but passes the message's times to a callback that takes
            # two.
            kind.Impl.FeedbackMessage,
            self._topic,
            cast(Callable[[Any], None], self._hear),
            qos,
        )
        self._client = ActionClient(ros.node, kind, action)

    def ready(self) -> bool:
        """Return True if the action is offered with the right type, and its feedback would be received."""
        return (
            self._client.server_is_ready()
            and self._feedback.get_publisher_count() > 0
            and self._type
            in [end.topic_type for end in graph(self._ros.node.get_publishers_info_by_topic, self._topic)]
        )

    def send(self, goal: Any, alive: Callable[[], bool]) -> Goal:
        """Send a goal to a program; does not wait for the answer."""
        sent, number = Goal(alive), uuid.uuid4().bytes
        self._goals[number] = sent
        self._client.send_goal_async(goal, goal_uuid=UUID(uuid=list(number))).add_done_callback(sent.on_answer)
        return sent

    def _hear(self, message: Any, info: dict[str, int]) -> None:
        if goal := self._goals.get(bytes(message.goal_id.uuid)):
            goal.on_feedback(message, published(info))


def offered_actions(ros: Ros) -> list[str]:
    """Return the actions that the student's nodes serve, with their types."""
    return _actions(ros, get_action_server_names_and_types_by_node)


def sought_actions(ros: Ros) -> list[str]:
    """Return the actions that the student's nodes are clients of, with their types."""
    return _actions(ros, get_action_client_names_and_types_by_node)


def _actions(ros: Ros, query: Callable[..., list[Any]]) -> list[str]:
    return sorted(
        f"the action {action} ({types[0]})"
        for node in ros.others()
        for action, types in graph(functools.partial(query, ros.node), *node)
    )


def serve(
    ros: Ros,
    action: str,
    kind: type,
    execute: Callable[[Any], Any],
    accept: Callable[[Any], bool] = lambda goal: True,
    ahead: Callable[[Callable[[Any], None]], None] | None = None,
) -> ActionServer:
    """Offer an action: `accept` decides whether to accept a goal, `execute` is its execute callback.

    Before a goal is answered, `ahead` is called with a function that publishes feedback of it.  `ros` needs several
    threads: one for each running goal and one more for cancel requests.
    """

    def await_client() -> None:
        wait_until(lambda: ros.node.count_subscribers(f"{action}/_action/feedback"), LISTENED)
        time.sleep(MATCHED)

    def heard(handle: Any) -> Any:
        await_client()
        return execute(handle)

    def begin(publish: Callable[[Any], None]) -> None:
        await_client()
        if ahead:
            ahead(publish)

    server = ActionServer(
        ros.node,
        kind,
        action,
        heard,
        callback_group=ReentrantCallbackGroup(),
        goal_callback=lambda goal: GoalResponse.ACCEPT if accept(goal) else GoalResponse.REJECT,
        cancel_callback=lambda handle: CancelResponse.ACCEPT,
    )
    if ahead:
        before_each_answer(server, begin)
    return server
