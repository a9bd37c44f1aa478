"""Every use of rclpy's private parts in this repository, but for the patches of `rclpy_patches`.

Each entry names the version it was seen in: that of the wheel ros-jazzy-rclpy (7.1.6 calls itself 7.1.5).
tests/ros/test_rclpy_internals.py fails when one is no longer needed, or a private part used here is gone.
"""

from __future__ import annotations

import contextlib
import functools
import inspect
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from enum import Enum
from types import FrameType, FunctionType, SimpleNamespace
from typing import TYPE_CHECKING, Any

from rclpy._rclpy_pybind11 import InvalidHandle, NodeNameNonExistentError, RCLError
from rclpy.impl.implementation_singleton import rclpy_implementation

from course.ros.taking import take

if TYPE_CHECKING:  # `ros2 node list` uses one name of this module, and has no time for all that these import
    from rcl_interfaces.msg import SetParametersResult
    from rclpy.action import ActionClient, ActionServer
    from rclpy.action.client import ClientGoalHandle
    from rclpy.client import Client
    from rclpy.executors import Executor, MultiThreadedExecutor
    from rclpy.node import Node
    from rclpy.parameter import Parameter
    from rclpy.qos import QoSProfile
    from rclpy.service import Service
    from rclpy.task import Future

__all__ = ["InvalidHandle", "NodeNameNonExistentError", "RCLError", "rclpy_implementation"]


def is_initialized(node: Node) -> bool:
    """Return True if `Node.__init__` has made the node behind a Node object.  Seen in 7.1.6: not public."""
    return hasattr(node, "_Node__node")


def is_executing(entity: Any) -> bool:
    """Return True if a callback of this service, client or timer keeps its exclusive callback group closed now."""
    return getattr(entity.callback_group, "_active_entity", None) is entity


def cancel_pending_requests(client: Client) -> None:
    """Cancel the requests that wait for an answer, so that no callback waits forever.

    Seen in 7.1.6: rclpy leaves them pending when the executor is shut down.
    """
    for future in list(client._pending_requests.values()):
        future.cancel()


def end_thread_pool(executor: MultiThreadedExecutor) -> Iterable[threading.Thread]:
    """Give no more work to the executor's threads, and return them.

    Seen in 7.1.6: `shutdown` leaves the thread pool alone, and prints the exceptions of unawaited tasks on stderr.
    """
    from rclpy.task import Future

    executor._executor.shutdown(wait=False, cancel_futures=True)
    for task in executor._futures:
        task._set_executor(None)
        task.add_done_callback(Future.exception)
    return pool_of(executor)


def pool_of(executor: Executor) -> list[threading.Thread]:
    """Return the threads of an executor that runs callbacks in a pool; none for others.  Seen in 7.1.6."""
    return list(getattr(getattr(executor, "_executor", None), "_threads", ()))


def is_shut_down(executor: Executor) -> bool:
    """Return True if `executor.shutdown` was called.  Seen in 7.1.6: not public."""
    return executor._is_shutdown


def destroy(waitable: object) -> None:
    """Destroy an action client or server.  Seen in 7.1.6: the method is public in both, but not in their base class."""
    waitable.destroy()  # type: ignore[attr-defined]


def action_type(waitable: object) -> type | None:
    """The type of an action client's or server's action; None for any other waitable.  Seen in 7.1.6: not public."""
    return getattr(waitable, "_action_type", None)


def action_name(client: ActionClient) -> str:
    """Return the full name of an action client's action.  Seen in 7.1.6: rclpy keeps only the given name, privately."""
    return client._node.resolve_topic_name(client._action_name)


def owner(client: Client | ActionClient) -> str:
    """Return the full name of the node that a client belongs to.

    Seen in 7.1.6: a client knows only the name of its node's logger, which has dots for the slashes.
    """
    if node := getattr(client, "_node", None):
        return str(node.get_fully_qualified_name())
    return f"/{getattr(client, 'logger_name', '').replace('.', '/')}"


def client_of(node: Node, future: Future) -> Client | ActionClient | None:
    """Return the client or the action client of `node` that waits for this future; None if there is none."""
    from rclpy.action import ActionClient

    for client in node.clients:
        if any(each is future for each in list(client._pending_requests.values())):
            return client
    for waitable in node.waitables:
        if isinstance(waitable, ActionClient):
            for kept in ("goal", "cancel", "result"):
                if any(each is future for each in list(getattr(waitable, f"_pending_{kept}_requests").values())):
                    return waitable
    return None


