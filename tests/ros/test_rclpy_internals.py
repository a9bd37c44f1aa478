"""The private parts of rclpy that are used still exist, and the repairs are still needed."""

import inspect
import os
import threading
import time

import pytest
from course_interfaces.action import Fibonacci
from example_interfaces.srv import AddTwoInts
from rclpy.action import ActionClient, ActionServer
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message
from std_msgs.msg import String

from course.foundation.waiting import wait_until
from course.ros import rclpy_internals
from course.ros.discovery import is_of_process
from course.session.spinner import Spinner


def test_shutting_an_executor_down_leaves_its_threads():
    """If this fails, rclpy ends the pool itself: remove `end_thread_pool`."""
    source = inspect.getsource(MultiThreadedExecutor.shutdown)
    assert ".shutdown(wait=False" not in source.replace(" ", "")


def test_an_executor_has_a_pool_whose_threads_are_known(node):
    executor = MultiThreadedExecutor(num_threads=2, context=node.context)
    started = executor._executor.submit(threading.get_ident).result(5)
    assert started in {thread.ident for thread in rclpy_internals.end_thread_pool(executor)}
    executor.shutdown()


def test_requests_are_taken_and_not_answered(node):
    service = node.create_service(AddTwoInts, "unasked", lambda request, response: response)
    client = node.create_client(AddTwoInts, "unasked")
    assert wait_until(client.service_is_ready, 10)
    before = time.time()
    futures = [client.call_async(AddTwoInts.Request(a=number)) for number in (1, 2)]
    for number in (1, 2):
        request, sent = wait_until(lambda: rclpy_internals.take_request(service), 10)
        assert request.a == number and before <= sent <= time.time()
    assert rclpy_internals.take_request(service) is None and not any(future.done() for future in futures)


def test_pending_requests_are_cancelled(node):
    client = node.create_client(AddTwoInts, "nobody")
    future = client.call_async(AddTwoInts.Request())
    rclpy_internals.cancel_pending_requests(client)
    assert future.cancelled()


@pytest.mark.parametrize(
    ("threads", "groups", "busy"),
    [
        (1, (None, None), "the executor"),
        (1, (ReentrantCallbackGroup, MutuallyExclusiveCallbackGroup), "the executor"),
        (2, (None, None), "the client's callback group"),
        (2, (MutuallyExclusiveCallbackGroup, MutuallyExclusiveCallbackGroup), ""),
        (2, (ReentrantCallbackGroup, ReentrantCallbackGroup), ""),
    ],
)
def test_what_is_busy_with_the_callback_that_waits_is_known(node, threads, groups, busy):
    """`groups` are those of the timer and of the client; None is the default group."""
    of_timer, of_client = (kind and kind() for kind in groups)
    client = node.create_client(AddTwoInts, "nobody", callback_group=of_client)
    found = []
    node.create_timer(0.01, lambda: found.append(rclpy_internals.busy_receiver(client)), callback_group=of_timer)
    spinner = Spinner(node, threads)
    spinner.start()
    assert wait_until(lambda: found, 10)
    assert spinner.stop(destroy=False)
    assert {*found} == {busy}
    assert rclpy_internals.busy_receiver(client) == ""


def test_a_node_tells_whether_it_was_initialized(node):
    assert rclpy_internals.is_initialized(node)
    assert not rclpy_internals.is_initialized(Node.__new__(Node))


def test_a_waitable_tells_its_action(node):
    client = ActionClient(node, Fibonacci, "fibonacci")
    assert rclpy_internals.action_type(client) is Fibonacci
    assert client in list(node.waitables)
    rclpy_internals.destroy(client)
    assert rclpy_internals.action_type(object()) is None


def test_an_action_client_still_forgets_feedback(node):
    """If this fails, rclpy hears the feedback that comes after a result: remove `keep_feedback`."""
    assert "del self._feedback_callbacks[goal_uuid]" in inspect.getsource(ActionClient._remove_pending_result_request)
    client = ActionClient(node, Fibonacci, "fibonacci")
    rclpy_internals.keep_feedback(client)
    client.send_goal_async(Fibonacci.Goal(order=1), feedback_callback=print)
    (number,) = client._feedback_callbacks
    del client._feedback_callbacks[number]
    assert list(client._feedback_callbacks.values()) == [print]
    client.destroy()


