"""Records requests of cells, nodes and other programs to services and actions as exchanges.

In JupyterLab the recording starts with the session (`record`), so that a panel that is opened later shows them, too.

Requests of this kernel are recorded by hooks in rclpy's clients (`course.ros.rclpy_internals.watch_clients`). Requests
of other programs are recorded at the server: services of nodes that the session starts publish their requests and
responses (rclpy's service introspection, on SERVICE/_service_event), see `course/session/started`.  Of an action,
feedback and status are topics, which anybody can subscribe to; goals and results are service calls, which others cannot
see.
"""

import threading
import time
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from action_msgs.msg import GoalStatus, GoalStatusArray
from rclpy.action import ActionClient
from rclpy.client import Client
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.subscription import Subscription
from rclpy.task import Future
from rclpy.topic_endpoint_info import TopicEndpointInfo
from service_msgs.msg import ServiceEventInfo

from course.lab.kernel.arrival import Arrival
from course.lab.kernel.exchange import LARGEST, Exchange, keep, summaries
from course.lab.kernel.nodes import of_interest
from course.lab.kernel.panels import Changes
from course.recorders import STATUS
from course.ros import messages
from course.ros.names import is_hidden, type_name
from course.ros.rclpy_internals import (
    ClientWatcher,
    RCLError,
    action_name,
    action_type,
    owner,
    replace_in_rclpy,
    sequence_number,
    unwatched,
    watch_clients,
)
from course.session.live import Session, current
from course.session.logs import decoded
from course.session.presence import EVENTS
from course.session.started import sitecustomize

REQUEST = bytes([ServiceEventInfo.REQUEST_RECEIVED])
HEAD = 64  # bytes kept of a message that is too long
WAITING = 400  # messages kept between two looks
OPEN = 100  # unfinished calls and goals that are remembered
SEEN = 1000  # calls that are remembered: a new subscription receives the last ones again
PERIOD = 0.5  # s between two looks while no page asks for one
SERVICE, STATUSES, FEEDBACK = "/_service_event", "/_action/status", "/_action/feedback"
QOS = {
    SERVICE: QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL),  # see `_fitting`
    STATUSES: QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL),
    FEEDBACK: QoSProfile(depth=100),
}
COMMAND = "the ros2 command"
OTHER = "another program"
UNTAKEN = 1.0  # s after which a response that its client has not taken is told
NOT_TAKEN = "The server has sent its response, and {} has not taken it: its executor is busy, or nothing spins it."
GAVE_UP = "{} has stopped waiting for the response."
TOO_LATE = "The server has sent its response, but {} has stopped waiting for it, and will not get it."
NEVER_TAKEN = (
    "The server sent its response, but {} did not take it before it stopped waiting: its executor was busy, or nothing "
    "spun it."
)
OF_A_SERVICE = "Seen from the server: the times are when it took the request and sent the response."
OF_AN_ACTION = (
    "Seen from the action's topics for status and feedback. The contents of goal and result are not shown, and "
    "neither are rejected goals: they travel in services, only between client and server."
)


@dataclass
class _Goal:
    """A goal in progress; `exchange` is None if it is shown elsewhere, or of no interest."""

    exchange: Exchange | None
    outside: bool = False  # sent by another program
    asked: bool = False  # whether its result was requested
    accepted: bool = False
    canceling: bool = False


@dataclass
class _Asked:
    """A request of this kernel; times are in s of time.monotonic, 0 for never."""

    exchange: Exchange
    client: Client
    number: int | None  # of the request, by its client
    answered: float = 0.0  # when the server sent the response
    untaken: bool = False  # whether it then waited for longer than `UNTAKEN`
    left: float = 0.0  # when nobody was seen to wait for the response any more

    @property
    def awaited(self) -> bool:
        """Return False once the caller has given up, as `call` does after its time limit."""
        try:
            return self.number is None or self.client.get_pending_request(self.number) is not None
        except KeyError:
            return False

    @property
    def outcome(self) -> str:
        """Return what has become of the request of a caller that has given up."""
        return (NEVER_TAKEN if self.untaken else TOO_LATE if self.answered else GAVE_UP).format(self.exchange.by)


