"""The owner of a home folder redirects what root does there for the class: root's files stay as they are.

`renameat2` with RENAME_EXCHANGE changes a folder and a link for each other at once, in a loop.
"""

import errno
import os
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path, PurePosixPath
from types import SimpleNamespace

import pytest
from nbgrader.api import Gradebook

from autograder.classroom import accounts, cli, course_files, enrolling, homes, hub
from autograder.classroom.members import Member
from autograder.classroom.plan import COURSE_ID, Classroom
from autograder.errors import ClassroomError
from tests.classroom.conftest import run_classroom

# In the student's kernel: `notebooks` and a link to root's folder change places, and what was laid goes away, so that
# it is laid again.
EXCHANGE = """
import contextlib, ctypes, os, shutil, threading
ending, turned = threading.Event(), 0
def turn():
    global turned
    libc, here = ctypes.CDLL(None), -100
    own, away = b"/home/ada/notebooks", b"/home/ada/away"
    while not ending.is_set():
        for _ in range(50):
            libc.renameat2(here, own, here, away, 2)
            turned += 1
        for folder in (own, away):
            if not os.path.islink(folder):
                for name in (b"index.ipynb", b"services", b"actions"):
                    path = os.path.join(folder, name)
                    with contextlib.suppress(OSError):
                        shutil.rmtree(path) if os.path.isdir(path) else os.unlink(path)
    if os.path.islink(own):
        libc.renameat2(here, own, here, away, 2)
    os.unlink(away)
os.symlink({canary!r}, "/home/ada/away")
thread = threading.Thread(target=turn)
thread.start()
"""
STOP = "ending.set(); thread.join(); print(turned > 1000)"


@pytest.fixture
def canary(classroom):
    """A folder of root's on the host, with files of the names that `up` lays, as (owner, mode, content) by path."""
    folder = classroom.folder / "canary"
    folder.mkdir()
    for name in ("index.ipynb", "calculator.txt"):
        (folder / name).write_text("root's")
        (folder / name).chmod(0o644)
    yield folder
    subprocess.run(["rm", "-rf", folder], check=True)


def state(folder: Path) -> dict[str, tuple[int, int, bytes]]:
    found = {}
    for path in [folder, *folder.rglob("*")]:
        known = path.lstat()
        found[str(path)] = (known.st_uid, known.st_mode, path.read_bytes() if path.is_file() else b"")
    return found


@pytest.mark.parametrize("rounds", [3, pytest.param(40, marks=pytest.mark.matrix)])  # as often as `up` would be given
def test_paths_that_turn_while_up_runs_lead_root_nowhere(up, classroom, ada, kernel, canary, rounds, monkeypatch):
    """The hub, which opens no home, is started again in the matrix alone."""
    before = state(canary)
    live = kernel(ada)
    live.run(EXCHANGE.format(canary=str(canary)))
    try:
        if rounds > 3:
            done = run_classroom(*up)
            assert done.returncode == 0, done.stderr
        else:
            for name in ("stop", "start"):
                monkeypatch.setattr(hub, name, lambda _: None)
            cli._up(classroom)
        for _ in range(rounds):
            course_files.hand_out_notebooks(classroom)
            course_files.disk(classroom)
    finally:
        live.connect()  # the proxy is a new one
        assert live.run(STOP).text == "True\n"
    assert state(canary) == before
    course_files.hand_out_notebooks(classroom)
    home, (uid, _) = classroom.home(classroom.find("ada")), accounts.ids(classroom, classroom.find("ada"))
    assert {path.lstat().st_uid for path in home.rglob("*")} == {uid}
    assert (home / "notebooks" / "services" / "services.ipynb").exists()


OWNER, LATER, STAFF = 61001, 61002, 61003  # numbers of users and groups that this machine does not have


@pytest.fixture
def home(able, tmp_path):
    folder = tmp_path / "home"
    folder.mkdir()
    os.chown(folder, OWNER, OWNER)
    return folder


# A folder in a home and a link to a folder elsewhere change places, until nobody reads what is printed.
TURN = """
import ctypes, sys
libc, (own, away) = ctypes.CDLL(None), map(str.encode, sys.argv[1:])
while True:
    for _ in range(1001):
        libc.renameat2(-100, own, -100, away, 2)
    print("turned", flush=True)
"""


