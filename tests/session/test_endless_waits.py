"""Why a program waits without end, from its text and the stacks that `faulthandler` writes of it."""

import pytest

from course.session.endless_waits import endless_wait

CLIENT = """import rclpy

def ask(node):
    client = node.create_client(Calculate, '/calculator')
    client.wait_for_service({limit})
    return client.call(Calculate.Request(), {limit})

def main():
    node = rclpy.create_node('client')
    rclpy.spin(node)

def on_answer(future):
    rclpy.spin_until_future_complete(node, future)
"""
RCLPY = "/venv/lib/rclpy"
WAITS = f'  File "{RCLPY}/client.py", line 250 in wait_for_service\n  File "/home/client.py", line 5 in ask\n'
CALLS = f'  File "/threading.py", line 3 in wait\n  File "{RCLPY}/client.py", line 2 in call\n'
CALLS += '  File "/home/client.py", line 6 in ask\n'
SPINS = f'  File "{RCLPY}/executors.py", line 4 in spin_once\n  File "{RCLPY}/__init__.py", line 2 in spin\n'
MAIN = '  File "/home/client.py", line 10 in main\n'
CALLBACK = '  File "/home/client.py", line 13 in on_answer\n'
HANDLER = f'  File "{RCLPY}/executors.py", line 5 in handler\n'
TASK = f'  File "{RCLPY}/task.py", line 5 in __call__\n'
SERVED = {"/calculator": ["calculator_interfaces/srv/Calculate"], "/lift": ["course_interfaces/action/Lift"]}


def why(tmp_path, *threads: str, limit: str = "", served=None, text: str = CLIENT) -> str:
    path = tmp_path / "client.py"
    path.write_text(text.replace("{limit}", limit))
    stacks = "\n".join(f"Thread 0x{number} (most recent call first):\n{each}" for number, each in enumerate(threads))
    return endless_wait(stacks, path, SERVED if served is None else served)


def test_a_call_that_nobody_spins_for(tmp_path):
    said = why(tmp_path, CALLS)
    assert said.startswith(
        "`call(...)` in line 6 waits for a response that can only be received while the node is spun"
    )
    assert "`call_async(...)`" in said


@pytest.mark.parametrize("other", [SPINS, f'  File "/lib/time.py", line 1 in sleep\n{MAIN}'])
def test_a_call_whose_answer_another_thread_may_receive(tmp_path, other):
    assert why(tmp_path, CALLS, other) == ""


def test_a_call_in_a_callback_of_the_thread_that_spins(tmp_path):
    assert why(tmp_path, CALLS + HANDLER + SPINS + MAIN).startswith("`call(...)` in line 6")


@pytest.mark.parametrize("stack", [CALLS, WAITS])
def test_a_wait_with_a_limit_ends(tmp_path, stack):
    assert why(tmp_path, stack, limit="timeout_sec=5.0", served={}) == ""


def test_a_wait_for_a_server_that_is_not_there(tmp_path):
    assert why(tmp_path, WAITS, SPINS, served={"/lift": SERVED["/lift"]}) == (
        "`wait_for_service()` in line 5 waits without a limit, and no node serves /calculator. Served here: /lift. "
        "`wait_for_service(timeout_sec=5.0)` returns False after 5 s."
    )
    other = {"/calculator": ["std_srvs/srv/Trigger"]}
    assert "and /calculator is served with the type std_srvs/srv/Trigger." in why(tmp_path, WAITS, served=other)


def test_a_wait_for_a_server_that_is_there_or_unknown(tmp_path):
    assert why(tmp_path, WAITS) == ""
    unknown = CLIENT.replace("'/calculator'", "name")
    assert why(tmp_path, WAITS, served={}, text=unknown) == ""


def test_a_spin_within_a_spin(tmp_path):
    said = why(tmp_path, SPINS + CALLBACK + HANDLER + SPINS + MAIN)
    assert said.startswith("Line 13 spins in a callback, inside the spin of line 10, and nothing else")
    # a function that is called when a future is done blocks no callback group, and so the inner spin gets its answer
    assert why(tmp_path, SPINS + CALLBACK + TASK + SPINS + MAIN) == ""
    grouped = f"{CLIENT}\n# callback_group=ReentrantCallbackGroup()\n"
    assert why(tmp_path, SPINS + CALLBACK + HANDLER + SPINS + MAIN, text=grouped) == ""


def test_a_program_that_spins_is_left_to_it(tmp_path):
    assert why(tmp_path, SPINS + MAIN) == ""
    assert why(tmp_path, "") == ""
