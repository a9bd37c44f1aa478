"""Programs outside of a session: who answers is told, with the process, and `nodes` has each of them."""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import pytest
from example_interfaces.srv import AddTwoInts
from rclpy.node import Node

from course import registry
from course.errors import CallTimeout, LiveError
from course.foundation import processes
from course.foundation.waiting import wait_until
from course.session import outsiders, started_nodes
from course.session.live import Session
from course.session.outsiders import Outsider

SERVER = """
import sys
import rclpy
from example_interfaces.srv import AddTwoInts
from rclpy.node import Node


def add(request, response):
    response.sum = request.a + request.b
    return response


rclpy.init()
node = Node("adder")
if "--silent" not in sys.argv:
    node.create_service(AddTwoInts, "add_two_ints", add)
rclpy.spin(node)
"""


class Adder(Node):
    def __init__(self, name="adder"):
        super().__init__(name)
        self.create_service(AddTwoInts, "add_two_ints", self.add)

    def add(self, request, response):
        response.sum = -1
        return response


@pytest.fixture
def session() -> Iterator[Session]:
    made = Session()
    yield made
    made.close()


@pytest.fixture
def server(tmp_path):
    path = tmp_path / "adder.py"
    path.write_text(SERVER)
    return path


@pytest.fixture
def outsider(session, server) -> Iterator[subprocess.Popen]:
    """The server, started in a terminal as it were."""
    with subprocess.Popen([sys.executable, server.name], cwd=server.parent, start_new_session=True) as process:
        # The names of nodes and the endpoints, which tell the process, are discovered in either order.
        wait_until(lambda: session.nodes() == ["/adder"] and any(row.process for row in session.rows()), 20.0)
        yield process
        process.kill()


def test_who_answers_is_told_when_the_session_has_not_started_it(session, outsider):
    assert session.call("add_two_ints", AddTwoInts, a=40, b=2).sum == 42
    (notice,) = session.watch.notices()
    assert notice == (
        f"/add_two_ints is answered by /adder, process {outsider.pid} (python adder.py), which this session has not "
        f"started. To end it: Ctrl-C in its terminal, or `!kill {outsider.pid}`."
    )
    session.call("add_two_ints", AddTwoInts, a=40, b=2)
    assert session.watch.notices() == []


def test_a_call_of_a_panel_tells_the_cells_nothing_of_who_answers(session, outsider):
    call = partial(session.call, "add_two_ints", AddTwoInts, a=40, b=2)
    with ThreadPoolExecutor(1) as panel:  # which works in a thread of its own
        assert panel.submit(call).result().sum == 42
    assert session.watch.notices() == []
    call()
    assert "is answered by /adder" in "".join(session.watch.notices())


def test_a_server_beside_that_of_the_session_is_told_and_is_in_the_table(session, outsider, server):
    stub = session.start(server, "--silent")
    (notice,) = session.watch.notices()
    assert "outside this session also has a node of this name" in notice and f"process {outsider.pid} " in notice
    outside = f"not started by this session: process {outsider.pid} (python adder.py)"
    assert [row.where for row in session.rows()] == [f"adder.py, process {stub.pid}", outside]
    session.call("add_two_ints", AddTwoInts)
    assert "is answered by /adder, process" in "".join(session.watch.notices())

    session.start(server)
    session.watch.notices()
    assert session.until(lambda: session.node.count_services("add_two_ints") == 2)
    session.wait_for_service("add_two_ints", AddTwoInts)
    assert "a node of this session and by /adder" in "".join(session.watch.notices())
    assert session.until(lambda: len(session.others("/add_two_ints")) == 2)
    (_, ending), own = session.others("/add_two_ints")
    assert f"`!kill {outsider.pid}`" in ending and own == ("adder.py of this notebook", "ros.stop('adder.py')")


