"""Why a program waits in vain at a line of its text, and which lines are no sign of that."""

import pytest

from course.session.failure_report import Frame
from course.session.lines_that_wait import crowded, remark

POLLS = """class Client(Node):
    def __init__(self):
        self.create_timer(1.0, self.tick)
        self.rate = self.create_rate(2.0)
    def tick(self):
        {loop}
    def run(self):
        {loop}
        self.rate.sleep()
        self.robot.sleep()
        answer = await self.client.call(request)
def main():
    {end}
"""
LOOP = "while not future.done(): time.sleep(0.1)"
SPINS = "Nothing spins the node while this loop waits, so no answer comes: write `rclpy.spin_until_future_complete(self"


@pytest.mark.parametrize(
    ("line", "function", "end", "says"),
    [
        (8, "run", "", SPINS),
        (8, "run", "Thread(target=rclpy.spin, args=(node,)).start()", ""),
        (6, "tick", "", ""),  # there, a spin would be wrong, too
        (9, "run", "rclpy.spin(node)", "A rate sleeps until another thread spins the node, and the only one is here"),
        (9, "run", "MultiThreadedExecutor(4).spin()", ""),
        (10, "run", "rclpy.spin(node)", ""),
        (
            11,
            "run",
            "MultiThreadedExecutor(4).spin()",
            "`call(...)` blocks here, before anything is awaited: write `aw",
        ),
    ],
)
def test_a_line_that_waits_in_vain(line, function, end, says):
    source = POLLS.format(loop=LOOP, end=end or "pass")
    frames = [Frame("client.py", line, function, source.splitlines()[line - 1].strip())]
    said = "".join(remark(frames, source))
    assert said.startswith(says) and bool(said) == bool(says)


def test_a_loop_that_spins_is_no_wait_in_vain():
    source = POLLS.format(loop="while not future.done(): rclpy.spin_once(self)", end="pass")
    assert remark([Frame("client.py", 8, "run", source.splitlines()[7].strip())], source) == remark([], source) == []


@pytest.mark.parametrize(
    ("function", "end", "told"),
    [
        ("tick", "rclpy.spin(node)", True),
        ("run", "rclpy.spin(node)", False),
        ("tick", "while rclpy.ok(): rclpy.spin_once(node)", False),
        ("tick", "MultiThreadedExecutor(4).spin(); rclpy.spin(node)", False),
    ],
)
def test_a_callback_that_spins_its_node_is_told_that_it_is_spun_already(function, end, told):
    source = POLLS.format(loop="rclpy.spin_once(self)", end=end)
    said = remark([Frame("client.py", 6, function, "rclpy.spin_once(self)")], source)
    assert (
        said
        == ["`rclpy.spin(node)` spins the node already, and waits until this callback returns: leave this out."] * told
    )
    asks = source.replace("await self.client.call(", "await self.client.call_async(")
    assert all(
        each.endswith("write `await client.call_async(...)` in an `async def`.")
        for each in remark([Frame("client.py", 6, function, "rclpy.spin_once(self)")], asks)
    )


@pytest.mark.parametrize(
    ("source", "in_calls", "told"),
    [
        ("MultiThreadedExecutor(num_threads=3)", 3, True),
        ("MultiThreadedExecutor(num_threads=3)", 2, False),
        ("MultiThreadedExecutor(3)\nSingleThreadedExecutor()", 3, False),
        ("MultiThreadedExecutor(3)\nThread(target=other.spin)", 3, False),
        ("MultiThreadedExecutor(3)\nMultiThreadedExecutor(3)", 6, False),
        ("MultiThreadedExecutor(count)", 9, False),
        ("rclpy.spin(node)", 1, False),
    ],
)
def test_an_executor_without_a_thread_that_could_receive_an_answer(source, in_calls, told):
    assert [line.startswith("All 3 threads") for line in crowded(source, in_calls)] == [True] * told