def is_served(client: Client | ActionClient) -> bool:
    """Return True if a client, or an action client, has found a server."""
    ready = getattr(client, "server_is_ready", None) or client.service_is_ready  # type: ignore[union-attr]
    return bool(ready())


def busy_receiver(client: Client) -> str:
    """Return what would receive `client`'s response, and is busy with this thread's callback; '' if nothing is.

    Seen in 7.1.6: what a callback was called for, and by which executor, only rclpy's own frames tell.
    """
    import rclpy.executors
    from rclpy.callback_groups import MutuallyExclusiveCallbackGroup

    frame: FrameType | None = sys._getframe()
    group = None
    while frame is not None:
        if frame.f_code.co_filename == rclpy.executors.__file__:
            group = getattr(frame.f_locals.get("entity"), "callback_group", group)
            executor = frame.f_locals.get("self")
            if isinstance(executor, rclpy.executors.SingleThreadedExecutor) and any(
                client in node.clients for node in executor.get_nodes()
            ):
                return "the executor"
        frame = frame.f_back
    if isinstance(group, MutuallyExclusiveCallbackGroup) and group is client.callback_group:
        return "the client's callback group"
    return ""


class _Kept(dict[bytes, Callable[..., Any]]):
    """Callbacks that are never removed."""

    def __delitem__(self, key: bytes) -> None:
        """Keep the callback."""


def keep_feedback(client: ActionClient) -> None:
    """Have the feedback callbacks of this action client receive feedback that comes after the result, too.

    Seen in 7.1.6: rclpy removes a goal's callback when its result has come.  Result and feedback are sent separately,
    so the last feedback is lost if it is slower.
    """
    if not isinstance(client._feedback_callbacks, _Kept):
        client._feedback_callbacks = _Kept(client._feedback_callbacks)


def watch_parameters(node: Node, watcher: Callable[[list[Parameter], SetParametersResult], None]) -> Callable[[], None]:
    """Call `watcher` with every attempt to set parameters of `node` and its outcome; return a function that ends this.

    Seen in 7.1.6: services, the command line and `set_parameters` all use one private method, and the public callbacks
    are not called for values that another one refuses.
    """
    original = node._set_parameters_atomically

    watchers = [watcher]

    def watched(parameters: list[Parameter]) -> SetParametersResult:
        result = original(parameters)
        for each in watchers:
            each(parameters, result)
        return result

    def end() -> None:
        watchers.clear()  # another watcher may stand on this one
        if node._set_parameters_atomically is watched:
            node._set_parameters_atomically = original  # type: ignore[method-assign]

    node._set_parameters_atomically = watched  # type: ignore[method-assign, assignment]
    return end


def is_watched(node: Node) -> bool:
    """Return True if `watch_parameters` watches a node."""
    return "_set_parameters_atomically" in vars(node)


def replace_in_rclpy(
    make: Callable[[Callable[..., Any]], Callable[..., Any]], owner: Any, name: str
) -> Callable[[], None]:
    """Replace `owner.name` by `make(original)`; return a function that restores the original.

    A live session replaces functions that are right in a program but block a kernel (`course.session.guards`).
    """
    original = getattr(owner, name)
    setattr(owner, name, functools.wraps(original)(make(original)))
    return functools.partial(setattr, owner, name, original)


def create_telling_subscription(
    node: Node, kind: type, topic: str, callback: Callable[[bytes, dict[str, Any]], None], qos: QoSProfile
) -> None:
    """Subscribe `node` to serialized messages; the info on each has the id of its publisher, too, as "publisher".

    Seen in 7.1.6: `take_message` drops it, and `create_subscription` takes no other class.
    """
    make = inspect.unwrap(type(node).create_subscription)
    names = {**make.__globals__, "_rclpy": SimpleNamespace(Subscription=_telling_subscription())}
    create = FunctionType(make.__code__, names, make.__name__, make.__defaults__, make.__closure__)
    create.__kwdefaults__ = make.__kwdefaults__
    create(node, kind, topic, callback, qos, raw=True)


