"""The patches of rclpy are still needed, and are made once."""

import inspect
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from course_interfaces.action import Fibonacci
from rclpy.action import ActionClient
from rclpy.executors import MultiThreadedExecutor
from rclpy.impl import rcutils_logger

from course.ros import rclpy_internals, rclpy_patches
from course.session.started import sitecustomize

SERVER = """
import os
import sys
import rclpy
from course_interfaces.action import Fibonacci
from rclpy.action import ActionServer, GoalResponse
from std_srvs.srv import Trigger
if "patched" in sys.argv:
    from course.ros.rclpy_patches import patch
    patch()
def execute(goal):
    goal.succeed()
    return Fibonacci.Result(sequence=[goal.request.order])
rclpy.init()
node = rclpy.create_node("server")
answered = []
def ask(request, response):
    answered.append("a request")
    return Trigger.Response(message="answered")
def take(goal):
    answered.append("a goal")
    return GoalResponse.ACCEPT
def note():
    if len(set(answered)) == 2 and (until := os.environ.get("UNDISCOVERED_UNTIL")):
        open(until, "w").close()
node.create_service(Trigger, "ask", ask)
server = ActionServer(node, Fibonacci, "count", execute, goal_callback=take)
node.create_timer(0.3, note)  # in the one thread: after the responses have left
print("ready", flush=True)
rclpy.spin(node)
"""
CLIENT = [sys.executable, "-c", """
import sys
import rclpy
from course_interfaces.action import Fibonacci
from rclpy.action import ActionClient
from std_srvs.srv import Trigger
rclpy.init()
node = rclpy.create_node("client")
asking, counting = node.create_client(Trigger, "ask"), ActionClient(node, Fibonacci, "count")
assert asking.wait_for_service(20) and counting.wait_for_server(20)
response, goal = asking.call_async(Trigger.Request()), counting.send_goal_async(Fibonacci.Goal(order=7))
rclpy.spin_until_future_complete(node, goal, timeout_sec=float(sys.argv[1]))
rclpy.spin_until_future_complete(node, response, timeout_sec=float(sys.argv[1]) if goal.done() else 0)
print(response.done() and response.result().message)
if goal.done():
    result = goal.result().get_result_async()
    rclpy.spin_until_future_complete(node, result, timeout_sec=float(sys.argv[1]))
    print(result.done() and list(result.result().result.sequence))
""", "20"]  # fmt: skip


def unpatched(name: str):
    return inspect.unwrap(getattr(ActionClient, name))


def test_action_clients_are_still_without_a_lock():
    """If this fails, rclpy locks an ActionClient itself: remove `lock_action_clients`."""
    assert not [name for name in rclpy_patches.UNLOCKED if "_lock" in inspect.getsource(unpatched(name))]


def test_a_patch_is_made_once():
    rclpy_patches.patch()
    patched = [getattr(ActionClient, name) for name in rclpy_patches.UNLOCKED]
    rclpy_patches.patch()
    assert [getattr(ActionClient, name) for name in rclpy_patches.UNLOCKED] == patched
    assert [inspect.unwrap(method) is not method for method in patched] == [True] * len(patched)


def loaded(before: str) -> str:
    """Return True, as text, if the first message of a process has loaded the parser of interface definitions."""
    first = "from std_srvs.srv import Trigger\ntype(Trigger).__import_type_support__()"
    program = f"{before}\n{first}\nimport sys\nprint('lark' in sys.modules)"
    return subprocess.check_output([sys.executable, "-c", program], text=True, timeout=60)


def test_a_message_still_loads_the_parser_of_definitions():
    """If this fails, rosidl_generator_py loads it only for a build itself: remove `load_generator_later`."""
    assert loaded("") == "True\n"
    assert loaded("from course.ros.rclpy_patches import load_generator_later as later\nlater()\nlater()") == "False\n"


def test_a_node_still_loads_numpy_unless_that_is_left_for_later():
    """If this fails, service_msgs loads it only for a message itself: remove `load_numpy_later`."""
    program = """{before}
import sys
import rclpy
rclpy.init()
node = rclpy.create_node('plain')
early = 'numpy' in sys.modules
from service_msgs.msg import ServiceEventInfo
import numpy
print(early, ServiceEventInfo(client_gid=[2] * 16).client_gid.sum() == numpy.arange(16)[-1] + 17)
"""
    later = "from course.ros.rclpy_patches import load_numpy_later as later\nlater()\nlater()"
    for before, early in (("", True), (later, False)):
        command = [sys.executable, "-c", program.format(before=before)]
        assert subprocess.check_output(command, text=True, timeout=60) == f"{early} True\n"