@pytest.mark.parametrize(
    "change",
    [lambda home, uid: homes.give(home, uid, uid), lambda home, uid: homes.hand_on(home, lambda _: uid, lambda _: uid)],
    ids=["give", "hand_on"],
)
def test_paths_that_turn_while_a_home_is_given_lead_root_nowhere(home, tmp_path, change):
    """Files elsewhere keep their owner, also those of the owner of the home."""
    elsewhere, own, away = tmp_path / "elsewhere", home / "own", home / "away"
    for folder in (elsewhere, own):
        folder.mkdir()
        for number in range(30):
            (folder / f"{number}.py").touch()
        for path in (folder, *folder.iterdir()):
            os.chown(path, OWNER, OWNER)
    away.symlink_to(elsewhere)
    os.lchown(away, OWNER, OWNER)
    before = state(elsewhere)
    with subprocess.Popen([sys.executable, "-c", TURN, own, away], stdout=subprocess.PIPE, text=True) as turning:
        try:
            for _ in range(10):
                assert turning.stdout.readline() == "turned\n"
                for uid in (OWNER, LATER) * 10:
                    change(home, uid)
                assert state(elsewhere) == before
        finally:
            turning.kill()
    change(home, OWNER)
    change(home, LATER)
    assert {path.lstat().st_uid for path in [home, *home.rglob("*")]} == {LATER}
    assert state(elsewhere) == before


def test_who_acts_in_a_home_has_no_rights_but_its_owners(home):
    look = "CapEff|CapPrm|CapInh|CapAmb|NoNewPrivs|Groups"

    def work(_: int) -> bytes:
        lines = Path("/proc/self/status").read_text().splitlines()
        return repr(
            [os.getresuid(), os.getresgid(), *(line.split()[1:] for line in lines if line.split(":")[0] in look)]
        ).encode()

    said = homes.act(home, OWNER, OWNER, work).decode()
    none = ["0" * 16]
    assert said == repr([(OWNER,) * 3, (OWNER,) * 3, [], none, none, none, none, ["1"]])


def test_who_does_not_end_is_ended(home):
    begin = time.monotonic()
    with pytest.raises(ClassroomError, match="did not end within 0.2 s"):
        homes.act(home, OWNER, OWNER, lambda _: time.sleep(600) or b"", seconds=0.2)
    assert time.monotonic() - begin < 60


def test_what_is_there_is_left_and_links_are_not_followed(home, tmp_path):
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir(0o777)
    elsewhere.chmod(0o777)
    for name, target in (("a", "nowhere"), ("b", elsewhere)):
        (home / name).symlink_to(target)
    (home / "c").write_text("own")
    os.mkfifo(home / "d")
    things = {name: {"": b"new"} for name in ("a", "b/file", "c", "d", "e/f/g")} | {"h": {"i/j": b"new", "k": b"new"}}
    assert homes.lay(home, OWNER, OWNER, things) == ["a", "b/file", "d"]
    assert not list(elsewhere.iterdir()) and not (home / "nowhere").exists()
    assert (home / "c").read_text() == "own"
    for name in ("e/f/g", "h/i/j", "h/k"):
        assert (home / name).read_text() == "new" and (home / name).stat().st_uid == OWNER


def test_a_full_home_is_told_and_hurts_nobody_else(home):
    home.chmod(0o500)
    with pytest.raises(ClassroomError, match="Permission denied"):
        homes.lay(home, OWNER, OWNER, {"a": {"": b""}})


@pytest.mark.parametrize("things", [{"a": {"b": b"new", "c/d": b"new"}}, {"a": {"": b"new"}}], ids=["folder", "file"])
def test_on_a_full_disk_a_thing_is_laid_whole_or_not_at_all(home, monkeypatch, things):
    """Existing files are never written again."""
    write = homes._write

    def full(folder: int, path: PurePosixPath, content: bytes) -> None:
        write(folder, path, content[:1])
        if path.name != "b":
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(homes, "_write", full)
    with pytest.raises(ClassroomError, match="No space left on device"):
        homes.lay(home, OWNER, OWNER, things)
    assert not list(home.iterdir())
    monkeypatch.undo()
    homes.lay(home, OWNER, OWNER, things)
    written = [path for path in home.rglob("*") if path.is_file()]
    assert len(written) == len(things["a"]) and all(path.read_bytes() == b"new" for path in written)