@functools.cache
def _telling_subscription() -> type:
    class TellingSubscription(rclpy_implementation.Subscription):
        def take_message(self, kind: type, raw: bool) -> tuple[Any, dict[str, Any]] | None:
            try:
                return take(self.pointer) or super().take_message(kind, raw)
            except (AttributeError, OSError):  # with other libraries than those of this version
                return super().take_message(kind, raw)

    return TellingSubscription


def before_each_answer(server: ActionServer, tell: Callable[[Callable[[Any], None]], None]) -> None:
    """Call `tell` before a goal is answered, with a function that publishes feedback of this goal.

    A client may receive feedback before the answer, because they are sent separately.  Seen in 7.1.6: a goal callback
    is not told the goal's ID, without which no feedback can be published.
    """
    patched: Any = server  # mypy lets no method be assigned to
    answer = patched._execute_goal_request
    kind = server.action_type.Impl.FeedbackMessage

    async def begin(request: Any) -> None:
        goal_id = request[1].goal_id
        tell(lambda feedback: server._handle.publish_feedback(kind(goal_id=goal_id, feedback=feedback)))
        await answer(request)

    patched._execute_goal_request = begin


class GoalFault(Enum):
    """A fault of an action server's callback that raises no exception."""

    NO_DECISION = "the goal callback returned no GoalResponse: rclpy rejects the goal"
    NO_STATE = "the execute callback set no final state: rclpy aborts the goal"


@dataclass(frozen=True)
class NoResult:
    """An execute callback that returned something else than a result."""

    callback: Callable[..., Any]
    returned: Any


def watch_goals(tell: Callable[[Node, Exception | GoalFault | NoResult], None]) -> Callable[[], None]:
    """Call `tell` with each fault of a goal callback or an execute callback of this process.

    Its arguments are the node, and the exception of the execute callback or what was wrong otherwise.  Returns a
    function that ends this.

    Seen in 7.1.6: an ActionServer prints the traceback on stderr, in the output of the cell that happens to run, and
    aborts the goal.  The goal is still aborted.
    """
    from rclpy.action import ActionServer, GoalResponse
    from rclpy.action.server import default_goal_callback
    from rclpy.executors import await_or_execute

    def decide(original: Callable[..., None]) -> Callable[..., None]:
        def register(self: Any, goal_callback: Callable[..., Any] | None) -> None:
            async def guarded(goal: Any) -> Any:
                decision = await await_or_execute(goal_callback or default_goal_callback, goal)
                if not isinstance(decision, GoalResponse):
                    tell(self._node, GoalFault.NO_DECISION)
                return decision

            original(self, guarded)

        return register

    def make(original: Callable[..., Any]) -> Callable[..., Any]:
        async def execute(self: Any, execute_callback: Callable[..., Any], goal_handle: Any) -> Any:
            async def guarded(handle: Any) -> Any:
                try:
                    result = await await_or_execute(execute_callback, handle)
                    made = isinstance(result, self._action_type.Result)
                    if handle.is_active or not made:
                        tell(self._node, GoalFault.NO_STATE if made else NoResult(execute_callback, result))
                    return result if made else self._action_type.Result()
                except Exception as error:
                    tell(self._node, error)
                    if handle.is_active:
                        handle.abort()
                    return self._action_type.Result()

            return await original(self, guarded, goal_handle)

        return execute

    ends = [
        replace_in_rclpy(decide, ActionServer, "register_goal_callback"),
        replace_in_rclpy(make, ActionServer, "_execute_goal"),
    ]

    def end() -> None:
        for each in ends:
            each()

    return end


def sequence_number(client: Client, future: Future) -> int | None:
    """Return the number by which a client knows the request of a future; None if it is done."""
    return next((number for number, each in [*client._pending_requests.items()] if each is future), None)


def take_request(service: Service) -> tuple[Any, float] | None:
    """Return a request that waits at a service, and when it was sent (s since 1970), or None; it is not answered.

    Seen in 7.1.6: only executors take requests, and they answer them.
    """
    kind: Any = service.srv_type
    with service.handle:
        request, header = service.handle.service_take_request(kind.Request)
    return None if request is None else (request, header.source_timestamp / 1e9)


