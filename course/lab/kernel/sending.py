"""Sends a reader's calls, goals, messages and parameters, each in its own thread, with a time limit."""

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from action_msgs.srv import CancelGoal
from rcl_interfaces.srv import SetParameters
from rclpy.action import ActionClient
from rclpy.duration import Duration
from rclpy.exceptions import InvalidHandle
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.task import Future

from course.errors import CallTimeout, CourseError, LiveError
from course.explaining.failure_report import FailureReport
from course.foundation.waiting import wait_until
from course.lab.kernel.exchange import Exchange, keep
from course.lab.kernel.forms import Interface
from course.recorders import GoalRecorder
from course.ros.names import is_hidden
from course.ros.rclpy_internals import RCLError, destroy, unwatched
from course.session.live import Session
from course.session.offered import may_act

MATCH = 2.0  # s that a new publisher may take to match the topic's subscriptions
RECEIVED = 10.0  # s; Fast DDS asks every 3 s for a lost acknowledgement
RATES = (0.1, 100.0)  # Hz
UNSEEN = 0.5  # s that a repeated publication may be unseen, as while one part of the Inspector replaces another
NOTED = 0.5  # s between two notes on the number of messages
LOOK = 0.25  # s between two checks that an action server is still there
RAISED = 0.5  # s in which it becomes known that the callback of an aborted goal has raised an exception
GONE = 2.0  # s that it may be missing from the graph
UNWATCHED = "Publishing stopped, because the Inspector of this notebook was no longer shown. Publish again to continue."
REFUSED = "The server refused the cancel: give its ActionServer a `cancel_callback` that returns CancelResponse.ACCEPT."
CANCEL = 3.0  # s until the reader is told why a server may not answer a cancel request

_repeating: dict[str, "Stop"] = {}  # by topic
_held: dict[str, Callable[[], object]] = {}  # destroys the last client of each action
_publishers: list[Publisher] = []  # those that exist now


def publishes(topic: str) -> int:
    """Return how many publishers the Inspector has on a topic now, by its full name."""
    return sum(each.topic_name == topic for each in list(_publishers))


def call(live: Session, interface: Interface, name: str, request: Any, timeout: float) -> Exchange:
    """Call a service; `timeout` in s."""
    exchange = keep(Exchange("service", name, interface.name))

    def work() -> None:
        live.wait_for_service(name, interface.loaded, timeout)
        exchange.add("request", request)
        exchange.add("response", live.call(name, interface.loaded, request, timeout=timeout))

    return _begun(exchange, work)


def set_parameter(live: Session, node: str, parameter: Parameter, timeout: float) -> Exchange:
    """Set a parameter of a node; `timeout` in s."""
    about = f"It sets the parameter {parameter.name}."
    exchange = keep(Exchange("parameter", node, "rcl_interfaces/srv/SetParameters", about=about))

    def work() -> None:
        service = f"{node}/set_parameters"
        request = SetParameters.Request(parameters=[parameter.to_parameter_msg()])
        live.wait_for_service(service, SetParameters, timeout)
        exchange.add("request", f"{parameter.name}: {parameter.value}")
        (result,) = live.call(service, SetParameters, request, timeout=timeout).results
        reason = result.reason or "it gives no reason"
        exchange.add("accepted" if result.successful else "rejected", "" if result.successful else reason)

    return _begun(exchange, work)


