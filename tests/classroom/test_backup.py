"""A class is written to a file and laid out again, also where others have its numbers; nothing half done is left."""

import contextlib
import csv
import json
import os
import pwd
import secrets
import shutil
import socket
import stat
import subprocess
import sys
import tarfile
import threading

import pytest

from autograder.classroom import accounts, backup
from autograder.classroom.plan import SETTINGS, Classroom
from autograder.errors import ClassroomError, UsageError
from tests.classroom.conftest import ROSTER, call_classroom, run_classroom
from tests.classroom.test_homes import TURN
from tests.classroom.visitor import Visitor
from tests.ports import free_port

TRIES = 20  # backups of a class in which a process changes paths


@pytest.fixture
def somebody():
    """Make a Unix user with a number, as another machine may have one."""
    made = []

    def make(number: int) -> None:
        made.append(f"q{secrets.token_hex(3)}")
        subprocess.run(["useradd", "--uid", str(number), "--no-create-home", made[-1]], check=True)

    yield make
    for name in made:
        subprocess.run(["userdel", name], check=True)


@pytest.mark.matrix  # a class of its own, twice; the tests below restore what a backup holds
@pytest.mark.long("two classes are started")
@pytest.mark.drives("it starts two hubs of its own")
def test_a_class_moves_with_everybodys_work_and_password(able, tmp_path, somebody):
    """To a machine that has given ada's number to somebody else, without a roster, with another prefix of the users."""
    for around in tmp_path.parents:
        if around.stat().st_mode & 0o005 != 0o005 and around.is_relative_to("/tmp"):
            around.chmod(around.stat().st_mode | 0o011)
    tmp_path.chmod(0o711)
    (tmp_path / "roster.csv").write_text(ROSTER)
    old, new, kept = tmp_path / "old", tmp_path / "new", tmp_path / "class.tar.gz"
    port, prefixes = ["--port", str(free_port())], [f"b{secrets.token_hex(2)}-" for _ in range(2)]
    try:
        done = run_classroom(
            "up", "--folder", str(old), "--roster", str(tmp_path / "roster.csv"), *port, "--prefix", prefixes[0]
        )
        assert done.returncode == 0, done.stderr
        there = Classroom.load(old)
        uid, gid = accounts.ids(there, there.find("ada"))
        work = old / "homes" / "ada" / "work.py"
        work.write_text("mine")
        os.chown(work, uid, gid)
        (old / "homes" / "zoe").mkdir()  # of somebody who has left the class
        os.chown(old / "homes" / "zoe", 4321, 4321)
        refused = run_classroom("backup", str(kept), "--folder", str(old))
        assert (refused.returncode, kept.exists()) == (2, False)
        assert "the class is up: run `down` first" in refused.stderr
        refused = run_classroom("up", "--folder", str(old), "--dry-run", *port, "--prefix", prefixes[1])
        assert (
            refused.returncode == 2
            and f"the prefix of this class is {prefixes[0]}: run `down` before you change it" in refused.stderr
        )
        assert run_classroom("down", "--folder", str(old)).returncode == 0
        written = run_classroom("backup", str(kept), "--folder", str(old))
        assert written.returncode == 0 and "3 members" in written.stdout, written.stderr
        assert stat.S_IMODE(kept.stat().st_mode) == 0o600
        shutil.rmtree(old)
        somebody(uid)

        done = run_classroom("restore", str(kept), "--folder", str(new))
        assert done.returncode == 0 and f"up --folder {new}" in done.stdout, done.stderr
        assert (new / "homes" / "zoe").stat().st_uid == 0, "somebody here may have the number of who has left"
        done = run_classroom("up", "--folder", str(new), *port, "--prefix", prefixes[1])
        assert done.returncode == 0 and "Kept the passwords that 3 members had" in done.stdout, done.stderr
        moved = Classroom.load(new)
        mine = moved.home(moved.find("ada")) / "work.py"
        assert mine.read_text() == "mine" and mine.stat().st_uid == accounts.ids(moved, moved.find("ada"))[0] != uid
        with open(moved.state / accounts.PASSWORDS, newline="") as file:
            passwords = {line["student"]: line["password"] for line in csv.DictReader(file)}
        assert Visitor(moved.url, "ada").log_in(passwords["ada"])
    finally:
        for folder in (old, new):
            if folder.exists():
                run_classroom("down", "--folder", str(folder), "--delete-homes")
    assert not [user for user in pwd.getpwall() if user.pw_name.startswith(tuple(prefixes))]


