"""A session belongs to a folder: who is in the same folder meets, and two sessions never do."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from course import registry
from course.errors import LiveError
from course.foundation.processes import birth
from course.session import domains
from course.session.domains import session_domain, shell_domain


@pytest.fixture(autouse=True)
def own_registry(tmp_path, monkeypatch):
    """A registry that no other session of this machine writes to."""
    (tmp_path / "run").mkdir()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "run"))


@pytest.fixture
def processes():
    """Makes processes that live until the test ends, in the place of kernels and shells."""
    started = []

    def start() -> int:
        started.append(subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE))
        return started[-1].pid

    yield start
    for process in started:
        process.kill()
        process.wait()


def session(pid: int, domain: int, folder: Path) -> None:
    registry.write(registry.SessionRecord(pid, domain, str(folder), 1.0 + pid, birth(pid)))


def test_a_terminal_meets_the_notebook_of_its_folder(tmp_path, processes):
    session(processes(), 33, tmp_path)
    assert shell_domain(tmp_path, processes()) == (None, 33)


def test_a_notebook_meets_the_terminal_that_was_there_first(tmp_path, processes):
    claim, domain = shell_domain(tmp_path, processes())
    assert session_domain(tmp_path) == (None, domain)
    claim.close()


def test_two_terminals_of_a_folder_meet(tmp_path, processes):
    claim, domain = shell_domain(tmp_path, processes())
    assert shell_domain(tmp_path, processes()) == (None, domain)
    claim.close()


def test_two_kernels_in_a_folder_do_not_meet(tmp_path, processes):
    held, waiting = shell_domain(tmp_path, processes())
    session(processes(), waiting, tmp_path)
    claim, domain = session_domain(tmp_path)
    assert domain != waiting
    held.close()
    claim.close()


def test_a_terminal_joins_the_oldest_session(tmp_path, processes):
    first, second = sorted([processes(), processes()])
    session(second, 44, tmp_path)
    session(first, 33, tmp_path)
    assert shell_domain(tmp_path, processes()) == (None, 33)


def test_folders_do_not_meet(tmp_path, processes):
    one, other = tmp_path / "one", tmp_path / "two"
    first, domain = shell_domain(one, processes())
    second, another = session_domain(other)
    assert domain != another
    first.close()
    second.close()


def test_what_a_dead_process_had_is_forgotten(tmp_path, processes):
    gone = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    session(gone.pid, 33, tmp_path)
    gone.kill()
    gone.wait()
    claim, _ = shell_domain(tmp_path, processes())
    assert claim is not None
    claim.close()


def test_when_all_domains_are_in_use_it_is_a_line(tmp_path, monkeypatch):
    monkeypatch.setattr(domains, "participants_here", lambda domain: 1)
    with pytest.raises(LiveError, match=r"all 100 ROS domains .* `course sessions` lists"):
        session_domain(tmp_path)


def test_a_registry_that_cannot_be_written_keeps_nobody_from_working(tmp_path, monkeypatch):
    def refuse():
        raise PermissionError("no")

    monkeypatch.setattr(registry, "runtime_folder", refuse)
    claim, domain = session_domain(tmp_path)
    assert domain in domains.DOMAINS
    claim.close()
    assert os.getpid() not in [record.pid for record in registry.running()]
