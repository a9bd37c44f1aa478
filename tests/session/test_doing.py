"""The line at which a program that does not answer is, read from outside, whatever it waits for."""

import contextlib
import linecache
import os
import signal
import subprocess
import threading
import time
from collections.abc import Iterator

import pytest
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import Trigger

from course.errors import CallTimeout, NodeFailed
from course.session import patience, stacks, started_nodes
from course.session.live import Session
from course.session.spinner import Spinner
from tests.chosen import each_night

SERVER = """import threading
import time

import rclpy
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from std_srvs.srv import Trigger


class Server(Node):
    def __init__(self):
        super().__init__('server')
        self.create_service(Trigger, '/ask', self.ask)

    def ask(self, request, response):
        {body}
        return response


def main():
    rclpy.init()
    node = Server()
    {spin}


{call}
"""
SPIN = "rclpy.spin(node)"
THREADS = "executor = MultiThreadedExecutor(4)\n    executor.add_node(node)\n    executor.spin()"


@pytest.fixture
def session() -> Iterator[Session]:
    made = Session()
    yield made
    made.close()


@pytest.mark.parametrize(
    ("spin", "body"),
    [
        (SPIN, "while not response.success: pass"),
        (THREADS, "time.sleep(60)"),
        (SPIN, "threading.Event().wait()"),
        each_night(THREADS, "while not response.success: pass"),
        each_night(SPIN, "time.sleep(60)"),
        each_night(THREADS, "threading.Event().wait()"),
    ],
)
def test_a_call_that_gets_no_answer_tells_the_line_of_the_callback(session, tmp_path, spin, body):
    file = tmp_path / "server.py"
    file.write_text(SERVER.format(body=body, spin=spin, call="main()"))
    process = session.start(file)
    assert process.doing() == ()  # it waits for callbacks
    process.services.discard("/ask")  # on a busy machine the graph may not have listed it yet
    with pytest.raises(CallTimeout) as told:
        session.call("/ask", Trigger, timeout=1.5)
    assert str(told.value).endswith(f"server.py is here:\n  server.py, line 16, in ask\n    {body}")
    assert process.alive


@pytest.mark.parametrize(
    ("spin", "body"),
    [
        (SPIN, "time.sleep(5.0)"),
        (THREADS, "time.sleep(5.0)"),
        each_night(SPIN, "while True: response.message += '.'"),
        each_night(THREADS, "while True: response.message += '.'"),
    ],
)
def test_a_callback_that_cannot_answer_in_time_is_told_before_the_limit(session, tmp_path, spin, body):
    file = tmp_path / "server.py"
    file.write_text(SERVER.format(body=body, spin=spin, call="main()"))
    session.start(file)
    began = time.monotonic()
    with pytest.raises(CallTimeout, match="/ask will not answer within 5 s: its callback 'ask' sleeps") as told:
        session.call("/ask", Trigger, timeout=5.0)
    assert time.monotonic() - began < 4.0
    assert str(told.value).endswith(f"server.py is here:\n  server.py, line 16, in ask\n    {body}")


def test_an_executor_whose_threads_all_wait_for_an_answer_is_told_before_the_limit(session, tmp_path):
    file = tmp_path / "server.py"
    asks = "self.create_client(Trigger, '/never').call(Trigger.Request())"
    file.write_text(SERVER.format(body=asks, spin=THREADS.replace("4", "1"), call="main()"))
    session.start(file)
    with pytest.raises(CallTimeout, match="/ask will not answer within 20 s") as told:
        session.call("/ask", Trigger, timeout=20.0)
    assert "All 1 threads of its executor wait in such a call" in str(told.value)