def test_what_students_have_made_of_their_homes_comes_back_as_it_was(quiet, tmp_path):
    home = quiet.homes / "ada"
    home.mkdir(parents=True)
    (home / "link").symlink_to("/etc/shadow")
    (home / "-rf\n*").write_text("odd")
    os.mkfifo(home / "pipe")
    with open(home / "sparse", "wb") as file:
        file.truncate(1 << 33)
    os.chown(home, 4321, 4321)
    (quiet.state / "proxy.pid").write_text("1")
    (home / "folder").symlink_to("/etc")
    with open(home / "holes", "wb") as file:  # as a database has them: more parts than fit in a header
        for number in range(60):
            file.seek(number << 20)
            file.write(b"data")
    (home / ("n" * 200)).write_bytes(b"long")
    os.link(home / "holes", home / "twice")
    socket.socket(socket.AF_UNIX).bind(str(home / "socket"))
    (home / "holes").chmod(0o640)
    size, too_deep = backup.write(quiet, tmp_path / "class.tar.gz")
    assert too_deep == []
    assert size == (tmp_path / "class.tar.gz").stat().st_size < 1 << 20
    back = backup.read(tmp_path / "class.tar.gz", tmp_path / "back")
    assert back == Classroom.load(tmp_path / "back") and back.members == quiet.members
    again = back.homes / "ada"
    assert {path.name for path in again.iterdir()} == {path.name for path in home.iterdir()} - {"socket"}
    assert (again / "holes").read_bytes() == (home / "holes").read_bytes() and (again / "twice").samefile(
        again / "holes"
    )
    assert stat.S_IMODE((again / "holes").stat().st_mode) == 0o640 and (again / "holes").stat().st_blocks < 2000
    assert int((again / "holes").stat().st_mtime) == int((home / "holes").stat().st_mtime)
    assert stat.S_ISFIFO((again / "pipe").stat().st_mode) and (again / ("n" * 200)).read_bytes() == b"long"
    assert os.readlink(again / "link") == "/etc/shadow" and (again / "-rf\n*").read_text() == "odd"
    assert (again / "sparse").stat().st_blocks < 100 and again.stat().st_uid == 4321
    assert stat.S_IMODE(back.folder.stat().st_mode) == 0o700, "nobody is in the class yet"
    assert not (back.state / "proxy.pid").exists(), "a process of the other machine"


def test_paths_that_turn_while_a_backup_is_written_lead_it_nowhere(quiet, tmp_path):
    """A process that is left over from the class changes a folder, and a file, for links to what is another's."""
    home, elsewhere = quiet.homes / "ada", tmp_path / "elsewhere"
    home.mkdir(parents=True)
    (home / "own").mkdir()
    (home / "file").write_text("mine")
    elsewhere.mkdir()
    for number in range(30):
        (elsewhere / f"{number}.py").write_text("root's secret")
        (home / "own" / f"{number}.py").write_text("mine")
    (home / "away").symlink_to(elsewhere)
    (home / "other").symlink_to(elsewhere / "0.py")
    with contextlib.ExitStack() as stack:
        for pair in (("own", "away"), ("file", "other")):
            turning = stack.enter_context(
                subprocess.Popen([sys.executable, "-c", TURN, *(home / name for name in pair)], stdout=subprocess.PIPE)
            )
            stack.callback(turning.kill)
            assert turning.stdout.readline() == b"turned\n"
            threading.Thread(target=lambda pipe=turning.stdout: [*pipe]).start()
        for number in range(TRIES):
            kept = tmp_path / f"{number}.tar.gz"
            backup.write(quiet, kept)
            with tarfile.open(kept) as archive:
                for each in archive:
                    if each.isreg() and each.name.startswith("./homes/"):
                        assert archive.extractfile(each).read() == b"mine", each.name


