"""Callbacks that cannot return in time, from their text and the stacks that `faulthandler` writes of a program."""

import pytest

from course.explaining.hangs import beginning, hang, unspun

PROGRAM = """import time
class Server(Node):
    def __init__(self):
        self.create_service(Trigger, '/ask', self.ask)

    def ask(self, request, response):
{body}
        return response

    def busy(self):
        return self.left > 0

    def late(self):
        return time.time() > self.end

def main():
    rclpy.spin(Server())
"""
EXECUTED = """  File "/venv/lib/rclpy/executors.py", line 111 in await_or_execute
  File "/venv/lib/rclpy/task.py", line 269 in __call__
"""
SPUN = (
    EXECUTED
    + '  File "/venv/lib/rclpy/executors.py", line 839 in spin_once\n  File "/home/server.py", line 99 in main\n'
)
LOOP = 8  # the line after that of the loop


def found(tmp_path, body: str, *, line: int = LOOP, limit: float = 5.0, text: str = PROGRAM, outer: str = SPUN):
    path = tmp_path / "server.py"
    path.write_text(text.replace("{body}", "\n".join(f"        {each}" for each in body.splitlines())))
    stack = f'Thread 0x1 (most recent call first):\n  File "{path}", line {line} in ask\n{outer}'
    return [frame.line for frame in hang(stack, path, {"ask"}, limit)]


@pytest.mark.parametrize(
    "body",
    [
        "while True:\n    self.left += 1",
        "for each in items:\n    while True: self.count(each)",
        "number = 0\nwhile number < request.order: response.sequence.append(response.sequence[number - 1])",
        "number = 0\nwhile number < 10: self.numbers.append(number * 2)",
        "while self.busy():\n    pass",
        "while not self.future.done():\n    time.sleep(0.1)",
        "while self.waiting:\n    self.get_logger().info('waiting')",
        "pass\ntime.sleep(5)",
    ],
)
def test_a_callback_that_cannot_return(tmp_path, body):
    assert found(tmp_path, body) == [LOOP]


@pytest.mark.parametrize(
    "body",
    [
        "while True:\n    if self.left: break",
        "while True:\n    return response",
        "while True:\n    raise ValueError",
        "try:\n    while True: self.count()\nexcept StopIteration: pass",
        "number = 0\nwhile number < request.order: number += 1",
        "number = [0]\nwhile number < [1]: number.append(1)",
        "number = Number(0)\nwhile number < 10: self.count(number)",
        "while self.number < 10: self.count()",
        "while not self.late():\n    time.sleep(0.1)",
        "while time.time() < self.end:\n    pass",
        "while not client.service_is_ready():\n    time.sleep(0.1)",
        "while self.waiting:\n    rclpy.spin_once(self)",
        "while True:\n    self.spin_for_a_while()",
        "pass\ntime.sleep(4.9)",
        f"pass\ntime.sleep({'9' * 400})",  # it raises
        "pass\ntime.sleep(self.period)",
        "pass\ntime.sleep(9 if self.left else 1)",
        "pass\ntime.sleep(9) if self.left else time.sleep(1)",
    ],
)
def test_a_callback_that_may_return(tmp_path, body):
    assert found(tmp_path, body) == []


@pytest.mark.parametrize("other", ["MultiThreadedExecutor(4)", "Thread(target=self.work)", "rclpy.spin_once(node)"])
def test_what_other_code_of_the_program_may_change(tmp_path, other):
    text = f"{PROGRAM}\n# {other}" if "spin" not in other else f"{PROGRAM}\n{other}"
    assert found(tmp_path, "while self.busy():\n    pass", text=text) == []
    assert found(tmp_path, "while True:\n    pass", text=text) == [LOOP]


def test_another_callback_and_the_main_part(tmp_path):
    endless, asleep = "while True:\n    pass", "pass\ntime.sleep(60)"
    other = PROGRAM.replace("def ask", "def tick")
    assert found(tmp_path, endless, text=other) == [LOOP]  # nothing else runs
    for_itself = f'  File "/home/server.py", line 21 in tick\n{SPUN}'
    assert found(tmp_path, endless, text=f"{other}# Thread", outer=for_itself) == []
    assert found(tmp_path, asleep, outer=for_itself) == []  # it may have begun long ago
    assert found(tmp_path, endless, outer='  File "/home/server.py", line 99 in main\n') == []


