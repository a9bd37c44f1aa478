"""Sessions on this machine are listed, known to other processes, and can be ended."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from rich.console import Console
from typer.testing import CliRunner

from course import registry, running_sessions
from course.cli import app
from course.foundation import processes
from course.foundation.folders import runtime_folder
from course.foundation.waiting import wait_until
from course.registry import NodeRecord, SessionRecord
from course.session import domains

HOLDER = """
import sys, time
import course
ros = course.live()
from course.nodes.add_two_ints_server import AddTwoIntsServer
ros.start(AddTwoIntsServer)
ros.start("child.py")
print("ready", flush=True)
time.sleep(120)
"""
CHILD = """
import rclpy
from rclpy.node import Node
rclpy.init()
rclpy.spin(Node("child"))
"""


@pytest.fixture(autouse=True)
def own_registry(tmp_path, monkeypatch):
    """A registry that no other session of this machine writes to."""
    (tmp_path / "run").mkdir()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "run"))
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)


@pytest.fixture
def session(tmp_path):
    """A process with a live session: two nodes, one of them in a process of its own."""
    (tmp_path / "child.py").write_text(CHILD)
    process = subprocess.Popen([sys.executable, "-c", HOLDER], cwd=tmp_path, stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "ready\n"
    yield process
    process.kill()
    process.communicate()


def run(*words: str):
    return CliRunner().invoke(app, ["sessions", *words])


def test_a_session_is_listed_with_its_folder_domain_and_nodes(session, tmp_path):
    (record,) = registry.running()
    assert (record.pid, record.folder) == (session.pid, str(tmp_path))
    assert {node.name: node.state for node in record.nodes} == {"/add_two_ints_server": "running", "/child": "running"}
    assert "/add_two_ints" in next(node.services for node in record.nodes if "add" in node.name)
    assert registry.of_domain(record.domain) == record
    shown = run().stdout
    assert str(session.pid) in shown and "/child: running" in shown


def test_a_forgotten_session_is_ended_with_its_nodes(session):
    (record,) = registry.running()
    child = int(next(node.where for node in record.nodes if node.name == "/child").rpartition(" ")[2])
    done = run("--stop", str(session.pid))
    assert done.exit_code == 0 and f"Ended: session {session.pid}" in done.stdout
    assert session.wait(10) is not None
    assert wait_until(lambda: not processes.birth(child), 10)
    assert registry.running() == [] and "No live session" in run().stdout


def test_a_number_that_no_session_has_is_a_line(session):
    done = run("--stop", "1")
    assert done.exit_code == 2 and done.stderr == "There is no session 1; `course sessions` lists them.\n"
    assert session.poll() is None


def test_what_a_killed_session_left_is_removed(session):
    session.kill()
    session.wait()
    assert registry.running() == []
    assert list(runtime_folder().glob("*.json")) == []


def test_another_process_of_the_same_number_is_no_session():
    record = SessionRecord(os.getpid(), 7, "/", time.time(), processes.birth(os.getpid()) - 1)
    registry.write(record)
    assert registry.running() == []


def test_in_a_narrow_terminal_the_end_of_a_long_path_is_shown(tmp_path, monkeypatch, capsys):
    record = SessionRecord(os.getpid(), 7, f"/home/{'a' * 200}/services", time.time(), processes.birth(os.getpid()))
    registry.write(record)
    monkeypatch.setattr(running_sessions, "Console", lambda **_: Console(width=60, color_system=None))
    assert running_sessions.show() == 0
    table = [line.split("│") for line in capsys.readouterr().out.splitlines() if "│" in line]
    assert "".join(row[4].strip() for row in table) == record.folder


def test_usage_and_errors_have_no_colours(monkeypatch):
    """Yellow and light blue cannot be read in a light terminal."""
    monkeypatch.setenv("FORCE_COLOR", "1")
    told = run("--nothing")
    assert told.exit_code == 2 and "\x1b[" not in told.stderr
    assert told.stderr.startswith("Usage: ") and "No such option" in told.stderr


@pytest.fixture
def zombie():
    """A process that has ended, and that nobody waits for; and when it was started."""
    process = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    born = processes.birth(process.pid)
    process.stdin.close()
    os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)  # it stays what it is
    assert Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    yield process.pid, born
    process.wait()


def test_a_zombie_is_no_session_and_no_terminal(zombie, tmp_path):
    """If a container's first process does not wait for its children, each ended kernel stays a zombie."""
    pid, born = zombie
    assert born and not processes.alive(pid, born)
    registry.write(SessionRecord(pid, 7, str(tmp_path), time.time(), born))
    registry.write(registry.ShellRecord(pid, born, str(tmp_path), 8))
    assert registry.running() == [] and registry.shells() == [] and registry.of_domain(7) is None
    assert list(runtime_folder().glob("*.json")) == []


