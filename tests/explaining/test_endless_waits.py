"""Reasons why a program waits without end, from its text and the stacks that `faulthandler` writes of it."""

import threading
from pathlib import Path

import pytest

from course.explaining.endless_waits import endless_spin, endless_wait, is_at_rest

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


def test_a_thread_that_outlives_the_main_part(tmp_path):
    python = Path(threading.__file__)
    lines = python.read_text().splitlines()
    at, timed = (
        lines.index("                waiter.acquire()") + 1,
        next(n for n, a in enumerate(lines, 1) if "(True, t" in a),
    )
    text = "keep = threading.Thread(target=event.wait)\n"
    main = f'  File "{python}", line 1580 in _shutdown\n'
    left = f'  File "{python}", line {at} in wait\n  File "{python}", line 600 in wait\n'
    assert "a thread that it has started, as in line 1, waits without end" in why(tmp_path, left, main, text=text)
    assert why(tmp_path, left, MAIN, text=text) == ""
    assert why(tmp_path, left.replace(str(at), str(timed)), main, text=text) == ""
    assert why(tmp_path, left, f'  File "/lib/time.py", line 1 in sleep\n{left}', main, text=text) == ""


@pytest.mark.parametrize(
    ("more", "stack", "told"),
    [
        ("", SPINS, True),
        ("", SPINS + MAIN, True),  # the thread's function is the program's own
        ("", HANDLER + SPINS, False),
        ("", SPINS.replace("in spin\n", "in spin_until_future_complete\n"), False),
        ("future.add_done_callback(lambda _: rclpy.shutdown())\n", SPINS, False),
        ("def hear(msg):\n    raise SystemExit\n", SPINS, False),
        ("def main():\n    node.destroy_node()\n", SPINS, True),
    ],
)
def test_a_thread_that_spins_after_the_main_part_is_told(tmp_path, more, stack, told):
    text = f"threading.Thread(target=rclpy.spin, args=(node,)).start()\n{more}"
    said = why(tmp_path, stack, f'  File "{threading.__file__}", line 1580 in _shutdown\n', text=text)
    assert ("as in line 1, spins without end" in said) == bool(said) == told


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
    """Spinning there would be the next mistake."""
    said = why(tmp_path, CALLS + HANDLER + SPINS + MAIN)
    assert said.startswith("`call(...)` in line 6 waits in a callback")
    assert "spin_until" not in said and "add_done_callback" in said


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


SPINNER = """import rclpy
class Asks(Node):
    def __init__(self):
        self.client = self.create_client(Calculate, '{name}')
    def ask(self):
        future = self.client.call_async(Calculate.Request())
        {spin}
def main():
    node = Asks()
    node.ask()
"""
UNTIL = "rclpy.spin_until_future_complete(self, Future())"


def spin(tmp_path, line: str = UNTIL, *, name: str = "calculator", more: str = "", outer: str = "", inner: str = SPINS):
    path = tmp_path / "client.py"
    path.write_text(SPINNER.replace("{name}", name).replace("{spin}", line) + more)
    number = 7 + line.count("\n")
    return endless_spin(
        f'x (most recent call first):\n{inner}  File "{path}", line {number} in ask\n{outer}{MAIN}', path
    )


@pytest.mark.parametrize(
    "line",
    [
        UNTIL,
        "self.executor.spin_until_future_complete(future)",
        "while not future.done():\n            rclpy.spin_once(self, timeout_sec=0.1)",
        "while rclpy.ok() and not future.done(): rclpy.spin_once(self)",
    ],
)
def test_a_spin_that_only_a_future_ends(tmp_path, line):
    found = spin(tmp_path, line)
    assert (found.line, found.names) == (7 + line.count("\n"), ("/calculator",))
    assert f"Line {found.line} spins until a future is done" in str(found) and "no request to /calculator" in str(found)


@pytest.mark.parametrize(
    "line",
    [
        "rclpy.spin_until_future_complete(self, future, timeout_sec=5.0)",
        "rclpy.spin_until_future_complete(self, future, None, 5.0)",
        "self.executor.spin_until_future_complete(future, 5.0)",
        "rclpy.spin_until_future_complete(self, future, **limit)",
        "rclpy.spin_until_future_complete(*waits)",
        "rclpy.spin_once(self)",
        "while not future.done() and time.time() < end: rclpy.spin_once(self)",
        "while not self.over(): rclpy.spin_once(self)",
        "while not future.done():\n            self.count(); rclpy.spin_once(self)",
    ],
)
def test_a_spin_that_ends_otherwise(tmp_path, line):
    assert spin(tmp_path, line) is None


@pytest.mark.parametrize("line", ["rclpy.spin(self)", "executor.spin()"])
def test_a_spin_that_only_ctrl_c_ends(tmp_path, line):
    found = spin(tmp_path, line)
    assert str(found).startswith(f"Line 7, `{line}`, returns only after Ctrl-C, and no request to /calculator")
    assert spin(tmp_path, line, more="create_timer(1.0, self.over)") is None


def test_a_future_that_something_else_may_complete(tmp_path):
    for more in ("create_timer(1.0, self.over)", "Thread(target=self.over)", "async def over(self):", "asyncio",
                 "create_subscription(String, 'over', self.over, 1)", "create_service(Trigger, 'over', self.over)",
                 "create_client(Trigger, name)", "import over"):  # fmt: skip
        (tmp_path / "over.py").touch()
        assert spin(tmp_path, more=more) is None, more
    assert spin(tmp_path, name="~/calculator") is None
    assert spin(tmp_path, outer=HANDLER) is None
    assert spin(tmp_path, inner="") is None  # it does not spin yet


def test_a_server_that_has_nothing_left_to_do(tmp_path):
    path = tmp_path / "server.py"
    path.write_text("import rclpy\n")
    own = f'  File "{path}", line 1 in '
    waits, works = (
        f"x (most recent call first):\n{SPINS}{own}main\n",
        f'{own}execute\n{TASK}  File "/pool.py", line 1 in run\n',
    )
    assert is_at_rest(waits, path)
    assert not is_at_rest("", path)  # it has not told where it is
    assert not is_at_rest(f"x (most recent call first):\n{works}{waits}", path)
    for text in ("create_timer(1.0, step)", "async def execute(self):", "create_client(Trigger, '/a')", "Thread(step)"):
        path.write_text(text)
        assert not is_at_rest(waits, path)
