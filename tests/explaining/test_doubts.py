"""Remarks on a text at the start of its program, before a long wait shows the mistake."""

import pytest

from course.explaining.doubts import doubts, endless_look, long_limit, short_result, short_wait

LIFT = """
class Lift(Node):
    def __init__(self):
        self.cabin = threading.Lock()

    def execute(self, goal_handle):
{body}
"""
TRIES = """        self.cabin.acquire()
        try:
            if self.blocked:
                return
        finally:
            self.cabin.release()"""
BRANCHES = """        self.cabin.acquire()
        if self.blocked:
            self.cabin.release()
            return
        while self.left:
            if self.left == 1:
                self.cabin.release()
                return
            if self.left == 2:
                break
        self.cabin.release()"""


def of_lift(body: str) -> list[str]:
    return doubts("lift.py", LIFT.format(body=body))


@pytest.mark.parametrize(
    ("body", "line", "way"),
    [
        ("        self.cabin.acquire()\n        return 1", 7, "8, `return 1`,"),
        (BRANCHES.replace("                self.cabin.release()\n", ""), 7, "13, `return`,"),
        (BRANCHES.replace("            self.cabin.release()\n", "", 1), 7, "9, `return`,"),
        (BRANCHES.removesuffix("        self.cabin.release()") + "        else:\n            self.cabin.release()",
         7, "16, `break`,"),
    ],
)  # fmt: skip
def test_a_lock_that_a_way_through_the_function_never_releases(body, line, way):
    (told,) = of_lift(body)
    assert told.startswith(
        f"lift.py, line {line}: `self.cabin.acquire()` takes the lock, but the path through line {way}"
    )
    assert told.endswith(" Write `with self.cabin:`, which releases it on every path.")


@pytest.mark.parametrize(
    "body",
    [
        TRIES,
        BRANCHES,
        "        self.cabin.acquire()\n        return 1\n\n    def done(self):\n        self.cabin.release()",
        "        if self.cabin.acquire(blocking=False):\n            return 1\n        self.cabin.release()",
        "        if self.free:\n            self.cabin.acquire()\n            self.cabin.release()\n        return 1",
        "        self.cabin.acquire()\n        if 1:\n            self.cabin.release()\n        if 2: return",
        "        self.cabin = threading.Semaphore(0)\n        self.cabin.acquire()\n        return 1".replace(
            "cabin", "key"
        ),
    ],
)
def test_a_lock_that_may_be_released_is_not_told(body):
    assert of_lift(body) == []


@pytest.mark.parametrize(
    ("body", "is_told"),
    [
        ("while goal_handle.is_cancel_requested:\n            pass", True),
        ("while goal_handle.is_cancel_requested:\n            time.sleep(0.1)", True),
        ("while goal_handle.is_cancel_requested:\n            goal_handle.canceled()", False),
        ("while goal_handle.is_cancel_requested:\n            return", False),
        ("while not goal_handle.is_cancel_requested:\n            pass", False),
        (
            "while goal_handle.is_cancel_requested:\n            pass\n\n    def end(self, it):\n        it.abort()",
            False,
        ),
    ],
)
def test_a_loop_that_waits_for_a_cancel_to_be_taken_back(body, is_told):
    found = of_lift(f"        {body}")
    assert len(found) == is_told
    assert not found or found[0].startswith(
        "lift.py, line 7: once a cancel is requested, `while goal_handle.is_cancel_re"
    )


@pytest.mark.parametrize(
    ("given", "is_told"),
    [("period", True), ("self.step_period", True), ("1.0 / period", False), ("rate", False), ("10", False)],
)
def test_a_rate_is_given_in_hertz(given, is_told):
    found = of_lift(f"        self.create_rate({given}).sleep()")
    assert len(found) == is_told
    assert not found or f"`create_rate` takes a frequency in Hz, and `{given}` is a time" in found[0]


CLIENT = """class Client(Node):
    def ask(self, a, timeout_sec={default}):
        self.client.wait_for_service(timeout_sec={given})

Client().ask({asked})
"""