def test_zombies_take_no_domain(zombie, tmp_path, monkeypatch):
    monkeypatch.setattr(domains, "CLAIM", f"test-{os.getpid()}-{{}}")  # no other worker's test can hold it meanwhile
    claim, free = domains.claim_domain()
    claim.close()
    monkeypatch.setattr(domains, "DOMAINS", [free])
    registry.write(registry.ShellRecord(*zombie, str(tmp_path), free))
    claim, domain = domains.claim_domain()
    claim.close()
    assert domain == free


def test_a_session_that_ended_before_it_was_written_down_is_none(zombie):
    """A process without a birth is not alive because it has none now either."""
    pid, _ = zombie
    assert processes.birth(pid) == 0 and not processes.alive(pid, processes.birth(pid))


def test_a_process_sleeps_only_while_all_its_threads_wait(zombie):
    text = "import threading, time; threading.Thread(target=lambda: input() or spin()).start()\n"
    text += "def spin():\n    while True: pass\ntime.sleep(60)"
    with subprocess.Popen([sys.executable, "-c", text], stdin=subprocess.PIPE, text=True) as process:
        assert wait_until(lambda: processes.sleeping(process.pid), 10)
        process.send_signal(signal.SIGSTOP)
        assert wait_until(lambda: not processes.sleeping(process.pid), 10)
        process.send_signal(signal.SIGCONT)
        assert wait_until(lambda: processes.sleeping(process.pid), 10)
        process.stdin.write("\n")
        process.stdin.flush()
        assert wait_until(lambda: not processes.sleeping(process.pid), 10)
        assert not any(processes.sleeping(process.pid) for _ in range(20))  # it wants a processor, or has one
        process.kill()
    assert not processes.sleeping(zombie[0]) and not processes.sleeping(process.pid)


def test_ending_a_session_does_not_wait_for_whoever_started_it(session, monkeypatch):
    """It is a zombie then: no second signal, no time limit."""
    (record,) = registry.running()
    signals = []
    kill = os.kill
    monkeypatch.setattr(os, "kill", lambda pid, number: (signals.append(number), kill(pid, number)))
    assert run("--stop", str(record.pid)).exit_code == 0
    assert signals == [signal.SIGTERM] and not processes.alive(record.pid, record.born)


def test_what_cannot_be_read_is_no_session():
    (runtime_folder() / "1.json").write_text('{"pid": 1')
    (runtime_folder() / "2.json").write_text('{"pid": 2, "colour": "red"}')
    assert registry.running() == []


def test_the_files_are_their_users_alone():
    assert runtime_folder().stat().st_mode & 0o777 == 0o700


def test_what_another_process_has_told_is_known():
    record = SessionRecord(os.getpid(), 7, "/", time.time(), 1, [NodeRecord("/a", "running", True, 1.0, "here")])
    registry.tell(record, "it died\nof this")
    assert registry.told_elsewhere(os.getpid()) == {"it died\nof this"}
    registry.remove(os.getpid())
    assert registry.told_elsewhere(os.getpid()) == set()