def publish(
    live: Session, interface: Interface, name: str, message: Any, rate: float | None = None, line: str = ""
) -> Exchange:
    """Publish a message once the publisher has matched the subscriptions: once, or at `rate` Hz.

    `line` is the command that does the same, from which the page sees whether its form has changed since.

    A repeated publication ends when it is stopped, no Inspector shows it any more, another message is published on the
    topic from here, or the session ends.
    """
    about = "Publishing continues while the Inspector is open. To change it, publish again." if rate else ""
    exchange = keep(Exchange("topic", name, interface.name, about=about, line=line))
    stop = Stop()
    if name in _repeating:
        _repeating.pop(name).cancel()
    if rate:
        exchange.may_be_canceled(stop)
        _repeating[name] = stop

    def work() -> None:
        publisher = live.node.create_publisher(interface.message, name, 10)
        _publishers.append(publisher)
        try:
            send(publisher)
        finally:
            _publishers.remove(publisher)
            with suppress(RCLError, InvalidHandle):  # the session has ended, or the type was built again
                if live.ok:
                    live.node.destroy_publisher(publisher)

    def send(publisher: Publisher) -> None:
        wait_until(lambda: publisher.get_subscription_count() >= max(1, live.node.count_subscribers(name)), MATCH)
        exchange.add("message", message)
        if rate:
            _repeat(live, exchange, publisher, message, rate, stop)
            with suppress(RCLError, InvalidHandle):
                publisher.wait_for_all_acked(Duration(seconds=RECEIVED))
            return
        publisher.publish(message)
        if not (count := publisher.get_subscription_count()):
            exchange.end(f"nobody received it: no node subscribes to {name} with the type {interface.name}")
        elif publisher.wait_for_all_acked(Duration(seconds=RECEIVED)):
            exchange.add("received", f"by {count} subscription{'s' * (count > 1)}")
        else:
            exchange.end(f"not every subscription has confirmed it within {RECEIVED:g} s")

    return _begun(exchange, work)


class Stop:
    """A handle by which a reader stops a repeated publication."""

    def __init__(self) -> None:
        self.event = threading.Event()

    def cancel(self) -> None:
        """Stop publishing."""
        self.event.set()


def _repeat(live: Session, exchange: Exchange, publisher: Publisher, message: Any, rate: float, stop: Stop) -> None:
    count, noted, due, why = 0, 0.0, time.monotonic(), ""
    while live.ok:
        if not exchange.is_shown(UNSEEN):
            why = UNWATCHED
            break
        try:
            publisher.publish(message)
        except (RCLError, InvalidHandle):  # the session has ended, or the type was built again
            break
        count += 1
        if (now := time.monotonic()) - noted >= NOTED:
            noted, to = now, _receivers(live, publisher)
            exchange.note(f"Published {count} time{'s' * (count != 1)} so far, {rate:g} a second, {to}.")
        due = max(due + 1.0 / rate, now)  # skips messages that are late
        if stop.event.wait(due - now):
            break
    exchange.add("last message", f"number {count}")
    exchange.about = ""  # it goes on no longer
    exchange.end(note=why)


def _receivers(live: Session, publisher: Publisher) -> str:
    """Return to how many subscriptions it publishes, in words; the session's own, such as a plot's, do not count."""
    own = (live.node.get_namespace(), live.node.get_name())
    found = live.node.get_subscriptions_info_by_topic(publisher.topic_name)
    others = sum((each.node_namespace, each.node_name) != own and not is_hidden(each.node_name) for each in found)
    count = min(others, publisher.get_subscription_count())
    return f"to {count} subscription{'s' * (count != 1)}" if count else "and no other node subscribes to it"


class Goal(GoalRecorder):
    """A goal whose events are added to an exchange."""

    def __init__(self, client: ActionClient, exchange: Exchange, goal: Any):
        super().__init__(client)
        self._goal = goal
        self._exchange = exchange
        self.answered = threading.Event()
        self.ended = threading.Event()
        self.cancel_unanswered = threading.Event()
        self.aborted = False

    def add(self, *nameless: object, **values: object) -> None:
        """Add an event to the exchange; nothing is kept here."""
        event = str(values["event"])
        if event == "cancel":
            self.cancel_unanswered.set()
        self._exchange.add(event, self._goal if event == "goal" else values.get("message"))
        if event in ("accepted", "rejected"):
            self.answered.set()
        self.aborted = event == "aborted"
        if event in self.END or event == "unknown":
            self.ended.set()

    def _on_cancel(self, future: Future) -> None:
        answer = future.result()
        self.cancel_unanswered.clear()
        if answer is None or answer.return_code == CancelGoal.Response.ERROR_GOAL_TERMINATED:
            return
        taken = bool(answer.goals_canceling)
        self._exchange.add("cancel accepted" if taken else "cancel refused")
        if answer.return_code == CancelGoal.Response.ERROR_UNKNOWN_GOAL_ID:
            self._exchange.note("The server does not know this goal: it was started again since.")
        else:
            self._exchange.note("" if taken else REFUSED)