@pytest.mark.parametrize(("rebuilt", "limit", "what"), [("std_srvs", 5.0, "will not"), ("std_msgs", 1.7, "did not")])
def test_a_request_that_a_server_with_an_old_definition_drops_is_not_waited_for(
    session, tmp_path, rebuilt, limit, what
):
    file = tmp_path / "server.py"
    file.write_text(SERVER.format(body="pass", spin="rclpy.spin(rclpy.create_node('other'))", call="main()"))
    session.start(file)
    session._calls.package_replaced(rebuilt)
    began = time.monotonic()
    with pytest.raises(CallTimeout) as told:
        session.call("/ask", Trigger, timeout=limit)
    old = f"server.py was started before {rebuilt} was built again, and still uses the old definition"
    assert str(told.value).startswith(f"/ask {what} answer within {limit:g} s: ")
    assert (old in str(told.value)) == (time.monotonic() - began < limit)


@pytest.mark.parametrize(
    ("body", "spin", "says"),
    [
        ("exit()", SPIN, "Line 16 ends the whole program, not only 'ask'."),
        ("exit()", THREADS, "'ask' never returns after that, but the program keeps running, so nobody"),
        ("self.misspelt()", THREADS, "AttributeError: 'Server' object has no attribute 'misspelt'"),
    ],
)
def test_a_callback_that_ends_the_program_or_raises_in_a_thread_is_told_at_once(session, tmp_path, body, spin, says):
    """In a thread, Python takes `exit()` silently, and rclpy shows an exception only at the next callback."""
    file = tmp_path / "server.py"
    file.write_text(SERVER.format(body=body, spin=spin, call="main()"))
    session.start(file)
    with pytest.raises(NodeFailed) as told:
        session.call("/ask", Trigger, timeout=20.0)
    assert says in str(told.value)
    assert f"server.py, line 16, in ask\n    {body}" in str(told.value)


def test_a_thread_that_has_ended_with_an_exception_is_told_where_no_answer_comes(session, tmp_path):
    file = tmp_path / "server.py"
    body = "threading.Thread(target=lambda: 1 / 0).start(); threading.Event().wait()"
    file.write_text(SERVER.format(body=body, spin=SPIN, call="main()"))
    session.start(file)
    with pytest.raises(CallTimeout) as told:
        session.call("/ask", Trigger, timeout=1.0)
    assert "server.py has lost a thread to an exception: ZeroDivisionError: division by zero\n" in str(told.value)
    assert str(told.value).index("in ask") < str(told.value).index("has lost a thread")


def test_a_server_that_dies_before_its_service_was_listed_is_the_answer(session, tmp_path):
    """The graph lists the services of a node one by one: those that every node has come first."""
    file = tmp_path / "server.py"
    file.write_text(SERVER.format(body="return {'success': True}", spin=SPIN, call="main()"))
    process = session.start(file)
    process.services = {"/server/list_parameters"}
    with pytest.raises(NodeFailed, match="TypeError\n.*line 16\n.*return {'success': True}\nHint: The service"):
        session.call("/ask", Trigger, timeout=20.0)


def test_a_callback_that_may_answer_in_time_is_waited_for(session, tmp_path, monkeypatch):
    monkeypatch.setattr(patience, "FIRST", 2)
    monkeypatch.setattr(patience, "AGAIN", 2)
    file = tmp_path / "server.py"
    body = "time.sleep(1.5 if request else 60); response.success = True"
    file.write_text(SERVER.format(body=body, spin=SPIN, call="main()"))
    session.start(file)
    assert session.call("/ask", Trigger, timeout=5.0).success


def test_a_callback_that_sleeps_for_an_earlier_call_is_waited_for(session, tmp_path, monkeypatch):
    monkeypatch.setattr(patience, "FIRST", 5)
    file = tmp_path / "server.py"
    body = "first, self.first = getattr(self, 'first', True), False\n        if first:\n            time.sleep(4.0)"
    file.write_text(SERVER.format(body=body, spin=SPIN, call="main()"))
    session.start(file)
    with pytest.raises(CallTimeout):
        session.call("/ask", Trigger, timeout=3.0)
    assert session.call("/ask", Trigger, timeout=3.9) is not None  # less than a whole sleep


