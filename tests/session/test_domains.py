"""A session belongs to a folder: who is there meets, and two sessions never do.  All terminals of a user meet."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from course import registry
from course.errors import LiveError
from course.foundation.processes import birth
from course.session import domains
from course.session.domains import note_chosen, session_domain, shell_domain


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


@pytest.fixture
def terminal(processes):
    """Opens a terminal in a folder, or looks again where that of the process `pid` is; returns its place."""
    claims = []

    def open_in(folder: Path, pid: int = 0, front: str = "", front_folder: Path | None = None) -> domains.Place:
        place = shell_domain(folder, pid or processes(), front, front_folder)
        claims.append(place.claim)
        return place

    yield open_in
    for claim in filter(None, claims):
        claim.close()


def session(pid: int, domain: int, folder: Path, kernel: str = "") -> None:
    registry.write(registry.SessionRecord(pid, domain, str(folder), 1.0 + pid, birth(pid), kernel=kernel))


def test_a_terminal_meets_the_notebook_of_its_folder(tmp_path, processes, terminal):
    session(processes(), 33, tmp_path)
    place = terminal(tmp_path)
    assert (place.domain, place.folder, place.with_notebook) == (33, tmp_path, True)


def test_a_notebook_meets_the_terminal_that_was_there_first(tmp_path, terminal):
    waiting = terminal(tmp_path).domain
    assert session_domain(tmp_path) == (None, waiting)


def test_the_terminals_of_a_user_meet_whatever_their_folders(tmp_path, processes, terminal):
    places = [terminal(tmp_path / name) for name in ("one", "one", "two")]
    assert len({place.domain for place in places}) == 1 and not any(place.with_notebook for place in places)
    session(processes(), 33, tmp_path / "three")
    assert terminal(tmp_path / "three").domain == 33
    assert terminal(tmp_path / "four").domain == places[0].domain, "a notebook's domain is not the terminals'"


def test_a_terminal_that_was_with_a_notebook_comes_back_to_its_domain(tmp_path, processes, terminal):
    pid = processes()
    session(processes(), 33, tmp_path / "notebook")
    before = terminal(tmp_path, pid).domain
    assert terminal(tmp_path / "notebook", pid).domain == 33
    assert terminal(tmp_path / "elsewhere", pid).domain == before
    assert terminal(tmp_path / "another").domain == before, "another terminal, opened later"


def test_the_terminals_domain_is_held_until_the_last_of_them_ends(tmp_path, processes):
    pids = [processes(), processes()]
    first, second = (shell_domain(tmp_path, pid) for pid in pids)
    assert first.domain == second.domain
    first.claim.close()
    for pid in pids:
        (registry.runtime_folder() / f"shell-{pid}.json").unlink()  # as another user, who cannot read them
    with pytest.MonkeyPatch.context() as only:
        only.setattr(domains, "DOMAINS", [first.domain])
        with pytest.raises(LiveError):
            domains.claim_domain()
        second.claim.close()
        claim, _ = domains.claim_domain()
    claim.close()


def test_a_terminal_in_jupyterlab_is_with_the_notebook_in_front(tmp_path, processes, terminal):
    one, two, pid = tmp_path / "one", tmp_path / "two", processes()
    session(processes(), 33, one, "a1")
    session(processes(), 44, two, "b2")
    assert (terminal(one, pid, "b2").domain, terminal(one, pid, "b2").folder) == (44, two)
    assert terminal(one, pid, "c3").domain == 33, "a notebook without a session is in front"


def test_a_terminal_waits_in_nobodys_domain_for_the_session_of_the_notebook_in_front(tmp_path, processes, terminal):
    start, one, pid = tmp_path, tmp_path / "one", processes()
    shared = terminal(start, pid).domain
    assert session_domain(start)[1] == shared  # of this process: the start page's
    waiting = terminal(one, pid, "b2", one)
    assert waiting.waits and not waiting.with_notebook and waiting.domain != shared
    assert terminal(one, pid, "b2", one).domain == waiting.domain
    assert terminal(one, 0, "b2", one).domain == waiting.domain, "another terminal of the same JupyterLab"
    session(processes(), next(each for each in (44, 45, 46) if each not in (shared, waiting.domain)), one, "c3")
    assert terminal(one, pid, "b2", one).domain == waiting.domain, "another notebook of the folder has a session"
    session(processes(), waiting.domain, one, "b2")
    joined = terminal(one, pid, "b2", one)
    assert joined.domain == waiting.domain and joined.with_notebook and not joined.waits


def test_a_notebook_takes_the_domain_in_which_a_terminal_waits_for_it(tmp_path, processes, terminal):
    pid, one = processes(), tmp_path / "one"
    session(processes(), terminal(tmp_path, pid).domain, tmp_path)
    waiting = terminal(one, pid, "b2", one)
    assert session_domain(one) == (None, waiting.domain)


def test_a_domain_that_somebody_chose_is_no_other_terminals(tmp_path, processes, terminal):
    pid = processes()
    own = terminal(tmp_path, pid).domain
    note_chosen(tmp_path, pid, 77)
    assert terminal(tmp_path).domain == own
    assert session_domain(tmp_path)[1] != 77


def test_a_second_notebook_never_takes_the_terminals_domain(tmp_path, processes, terminal):
    pid = processes()
    shared = terminal(tmp_path / "one", pid).domain
    session(processes(), shared, tmp_path / "two")
    claim, domain = session_domain(tmp_path / "one")
    assert domain != shared
    assert terminal(tmp_path / "one", pid).domain == domain, "the terminal moves to the notebook of its folder"
    claim.close()


def test_two_kernels_in_a_folder_do_not_meet(tmp_path, processes, terminal):
    waiting = terminal(tmp_path).domain
    session(processes(), waiting, tmp_path)
    claim, domain = session_domain(tmp_path)
    assert domain != waiting
    claim.close()


def test_a_terminal_joins_the_oldest_session(tmp_path, processes, terminal):
    first, second = sorted([processes(), processes()])
    session(second, 44, tmp_path)
    session(first, 33, tmp_path)
    assert terminal(tmp_path).domain == 33


def test_the_folders_of_notebooks_do_not_meet(tmp_path, processes, terminal):
    session(processes(), terminal(tmp_path / "one").domain, tmp_path / "one")
    claim, another = session_domain(tmp_path / "two")
    assert another != terminal(tmp_path / "one").domain
    claim.close()


def test_what_a_dead_process_had_is_forgotten(tmp_path, terminal):
    gone = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    session(gone.pid, 33, tmp_path)
    gone.kill()
    gone.wait()
    assert not terminal(tmp_path).with_notebook


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