class Traffic(ClientWatcher):
    """Watches a session until `close`."""

    def __init__(self, live: Session):
        self.live = live
        self._incoming: deque[tuple[float, str, str, type, bytes, int]] = deque(maxlen=WAITING)
        self._subscriptions: dict[str, Subscription] = {}
        self._begun: set[str] = set()  # status topics with a message that was read
        self._callers: dict[bytes, str] = {}
        self._calls: dict[tuple[bytes, int], Exchange] = {}  # calls of other programs that are not finished
        self._seen: dict[tuple[bytes, int], None] = {}  # all calls of other programs, finished ones included
        self._unseen: set[str] = set()  # services without introspection at the last look
        self._goals: dict[bytes, _Goal] = {}
        self._asked: dict[Future, _Asked] = {}  # requests of this kernel that are not finished
        self._lock = threading.Lock()
        self._noting = threading.Lock()  # protects the goals, which are sent in other threads
        full = (live.node.get_name(), live.node.get_namespace())
        self._own = {
            bytes(each.endpoint_gid[:12])
            for each in live.node.get_publishers_info_by_topic(EVENTS)
            if (each.node_name, each.node_namespace) == full
        }
        live.introspecting = True
        self._ends = [watch_clients(self), replace_in_rclpy(sitecustomize.introspected, Node, "create_service")]

    def look(self) -> None:
        """Update the subscriptions, and read new messages."""
        with self._lock:
            if not self.live.ok:
                return
            self._listen()
            while self._incoming:
                self._read(*self._incoming.popleft())
            self._look_after_servers()
            self._look_after_requests()

    def close(self) -> None:
        """Undo all changes, except that an introspected service stays so until its node ends."""
        self.live.introspecting = False
        for end in self._ends:
            end()
        with self._lock:
            if self.live.ok:
                for subscription in self._subscriptions.values():
                    self.live.node.destroy_subscription(subscription)

    # Requests of other programs

    def _listen(self) -> None:
        """Subscribe to the topics that are published now, and to no others."""
        node, wanted = self.live.node, {}
        for topic, types in node.get_topic_names_and_types():
            for end in QOS:
                if topic.endswith(end) and node.count_publishers(topic):
                    wanted[topic] = types[0], end
        there = {id(each) for each in node.subscriptions}  # building a type again removes its subscriptions
        for topic, subscription in list(self._subscriptions.items()):
            if topic not in wanted or id(subscription) not in there:
                del self._subscriptions[topic]
                self._begun.discard(topic)
                if id(subscription) in there:
                    node.destroy_subscription(subscription)
        for topic, (kind, end) in wanted.items():
            if topic not in self._subscriptions and (loaded := _loaded(kind, end)):
                hear = self._hear(topic.removesuffix(end), end, loaded)
                qos = _fitting(node.get_publishers_info_by_topic(topic), QOS[end])
                self._subscriptions[topic] = node.create_subscription(loaded, topic, hear, qos, raw=True)

    def unseen(self) -> list[dict[str, Any]]:
        """Return the services whose calls by other programs are not recorded: {"service", "server", "restart"}.

        `restart` says whether `Session.restart_server` would change that.  A server that was just started gets a moment
        to begin.
        """
        with self._lock:
            if not self.live.ok:
                return []
            node = self.live.node
            silent = {
                name
                for name, types in node.get_service_names_and_types()
                if of_interest(name, types[0])
                and node.count_services(name)
                and not node.count_publishers(f"{name}{SERVICE}")
            }
            told, self._unseen = sorted(silent & self._unseen), silent
        found = ((name, *self.live.server(name)) for name in told)
        return [{"service": name, "server": server, "restart": can} for name, server, can in found if server]

    def _hear(self, name: str, end: str, kind: type) -> Callable[[bytes], None]:
        def hear(message: bytes) -> None:
            # A short-lived client, such as that of `ros2 service call`, must be identified now.
            if end == SERVICE and message[4:5] == REQUEST:
                self._caller(name, message[16:32])
            long = len(message) if len(message) > LARGEST else 0
            self._incoming.append((time.monotonic(), name, end, kind, message[:HEAD] if long else message, long))

        return hear

    def _caller(self, service: str, client: bytes) -> str:
        """Return the node whose client sent a request, by the middleware's id of the client."""
        if self._callers.get(client, OTHER) == OTHER:
            infos = self.live.node.get_subscriptions_info_by_topic(f"rr{service}Reply", no_mangle=True)
            self._callers[client] = self._sender_of([each for each in infos if bytes(each.endpoint_gid) == client])
        return self._callers[client]

    def _sender_of(self, ends: Iterable[TopicEndpointInfo]) -> str:
        """Return who sends with the clients that have these endpoints; OTHER if that is not one, or is not known."""
        senders = {
            _said(names)
            if (names := _names([each]))
            else COMMAND
            if self.live.outsiders.is_command(each.endpoint_gid, "ros2")
            else OTHER
            for each in ends
        }
        return senders.pop() if len(senders) == 1 else OTHER

    def _read(self, at: float, name: str, end: str, kind: type, message: bytes, long: int) -> None:
        """Read a message; of a `long` one (its number of bytes), only the beginning was kept."""
        if long:
            if end == FEEDBACK:  # the goal's id comes first
                self._read_feedback(message[4:20], name, f"(a message of {long:,} bytes: too long to be kept)", at)
            return
        read: Any = decoded(message, kind)
        if read is None:
            return
        if end == SERVICE:
            self._read_call(name, kind, read)
        elif end == STATUSES:
            self._read_statuses(name, at, read)
        else:
            self._read_feedback(bytes(read.goal_id.uuid), name, read.feedback, at)

    def _read_feedback(self, goal_id: bytes, name: str, feedback: Any, at: float) -> None:
        goal = self._goal(goal_id, name)
        if goal.outside and goal.exchange and not goal.exchange.over:
            self._follow(goal, GoalStatus.STATUS_EXECUTING, at)  # its status message may come later
            goal.exchange.add("feedback", feedback, at)

    def _read_call(self, name: str, kind: type, event: Any) -> None:
        info = event.info
        client, at = bytes(info.client_gid), info.stamp.sec + 1e-9 * info.stamp.nanosec
        key = client, info.sequence_number
        if client[:12] in self._own:  # sent by this kernel, whose client records more
            if info.event_type == ServiceEventInfo.RESPONSE_SENT:
                self._note_response(name, client, info.sequence_number)
            return
        if info.event_type == ServiceEventInfo.REQUEST_RECEIVED and event.request and key not in self._seen:
            _remember(self._seen, key, None, SEEN)
            service_type = type_name(kind).removesuffix("_Event")
            exchange = keep(Exchange("service", name, service_type, self._caller(name, client), OF_A_SERVICE))
            exchange.add("request", event.request[0], at)
            _remember(self._calls, key, exchange)
        elif info.event_type == ServiceEventInfo.RESPONSE_SENT and event.response and key in self._calls:
            exchange = self._calls.pop(key)
            exchange.add("response", event.response[0], at)
            exchange.end()

    def _read_statuses(self, name: str, at: float, message: GoalStatusArray) -> None:
        first = name not in self._begun
        self._begun.add(name)
        for each in message.status_list[-OPEN:]:
            over = first and each.status in STATUS  # it ended before the first look
            self._follow(self._goal(bytes(each.goal_info.goal_id.uuid), name, over=over), each.status, at)

    def _goal(self, goal_id: bytes, name: str, *, over: bool = False) -> _Goal:
        """Return the record of a goal; an unknown one is another program's, and is not recorded if it is `over`."""
        if goal_id not in self._goals:
            goal = _Goal(None if over else self._outside(name), outside=True)
            with self._noting:
                _remember(self._goals, goal_id, goal)
        return self._goals[goal_id]

    def _follow(self, goal: _Goal, status: int, at: float) -> None:
        """Record the changes of a goal's status that are not recorded otherwise."""
        exchange = goal.exchange
        if exchange is None or exchange.over:
            return
        if goal.outside:
            if not goal.accepted:
                goal.accepted = True
                exchange.add("accepted", at=at)
            if status == GoalStatus.STATUS_CANCELING and not goal.canceling:
                goal.canceling = True
                exchange.add("cancel accepted", at=at)
        if status in STATUS and (goal.outside or not goal.asked):
            exchange.add(STATUS[status], at=at)
            exchange.end()

    def _outside(self, name: str) -> Exchange:
        """Return an exchange for a goal of another program, with its client as sender if there is only one."""
        node = self.live.node
        infos = node.get_subscriptions_info_by_topic(f"rr{name}/_action/send_goalReply", no_mangle=True)
        kinds = dict(node.get_topic_names_and_types()).get(f"{name}{FEEDBACK}", [""])
        by = self._sender_of(each for each in infos if bytes(each.endpoint_gid[:12]) not in self._own)
        return keep(Exchange("action", name, kinds[0].removesuffix("_FeedbackMessage"), by, OF_AN_ACTION))

    def _look_after_servers(self) -> None:
        """End exchanges that can get no answer any more."""
        for key, exchange in list(self._calls.items()):
            if not self.live.node.count_services(exchange.name):
                exchange.end(f"the server of {exchange.name} has gone: no response will come")
                del self._calls[key]
        with self._noting:
            running = [goal.exchange for goal in self._goals.values() if goal.exchange and goal.accepted]
        for exchange in running:
            if not exchange.over and not self.live.node.count_publishers(f"{exchange.name}{STATUSES}"):
                exchange.end(f"the action server of {exchange.name} has gone: no result will come")

    # Requests of this kernel, see course.ros.rclpy_internals.ClientWatcher

    def called(self, client: Client, request: Any, future: Future, at: float) -> None:
        """Record a request that a client of this kernel has sent."""
        kind: Any = client.srv_type
        exchange = keep(Exchange("service", client.service_name, type_name(kind), _sender(client)))
        exchange.add("request", request, at)
        self._asked[future] = _Asked(exchange, client, sequence_number(client, future))
        future.add_done_callback(self._answered)

    def _look_after_requests(self) -> None:
        """End the exchanges whose future will never be done, or has nobody left to run its callbacks."""
        now = time.monotonic()
        for future, asked in list(self._asked.items()):
            awaited = asked.awaited  # before `done`: a future that is done is not awaited either
            if future.done():
                self._answered(future)
            elif not _exists(asked.client):
                asked.exchange.end("the client was destroyed before it took a response")
                self._asked.pop(future, None)
            elif not awaited:
                asked.left = asked.left or now
                asked.exchange.note(asked.outcome)
                if now - asked.left > UNTAKEN:  # until then, `ros.call` may tell why it has given up
                    asked.exchange.end(asked.outcome)
                    self._asked.pop(future, None)
            elif asked.answered and now - asked.answered > UNTAKEN:
                asked.untaken = True
                asked.exchange.note(NOT_TAKEN.format(asked.exchange.by))

    def _note_response(self, service: str, client: bytes, number: int) -> None:
        """Note that a server has sent the response to a request of this kernel."""
        for asked in list(self._asked.values()):
            waits = (asked.exchange.name, asked.number) == (service, number)  # most have taken the response by now
            if waits and asked.exchange.by == self._caller(service, client):
                asked.answered = time.monotonic()

    def _answered(self, future: Future) -> None:
        if (asked := self._asked.pop(future, None)) is None:
            return
        exchange = asked.exchange
        exchange.note("")
        if future.cancelled() or (failed := future.exception()):
            exchange.end("it was canceled" if future.cancelled() else str(failed))
            return
        exchange.add("response", future.result())
        exchange.end()

    def goal_begins(self, client: ActionClient, goal: Any, goal_id: bytes, *, own: bool) -> None:
        """Record a goal that an action client of this kernel sends; the inspector shows its own goals."""
        exchange = None
        if not own and (kind := action_type(client)):
            exchange = Exchange("action", action_name(client), type_name(kind), _sender(client))
            exchange.add("goal", goal)
        with self._noting:
            _remember(self._goals, goal_id, _Goal(exchange))

    def goal_sent(self, goal_id: bytes, future: Future) -> None:
        """Record that the goal was sent."""
        if exchange := self._exchange(goal_id):
            keep(exchange)
            future.add_done_callback(lambda done: self._decided(goal_id, exchange, done))

    def _decided(self, goal_id: bytes, exchange: Exchange, future: Future) -> None:
        handle = future.result()
        exchange.add("accepted" if handle.accepted else "rejected")
        if handle.accepted:
            exchange.may_be_canceled(_Handle(handle))
            self._goals[goal_id].accepted = True
        else:
            exchange.end()

    def feedback(self, goal_id: bytes, feedback: Any) -> None:
        """Record feedback that has come to this kernel."""
        if exchange := self._exchange(goal_id):
            exchange.add("feedback", feedback)

    def result_asked(self, goal_id: bytes, future: Future) -> None:
        """Record that this kernel will get the result."""
        if exchange := self._exchange(goal_id):
            self._goals[goal_id].asked = True
            future.add_done_callback(lambda done: self._done(exchange, done))

    def _done(self, exchange: Exchange, future: Future) -> None:
        response = future.result()
        exchange.add(STATUS.get(response.status, "unknown"), response.result)
        exchange.end()

    def cancel_sent(self, goal_id: bytes, future: Future) -> None:
        """Record that this kernel has asked to cancel the goal."""
        if exchange := self._exchange(goal_id):
            exchange.add("cancel")
            future.add_done_callback(lambda done: self._canceled(exchange, done))

    def _canceled(self, exchange: Exchange, future: Future) -> None:
        taken = bool(future.result().goals_canceling)
        exchange.add("cancel accepted" if taken else "cancel refused")

    def _exchange(self, goal_id: bytes) -> Exchange | None:
        goal = self._goals.get(goal_id)
        return goal.exchange if goal and not goal.outside else None


