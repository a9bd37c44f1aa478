"""The live session: nodes in the kernel and beside it, replaced, called, ended, and nothing left behind."""

import gc
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
import rclpy
from course_interfaces.action import Fibonacci
from example_interfaces.srv import AddTwoInts
from rcl_interfaces.srv import GetParameters
from rclpy.action import ActionClient
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_srvs.srv import Trigger

from course.errors import CallTimeout, LiveError, NodeFailed
from course.foundation import processes
from course.foundation.waiting import wait_until
from course.nodes.fibonacci_action_server import FibonacciActionServer
from course.session.domains import claim_domain
from course.session.live import Session
from course.session.logs import Entry, Logs

SERVER = """
import sys
import rclpy
from example_interfaces.srv import AddTwoInts
from rclpy.node import Node

def main(args=None):
    rclpy.init(args=args)
    node = Node('file_server')
    node.declare_parameter('extra', 0)
    def add(request, response):
        response.sum = request.a + request.b + node.get_parameter('extra').value
        return response
    node.create_service(AddTwoInts, 'file_add', add)
    print('arguments', sys.argv[1:2])
    try:
        rclpy.spin(node)
    except BaseException:
        pass

main()
"""


class Adder(Node):
    """As the chapter writes it: no keyword passes the context on."""

    def __init__(self):
        super().__init__("adder")
        self.declare_parameter("extra", 0)
        self.create_service(AddTwoInts, "add", self.add)

    def add(self, request, response):
        response.sum = request.a + request.b + self.get_parameter("extra").value
        self.get_logger().info(f"sum {response.sum}")
        return response


@pytest.fixture
def session():
    session = Session()
    yield session
    session.close()


@pytest.fixture
def server(tmp_path):
    path = tmp_path / "server.py"
    path.write_text(SERVER)
    return path


def test_a_class_without_keywords_runs_in_the_private_context(session):
    handle = session.start(Adder)
    assert handle.alive and session.nodes() == ["/adder"]
    assert session.call("add", AddTwoInts, a=2, b=3).sum == 5


def test_nodes_of_rclpys_own_class_run_beside_each_other(session):
    first, second = session.start(Node, "first"), session.start(Node, "second")
    assert first.alive and second.alive and session.until(lambda: session.nodes() == ["/first", "/second"], 5)
    again = session.start(Node, "first")
    assert again.alive and second.alive and not first.alive


def test_parameters_are_overridden_at_the_start(session, server):
    session.start(Adder, parameters={"extra": 10})
    assert session.call("add", AddTwoInts, a=2, b=3).sum == 15
    session.start(server, "word", parameters={"extra": 20})
    assert session.call("file_add", AddTwoInts, a=2, b=3).sum == 25


def test_starting_again_leaves_one_node_and_the_new_answer(session):
    for extra in range(3):
        session.start(Adder, parameters={"extra": extra})
        assert session.call("add", AddTwoInts, a=0, b=0).sum == extra
    assert session.nodes() == ["/adder"]
    assert session.node.count_services("/add") == 1


def test_another_class_of_the_same_node_name_replaces_it(session):
    class Other(Node):
        def __init__(self):
            super().__init__("adder")

            self.get_logger().info("the other one")

    first = session.start(Adder)
    session.start(Other)
    assert session.nodes() == ["/adder"] and not first.alive
    assert "the other one" in str(session.logs("adder", until="the other one"))


def test_a_class_and_a_file_replace_each_other_when_their_node_has_the_same_name(session, server):
    class FileServer(Node):
        def __init__(self):
            super().__init__("file_server")
            self.get_logger().info("of the class")

    server.write_text(SERVER.replace("    try:", "    node.get_logger().info('of the file')\n    try:"))
    process = session.start(server)
    handle = session.start(FileServer)
    assert session.nodes() == ["/file_server"] and not process.alive
    assert [entry.text for entry in session.logs(until="of the class")] == ["of the class"]
    session.start(server)
    assert session.nodes() == ["/file_server"] and not handle.alive
    assert [entry.text for entry in session.logs(until="of the file")] == ["arguments []", "of the file"]
    other = server.with_name("other.py")
    other.write_text(server.read_text())
    session.start(other)
    assert session.nodes() == ["/file_server"]


def test_a_node_that_passes_by_the_session_is_told_how_to_get_in(session):
    class Explicit(Node):
        def __init__(self):
            Node.__init__(self, "explicit")

    with pytest.raises(LiveError, match=r"Explicit .* write super\(\).__init__\('name'\) instead of Node.__init__"):
        session.start(Explicit)