def test_feedback_can_be_published_before_a_goal_is_answered(node):
    """If this fails, what comes before the answer to a goal can no longer be tried with a student's client."""
    told = []
    server = ActionServer(
        node, Fibonacci, "fibonacci", lambda goal: Fibonacci.Result(), goal_callback=lambda _: told.append("answered")
    )
    client = ActionClient(node, Fibonacci, "fibonacci")
    rclpy_internals.before_each_answer(server, lambda publish: publish(Fibonacci.Feedback(partial_sequence=[0, 1])))
    client.wait_for_server(5.0)
    heard = client.send_goal_async(Fibonacci.Goal(order=1), lambda message: told.append(message.feedback))
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    executor.spin_until_future_complete(heard, 5.0)
    assert wait_until(lambda: executor.spin_once(0.05) or len(told) > 1, 5.0)
    assert "answered" in told
    executor.shutdown()
    client.destroy()
    server.destroy()


def test_every_way_of_setting_parameters_is_watched(node):
    node.declare_parameter("speed", 1.0)
    seen = []
    end = rclpy_internals.watch_parameters(node, lambda parameters, result: seen.append(parameters[0].value))
    node.set_parameters([Parameter("speed", value=2.0)])
    node.set_parameters_atomically([Parameter("speed", value=3.0)])
    end()
    node.set_parameters([Parameter("speed", value=4.0)])
    assert seen == [2.0, 3.0]


def test_an_executor_tells_whether_it_was_shut_down(node):
    executor = MultiThreadedExecutor(num_threads=2, context=node.context)
    assert not rclpy_internals.is_shut_down(executor)
    executor.shutdown()
    assert rclpy_internals.is_shut_down(executor)
    rclpy_internals.end_thread_pool(executor)


def test_an_action_server_still_prints_what_an_execute_callback_raises():
    """If this fails, rclpy hands such an exception on: `watch_goals` may be no longer needed."""
    end = rclpy_internals.watch_goals(lambda node, fault: None)
    assert inspect.unwrap(ActionServer._execute_goal) is not ActionServer._execute_goal
    end()
    assert "traceback.print_exc()" in inspect.getsource(ActionServer._execute_goal)
    assert not hasattr(ActionServer._execute_goal, "__wrapped__")


class Watcher:
    """Raises whenever it is told of something, and keeps the names of what it was told of."""

    def __init__(self) -> None:
        self.told: list[str] = []

    def __getattr__(self, name: str):
        def tell(*args: object, **kwargs: object) -> None:
            self.told.append(name)
            raise RuntimeError("a watcher's own mistake")

        return tell


def test_who_watches_clients_is_told_and_disturbs_nobody(node):
    """If `call_async` or an ActionClient's methods go or change, the flow diagrams have nothing to draw."""
    watcher = Watcher()
    end = rclpy_internals.watch_clients(watcher)
    client = node.create_client(AddTwoInts, "add")
    goals = ActionClient(node, Fibonacci, "fibonacci")
    assert not client.call_async(AddTwoInts.Request()).done()
    assert not goals.send_goal_async(Fibonacci.Goal()).done()
    assert watcher.told == ["called", "goal_begins", "goal_sent"]
    with rclpy_internals.unwatched():
        client.call_async(AddTwoInts.Request())
        goals.send_goal_async(Fibonacci.Goal())
    assert watcher.told[3:] == ["goal_begins"]  # told so that its status is known to be nobody else's
    end()
    client.call_async(AddTwoInts.Request())
    assert len(watcher.told) == 4
    assert rclpy_internals.action_name(goals) == "/fibonacci"
    goals.destroy()


def test_a_raw_subscription_still_leaves_its_publisher_out_and_can_tell_it(node):
    """If the first assertion fails, rclpy tells it itself: remove `create_telling_subscription` and `taking`."""
    heard = {}
    node.create_subscription(String, "told", lambda message, info: heard.update(plain=(message, info)), 10, raw=True)
    rclpy_internals.create_telling_subscription(
        node, String, "told", lambda message, info: heard.update(telling=(message, info)), QoSProfile(depth=10)
    )
    publisher = node.create_publisher(String, "told", 10)
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)

    def spun() -> bool:
        publisher.publish(String(data="hello"))
        executor.spin_once(0.1)
        return len(heard) == 2

    assert wait_until(spun, 30.0)
    assert "publisher" not in heard["plain"][1]
    message, info = heard["telling"]
    assert deserialize_message(message, String).data == "hello"
    (end,) = node.get_publishers_info_by_topic("/told")
    assert info["publisher"] == bytes(end.endpoint_gid)[:16]
    assert info.keys() - {"publisher"} == heard["plain"][1].keys()
    assert is_of_process(info["publisher"], os.getpid())
    executor.shutdown()