def test_a_program_of_a_terminal_is_stopped_as_by_ctrl_c_but_not_another_users(session, outsider, monkeypatch):
    (row,) = session.rows()
    assert row.process == (outsider.pid, processes.birth(outsider.pid))
    pid, born = row.process
    with pytest.raises(LiveError, match="has no node any more"):
        session.stop_outsider(pid, born - 1)  # an earlier process with this id
    with monkeypatch.context() as patched:
        patched.setattr(processes, "user", lambda pid: os.getuid() + 1)
        assert [row.process for row in session.rows()] == [None]
        with pytest.raises(LiveError, match="must not be stopped"):
            session.stop_outsider(pid, born)
    assert outsider.poll() is None
    session.stop_outsider(pid, born)
    assert wait_until(lambda: outsider.poll() is not None, 5.0)


def test_a_program_that_ignores_ctrl_c_is_named_with_what_ends_it(session, server, monkeypatch):
    monkeypatch.setattr(started_nodes, "ENDING", 0.2)
    ignoring = (
        "import signal\nrclpy.init(signal_handler_options=rclpy.signals.SignalHandlerOptions.NO)\n"
        "signal.signal(signal.SIGINT, signal.SIG_IGN)"
    )
    server.write_text(SERVER.replace("rclpy.init()", ignoring))
    with subprocess.Popen([sys.executable, server.name], cwd=server.parent) as process:
        assert session.until(lambda: [row for row in session.rows() if row.process], 20.0)
        with pytest.raises(LiveError, match=f"still runs .* `!kill {process.pid}`"):
            session.stop_outsider(process.pid, processes.birth(process.pid))
        process.kill()


@pytest.mark.parametrize(
    ("program", "may"), [("ipykernel_launcher.py", False), ("jupyter-lab", False), ("bash", False), ("adder.py", True)]
)
def test_a_kernel_a_jupyterlab_or_a_shell_may_not_be_stopped(tmp_path, program, may):
    (tmp_path / program).write_text("input()")
    command = ["bash"] if program == "bash" else [sys.executable, program]
    with subprocess.Popen(command, cwd=tmp_path, stdin=subprocess.PIPE) as process:
        wait_until(Path(f"/proc/{process.pid}/cmdline").read_text, 5.0)  # it is empty for a moment after the start
        assert (Outsider("/node", process.pid).process is not None) == may
    assert Outsider("/node", os.getppid()).process is None  # it has started this process


def test_a_program_that_ctrl_z_has_stopped_is_ended_by_what_does_not_wait_for_it():
    with subprocess.Popen(["sleep", "60"]) as process:
        outsider = Outsider("/node", process.pid)
        assert outsider.ending == f"Ctrl-C in its terminal, or `!kill {process.pid}`"
        process.send_signal(signal.SIGSTOP)
        ending = f"`fg` and Ctrl-C in its terminal, or `!kill -9 {process.pid}`"
        assert wait_until(lambda: outsider.ending == ending, 9)
        process.kill()


@pytest.mark.parametrize(
    ("kernel", "command", "there"),
    [
        (12, [sys.executable, "waits.py"], True),
        (12, ["sleep", "60"], False),  # as `ros2 topic pub`: no file that a session has started
        (13, [sys.executable, "waits.py"], False),  # whose parent is a shell
        (0, [sys.executable, "waits.py"], False),  # this kernel's own, by subprocess
    ],
)
def test_a_file_that_another_notebooks_session_runs_is_ended_there(tmp_path, monkeypatch, kernel, command, there):
    (tmp_path / "waits.py").write_text("input()")
    records = [registry.SessionRecord(kernel or os.getpid(), 42, "/home/ada/services", 0.0, 0, kernel="1234")]
    monkeypatch.setattr(registry, "running", lambda: records)
    monkeypatch.setattr(outsiders.processes, "ancestors", lambda pid: [12 if kernel else os.getpid(), 1])
    with subprocess.Popen(command, cwd=tmp_path, stdin=subprocess.PIPE) as process:
        wait_until(Path(f"/proc/{process.pid}/cmdline").read_text, 5.0)  # it is empty for a moment after the start
        ending = "`ros.stop()` in the notebook in services" if there else "Ctrl-C in its terminal"
        assert Outsider("/node", process.pid).ending == f"{ending}, or `!kill {process.pid}`"
        process.kill()