@pytest.mark.parametrize("first", [True, False])
def test_another_node_made_in_a_constructor_is_told_apart(session, first):
    class Pair(Node):
        def __init__(self):
            if first:
                super().__init__("pair")
            self.helper = Node("helper")

    with pytest.raises(LiveError, match=r"Pair makes another node in its __init__") as told:
        session.start(Pair)
    assert "super()" not in str(told.value)


def test_a_constructor_that_fails_leaves_no_node(session):
    class Broken(Node):
        def __init__(self):
            super().__init__("broken")
            raise ValueError("no sensor")

    with pytest.raises(ValueError, match="no sensor"):
        session.start(Broken)
    assert session.until(lambda: session.nodes() == [], 2.0)


def test_a_file_runs_in_its_own_process(session, server):
    process = session.start(server, "word")
    assert process.nodes == ["/file_server"]
    assert session.call("file_add", AddTwoInts, a=2, b=3).sum == 5
    process = session.start(server, "word")
    assert session.nodes() == ["/file_server"]
    assert session.call("file_add", AddTwoInts, a=2, b=3).sum == 5
    session.stop("server.py")
    assert not process.alive and session.nodes() == []
    assert process.output == "arguments ['word']"


ENDING = """import rclpy
rclpy.init()
node = rclpy.create_node('ending')
print('begun')
try:
    rclpy.spin(node)
finally:
    print('cleaned up')
    {last}
"""


@pytest.mark.parametrize(("last", "shown"), [("pass", ""), ("node.nonsense()", "has no attribute 'nonsense'")])
def test_stopping_a_program_shows_its_last_traceback_only_when_it_has_another_error(session, tmp_path, last, shown):
    file = tmp_path / "ending.py"
    file.write_text(ENDING.format(last=last))
    process = session.start(file)
    assert session.until(lambda: "begun" in process.output)
    session.stop(file.name)
    begin, *rest = process.output.splitlines()
    assert begin == "begun" and "cleaned up" in rest
    assert shown in rest[-1] and ("Traceback" in process.output) == bool(shown)


def test_what_a_program_logs_on_its_terminal_bears_no_time(session, server):
    server.write_text(SERVER.replace("    print(", "    node.get_logger().info('once')\n    print("))
    process = session.start(server)
    assert session.until(lambda: "arguments" in process.output)
    assert "[INFO] [file_server]: once" in process.output


def test_a_program_that_was_killed_is_soon_forgotten(session, server):
    process = session.start(server)
    os.killpg(process._popen.pid, signal.SIGKILL)
    with pytest.raises(NodeFailed, match="SIGKILL"):  # whoever waits is told, once
        session.until(lambda: False, 10.0)
    assert session.until(lambda: session.nodes() == [], 10.0)


def test_a_file_that_ends_at_once_says_why(session, tmp_path):
    path = tmp_path / "broken.py"
    path.write_text("import nothing_of_this_name\n")
    says = r"(?s)exit status 1.*No module named 'nothing_of_this_name'.*broken.py, line 1"
    with pytest.raises(LiveError, match=says):
        session.start(path)


def test_a_file_without_a_node_is_ended_in_time(session, tmp_path):
    path = tmp_path / "idle.py"
    path.write_text("import threading\nthreading.Event().wait()\n")
    with pytest.raises(CallTimeout, match="created no node"):
        session.start(path, timeout=1.0)


@pytest.mark.parametrize(("what", "says"), [("nowhere.py", "there is no file"), (3, "takes a Node class")])
def test_what_cannot_be_started_is_named(session, what, says):
    with pytest.raises(LiveError, match=says):
        session.start(what)


@pytest.mark.parametrize("threads", ["4", 0, 2.0, True])
def test_threads_that_are_no_number_start_nothing(session, threads):
    before = session.start(Adder)
    with pytest.raises(LiveError, match="`threads` is a whole number from 1 on"):
        session.start(Adder, threads=threads)
    assert before.alive


