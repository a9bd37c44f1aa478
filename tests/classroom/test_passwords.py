"""Passwords survive `down`, and one person's is set anew on purpose; a proxy that a killed hub left is its own."""

import json
import os
import subprocess
import sys
from pathlib import Path

from autograder.classroom import accounts, hub
from autograder.classroom.plan import Classroom
from tests.classroom.conftest import call_classroom, run_classroom


def hashes(classroom: Classroom) -> dict[str, str]:
    """The members' passwords as the system knows them."""
    lines = (line.split(":")[:2] for line in Path("/etc/shadow").read_text().splitlines())
    return {user.removeprefix(classroom.prefix): word for user, word in lines if user.startswith(classroom.prefix)}


def start(classroom: Classroom) -> list[str]:
    """Make users and passwords as `up` does; the names of those with a new password."""
    new = accounts.make(classroom)
    without = accounts.without_password(classroom, new)
    if without:
        accounts.set_passwords(classroom, without)
    return [member.name for member in without]


def test_passwords_survive_down(quiet):
    classroom = quiet
    assert start(classroom) == ["ada", "bob", "teacher"]
    subprocess.run(["chpasswd"], input=f"{classroom.prefix}bob:chosen by bob\n", text=True, check=True)
    before, written = hashes(classroom), (classroom.state / accounts.PASSWORDS).read_text()
    accounts.remove(classroom)
    assert hashes(classroom) == {}
    assert (classroom.state / accounts.KEPT).stat().st_mode & 0o077 == 0
    assert start(classroom) == []
    assert hashes(classroom) == before
    assert (classroom.state / accounts.PASSWORDS).read_text() == written


def test_whoever_never_had_one_gets_one_after_down(quiet):
    classroom = quiet
    start(classroom)
    accounts.remove(classroom)
    kept = json.loads((classroom.state / accounts.KEPT).read_text())
    del kept["bob"]
    (classroom.state / accounts.KEPT).write_text(json.dumps(kept))
    assert start(classroom) == ["bob"]


def test_one_password_is_set_anew_on_purpose(quiet):
    classroom = quiet
    start(classroom)
    before = hashes(classroom)
    done = run_classroom("password", "ada", "--folder", str(classroom.folder))
    assert done.returncode == 0, done.stderr
    after = hashes(classroom)
    assert {name for name in after if after[name] != before[name]} == {"ada"}
    assert "The new password of ada is in the last line of" in done.stdout
    last = (classroom.state / accounts.PASSWORDS).read_text().splitlines()[-1]
    assert last.startswith("ada,") and last.partition(",")[2] not in done.stdout
    wrong = call_classroom("password", "eve", "--folder", str(classroom.folder))
    assert wrong.returncode == 2 and "eve is not in the class" in wrong.stderr


def test_a_proxy_that_a_killed_hub_left_behind_is_taken_up(quiet, tmp_path):
    """`up` took the port for somebody else's, whom the hub's own proxy was."""
    classroom = quiet
    (tmp_path / "roster.csv").write_text("student,role\nada,\nbob,\nteacher,instructor\n")
    listen = "import socket, sys\ns = socket.create_server(('127.0.0.1', int(sys.argv[1])))\nprint(flush=True)\n"
    command = [sys.executable, "-c", listen + "input()", str(classroom.port)]
    arguments = ["up", "--roster", str(tmp_path / "roster.csv"), "--folder", str(classroom.folder), "--dry-run"]
    arguments += ["--port", str(classroom.port), "--prefix", classroom.prefix]
    for program, code in (("somebody-else", 2), (str(hub.proxy()), 0)):
        with subprocess.Popen([*command, program], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as left:
            assert left.stdout.readline()
            hub.proxy_pid(classroom).write_text(str(left.pid))
            try:
                done = call_classroom(*arguments)
                assert done.returncode == code, done.stderr
                assert hub.left(classroom) is (code == 0)
                if code:
                    assert f"port {classroom.port} is in use" in done.stderr
                else:
                    hub.stop(classroom)
                    assert left.wait(10) == -9 and not hub.proxy_pid(classroom).exists()
            finally:
                if left.poll() is None:
                    os.kill(left.pid, 9)
