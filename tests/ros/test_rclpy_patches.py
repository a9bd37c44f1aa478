"""What is patched in rclpy is still needed, and patched once."""

import inspect
import threading
import time

from course_interfaces.action import Fibonacci
from rclpy.action import ActionClient
from rclpy.executors import MultiThreadedExecutor

from course.ros import rclpy_internals, rclpy_patches


def unpatched(name: str):
    return inspect.unwrap(getattr(ActionClient, name))


def test_action_clients_are_still_without_a_lock():
    """When this fails, rclpy locks an ActionClient itself: remove `_lock_action_clients`."""
    assert not [name for name in rclpy_patches.UNLOCKED if "_lock" in inspect.getsource(unpatched(name))]


def test_a_patch_is_made_once():
    rclpy_patches.patch()
    patched = [getattr(ActionClient, name) for name in rclpy_patches.UNLOCKED]
    rclpy_patches.patch()
    assert [getattr(ActionClient, name) for name in rclpy_patches.UNLOCKED] == patched
    assert [inspect.unwrap(method) is not method for method in patched] == [True] * len(patched)


def test_an_answer_waits_until_its_question_is_noted(node):
    """The patched methods exclude each other: while one runs, another thread's waits."""
    rclpy_patches.patch()
    client = ActionClient(node, Fibonacci, "fibonacci")
    entered = threading.Event()

    def take() -> None:
        client.take_data()
        entered.set()

    class Handle:
        """In the place of the middleware's: sends while another thread would take the answer."""

        def __init__(self, inner):
            self.inner = inner

        def send_goal_request(self, request):
            thread.start()
            self.took_it = entered.wait(0.3)
            return self.inner.send_goal_request(request)

        def __getattr__(self, name):
            return getattr(self.inner, name)

    client._is_ready = client._is_goal_response_ready = False
    for name in ("_is_feedback_ready", "_is_status_ready", "_is_cancel_response_ready", "_is_result_response_ready"):
        setattr(client, name, False)
    thread = threading.Thread(target=take, daemon=True)
    handle = client._client_handle = Handle(client._client_handle)
    client.send_goal_async(Fibonacci.Goal(order=1))
    assert not handle.took_it  # it had to wait
    assert entered.wait(5)
    client._client_handle = handle.inner
    client.destroy()


def test_an_executor_still_gives_a_callback_to_its_threads_again():
    """When this fails, rclpy gives each callback once, or waits until it has begun: remove `_hand_over_to_workers`."""
    waiting = inspect.getsource(MultiThreadedExecutor._wait_for_ready_callbacks)
    assert "not task.executing() and not task.done()" in waiting
    assert "self._executor.submit(handler)\n" in inspect.getsource(MultiThreadedExecutor._spin_once_impl)


def test_an_executor_waits_a_moment_after_it_has_given_a_callback(node):
    rclpy_patches.patch()
    executor = MultiThreadedExecutor(num_threads=2, context=node.context)
    start = time.perf_counter()
    executor._executor.submit(threading.get_ident)
    assert time.perf_counter() - start >= rclpy_patches.HANDED_OVER
    rclpy_internals.end_thread_pool(executor)
    executor.shutdown()