def test_a_constructor_may_spin_until_an_answer_is_there(session, capsys):
    class Asking(Node):
        def __init__(self):
            super().__init__("asking")
            client = self.create_client(AddTwoInts, "/add")
            client.wait_for_service()
            future = client.call_async(AddTwoInts.Request(a=1, b=2))
            rclpy.spin_until_future_complete(self, future)
            self.answer = future.result().sum
            self.ticks = 0
            self.create_timer(0.01, self.tick)

        def tick(self):
            self.ticks += 1

    session.start(Adder)
    node = session.start(Asking).node
    assert node.answer == 3
    assert session.until(lambda: node.ticks > 2)
    assert capsys.readouterr().err == ""


def test_a_node_that_nothing_spins_may_be_spun_again_and_again(session, capsys):
    session.start(Adder)
    node = Node("alone", context=session.context)
    try:
        client = node.create_client(AddTwoInts, "/add")
        assert client.wait_for_service(timeout_sec=5.0)
        for a in (1, 2):
            future = client.call_async(AddTwoInts.Request(a=a, b=2))
            rclpy.spin_until_future_complete(node, future, SingleThreadedExecutor(context=session.context), 5.0)
            assert node.executor is not None  # rclpy keeps it
            assert future.done() and future.result().sum == a + 2
            future = client.call_async(AddTwoInts.Request(a=a, b=3))
            rclpy.spin_until_future_complete(node, future, timeout_sec=5.0)
            assert future.done() and future.result().sum == a + 3
    finally:
        node.destroy_node()
    assert capsys.readouterr().err == ""


def test_calls_end_in_time_and_say_what_is_missing(session):
    class Silent(Node):
        def __init__(self):
            super().__init__("silent")
            self.create_service(Trigger, "silent", lambda request, response: released.wait(20) and response)

    released = threading.Event()
    with pytest.raises(CallTimeout, match="no server for /nobody within 0.2 s"):
        session.call("/nobody", Trigger, timeout=0.2)
    session.start(Silent)
    with pytest.raises(CallTimeout, match="did not answer within 0.3 s"):
        session.call("silent", Trigger, timeout=0.3)
    released.set()


def test_a_wrong_field_names_the_right_ones_and_harms_nothing(session):
    with pytest.raises(LiveError, match=r"no request field 'c': it has a \(int64\), b \(int64\)"):
        session.call("add", AddTwoInts, c=1)
    with pytest.raises(LiveError, match="AddTwoInts.a must be int64, not .two., which is a str"):
        session.call("add", AddTwoInts, a="two")
    with pytest.raises(LiveError, match=r"names must be string\[\], a list, even for a single value: names=\['a'\]$"):
        session.call("add", GetParameters, names="a")


def test_a_callback_that_raises_is_kept_and_the_node_goes_on(session):
    class Careless(Node):
        def __init__(self):
            super().__init__("careless")
            self.create_service(AddTwoInts, "careless", self.divide)

        def divide(self, request, response):
            response.sum = request.a // request.b
            return response

    handle = session.start(Careless)
    with pytest.raises(CallTimeout):
        session.call("careless", AddTwoInts, a=1, b=0, timeout=0.5)
    assert wait_until(lambda: bool(handle.errors), 20, alert=False)  # it may come only now to a busy machine
    assert [type(error) for error in handle.errors] == [ZeroDivisionError]
    assert session.call("careless", AddTwoInts, a=8, b=4).sum == 2


def test_a_callback_that_raises_something_else_each_time_tells_only_the_first(session, monkeypatch):
    most = 5
    monkeypatch.setattr("course.session.spinner.REPORTS", most)

    class Raising(Node):
        def __init__(self):
            super().__init__("raising")
            self.count = 0
            self.create_timer(0.001, self.tick)

        def tick(self):
            self.count += 1
            raise RuntimeError(f"number {self.count}")

    handle = session.start(Raising)
    assert wait_until(lambda: handle.node.count > 3 * most, 20, alert=False)
    assert len(handle.reports) == most
    assert "ros.logs()" in handle.reports[-1].hint
    assert len(session.watch.pending()) == most


def test_a_node_that_blocks_for_ever_blocks_only_itself_and_can_be_stopped(session):
    class Relay(Node):
        def __init__(self):
            super().__init__("relay")
            self.adder = self.create_client(AddTwoInts, "add")
            self.create_service(AddTwoInts, "relay", self.relay)

        def relay(self, request, response):
            return self.adder.call(request)  # the executor that should bring the answer is waiting here

    session.start(Adder)
    relay = session.start(Relay)
    with pytest.raises(CallTimeout):
        session.call("relay", AddTwoInts, a=1, b=2, timeout=0.5)
    assert session.call("add", AddTwoInts, a=1, b=2).sum == 3
    relay.stop()
    assert not relay.alive and session.nodes() == ["/adder"]