@pytest.mark.parametrize(
    ("body", "line", "hangs"),
    [
        ("self.lock.acquire()\nself.count += 1", 7, True),
        ("self.lock.acquire()\nwith self.lock:\n    self.count += 1", 8, True),
        ("self.lock.acquire()\nself.lock.release()", 7, False),
        ("with self.lock:\n    self.count += 1", 7, False),
        ("self.lock.acquire(timeout=1.0)", 7, False),
        ("self.lock.acquire()\nwith self.other:\n    self.count += 1", 8, False),
    ],
)
def test_a_lock_that_is_never_released(tmp_path, body, line, hangs):
    assert found(tmp_path, body, line=line) == [line] * hangs


def test_a_callback_that_is_elsewhere(tmp_path):
    assert found(tmp_path, "while True:\n    pass", line=9) == []
    library = f'  File "/venv/lib/other.py", line 1 in wait\n  File "{tmp_path}/server.py", line 8 in ask\n{SPUN}'
    path = tmp_path / "server.py"
    path.write_text(PROGRAM.replace("{body}", "        pass\n        time.sleep(60); self.wait()"))
    assert hang(f"Thread 0x1 (most recent call first):\n{library}", path, {"ask"}, 5.0) == ()


BEGINS = """class Server(Node):
    def __init__(self):
        self.create_service(Trigger, '/ask', self.ask)
{made}
    def step(self):
{step}
def main():
    node = Server()
{main}
{rest}
"""


@pytest.mark.parametrize(
    ("made", "step", "main", "rest", "is_kept"),
    [
        ("while True:\n    time.sleep(1)", "pass", "rclpy.spin(node)", "", True),
        ("while rclpy.ok():\n    self.step()", "pass", "rclpy.spin(node)", "rclpy.try_shutdown()", True),
        ("while rclpy.ok():\n    self.step()", "rclpy.shutdown()", "rclpy.spin(node)", "", False),
        ("while True:\n    self.step()", "rclpy.spin_once(self)", "pass", "", False),
        ("while self.waits:\n    self.step()", "self.waits = False", "rclpy.spin(node)", "", False),
        ("while True:\n    time.sleep(1)", "pass", "Thread(target=rclpy.spin, args=[node])", "", False),
        ("pass", "pass", "while True:\n    time.sleep(1)", "", True),
        ("pass", "pass", "while True:\n    rclpy.spin_once(node)", "", False),
    ],
)
def test_a_loop_that_keeps_the_node_from_being_spun(tmp_path, made, step, main, rest, is_kept):
    parts = {"made": (made, 8), "step": (step, 8), "main": (main, 4), "rest": (rest, 4)}
    text = BEGINS.format(
        **{name: "\n".join(" " * by + each for each in part.splitlines()) for name, (part, by) in parts.items()}
    )
    (path := tmp_path / "server.py").write_text(text)
    at = 5 if "while" in made else len(BEGINS[: BEGINS.index("{main}")].splitlines()) + 1
    name = "__init__" if at == 5 else "main"
    stacks = f'Thread 0x1 (most recent call first):\n  File "{path}", line {at} in {name}\n'
    assert [frame.line for frame in unspun(stacks, path)] == [at] * is_kept
    spun = f'{stacks}  File "/venv/lib/rclpy/executors.py", line 839 in spin_once\n'
    assert unspun(spun, path) == ()


@pytest.mark.parametrize(
    ("main", "is_told"), [("    while answer is None:\n        answer = node.step()", True), ("    node.step()", False)]
)
def test_a_loop_of_main_around_the_line_that_waits_is_told(tmp_path, main, is_told):
    text = BEGINS.format(made="        pass", step="        self.wait()", main=main, rest="")
    (path := tmp_path / "client.py").write_text(text)
    waits, asks = (text[: text.index(part)].count("\n") + 1 for part in ("self.wait()", "node.step()"))
    calls = f'  File "{path}", line {waits} in step\n  File "{path}", line {asks} in main\n'
    frames = beginning(f"Thread 0x1 (most recent call first):\n{calls}", path, endless=False)
    assert [frame.line for frame in frames] == [asks] * is_told + [waits]