def send_goal(live: Session, interface: Interface, name: str, goal: Any, timeout: float) -> Exchange:
    """Send a goal to an action server, which must answer within `timeout` s but may execute it for any time."""
    exchange = keep(Exchange("action", name, interface.name))

    def work() -> None:
        client = ActionClient(live.node, interface.loaded, name)
        _hold(name, lambda: destroy(client) if live.ok else None)
        if not wait_until(client.server_is_ready, timeout):
            raise CallTimeout(f"no action server for {name} within {timeout:g} s: has its node been started?")
        sent = Goal(client, exchange, goal)
        exchange.may_be_canceled(sent)
        sent.send(goal)
        if not sent.answered.wait(timeout):
            raise CallTimeout(f"{name} did not answer the goal within {timeout:g} s: is its server busy or blocked?")
        known = _servers(live, name)
        while not sent.ended.wait(LOOK):
            if not live.ok:
                raise LiveError("the session has ended before the goal")
            if known and not (known & _servers(live, name)) and client.server_is_ready():
                raise LiveError(
                    f"the action server of {name} was started again and does not know this goal: no result will come"
                )
            if not wait_until(lambda: client.server_is_ready() or sent.ended.is_set() or not live.ok, GONE):
                why = raised(again=True) or ""
                raise LiveError(f"the action server of {name} has gone: no result will come.\n{why}".strip())
            if sent.cancel_unanswered.is_set() and not wait_until(
                lambda: not sent.cancel_unanswered.is_set() or sent.ended.is_set(), CANCEL
            ):
                exchange.note(
                    "The server has not answered the cancel yet. While its execute callback waits in a "
                    "SingleThreadedExecutor, nothing else is handled: use a MultiThreadedExecutor, or await in it."
                )
                sent.cancel_unanswered.clear()
        if sent.aborted and (report := wait_until(raised, RAISED)):
            exchange.end(note=f"Its callback has raised an exception.\n{report}")

    def raised(*, again: bool = False) -> FailureReport | None:
        """Return what a callback of the server has raised, and with `again`, also what the reader knows already."""
        return live.watch.reason(f"{name}/_action/send_goal", lambda handle: may_act(handle.source, name), again=again)

    return _begun(exchange, work)


def _servers(live: Session, name: str) -> set[tuple[int, ...]]:
    """Return the action's servers that the graph has, each by the id of its publisher of the goals' status."""
    found = live.node.get_publishers_info_by_topic(f"{name}/_action/status")
    return {tuple(each.endpoint_gid) for each in found}


def _begun(exchange: Exchange, work: Callable[[], None]) -> Exchange:
    """Do the work of an exchange in a thread; an exception is reported in the exchange."""

    def run() -> None:
        failed = ""
        try:
            with unwatched():
                work()
        except CourseError as error:
            failed = str(error)
        except Exception as error:  # from rclpy, when the session is closed meanwhile
            failed = f"{type(error).__name__}: {error}"
        if failed or not exchange.over:
            exchange.end(failed)

    threading.Thread(target=run, name="inspector", daemon=True).start()
    return exchange


def _hold(name: str, leave: Callable[[], object]) -> None:
    """Keep an action's client until the next one of its name, for late feedback."""
    if name in _held:
        _held.pop(name)()
    _held[name] = leave