def test_stopping_a_node_amid_its_callbacks_is_silent_and_takes_no_longer_than_its_limit(session, capfd):
    class Busy(Node):
        def __init__(self):
            super().__init__("busy")
            self.calling, self.waiting, self.go_on = threading.Event(), threading.Event(), threading.Event()
            self.ended = False
            group = ReentrantCallbackGroup()
            self.nobody = self.create_client(AddTwoInts, "nobody")
            self.create_service(AddTwoInts, "relay", self.relay, callback_group=group)
            self.create_service(Trigger, "wait", self.wait, callback_group=group)
            self.create_timer(0.001, lambda: None)

        def relay(self, request, response):
            self.calling.set()
            return self.nobody.call(request)

        def wait(self, request, response):
            self.waiting.set()
            self.go_on.wait(600)
            self.ended = True
            return response

    before = {*threading.enumerate()}
    busy = session.start(Busy, threads=3)
    node = busy.node
    for name, srv_type in (("relay", AddTwoInts), ("wait", Trigger)):
        session.wait_for_service(name, srv_type)
        session.node.create_client(srv_type, name).call_async(srv_type.Request())
    assert node.calling.wait(60) and node.waiting.wait(60)
    busy.stop()
    assert not node.ended and session.nodes() == []
    threads = [
        thread
        for thread in threading.enumerate()
        if thread.name.startswith("ThreadPoolExecutor") and thread not in before
    ]
    assert threads
    node.go_on.set()  # and what it does now, without its node, is nobody's concern
    for thread in threads:
        thread.join(60)
    del busy, node
    gc.collect()
    assert capfd.readouterr().err == ""


def test_several_threads_let_a_callback_call(session):
    class Relay(Node):
        def __init__(self):
            super().__init__("relay")
            group = ReentrantCallbackGroup()
            self.adder = self.create_client(AddTwoInts, "add", callback_group=group)
            self.create_service(
                AddTwoInts, "relay", lambda request, response: self.adder.call(request), callback_group=group
            )

    session.start(Adder)
    session.start(Relay, threads=3)
    assert session.call("relay", AddTwoInts, a=1, b=2).sum == 3


def test_an_answer_that_comes_before_its_question_is_noted_is_not_lost(session):
    class Slow:
        """The client's handle, and a thread that is interrupted after it has sent the goal."""

        def __init__(self, handle):
            self.handle = handle

        def __getattr__(self, name):
            return getattr(self.handle, name)

        def __enter__(self):
            return self.handle.__enter__()

        def __exit__(self, *exception):
            return self.handle.__exit__(*exception)

        def send_goal_request(self, request):
            number = self.handle.send_goal_request(request)
            time.sleep(0.3)
            return number

    session.start(FibonacciActionServer, threads=4, parameters={"step_period": 0.01})
    client = ActionClient(session.node, Fibonacci, "fibonacci")
    assert client.wait_for_server(5.0)
    client._client_handle = Slow(client._client_handle)
    assert session.wait(client.send_goal_async(Fibonacci.Goal(order=3))).accepted


def test_logs_are_kept_by_node_and_begin_anew_with_it(session):
    session.start(Adder)
    session.call("add", AddTwoInts, a=1, b=2)
    assert "[INFO] [adder]: sum 3" in str(session.logs("adder", until="sum 3"))
    session.start(Adder)
    assert "sum 3" not in str(session.logs("adder"))


def test_the_log_of_a_program_that_was_stopped_stays_until_its_node_is_started_again(session, server):
    """By its name and by its file's, among all, and for a panel that is opened later."""
    session.start(server)
    printed = session.logs("server.py", until="arguments")
    session.stop("server.py")
    assert session.logs("server.py") == session.logs("file_server") == printed
    assert [entry for entry in session.logs() if entry.node == "server.py"] == printed
    followed, _ = session.follow_logs().read(100)
    assert [entry.text for entry in followed if entry.node == "server.py"] == [entry.text for entry in printed]
    session.start(server)
    session.stop("server.py")
    assert [entry.text for entry in session.logs()].count(printed[0].text) == 1
    session.start(Node, "file_server")
    assert session.logs("server.py") == []


