"""The pages' statements on rclpy's defaults and versions are true of the installed rclpy."""

import inspect
import os
import signal
import subprocess
import sys

import rclpy
from rclpy.action import ActionServer
from rclpy.action.server import default_cancel_callback, default_handle_accepted_callback
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node

from course.foundation import cells
from tests.notebooks.test_pages import ROOT


def page(name: str) -> str:
    return " ".join(cell.source for cell in cells.read(ROOT / f"notebooks/{name}/{name}.ipynb"))


def defaults(function) -> dict:
    return {name: each.default for name, each in inspect.signature(function).parameters.items()}


def test_a_result_is_kept_for_900_seconds():
    assert defaults(ActionServer.__init__)["result_timeout"] == 900
    assert "900 s in Jazzy" in page("actions")


def test_an_action_server_refuses_a_cancel_and_begins_a_goal_when_it_is_accepted_by_default():
    known = defaults(ActionServer.__init__)
    assert known["handle_accepted_callback"] is default_handle_accepted_callback
    assert known["cancel_callback"] is default_cancel_callback
    assert default_cancel_callback(None).name == "REJECT"
    assert "By default the executor begins each goal when it is accepted" in page("actions")
    assert "without a `cancel_callback` refuses every request to cancel" in page("actions")


def test_a_goal_is_a_task_of_the_executor():
    source = inspect.getsource(ActionServer.notify_execute)
    assert "executor.create_task(" in source and "callback_group" not in source
    assert "rclpy runs goals as tasks of the executor" in page("actions")


def test_an_executor_without_a_number_has_a_thread_for_each_core_that_the_program_may_use():
    context = rclpy.Context()
    context.init()
    executor = MultiThreadedExecutor(context=context)
    assert executor._executor._max_workers == len(os.sched_getaffinity(0))
    executor.shutdown()
    context.try_shutdown()
    for name in ("services", "actions"):
        assert "processor core" in page(name) and "may use" in page(name)


def test_undeclared_parameters_and_other_types_are_refused_by_default():
    assert defaults(Node.__init__)["allow_undeclared_parameters"] is False
    assert "dynamic_typing=True" in page("parameters") and "allow_undeclared_parameters=True" in page("parameters")


SENT = """
import rclpy
from example_interfaces.srv import AddTwoInts

rclpy.init()
client = rclpy.create_node("unchecked").create_client(AddTwoInts, "add_two_ints")
request = AddTwoInts.Request(a=1.5, c=3)
print(request, flush=True)
client.call_async(request)
"""


def test_without_the_check_of_fields_a_program_aborts_when_it_sends():
    def run(check: str) -> subprocess.CompletedProcess[str]:
        surroundings = {**os.environ, "ROS_PYTHON_CHECK_FIELDS": check}
        command = [sys.executable, "-c", "from course import environment\nenvironment.prepare()" + SENT]
        return subprocess.run(command, env=surroundings, capture_output=True, text=True, timeout=60)

    unchecked, checked = run("0"), run("1")
    assert "AddTwoInts_Request(a=1.5, b=0)" in unchecked.stdout
    assert unchecked.returncode == -signal.SIGABRT
    assert "PyLong_Check(field)" in unchecked.stderr and "Traceback" not in unchecked.stderr
    assert checked.stdout == "" and "AssertionError" in checked.stderr
    assert "the process aborts with `PyLong_Check(field)`" in page("services")
    assert "ROS_PYTHON_CHECK_FIELDS=1" in page("services") and "ROS_PYTHON_CHECK_FIELDS=1" in page("actions")