def test_a_process_without_a_command_line_may_not_be_stopped(monkeypatch):
    """As each has none for a moment while it is started: it may become a shell."""
    with subprocess.Popen(["cat"], stdin=subprocess.PIPE) as process:
        monkeypatch.setattr(outsiders.processes, "command_line", lambda _: [""])
        assert Outsider("/node", process.pid).process is None
        monkeypatch.setattr(outsiders.processes, "command_line", lambda _: ["cat"])
        assert Outsider("/node", process.pid).process is not None


def test_a_stop_by_the_name_of_a_nodes_file_or_of_a_files_node_ends_it(session, server):
    """A student thinks of the node, or of the file; whichever is typed, it does not run on without a word."""
    for name in ("adder.py", "adder", "/adder"):
        started = session.start(server)
        session.stop(name)
        assert not started.alive and session.watch.notices() == []
    again = session.restart("adder")
    assert again.alive and again.name == "adder.py"


def test_a_stop_of_what_others_have_started_says_how_to_end_it(session, outsider):
    session.stop("adder")
    (notice,) = session.watch.notices()
    assert notice == (
        f"/adder, process {outsider.pid} (python adder.py) was not started by this session. To end it: Ctrl-C in its "
        f"terminal, or `!kill {outsider.pid}`."
    )
    assert outsider.poll() is None


def test_what_the_session_has_started_or_what_has_ended_is_no_outsider(session, server, outsider):
    outsider.kill()
    outsider.wait()
    session.start(Adder, "another")
    session.start(server)
    expected = ["adder.py of this notebook", "another of this notebook"]
    assert session.until(lambda: sorted(who for who, _ in session.others("/add_two_ints")) == expected)
    assert not [row for row in session.rows() if not row.started_as]


def test_a_file_that_takes_the_place_of_another_is_told(session, server):
    session.start(server)
    other = server.with_name("other.py")
    other.write_text(SERVER)
    session.start(other)
    (notice,) = session.watch.notices()
    assert notice == (
        "other.py replaces adder.py: both name their node 'adder'. To run both, give one of them another name in "
        "`super().__init__(...)`."
    )
    session.start(other)
    assert session.watch.notices() == []


def test_a_server_that_was_killed_is_not_called_busy(session, outsider):
    assert session.call("add_two_ints", AddTwoInts, a=40, b=2).sum == 42
    outsider.kill()
    outsider.wait()
    with pytest.raises(CallTimeout, match="did not answer within 1 s: the program that served it no longer runs"):
        session.call("add_two_ints", AddTwoInts, a=40, b=2, timeout=1.0)


def test_a_server_of_the_sessions_own_node_is_not_taken_for_one_that_was_killed(session):
    session.node.create_service(AddTwoInts, "held", lambda request, response: threading.Event().wait(2.0) and response)
    with pytest.raises(CallTimeout, match="is its server busy or blocked"):
        session.call("held", AddTwoInts, timeout=1.0)


def test_a_server_that_was_stopped_while_it_was_asked_is_not_called_busy(session):
    asked, ends = threading.Event(), threading.Event()

    class Patient(Node):
        def __init__(self):
            super().__init__("patient")
            self.create_service(AddTwoInts, "patient_sum", self.add)

        def add(self, request, response):
            asked.set()
            ends.wait(5.0)
            return response

    session.start(Patient)
    stopper = threading.Thread(target=lambda: asked.wait(5.0) and session.stop("patient"))
    stopper.start()
    with pytest.raises(CallTimeout, match="did not answer: its server was stopped meanwhile"):
        session.call("patient_sum", AddTwoInts, timeout=1.5)
    ends.set()
    stopper.join()


def test_a_file_that_takes_the_place_of_a_class_is_told_unless_the_name_is_its_own(session, server):
    other = server.with_name("other.py")
    other.write_text(SERVER)
    for file, count in ((server, 0), (other, 1)):
        session.start(Adder)
        session.watch.notices()
        session.start(file)
        told = [each for each in session.watch.notices() if "replaces Adder: both name their node 'adder'" in each]
        assert len(told) == count
