"""`down` leaves nothing behind: no process, no network, no user, no mount, no control group.

These tests have a class of their own, because they end it.
"""

import csv
import grp
import os
import pwd
from pathlib import Path

import pytest

from autograder.classroom import accounts, hub, spawner
from autograder.classroom.plan import RUN, Classroom
from tests.classroom.conftest import ROSTER, classroom
from tests.classroom.visitor import Visitor
from tests.ports import free_port

PREFIX = "gone-"


@pytest.fixture(scope="module")
def ended(able, tmp_path_factory):
    """A class that these tests end, and the arguments of its commands."""
    folder = tmp_path_factory.mktemp("ended")
    folder.parent.chmod(folder.parent.stat().st_mode | 0o011)
    folder.chmod(0o711)
    (folder / "roster.csv").write_text(ROSTER)
    common = ["--folder", str(folder / "class")]
    arguments = [*common, "--roster", str(folder / "roster.csv"), "--port", str(free_port()), "--prefix", PREFIX]
    done = classroom("up", *arguments, "--passwords", "dummy")
    try:
        assert done.returncode == 0, done.stderr
        yield Classroom.load(folder / "class"), arguments, common
    finally:
        classroom("down", *common, "--delete-homes")


def come_in(room: Classroom, name: str, password: str) -> Visitor:
    visitor = Visitor(room.url, name)
    assert visitor.log_in(password)
    return visitor.start()


def test_who_leaves_the_class_is_out_and_pam_knows_each_ones_own_password(ended):
    room, arguments, _ = ended
    known = hub.shared_passwords(room)
    come_in(room, "bob", known["students"])
    (room.folder.parent / "roster.csv").write_text(ROSTER.replace("bob,student\n", ""))
    again = classroom("up", *arguments, "--passwords", "pam")
    assert again.returncode == 0, again.stderr
    assert "Ended the server of bob" in again.stdout and not spawner.servers(room)
    with open(room.state / accounts.PASSWORDS, newline="") as file:
        own = {line["student"]: line["password"] for line in csv.DictReader(file)}
    assert own.keys() == {"ada", "teacher"}
    assert not Visitor(room.url, "bob").log_in(known["students"])
    assert not Visitor(room.url, "ada").log_in(own["teacher"])
    for name, password in own.items():
        sleeper = "import subprocess; subprocess.Popen(['setsid', '-f', 'sleep', '1000'])"
        assert come_in(room, name, password).kernel().run(sleeper).error == ""


def traces(room: Classroom, uids: set[int], networks: set[str]) -> list[str]:
    """Everything on this machine that belongs to the class."""
    found = [user.pw_name for user in pwd.getpwall() if user.pw_name.startswith(room.prefix)]
    found += [group.gr_name for group in grp.getgrall() if group.gr_name.startswith(room.prefix)]
    found += [str(path) for path in Path("/sys/fs/cgroup").glob(f"**/ros2-classroom-{room.run.name}-*")]
    found += [str(path) for path in RUN.glob(room.run.name)]
    for process in Path("/proc").glob("[0-9]*"):
        try:
            words = (process / "cmdline").read_bytes().decode(errors="replace")
            variables = (process / "environ").read_bytes().decode(errors="replace")
            if process.stat().st_uid in uids or str(room.folder) in words + variables:
                found.append(f"{process.name} {words[:80]}")
            if os.readlink(process / "ns/net") in networks:
                found.append(f"{process.name} is in a student's network")
            if str(room.folder) in (process / "mountinfo").read_text():
                found.append(f"{process.name} has a folder of the class mounted")
        except OSError:  # it has ended meanwhile
            continue
    return found


def test_down_leaves_nothing(ended):
    room, _, common = ended
    uids = {accounts.ids(room, member)[0] for member in room.members}
    networks = {
        os.readlink(f"/proc/{child}/ns/net")
        for server in spawner.servers(room).values()
        for child in children(server.pid)
    }
    assert len(networks) == 2 and os.readlink("/proc/self/ns/net") not in networks
    assert traces(room, uids, networks), "nothing was found while the class was up"

    dry = classroom("down", *common, "--dry-run")
    assert dry.returncode == 0 and "Would end the hub and 2 servers" in dry.stdout
    assert hub.running(room)

    down = classroom("down", *common)
    assert down.returncode == 0, down.stderr
    assert traces(room, uids, networks) == []
    kept = room.home(room.find("ada"))
    assert (kept / "notebooks" / "index.ipynb").exists() and kept.stat().st_uid in uids


def children(pid: int) -> list[int]:
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