class ClientWatcher:
    """A receiver of what the clients of this process send, here of nothing; `at` is in s of `time.monotonic`."""

    def called(self, client: Client, request: Any, future: Future, at: float) -> None:
        """Note that a service was called; `future` will have the response, or an exception."""

    def goal_begins(self, client: ActionClient, goal: Any, goal_id: bytes, *, own: bool) -> None:
        """Note that a goal is about to be sent; for the course's `own` goals the next methods are not called."""

    def goal_sent(self, goal_id: bytes, future: Future) -> None:
        """Note that the goal was sent; `future` will have its handle."""

    def feedback(self, goal_id: bytes, feedback: Any) -> None:
        """Note that feedback has come."""

    def result_asked(self, goal_id: bytes, future: Future) -> None:
        """Note that the goal's result was requested."""

    def cancel_sent(self, goal_id: bytes, future: Future) -> None:
        """Note that canceling the goal was requested."""


_threads = threading.local()


@contextlib.contextmanager
def unwatched() -> Iterator[None]:
    """Hide the course's own requests, sent by this thread in the block, from every `ClientWatcher`."""
    before = getattr(_threads, "unwatched", False)
    _threads.unwatched = True
    try:
        yield
    finally:
        _threads.unwatched = before


def watch_clients(watcher: ClientWatcher) -> Callable[[], None]:
    """Call `watcher` for everything that the clients of this process send; return a function that ends this.

    Seen in 7.1.6: service introspection reports a call, but not who waits for it or why there is no answer, and actions
    have none.
    """
    from rclpy.action import ActionClient
    from rclpy.client import Client

    def tell(method: Callable[..., None], *args: Any, **kwargs: Any) -> None:
        if not getattr(_threads, "unwatched", False):
            with contextlib.suppress(Exception):  # an error of the watcher must not disturb the sender
                method(*args, **kwargs)

    def calls(original: Callable[..., Future]) -> Callable[..., Future]:
        def call_async(self: Client, request: Any) -> Future:
            at = time.monotonic()
            future = original(self, request)
            tell(watcher.called, self, request, future, at)
            return future

        return call_async

    def goals(original: Callable[..., Future]) -> Callable[..., Future]:
        def send_goal_async(self: Any, goal: Any, feedback_callback: Any = None, goal_uuid: Any = None) -> Future:
            goal_uuid = goal_uuid or self._generate_random_uuid()
            goal_id = bytes(goal_uuid.uuid)
            own = getattr(_threads, "unwatched", False)
            with contextlib.suppress(Exception):
                watcher.goal_begins(self, goal, goal_id, own=own)
            if not own:
                feedback_callback = _heard(feedback_callback, watcher, goal_id)
            future = original(self, goal, feedback_callback=feedback_callback, goal_uuid=goal_uuid)
            tell(watcher.goal_sent, goal_id, future)
            return future

        return send_goal_async

    def later(tells: Callable[[bytes, Future], None]) -> Callable[[Callable[..., Future]], Callable[..., Future]]:
        def make(original: Callable[..., Future]) -> Callable[..., Future]:
            def ask(self: Any, goal_handle: ClientGoalHandle) -> Future:
                future = original(self, goal_handle)
                tell(tells, bytes(goal_handle.goal_id.uuid), future)
                return future

            return ask

        return make

    ends = [
        replace_in_rclpy(calls, Client, "call_async"),
        replace_in_rclpy(goals, ActionClient, "send_goal_async"),
        replace_in_rclpy(later(watcher.result_asked), ActionClient, "_get_result_async"),
        replace_in_rclpy(later(watcher.cancel_sent), ActionClient, "_cancel_goal_async"),
    ]

    def end() -> None:
        for each in ends:
            each()

    return end


def _heard(callback: Callable[..., Any] | None, watcher: ClientWatcher, goal_id: bytes) -> Callable[..., Any]:
    """Return a feedback callback that calls the watcher, and then the client's own."""

    def tell(message: Any) -> None:
        with contextlib.suppress(Exception):
            watcher.feedback(goal_id, message.feedback)

    if callback is None:
        return tell
    if inspect.iscoroutinefunction(callback):

        async def wait(message: Any) -> Any:
            tell(message)
            return await callback(message)

        return wait

    def hear(message: Any) -> Any:
        tell(message)
        return callback(message)

    return hear