def test_a_right_answer_of_a_starved_or_stopped_program_is_waited_for(session, tmp_path, monkeypatch):
    monkeypatch.setattr(patience, "FIRST", 2)
    monkeypatch.setattr(patience, "AGAIN", 2)
    file = tmp_path / "server.py"
    body = "end = time.process_time() + 0.5\n        while time.process_time() < end: pass\n        time.sleep(0.5)"
    file.write_text(SERVER.format(body=body, spin=SPIN, call="main()"))
    process = session.start(file)
    processor = min(os.sched_getaffinity(process.pid))
    os.system(f"taskset -acp {processor} {process.pid} >/dev/null")
    rivals = [subprocess.Popen(["taskset", "-c", str(processor), "sh", "-c", "while :; do :; done"]) for _ in range(3)]
    stops = threading.Timer(0.3, os.kill, (process.pid, signal.SIGSTOP))
    goes = threading.Timer(1.3, os.kill, (process.pid, signal.SIGCONT))
    try:
        stops.start()
        goes.start()
        assert session.call("/ask", Trigger, timeout=30.0) is not None
    finally:
        goes.join()
        for each in rivals:
            each.kill()
            each.wait()


@pytest.mark.parametrize(
    ("call", "place"),
    [
        ("while True:\n    pass\nmain()", r"  server\.py, line 2\d\n    (while True:|pass)"),
        ("time.sleep(60)", r"  server\.py, line 26\n    time\.sleep\(60\)"),
        ("input()", ""),  # which ends at once
    ],
)
def test_a_program_without_a_node_tells_where_it_is(session, tmp_path, monkeypatch, capfd, call, place):
    monkeypatch.setattr(started_nodes, "PATIENCE", 1.0)
    file = tmp_path / "server.py"
    file.write_text(SERVER.format(body="pass", spin=SPIN, call=call))
    with pytest.raises(CallTimeout, match=f"created no node. It was here:\n{place}" if place else "EOFError"):
        session.start(file, timeout=1.5)
    assert ("server.py has created no node after 1 s. It is here:" in capfd.readouterr().err) == bool(place)


@pytest.mark.parametrize(
    ("before", "limit", "says"),
    [
        ("while not self.ready: time.sleep(0.1)", 20.0, "no server for /ask yet.\nserver.py is here, in a loop that"),
        each_night(
            "while True: self.get_logger().info('x', throttle_duration_sec=1.0)", 20.0, "no server for /ask yet.\n"
        ),
        ("while time.time() < self.end: time.sleep(0.1)", 2.5, "no server for /ask within 2.5 s."),
    ],
)
def test_a_call_of_a_program_that_has_not_made_its_server_tells_where_it_is(session, tmp_path, before, limit, says):
    file = tmp_path / "server.py"
    body = f"self.ready, self.end = False, time.time() + 60.0\n        {before}\n        self.create_service("
    text = SERVER.format(body="pass", spin=SPIN, call="main()").replace("self.create_service(", body, 1)
    file.write_text(text.replace(SPIN, f"try:\n        {SPIN}\n    except KeyboardInterrupt:\n        pass"))
    session.start(file)
    began = time.monotonic()
    with pytest.raises(CallTimeout) as told:
        session.call("/ask", Trigger, timeout=limit)
    assert str(told.value).startswith(says) and f"\n  server.py, line 14, in __init__\n    {before}" in str(told.value)
    assert time.monotonic() - began < 10.0


@pytest.mark.matrix  # the test of a starved or stopped program has one that is slow for another reason
def test_a_server_that_comes_late_is_waited_for(session, tmp_path):
    file = tmp_path / "server.py"
    text = SERVER.format(body="response.success = True", spin=SPIN, call="main()")
    late = "end = time.time() + 4.0\n        while time.time() < end: pass\n        self.create_service("
    file.write_text(text.replace("self.create_service(", late, 1))
    session.start(file)
    assert session.call("/ask", Trigger, timeout=30.0).success


BLOCKED = """class Waits(Node):
    def __init__(self):
        super().__init__('waits')
        self.client = self.create_client(Trigger, '/waits')
        self.create_service(Trigger, '/waits', lambda request, response: response)
        self.create_timer(0.05, self.tick)

    def tick(self):
        self.client.call(Trigger.Request())
"""