def test_a_folder_that_goes_too_deep_is_told_and_everything_else_comes_back(quiet, tmp_path):
    home = quiet.homes / "ada"
    home.mkdir(parents=True)
    (home / "work").write_text("mine")
    script = "import os\nfor _ in range(300):\n    os.mkdir('d' * 200)\n    os.chdir('d' * 200)\n"
    subprocess.run([sys.executable, "-c", script], cwd=home, check=True)
    _, too_deep = backup.write(quiet, tmp_path / "class.tar.gz")
    assert len(too_deep) == 1 and too_deep[0].startswith("homes/ada/ddd")
    back = backup.read(tmp_path / "class.tar.gz", tmp_path / "back")
    assert (back.homes / "ada" / "work").read_text() == "mine"


def test_nothing_that_is_there_is_overwritten(quiet, tmp_path):
    kept = tmp_path / "class.tar.gz"
    backup.write(quiet, kept)
    with pytest.raises(UsageError, match="class.tar.gz exists; name another file"):
        backup.write(quiet, kept)
    with pytest.raises(UsageError, match="class exists; name another folder"):
        backup.read(kept, quiet.folder)


@pytest.mark.parametrize(
    ("content", "said"),
    [(b"no archive", "class.tar.gz cannot be unpacked: .*not in gzip format"), (None, "is not a backup of a class")],
)
def test_a_file_that_is_no_backup_leaves_nothing(quiet, tmp_path, content, said):
    kept = tmp_path / "class.tar.gz"
    if content is None:
        with tarfile.open(kept, "w:gz") as archive:
            archive.add(__file__, "essay.txt")
    else:
        kept.write_bytes(content)
    before = sorted(tmp_path.iterdir())
    with pytest.raises((UsageError, ClassroomError), match=said):
        backup.read(kept, tmp_path / "back")
    assert sorted(tmp_path.iterdir()) == before


def test_a_full_disk_leaves_no_half_of_a_backup(quiet, tmp_path):
    small = tmp_path / "small"
    small.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=20k", "tmpfs", small], capture_output=True).returncode:
        pytest.skip("this root may not mount")
    try:
        (quiet.homes / "ada").mkdir(parents=True)
        (quiet.homes / "ada" / "work").write_bytes(os.urandom(1 << 17))
        with pytest.raises(ClassroomError, match="No space left on device"):
            backup.write(quiet, small / "class.tar.gz")
        assert list(small.iterdir()) == []
    finally:
        subprocess.run(["umount", "-l", small], check=True)


def test_the_settings_of_an_older_version_are_taken_up_and_those_of_a_newer_one_are_told(quiet):
    path = quiet.state / SETTINGS
    fields = json.loads(path.read_text())
    path.write_text(json.dumps({key: value for key, value in fields.items() if key not in ("host", "staff_port")}))
    assert Classroom.load(quiet.folder).members == quiet.members
    path.write_text(json.dumps(fields | {"dormitory": 1}))
    with pytest.raises(UsageError, match="is damaged, or was written by a newer version: .*dormitory"):
        Classroom.load(quiet.folder)


def test_without_a_class_up_asks_for_a_roster(able, tmp_path):
    done = call_classroom("up", "--folder", str(tmp_path / "class"))
    assert done.returncode == 2 and "there is no class in" in done.stderr and "give --roster" in done.stderr
