"""A wrong command is answered with one line, and nothing is made."""

import os
import pwd
import socket
import subprocess
import sys
from pathlib import Path

import pytest
import typer

from autograder.classroom import cli, hub, members
from autograder.errors import UsageError
from tests.classroom.conftest import COMMAND, ROSTER, call_classroom, run_classroom
from tests.ports import free_port

WRONG = {
    "two equal names": ("student\nada\nada\n", "line 3: 'ada' is listed twice"),
    "not a Unix name": ("student\nAda Lovelace\n", "line 2: 'Ada Lovelace' is not a valid Unix user name"),
    "an attack": ("student\n../../root\n", "is not a valid Unix user name"),
    "the instructors' group": ("student\nstaff\n", "line 2: 'staff' is what the instructors' group is called"),
    "the instructors' address": ("student\ninstructors\n", "line 2: 'instructors' is in the address at which"),
    "too long": (f"student\n{'a' * 25}\n", "longer than 24 letters"),
    "an empty line": ("student,role\nada,\n,\n", "line 3: '' is not a valid Unix user name"),
    "no column": ("name\nada\n", "no column 'student'"),
    "an unknown role": ("student,role\nada,boss\n", "the role 'boss' is neither"),
    "nobody": ("student\n", "contains no students"),
    "no instructor": ("student\nada\n", "there is no instructor"),
}


@pytest.mark.parametrize(("text", "said"), WRONG.values(), ids=WRONG)
def test_a_wrong_roster(tmp_path, text, said):
    path = tmp_path / "roster.csv"
    path.write_text(text)
    with pytest.raises(UsageError, match=".") as problem:
        members.read(path, [])
    assert said in str(problem.value) and "\n" not in str(problem.value)


def test_a_roster_may_leave_the_instructor_to_the_command(tmp_path):
    path = tmp_path / "roster.csv"
    path.write_text("student\nada\n")
    assert members.read(path, ["teacher"]) == [members.Member("ada"), members.Member("teacher", True)]


@pytest.fixture
def arguments(able, tmp_path):
    path = tmp_path / "roster.csv"
    path.write_text(ROSTER)
    common = ["up", "--roster", str(path), "--folder", str(tmp_path / "class"), "--port", str(free_port())]
    return [*common, "--passwords", "dummy", "--prefix", "never-"]


def test_a_dry_run_says_what_it_would_do_and_does_nothing(arguments, tmp_path):
    done = run_classroom(*arguments, "--dry-run")
    assert done.returncode == 0, done.stderr
    assert "Would make 3 Unix users: never-ada, never-bob, never-teacher." in done.stdout
    assert all(line.startswith("Would ") for line in done.stdout.splitlines())
    assert not (tmp_path / "class").exists()
    assert not [user for user in pwd.getpwall() if user.pw_name.startswith("never-")]


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--certificate", "/nowhere.pem", "--key", "/nowhere.key"], "there is no file /nowhere.pem"),
        (["--certificate", "/nowhere.pem"], "give --certificate and --key, or neither"),
        (["--passwords", "none"], "it must be pam or dummy"),
        (["--host", "", "--ip", "instructors.localhost"], "names that end in .localhost are for --host"),
        (["--roster", "/nowhere.csv"], "/nowhere.csv cannot be read"),
    ],
)
def test_a_wrong_option(arguments, tmp_path, more, said):
    done = call_classroom(*arguments, *more)
    assert done.returncode == 2 and said in done.stderr
    assert len(done.stderr.splitlines()) == 1 and not (tmp_path / "class").exists()


def test_a_port_that_is_in_use(arguments, tmp_path):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        done = call_classroom(*arguments, "--port", str(port))
    assert done.returncode == 2 and f"port {port} is in use" in done.stderr
    assert not (tmp_path / "class").exists()


def path_without(folder: Path, *names: str) -> dict[str, str]:
    """An environment whose PATH has the system's programs but these."""
    folder.mkdir()
    for system in ("/usr/sbin", "/usr/bin"):
        for program in Path(system).iterdir():
            link = folder / program.name
            if program.name not in names and not link.exists():
                link.symlink_to(program)
    return os.environ | {"PATH": str(folder)}


def test_without_a_tool(arguments, tmp_path):
    run = [COMMAND, *arguments]
    variables = path_without(tmp_path / "bin", "bwrap", "useradd")
    done = subprocess.run(run, capture_output=True, text=True, env=variables, timeout=60)
    assert done.returncode == 2 and "bwrap is not installed (package bubblewrap)" in done.stderr
    assert "useradd is not installed (package passwd)" in done.stderr and not (tmp_path / "class").exists()


def test_the_systems_nodejs_is_not_needed(arguments, tmp_path):
    run = [COMMAND, *arguments, "--dry-run"]
    variables = path_without(tmp_path / "bin", "node", "npm")
    done = subprocess.run(run, capture_output=True, text=True, env=variables, timeout=60)
    assert done.returncode == 0, done.stderr


def test_without_the_nodejs_that_is_installed_with_the_course(able, tmp_path, monkeypatch):
    monkeypatch.setattr(hub, "node", lambda: tmp_path / "node")
    assert hub.missing_tools() == ["Node.js is not installed: run environment/install classroom"]


def test_a_user_of_somebody_else_is_not_taken(arguments):
    done = call_classroom(*arguments, "--prefix", "d", "--instructor", "aemon")  # daemon, which every system has
    assert done.returncode == 2
    assert "the Unix user daemon exists, but not from this class" in done.stderr


def test_without_root(able):
    command = ["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups", sys.executable, "-m"]
    done = subprocess.run([*command, "autograder.classroom.cli", "status"], capture_output=True, text=True, timeout=60)
    if "Permission denied" in done.stderr or "No module named 'autograder'" in done.stderr:
        pytest.skip("the checkout can be read by root alone")
    assert done.returncode == 2 and "run this command as root" in done.stderr


def test_status_of_a_class_that_is_down_says_so(quiet, capsys):
    with pytest.raises(typer.Exit) as ended:
        cli.status(quiet.folder)
    assert ended.value.exit_code == 1
    said = capsys.readouterr().out
    assert f"The hub does not run; `environment/classroom up --folder {quiet.folder}` starts it." in said
    assert f"The class is down: it has no Unix users. Its files are in {quiet.folder}." in said


def test_status_and_down_where_there_is_no_classroom(able, tmp_path):
    for command in ("status", "down"):
        done = call_classroom(command, "--folder", str(tmp_path))
        assert done.returncode == 2 and f"there is no class in {tmp_path}" in done.stderr
