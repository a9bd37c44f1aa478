"""Lines of a text at which a program waits in vain, and lines that are no sign of that."""

import pytest

from course.explaining.failure_report import Frame
from course.explaining.lines_that_wait import crowded, of_an_action, remark

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


LOOKS = """class Relay(Node):
    def {function}(self, request, response):
        while not self.client.wait_for_service({limit}):
            {body}
        return response

    def __str__(self):
        self.create_service(Trigger, '/relay', self.relay)
"""


@pytest.mark.parametrize(
    ("function", "limit", "body", "line", "says"),
    [
        ("relay", "timeout_sec=1.0", "self.get_logger().info('wait')", 3, "meanwhile the node answers no request. "),
        ("__init__", "1.0", "pass", 3, "it keeps the node from being spun meanwhile. Leave it out of the constr"),
        ("ask", "1.0", "pass", 3, "look once, with a limit, or count the rounds and give up."),
        ("relay", "1.0", "self.rounds += 1", 3, "`wait_for_service` keeps the only thread until a server comes or its"),
        ("ask", "1.0", "self.rounds += 1", 3, ""),
        ("relay", "1.0", "pass", 5, ""),
    ],
)
def test_a_loop_that_looks_for_a_server_without_end_is_told_where_it_is(function, limit, body, line, says):
    text = LOOKS.format(function=function, limit=limit, body=body)
    said = "".join(remark([Frame("relay.py", line, function, text.splitlines()[line - 1].strip())], text))
    assert says in said and bool(said) == bool(says)


@pytest.mark.parametrize(
    ("end", "says"),
    [
        (
            "",
            "keeps the only thread until a server comes or its time is over, so the callers wait one after the other.",
        ),
        ("MultiThreadedExecutor(4).spin()", "keeps its thread until a server comes or its time is over, and meanwhile"),
    ],
)
def test_a_look_with_a_limit_in_a_service_callback_holds_the_next_caller_up(end, says):
    text = LOOKS.format(function="relay", limit="timeout_sec=1.0", body="pass").replace("while not", "if not") + end
    for function, told in (("relay", says), ("ask", "")):
        line = text.replace("def relay", f"def {function}")
        frames = [Frame("relay.py", 3, function, line.splitlines()[2].strip())]
        said = "".join(remark(frames, line))
        assert told in said and bool(said) == bool(told)


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


LOCKS = """class Relay(Node):
    def __init__(self):
        self.lock = threading.{kind}()
        self.create_service(Trigger, '/relay', self.relay)
    async def relay(self, request, response):
        with self.lock:
            self.word()
            {inside}
    def word(self):
        with self.lock:
            return 'on'
rclpy.spin(Relay())
"""


@pytest.mark.parametrize(
    ("kind", "inside", "frames", "says"),
    [
        ("Lock", "pass", ((7, "relay"), (10, "word")), "Line 6 has locked `self.lock` already, in the same thread"),
        ("RLock", "pass", ((7, "relay"), (10, "word")), ""),
        ("Lock", "pass", ((10, "word"),), ""),
        (
            "Lock",
            "await self.client.call_async(request)",
            ((6, "relay"),),
            "While line 8 awaits, `self.lock` of line 6",
        ),
        ("Lock", "self.client.call(request)", ((6, "relay"),), ""),
    ],
)
def test_a_lock_that_nothing_will_release(kind, inside, frames, says):
    source = LOCKS.format(kind=kind, inside=inside)
    lines = source.splitlines()
    stack = [Frame("relay.py", line, name, lines[line - 1].strip()) for line, name in frames]
    said = "".join(remark(stack, source))
    assert said.startswith(says) and bool(said) == bool(says)
    if "await" in inside:
        assert remark(stack, source.replace("rclpy.spin(Relay())", "MultiThreadedExecutor(4).spin()")) == []