def test_a_text_that_no_line_has_and_a_node_that_is_not_there_are_told(session, capsys):
    session.start(Adder)
    session.call("add", AddTwoInts, a=1, b=2)
    assert session.logs("adder", until="sum 3")
    assert capsys.readouterr().err == ""
    session.logs("adder", until="sums 3", timeout=0.1)
    assert capsys.readouterr().err == "The log of 'adder' has no line with 'sums 3'. Did you mean 'sum 3'?\n"
    began = time.monotonic()
    assert session.logs("Adder", until="sum 3", timeout=20.0) == []
    assert time.monotonic() - began < 10.0
    assert session.watch.notices() == ["This session has no node or file called 'Adder'. It has: adder."]


def test_a_log_without_a_line_names_a_timer_whose_period_may_be_in_milliseconds(session, capsys):
    class Slow(Node):
        def __init__(self):
            super().__init__("slow")
            self.create_timer(200, lambda: self.get_logger().info("tick"))

    session.start(Slow)
    session.logs("slow", until="tick", timeout=0.1)
    said = "The log of 'slow' has no line with 'tick'. A timer of this node runs every 200 s: `create_timer` takes "
    assert capsys.readouterr().err == f"{said}seconds.\n"


def test_a_domain_that_others_are_in_is_left_to_them(monkeypatch):
    """Whoever set ROS_DOMAIN_ID by hand has claimed nothing, but holds a participant's port (RTPS 2.5, 9.6.2.3)."""
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    claims = [claim_domain() for _ in range(3)]  # others may hold domains that nobody is in yet
    _, *others = domains = [domain for _, domain in claims]
    for claim, _ in claims:
        claim.close()
    monkeypatch.setattr("course.session.domains.DOMAINS", domains)
    monkeypatch.setattr(os, "getpid", lambda: 0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as participant:
        participant.bind(("127.0.0.1", 7400 + 250 * domains[0] + 10))
        claim, domain = claim_domain()
    claim.close()
    assert domain in others


def test_logs_and_parts_of_them_show_what_was_logged_as_it_is():
    entries = Logs([Entry("INFO", "say", 'he said "it\'s"'), Entry("INFO", "say", "two\nlines, \u00fc")])
    shown = '[INFO] [say]: he said "it\'s"\n[INFO] [say]: two\nlines, \u00fc'
    assert repr(entries) == repr(entries[-2:]) == shown
    assert repr([*entries]) == f"[{entries[0]}, {entries[1]}]"
    assert (entries[1].text, entries[:1][0].text) == ("two\nlines, \u00fc", 'he said "it\'s"')


def test_logs_are_escaped_in_the_notebook(session):
    class Shouting(Node):
        def __init__(self):
            super().__init__("shouting")
            self.get_logger().info("<script>alert(1)</script>")

    session.start(Shouting)
    shown = session.logs("shouting", until="script")._repr_html_()
    assert "<script>" not in shown and "&lt;script&gt;" in shown


def test_an_executor_of_a_started_file_lets_its_threads_begin(session, server):
    """Otherwise, on an idle machine with several cores, a callback may wait for half a second."""
    looking = """    import time
    from rclpy.executors import MultiThreadedExecutor
    executor, start = MultiThreadedExecutor(2), time.perf_counter()
    executor._executor.submit(int)
    print('waited', time.perf_counter() - start >= 50e-6)
"""
    server.write_text(SERVER.replace("    print(", f"{looking}    print(", 1))
    process = session.start(server)
    assert session.until(lambda: "arguments" in process.output)
    assert "waited True" in process.output


def test_a_class_that_is_no_service_is_not_taken_for_the_half_of_one(session):
    class My_Node(Node):  # noqa: N801
        pass

    with pytest.raises(LiveError, match="My_Node is not the type of a service, such as AddTwoInts"):
        session.call("add", My_Node)
    with pytest.raises(LiveError, match=r"not a message of it. .* ros.call\(name, AddTwoInts, a=1, b=2\)"):
        session.call("/add_two_ints", AddTwoInts.Request(a=1, b=2))
    with pytest.raises(LiveError, match=r"`AddTwoInts.Request` is only the class of a request"):
        session.call("add", AddTwoInts.Request)


def test_two_sessions_do_not_meet(session):
    session.start(Adder)
    saved = os.environ.pop("ROS_DOMAIN_ID")
    other = Session()
    try:
        assert other.domain_id != session.domain_id
        with pytest.raises(CallTimeout):
            other.call("add", AddTwoInts, a=1, b=2, timeout=0.5)
    finally:
        other.close()
        os.environ["ROS_DOMAIN_ID"] = saved


def test_closing_leaves_no_thread_and_no_process(server):
    before = set(threading.enumerate())
    session = Session()
    session.start(Adder)
    session.start(Adder, threads=3)
    process = session.start(server)
    session.close()
    session.close()
    assert set(threading.enumerate()) == before
    assert not process.alive
    with pytest.raises(LiveError, match="course.live"):
        session.call("add", AddTwoInts, a=1, b=2)


def child(code: str) -> subprocess.Popen:
    return subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def gone(pid: int, timeout: float = 5.0) -> bool:
    deadline = time.monotonic() + timeout
    while Path(f"/proc/{pid}").exists() and "Z" not in Path(f"/proc/{pid}/stat").read_text().split(")")[1][:3]:
        if time.monotonic() > deadline:
            return False
        time.sleep(0.02)
    return True


@pytest.mark.parametrize("end", ["import os; os.kill(os.getpid(), 9)", "", "raise SystemExit(3)"])
def test_however_the_kernel_ends_its_processes_end_with_it(end, server):
    process = child(f"""
import course, sys
ros = course.live()
node = ros.start({str(server)!r})
print(node._popen.pid, flush=True)
{end}
""")
    pid = int(process.stdout.readline())
    process.communicate(timeout=20)
    assert gone(pid)
    assert process.returncode == {"": 0, "raise SystemExit(3)": 3}.get(end, -signal.SIGKILL)


def test_an_interrupted_cell_does_not_kill_the_session(server):
    """Jupyter interrupts the kernel's whole process group."""
    process = subprocess.Popen(
        [
            sys.executable,
            "-c",
            f"""
import course, time
from example_interfaces.srv import AddTwoInts
ros = course.live()
ros.start({str(server)!r})
for attempt in range(3):
    try:
        print("waiting", flush=True)
        time.sleep(20)
    except KeyboardInterrupt:
        print(ros.call("file_add", AddTwoInts, a=attempt, b=1).sum, flush=True)
""",
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    for attempt in range(3):
        assert process.stdout.readline() == "waiting\n"
        assert wait_until(lambda: processes.sleeping(process.pid), 20)  # a signal just before would wait for the end
        os.killpg(process.pid, signal.SIGINT)
        said = process.stdout.readline()
        assert said == f"{attempt + 1}\n", process.communicate(timeout=20)[1]
    _, errors = process.communicate(timeout=20)
    assert process.returncode == 0 and not errors


def test_who_asks_again_gets_the_same_session_or_a_new_one_when_it_has_ended():
    """`course.live()` is a notebook's first cell, which is run again and again."""
    code = (
        "import course; first = course.live(); assert course.live() is first; first.close(); "
        "second = course.live(); assert second is not first and second.ok"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def test_a_name_that_nothing_has_is_told(session):
    session.stop("nothing")
    assert session.watch.notices() == ["This session has no node or file called 'nothing'."]
    session.start(Adder)
    assert session.logs("nothing") == []
    assert session.watch.notices() == ["This session has no node or file called 'nothing'. It has: adder."]
    session.stop("adder")
    session.stop("adder")
    assert session.logs("adder") == [] and session.watch.notices() == []


def test_an_interrupted_wait_is_shown_in_a_line(session, monkeypatch):
    def press(*_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as pressed:
        session.until(press)
    assert pressed.value._render_traceback_() == ["KeyboardInterrupt: the cell was interrupted. The session goes on."]


@pytest.mark.parametrize(("in_a_thread", "says"), [(False, "Still waiting for /nowhere."), (True, "")])
def test_a_cell_alone_is_told_that_it_still_waits(session, monkeypatch, capsys, in_a_thread, says):
    """A panel's call waits in a thread, and its message would stand below a cell that waits for nothing."""
    monkeypatch.setattr("course.session.calls.TELLING", 0.2)
    monkeypatch.setattr("course.session.calls.PATIENT", 0.1)

    def wait() -> None:
        with pytest.raises(CallTimeout, match="/nowhere"):
            session.wait_for_service("/nowhere", Trigger, 1.5)

    if in_a_thread:
        thread = threading.Thread(target=wait)
        thread.start()
        thread.join()
    else:
        wait()
    told = capsys.readouterr().err
    assert told.startswith(says) and bool(told) == bool(says)