class _Handle:
    """A goal of a cell or a node that a page can cancel."""

    def __init__(self, handle: Any):
        self._handle = handle

    def cancel(self) -> None:
        """Ask the server to cancel the goal."""
        self._handle.cancel_goal_async()


def _remember(known: dict[Any, Any], key: object, value: object, most: int = OPEN) -> None:
    known[key] = value
    while len(known) > most:
        del known[next(iter(known))]


def _exists(client: Client) -> bool:
    """Return False if a client was destroyed."""
    try:
        with client.handle:
            return True
    except InvalidHandle:
        return False


def _sender(client: Client | ActionClient) -> str:
    """Return who sends with a client of this kernel: its node, or what uses the session's own hidden node."""
    node = owner(client)
    return _here() if is_hidden(node) else node


def _here() -> str:
    """Return the name of the sender that runs in this thread of the kernel."""
    thread = threading.current_thread()
    if thread is threading.main_thread():
        return "a cell"
    return f"/{thread.name.removeprefix('spin ')}" if thread.name.startswith("spin ") else "a node of this kernel"


def _names(ends: Iterable[TopicEndpointInfo]) -> list[str]:
    """Return the full names of the nodes that have these endpoints.

    The middleware may know an endpoint before its node: such a node has no name yet.
    """
    return sorted(
        {f"{each.node_namespace.rstrip('/')}/{each.node_name}" for each in ends if "UNKNOWN" not in each.node_name}
    )