@pytest.mark.parametrize(
    "wait",
    [
        lambda session: session.until(lambda: False, 4.5),
        each_night(lambda session: session.wait(Future(), 3.5)),
        each_night(lambda session: session.call("/rest", Trigger, timeout=3.5)),
    ],
)
def test_a_wait_in_vain_tells_the_callback_of_a_node_that_does_not_return(session, monkeypatch, wait):
    cell = "/tmp/ipykernel_1/1.py"
    monkeypatch.setitem(linecache.cache, cell, (len(BLOCKED), None, BLOCKED.splitlines(keepends=True), cell))
    given = {"Node": Node, "Trigger": Trigger, "__name__": "__main__"}
    exec(compile(BLOCKED, cell, "exec"), given)
    blocked = threading.Event()
    rest = Node("rest", context=session.context)
    rest.create_service(Trigger, "/rest", lambda request, response: blocked.wait(20.0) and response)
    spinner = Spinner(rest)
    spinner.start()
    try:
        session.start(given["Waits"])
        with contextlib.suppress(CallTimeout):
            wait(session)
        why, told = session.watch.notices()
        assert why.startswith("`call(...)` inside a callback of 'waits' waits for a response of ")
        assert told.startswith("'waits' is in a callback that has not returned for ")
        assert told.endswith("the cell, line 9, in tick\n    self.client.call(Trigger.Request())")
        session.stop("waits")
        with contextlib.suppress(CallTimeout):
            wait(session)
        assert session.watch.notices() == []
    finally:
        blocked.set()
        spinner.stop()


def test_what_is_asked_leaves_no_trace_in_the_program(session, tmp_path):
    file = tmp_path / "server.py"
    body = (
        "import os, subprocess; response.message = f'{sorted(os.environ)} ' + subprocess.getoutput('ls /proc/self/fd')"
    )
    file.write_text(SERVER.format(body=body, spin=SPIN, call="main()"))
    process = session.start(file)
    told = session.call("/ask", Trigger).message
    assert "COURSE_STACKS" not in told and "COURSE_INTROSPECTION" not in told
    assert len(told.splitlines()) <= 5, told  # 0, 1, 2, and what `ls` opens
    os.kill(process.pid, signal.SIGUSR2)
    assert session.call("/ask", Trigger).message and process.alive


def test_a_program_that_only_uses_the_processor_is_not_waited_for(session, tmp_path, monkeypatch):
    monkeypatch.setattr(stacks, "SPENT", 1.0)
    file = tmp_path / "server.py"
    file.write_text(SERVER.format(body="pass", spin=SPIN, call="while True:\n    pass\nmain()"))
    began = time.monotonic()
    with pytest.raises(CallTimeout, match=r"created no node. It was here:\n  server\.py, line 2\d\n"):
        session.start(file)
    assert time.monotonic() - began < started_nodes.USUAL  # the limit is not waited for


class Awaiting(Node):
    """Awaits what never comes; `group` is that of its service."""

    group = None

    def __init__(self):
        super().__init__("awaiting")
        self.never, self.begun = Future(), 0
        self.create_service(Trigger, "/awaits", self.ask, callback_group=self.group and self.group())

    async def ask(self, request, response):
        self.begun += 1
        await self.never
        return response


class AwaitingReentrant(Awaiting):
    group = ReentrantCallbackGroup


@pytest.mark.parametrize(("cls", "begun", "told"), [(Awaiting, 1, True), (AwaitingReentrant, 2, False)])
def test_a_group_that_lets_no_other_call_begin_is_told_while_one_awaits(session, cls, begun, told):
    node = session.start(cls).node
    client = session.node.create_client(Trigger, "/awaits")
    client.wait_for_service(timeout_sec=5.0)
    assert session.doing("/awaits") == ""  # nobody has asked
    futures = [client.call_async(Trigger.Request()) for _ in range(2)]
    assert session.until(lambda: node.begun == begun)
    assert ("lets one callback run at a time" in session.doing("/awaits")) == told
    assert session.doing("/awaits", groups=False) == ""
    assert not any(future.done() for future in futures)