@pytest.mark.parametrize(("before", "told"), [("goal_handle.canceled()", True), ("self.cabin.release()", False)])
def test_a_lock_that_a_way_through_the_function_keeps_is_told_where_another_call_waits_for_it(before, told):
    source = (
        "self.cabin = threading.Lock()\ndef execute(self, goal_handle):\n    self.cabin.acquire()\n"
        f"    if goal_handle.is_cancel_requested:\n        {before}\n        return Lift.Result()\n"
        "    self.cabin.release()\n    return Lift.Result()\nMultiThreadedExecutor(4).spin()\n"
    )
    said = remark([Frame("lift_server.py", 3, "execute", "self.cabin.acquire()")], source)
    assert [each.startswith("`self.cabin.acquire()` takes the lock, but the path t") for each in said] == [True] * told


FLAG = """class Lift(Node):
    def execute(self, goal_handle):
        while self.busy:
            time.sleep(0.01)
        self.busy = True
        while left:
            if goal_handle.is_cancel_requested:
                goal_handle.canceled()
                {before}return Lift.Result()
        {last}
        return Lift.Result()
"""


@pytest.mark.parametrize(
    ("before", "last", "told"),
    [
        ("", "self.busy = False", True),
        ("self.busy = False\n                ", "self.busy = False", False),
        ("", "pass", False),
    ],
)
def test_a_flag_that_a_return_leaves_set_is_told_where_another_goal_waits_for_it(before, last, told):
    source = FLAG.format(before=before, last=last)
    said = "".join(remark([Frame("lift_server.py", 4, "execute", "time.sleep(0.01)")], source))
    assert said.startswith("Line 9 returns while `self.busy` is True, before line 10 sets it to False again") == told
    assert bool(said) == told
    in_finally = source.replace("        while left:", "        try:\n          while left:")
    kept = in_finally.replace(last, f"\n        finally: {last}")
    assert remark([Frame("lift_server.py", 4, "execute", "time.sleep(0.01)")], kept) == []


@pytest.mark.parametrize(("kept", "told"), [("self.future", True), ("future", False)])
def test_a_future_that_all_calls_keep_in_one_place_is_told(kept, told):
    source = (
        "self.create_service(Trigger, '/relay', self.relay)\ndef relay(self, request, response):\n"
        f"    {kept} = self.client.call_async(request)\n    while not {kept}.done():\n        time.sleep(0.01)\n"
        "MultiThreadedExecutor(8).spin()\n"
    )
    said = remark([Frame("relay.py", 5, "relay", "time.sleep(0.01)")], source)
    assert [each.startswith("`self.future` is the future of the newest call") for each in said] == [True] * told


@pytest.mark.parametrize(
    ("loop", "told"),
    [
        ("while not node.fresh(): time.sleep(0.1)", True),
        ("while not node.fresh(): rclpy.spin_once(node)", False),
        ("while not ready(): time.sleep(0.1)", False),
    ],
)
def test_a_loop_of_main_above_the_spin_is_told(loop, told):
    source = f"class A(Node): pass\ndef main():\n    node = A()\n    {loop}\n    rclpy.spin(node)\n"
    at = Frame("a.py", 4, "main", loop)
    inner = Frame("a.py", 1, "fresh", "class A(Node): pass")
    for frames in ([at], [at, inner]):
        said = remark(frames, source)
        assert [each.startswith("Nothing spins the node while the loop in line 4 waits") for each in said] == [
            True
        ] * told
    assert remark([inner], source) == []


@pytest.mark.parametrize(
    ("code", "says"),
    [
        ("end = goal_handle.get_result().result", "`get_result(...)` blocks its callback until the answer has come"),
        ("self.handle.cancel_goal()", "Write `cancel_goal_async(...).add_done_callback(self.FUNCTION)`, and go on in"),
        ("goal_handle.get_result_async()", ""),
        ("time.sleep(30)", ""),
    ],
)
def test_a_call_of_an_action_client_that_blocks_its_callback(code, says):
    said = "".join(of_an_action([Frame("the cell", 20, "on_goal", code)]))
    assert says in said and bool(said) == bool(says)