def test_on_a_full_disk_up_ends_no_hub_that_runs(quiet, monkeypatch):
    monkeypatch.setattr(os, "statvfs", lambda _: SimpleNamespace(f_bfree=100, f_frsize=4096))
    monkeypatch.setattr(hub, "stop", lambda _: pytest.fail("it was ended"))
    with pytest.raises(
        ClassroomError, match="is full: 400 KiB are left, .* Nothing was changed: free some space, and give"
    ):
        cli._up(quiet)
    assert {*accounts.missing(quiet)} == {*quiet.members}


def test_a_home_that_was_kept_is_given_without_what_is_elsewhere_too(home, tmp_path):
    outside = tmp_path / "outside"
    outside.write_text("root's")
    others = tmp_path / "others"
    others.write_text("the former owner's")
    os.chown(others, OWNER, OWNER)
    (home / "folder").mkdir()
    (home / "folder" / "file").write_text("")
    for path in (home / "folder", home / "folder" / "file"):
        os.chown(path, OWNER, OWNER)
    (home / "root's").write_text("")
    (home / "link").symlink_to(outside)
    os.link(outside, home / "outside")
    others.chmod(0o4755)
    os.link(others, home / "others")
    os.mkfifo(home / "pipe")
    (home / "own link").symlink_to("/etc/passwd")
    (home / "twice").write_text("mine")
    for name in ("pipe", "own link", "twice"):
        os.lchown(home / name, OWNER, OWNER)
    (home / "twice").chmod(0o6755)
    os.link(home / "twice", home / "folder" / "twice")
    homes.give(home, LATER, LATER)
    assert {(home / name).lstat().st_uid for name in ("pipe", "own link", "twice", "folder/twice")} == {LATER}
    assert {path.stat().st_mode & 0o6000 for path in (home / "twice", others)} == {0}, "as a former owner"
    assert [path.stat().st_uid for path in (home, home / "folder", home / "folder" / "file")] == [LATER] * 3
    assert [path.stat().st_uid for path in (outside, others, home / "root's")] == [0, OWNER, 0]


def test_what_instructors_released_is_read_with_their_rights(able, tmp_path):
    exchange, secret = tmp_path / "exchange", tmp_path / "secret"
    (exchange / "outbound" / "one").mkdir(parents=True)
    exchange.chmod(0o755)
    secret.write_text("root's")
    secret.chmod(0o600)
    (exchange / "outbound" / "one" / "one.ipynb").write_text("{}")
    (exchange / "outbound" / "one" / "linked").symlink_to(secret)
    (exchange / "outbound" / "two").symlink_to(tmp_path)
    os.link(secret, exchange / "outbound" / "one" / "hard")
    os.mkfifo(exchange / "outbound" / "one" / "waits")
    assert homes.read(exchange, "outbound", OWNER, OWNER, []) == {"one/one.ipynb": b"{}"}


def test_the_exchanges_folders_are_roots_and_no_links(classroom, tmp_path):
    course = classroom.exchange / COURSE_ID
    assert course.stat().st_uid == 0 and course.stat().st_mode & 0o022 == 0, "an instructor could change what is in it"
    target = tmp_path / "target"
    target.mkdir(0o700)
    (course / "feedback").rename(course / "kept")
    (course / "feedback").symlink_to(target)
    try:
        with pytest.raises(ClassroomError, match="move it away"):
            course_files.make_shared(classroom)
        assert target.stat().st_mode & 0o777 == 0o700 and target.stat().st_gid == 0
    finally:
        (course / "feedback").unlink()
        (course / "kept").rename(course / "feedback")
        course_files.make_shared(classroom)


def test_a_deep_folder_does_not_keep_a_class_from_being_removed(tmp_path):
    folder = tmp_path / "class"
    script = f"import os\nos.mkdir({str(folder)!r})\nos.chdir({str(folder)!r})\n"
    script += "for _ in range(3000):\n    os.mkdir('d')\n    os.chdir('d')\n"
    subprocess.run([sys.executable, "-c", script], check=True)
    course_files.remove(Classroom(folder, ()))
    assert not folder.exists()