def _said(names: list[str]) -> str:
    if not names:
        return OTHER
    return COMMAND if names[0].startswith("/_ros2cli") else names[0]


def _fitting(publishers: Iterable[TopicEndpointInfo], qos: QoSProfile) -> QoSProfile:
    """Return a QoS profile that all publishers of a topic satisfy: a program's own introspection may be volatile."""
    wanted = DurabilityPolicy.TRANSIENT_LOCAL
    if all(each.qos_profile.durability == wanted for each in publishers):
        return qos
    return QoSProfile(depth=qos.depth)


def _loaded(kind: str, end: str) -> type | None:
    """Return the class of a topic's messages; None if this kernel cannot import it."""
    package, _, name = kind.split("/")
    try:
        if end == SERVICE:
            return messages.get_service(f"{package}/srv/{name.removesuffix('_Event')}").Event
        if end == FEEDBACK:
            return messages.get_action(f"{package}/action/{name.removesuffix('_FeedbackMessage')}").Impl.FeedbackMessage
    except (*messages.INVALID_TYPE, RuntimeError):
        return None
    return GoalStatusArray


_traffic: list[Traffic] = []
_arrival = Arrival()
_threads: list[threading.Thread] = []
_sharing = threading.Lock()


def record() -> None:
    """Record what passes in the kernel's session, and in its later ones, from now until the kernel ends.

    When a robot comes, that is told to the pages.
    """
    with _sharing:
        if not _threads:
            _threads.append(threading.Thread(target=_go_on, name="lab's recording", daemon=True))
            _threads[0].start()
    _look()


def _go_on() -> None:
    ended = threading.Event()  # never set: the thread ends with the process
    with unwatched():
        while not ended.wait(PERIOD):
            try:
                _look()
                _arrival.look(current())
            except (RCLError, InvalidHandle, RuntimeError):
                if (live := current()) and live.ok:  # otherwise the session has ended
                    raise


def _look() -> Traffic | None:
    """Watch the current session; returns None without one."""
    with _sharing:
        live = current()
        if _traffic and _traffic[0].live is not live:
            _traffic.pop().close()
        if live is None:
            return None
        if not _traffic:
            _traffic.append(Traffic(live))
        _traffic[0].look()
        return _traffic[0]


class Summaries(Changes):
    """A feed of the list of exchanges; it starts the recording if needed."""

    def __init__(self) -> None:
        super().__init__(summaries)
        record()

    def read(self) -> Any:
        """Return the list if it has changed."""
        _look()
        return super().read()


def unseen() -> list[dict[str, Any]]:
    """Return the services of the session whose calls by other programs are not recorded, see `Traffic.unseen`."""
    traffic = _look()
    return traffic.unseen() if traffic else []