def test_the_generator_is_there_for_a_build():
    """Also for whoever asks for another part of it by its name."""
    asked = """from course.ros.rclpy_patches import load_generator_later
load_generator_later()
from rosidl_generator_py import generate_py
from rosidl_generator_py.generate_py_impl import SPECIAL_NESTED_BASIC_TYPES
import rosidl_generator_py.cli
try:
    generate_py('nothing.json', [])
except FileNotFoundError:
    print(len(SPECIAL_NESTED_BASIC_TYPES) > 5)"""
    assert subprocess.check_output([sys.executable, "-c", asked], text=True, timeout=60) == "True\n"


def test_a_log_line_still_looks_for_the_sources_of_its_callers():
    """If this fails, rclpy itself reads no file for the line that logs: remove `find_callers_by_name`."""
    assert "inspect.getframeinfo(frame).filename" in inspect.getsource(rcutils_logger)


def test_a_log_line_has_its_place_and_reads_no_file(monkeypatch):
    rclpy_patches.patch()
    place = rcutils_logger.CallerId()
    monkeypatch.setattr(inspect, "getframeinfo", None)
    monkeypatch.setattr(os, "stat", None)
    again = rcutils_logger.CallerId()
    monkeypatch.undo()
    name = "test_a_log_line_has_its_place_and_reads_no_file"
    assert (place.function_name, place.file_path) == (again.function_name, again.file_path) == (name, __file__)
    assert again.line_number == place.line_number + 3


def test_a_program_that_the_session_starts_is_patched_too(tmp_path):
    program = "import sys\nimport rclpy.node\nprint('service_msgs.msg' in sys.modules, 'numpy' in sys.modules)\n"
    program += "from rclpy.action import ActionClient\nfrom rclpy.impl import rcutils_logger\n"
    program += (
        "print(hasattr(ActionClient.send_goal_async, '__wrapped__'), hasattr(rcutils_logger.inspect, 'getsource'))"
    )
    with (tmp_path / "stacks").open("w") as stacks:
        variables = sitecustomize.environment(os.environ, stacks.fileno(), introspecting=False)
        command = [sys.executable, "-c", program]
        said = subprocess.check_output(
            command, text=True, env={**os.environ, **variables}, pass_fds=[stacks.fileno()], timeout=60
        )
    assert said == "True False\nTrue False\n"


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


@pytest.fixture(scope="module")
def undiscovered(tmp_path_factory):
    """Return a library that keeps the readers of a process from being discovered for a while."""
    library = tmp_path_factory.mktemp("library") / "undiscovered.so"
    source = Path(__file__).with_name("undiscovered.c")
    subprocess.run(["cc", "-shared", "-fPIC", "-o", library, source, "-ldl"], check=True)
    return library


def asked(library: Path, *words: str, client: list[str] = CLIENT, stacks: int | None = None) -> list[str]:
    """Return what a client whose readers are discovered late prints of the server's responses."""
    variables = sitecustomize.environment(os.environ, stacks, introspecting=False) if stacks else {}
    with subprocess.Popen(
        [sys.executable, "-c", SERVER, *words],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, **variables},
        pass_fds=[stacks] if stacks else [],
    ) as program:
        try:
            assert program.stdout.readline() == "ready\n"
            preloaded = {**os.environ, "LD_PRELOAD": str(library)}
            return subprocess.run(client, capture_output=True, text=True, env=preloaded, timeout=90).stdout.splitlines()
        finally:
            program.kill()


def test_a_response_is_still_lost_while_its_reader_is_undiscovered(domain, undiscovered, monkeypatch, tmp_path):
    """If this fails, a server waits for the reader of its response, or sends it later: remove that patch."""
    monkeypatch.setenv("UNDISCOVERED_UNTIL", str(tmp_path / "answered"))
    assert asked(undiscovered, client=[*CLIENT[:-1], "4"]) == ["False"]


def test_a_response_is_sent_again_until_its_reader_is_discovered(domain, undiscovered):
    assert asked(undiscovered, "patched") == ["answered", "[7]"]


def test_a_program_that_the_session_starts_sends_its_responses_again_too(domain, undiscovered, tmp_path):
    with (tmp_path / "stacks").open("w") as stacks:
        assert asked(undiscovered, stacks=stacks.fileno()) == ["answered", "[7]"]


def test_ros2_param_asks_again_and_sets_once(domain, undiscovered):
    """The server is not patched, as one that was started in a terminal."""
    command = [sys.executable, "-m", "course.ros2.main", "param"]
    assert "  use_sim_time" in asked(undiscovered, client=[*command, "list", "/server"])
    said = asked(undiscovered, client=[*command, "set", "/server", "use_sim_time", "true"])
    assert said == ["Set parameter successful"]


def test_an_executor_still_gives_a_callback_to_its_threads_again():
    """If this fails, rclpy gives each callback once, or waits until it has begun: remove `_hand_over_to_workers`."""
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