def test_an_instructor_enters_students_in_a_gradebook_that_another_one_made(able, tmp_path):
    """It belongs to whoever was the first in the roster, and may write what the group may."""
    course = tmp_path / "course"
    course.mkdir()
    enrolling.main(course, {"ada": {}}, {"61001": "ada"})
    for path in (course, course / "gradebook.db"):
        os.chown(path, OWNER, STAFF)
    course.chmod(0o2770)
    for folder in course.parents:
        folder.chmod(folder.stat().st_mode | 0o001)

    def enter(_: int) -> bytes:
        enrolling.main(course, {"bob": {}}, {"61002": "bob"})
        return b"entered"

    assert homes.act(course, LATER, STAFF, enter) == b"entered"
    assert (course / "gradebook.db").stat().st_uid == OWNER
    with Gradebook(f"sqlite:///{course / 'gradebook.db'}") as book:
        assert {student.id for student in book.students} == {"ada", "bob"}


def test_an_account_made_while_the_class_was_down_moves_nobody_else(quiet):
    """It has a number of the class now; whose that was gets another one, and keeps what is theirs."""
    accounts.make(quiet)
    course_files.make_shared(quiet)
    course = quiet.exchange / COURSE_ID
    had = {each.name: accounts.ids(quiet, each)[0] for each in quiet.members}
    theirs = {name: course / "inbound" / f"{name}+calculator+x" for name in ("ada", "bob")}
    theirs["teacher"] = course / "outbound/services"
    for name, folder in theirs.items():
        folder.mkdir()
        (folder / "work.py").touch()
        for path in (folder, folder / "work.py"):
            os.chown(path, had[name], -1)
    stranger = f"{quiet.prefix}x"
    try:
        accounts.remove(quiet)
        subprocess.run(["useradd", "-M", "--uid", str(had["ada"]), stranger], check=True)
        course_files.make_folders(quiet)
        accounts.make(quiet)
        course_files.make_shared(quiet)
        now = {each.name: accounts.ids(quiet, each)[0] for each in quiet.members}
        assert now["ada"] not in had.values() and now | {"ada": 0} == had | {"ada": 0}
        for name, folder in theirs.items():
            assert {path.stat().st_uid for path in (folder, folder / "work.py")} == {now[name]}
        assert [path for path in quiet.folder.rglob("*") if path.lstat().st_uid == had["ada"]] == []
    finally:
        accounts.remove(quiet)
        subprocess.run(["userdel", stranger], check=False)


def test_who_is_no_instructor_any_more_owns_nothing_that_is_released(quiet):
    accounts.make(quiet)
    course_files.make_shared(quiet)
    outbound = quiet.exchange / COURSE_ID / "outbound"
    teacher = accounts.ids(quiet, quiet.find("teacher"))[0]
    released = [outbound / "services", outbound / "services/services.ipynb", quiet.grading / "gradebook.db"]
    released[0].mkdir()
    for path in released:
        path.touch()
        os.chown(path, teacher, -1)
    later = replace(quiet, members=(Member("ada"), Member("bob", True), Member("teacher")))
    accounts.make(later)
    course_files.make_shared(later)
    assert {path.stat().st_uid for path in released} == {accounts.ids(later, later.find("bob"))[0]}


def test_what_an_instructor_who_leaves_has_written_as_configuration_is_run_by_nobody(quiet):
    accounts.make(quiet)
    course_files.make_shared(quiet)
    uid, staff = accounts.ids(quiet, quiet.find("teacher"))[0], accounts.staff_id(quiet)
    for name in ("nbgrader_config.py", "jupyter_server_config.json", "nbgrader_config.py.1", "late.txt"):
        (quiet.grading / name).write_text("planted")
        os.chown(quiet.grading / name, uid, staff)
    aside = course_files.set_aside_configuration(quiet)
    assert aside == ["jupyter_server_config.json.1", "nbgrader_config.py.2"]
    there = {path.name for path in quiet.grading.iterdir() if path.is_file()}
    assert there >= {*aside, "nbgrader_config.py.1", "late.txt"} and "nbgrader_config.py" not in there