@pytest.mark.parametrize(
    ("default", "given", "asked", "line"),
    [
        ("5000", "timeout_sec", "1", 2),
        ("5.0", "5000.0", "1", 3),
        ("5.0", "timeout_sec", "1", 0),
        ("5000", "timeout_sec", "1, timeout_sec=5.0", 0),
        ("5000", "timeout_sec", "1, 5.0", 0),
        ("5000", "5.0", "1", 0),
        ("5.0", "LONG", "1", 0),
        ("5.0", "9" * 400, "1", 0),  # more than the largest float
        ("5.0", "0x" + "f" * 4000, "1", 0),
    ],
)
def test_a_time_limit_in_milliseconds(default, given, asked, line):
    told = long_limit(CLIENT.format(default=default, given=given, asked=asked), 3)
    assert told == (f"A time limit is in seconds: 5000 in line {line} are 83 minutes." if line else "")


SERVES = """class Lift(Node):
    def __init__(self):
        self.create_service(SetBool, 'block', self.block)
        ActionServer(self, Lift, 'lift', self.execute, cancel_callback=self.agree)
    def agree(self, goal_handle):
        return {agrees}
    def block(self, request, response):
        {body}
"""


@pytest.mark.parametrize(
    ("body", "agrees", "says"),
    [
        (
            "response.success = True",
            "CancelResponse.ACCEPT",
            "line 7: the service callback 'block' returns nothing, so",
        ),
        ("if self.on:\n            return\n        self.on = 1", "CancelResponse.ACCEPT", "End it with `return resp"),
        ("if self.on:\n            return response", "CancelResponse.ACCEPT", ""),
        ("raise ValueError", "CancelResponse.ACCEPT", ""),
        ("while self.on:\n            pass", "CancelResponse.ACCEPT", ""),
        ("return self.answer(response)", "CancelResponse.ACCEPT", ""),
        ("return response", "GoalResponse.ACCEPT", "line 6: the cancel callback 'agree' returns GoalResponse.ACCEPT,"),
    ],
)
def test_a_callback_whose_answer_is_none_is_told_at_the_start(body, agrees, says):
    text = SERVES.format(body=body, agrees=agrees)
    told = doubts("lift.py", f"{text}\nrclpy.init()\n")
    assert len(told) == bool(says)
    assert "service callback" not in "".join(doubts("the cell", text))  # a page shows it on purpose
    assert not told or says in told[0]


@pytest.mark.parametrize(
    ("default", "given", "asked", "found"),
    [
        ("0.5", "timeout_sec", "1", (3, 0.5)),
        ("5.0", "0.5", "1", (3, 0.5)),
        ("0.5", "timeout_sec", "1, timeout_sec=5.0", None),
        ("5.0", "timeout_sec", "1", None),
        ("0.5", "LIMIT", "1", None),
        ("5.0", "0.5", "[each for each in (1, 2)]", None),
    ],
)
def test_a_wait_for_a_service_that_is_too_short_is_found(default, given, asked, found):
    assert short_wait(CLIENT.format(default=default, given=given, asked=asked), 1.0) == found


RESULT = """def run(self, floors):
    future = self.client.send_goal_async(goal)
    rclpy.spin_until_future_complete(self, future, timeout_sec=5.0)
    {}future = self.handle.get_result_async()
    rclpy.spin_until_future_complete(self, {})
"""


@pytest.mark.parametrize(
    ("before", "given", "found"),
    [
        ("", "future, timeout_sec=5.0", (5, 5.0)),
        ("", "self.handle.get_result_async(), None, 1.0", (5, 1.0)),
        ("", "future", None),
        ("", "future, timeout_sec=600.0", None),
        ("", "future, timeout_sec=limit", None),
        ("other_", "future, timeout_sec=5.0", None),
        ("while not self.done: ", "future, timeout_sec=5.0", None),
    ],
)
def test_a_wait_for_a_result_that_is_too_short_is_found(before, given, found):
    assert short_result(RESULT.format(before, given)) == found


@pytest.mark.parametrize(
    ("test", "body", "line"),
    [
        ("not self.client.wait_for_service(1.0)", "print('waiting')", 2),
        ("rclpy.ok() and not self.client.wait_for_server(timeout_sec=1.0)", "self.get_logger().info('waiting')", 2),
        ("not self.client.wait_for_service(1.0)", "self.rounds += 1", 0),
        ("not self.client.wait_for_service(1.0)", "return None", 0),
        ("self.rounds < 5 and not self.client.wait_for_service(1.0)", "pass", 0),
        ("not self.client.wait_for_service(1.0) or self.late", "pass", 0),
        ("not self.done", "pass", 0),
    ],
)
def test_a_loop_that_looks_for_a_server_without_end_is_found(test, body, line):
    assert endless_look(f"def ask(self):\n    while {test}:\n        {body}\n") == line
