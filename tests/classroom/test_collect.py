"""Nothing that a member of a class can put into the exchange stops another hand-in from being collected."""

import contextlib
import ctypes
import os
import pwd
import resource
import struct
import subprocess
from datetime import UTC, datetime, timedelta
from types import SimpleNamespace

import pytest
from nbgrader.auth import Authenticator
from nbgrader.coursedir import CourseDirectory
from nbgrader.exchange import ExchangeFactory
from traitlets.config import Config

from autograder.classroom import box, course_files
from autograder.classroom.plan import Classroom, Member
from autograder.errors import UsageError
from autograder.gradebook import ends, exchange_collect, extensions, members
from autograder.gradebook.config import apply
from autograder.gradebook.exchange_collect import MOST_ENTRIES, OwnersCollect, RegularCollect
from autograder.gradebook.exchange_list import RegularList
from autograder.sandbox.confine import CAPABILITIES_V3
from course.environment import prepare
from course.foundation.waiting import wait_until
from course.submitting import WholeSubmit

ADA, EVE, BOB, GONE = 61001, 61002, 61003, 61009  # users that this machine does not have
READ_CLOSED = 1 << 1 | 1 << 2  # CAP_DAC_OVERRIDE, CAP_DAC_READ_SEARCH
TIME = "2026-01-0{} 10:00:00.000000 UTC"


@pytest.fixture
def inbound(tmp_path, monkeypatch):
    if os.geteuid() != 0:
        pytest.skip("hand-ins of several users take root")
    folder = tmp_path / "exchange" / "ros2" / "inbound"
    folder.mkdir(parents=True)
    of = pwd.getpwuid

    def known(number: int):
        return of(number) if number in (0, GONE) else SimpleNamespace(pw_name=f"user-{number}")

    monkeypatch.setattr(pwd, "getpwuid", known)
    yield folder
    subprocess.run(["rm", "-rf", folder], check=True)  # pytest's own way does not go deep enough


@pytest.fixture
def collect(tmp_path, inbound):
    """Collects, and returns what came of whom, as text by path; and what was said."""

    def run():
        prepare()
        config = Config()
        config.Exchange.root = str(tmp_path / "exchange")
        config.CourseDirectory.course_id, config.CourseDirectory.assignment_id = "ros2", "calculator"
        config.CourseDirectory.root = str(tmp_path / "course")
        (tmp_path / "course").mkdir(exist_ok=True)
        own = CourseDirectory(config=config)
        collecting = OwnersCollect(coursedir=own, authenticator=Authenticator(config=config), config=config)
        collecting.start()
        submitted = tmp_path / "course" / "submitted"
        return {
            str(path.relative_to(submitted)).replace("/calculator/", ": "): path.read_bytes()
            for path in submitted.rglob("*")
            if path.is_file() and path.name not in (exchange_collect.TIMESTAMP, exchange_collect.SECRETS)
        }

    return run


def hand_in(inbound, uid, name, **files):
    folder = inbound / name
    folder.mkdir()
    for file, text in files.items():
        (folder / f"{file}.py").write_text(text)
        os.chown(folder / f"{file}.py", uid, uid)
    os.chown(folder, uid, uid)
    return folder


def test_links_and_pipes_in_place_of_a_folder_and_times_that_are_none(inbound, collect, tmp_path):
    secret = tmp_path / "secret"
    secret.mkdir()
    (secret / "a.py").write_text("root's")
    hand_in(inbound, ADA, f"ada+calculator+{TIME.format(1)}+x", a="ada's")
    (inbound / f"eve+calculator+{TIME.format(2)}+gone").symlink_to("nowhere")
    (inbound / f"eve+calculator+{TIME.format(2)}+link").symlink_to(secret)
    os.mkfifo(inbound / f"eve+calculator+{TIME.format(2)}+pipe")
    for time in ("9999-12-31 23:59:59 -12:00", "99999999999999999999", "", "\udcff", "never\nFAILED"):
        hand_in(inbound, EVE, f"eve\n+calculator+{time}+x", b="eve's")
    found = collect()
    assert found[f"user-{ADA}: a.py"] == b"ada's"
    assert {name for name in found if str(EVE) in name} == {f"user-{EVE}: b.py"} and b"root's" not in found.values()


@pytest.mark.parametrize("name", [exchange_collect.TIMESTAMP, exchange_collect.SECRETS])
def test_a_folder_under_the_name_of_a_file_of_nbgraders(inbound, collect, tmp_path, name):
    folder = hand_in(inbound, EVE, f"eve+calculator+{TIME.format(1)}+x", a="eve's")
    (folder / name).mkdir()
    (folder / name / "b.py").write_text("eve's")
    assert collect() == {f"user-{EVE}: a.py": b"eve's"}
    assert (tmp_path / "course/submitted" / f"user-{EVE}" / "calculator" / name).is_file()


def test_the_last_hand_in_counts_whatever_lies_between(inbound, collect, monkeypatch):
    for day in (1, 3, 2):
        hand_in(inbound, ADA, f"ada+calculator+{TIME.format(day)}+x{day}", a=f"day {day}")
        hand_in(inbound, EVE, f"eve+calculator+{TIME.format(day)}+x{day}", a=f"day {day}")
    names = [f"{who}+calculator+{TIME.format(day)}+x{day}" for day in (1, 3, 2) for who in ("ada", "eve")]
    monkeypatch.setattr("glob.glob", lambda _: [str(inbound / name) for name in names])
    assert collect() == {f"user-{ADA}: a.py": b"day 3", f"user-{EVE}: a.py": b"day 3"}


def test_configuration_in_a_hand_in_is_left_out(inbound, collect, caplog):
    """nbgrader, given in that folder, would run it as the instructor."""
    folder = hand_in(inbound, EVE, f"eve+calculator+{TIME.format(1)}+x", a="eve's")
    (folder / "nbgrader_config.py").write_text("raise SystemExit")
    (folder / "jupyter_nbconvert_config.json").write_text("{}")
    assert collect() == {f"user-{EVE}: a.py": b"eve's"}


def test_hard_links_pipes_and_huge_files_in_a_folder(inbound, collect, tmp_path):
    secret = tmp_path / "secret"
    secret.write_text("root's")
    folder = hand_in(inbound, EVE, f"eve+calculator+{TIME.format(1)}+x", a="eve's")
    os.link(secret, folder / "hard.py")
    (folder / "soft.py").symlink_to(secret)
    os.mkfifo(folder / "pipe.py")
    with open(folder / "huge.py", "wb") as huge:
        huge.truncate(1 << 40)
    (folder / "line\nbreak.py").write_text("eve's")
    assert collect() == {f"user-{EVE}: a.py": b"eve's", f"user-{EVE}: line\nbreak.py": b"eve's"}


@pytest.mark.matrix  # thousands of files and folders take long to make; the other tests have the other bounds
def test_folders_too_deep_and_files_too_many(inbound, collect):
    hand_in(inbound, ADA, f"ada+calculator+{TIME.format(1)}+x", a="ada's")
    deep = hand_in(inbound, EVE, f"eve+calculator+{TIME.format(1)}+x", a="eve's")
    many = hand_in(inbound, EVE + 1, f"mallory+calculator+{TIME.format(1)}+x", a="mallory's")
    (many / "b").mkdir()
    for number in range(MOST_ENTRIES + 1):
        (many / "b" / f"{number}").touch()
    here = os.open(".", os.O_RDONLY)
    try:
        os.chdir(deep)
        for _ in range(min(1500, resource.getrlimit(resource.RLIMIT_NOFILE)[0] * 2)):
            os.mkdir("d")
            os.chdir("d")
    finally:
        os.fchdir(here)
        os.close(here)
    assert collect() == {
        f"user-{who}: a.py": f"{name}'s".encode() for who, name in ((ADA, "ada"), (EVE, "eve"), (EVE + 1, "mallory"))
    }


def test_who_has_left_the_class_is_named_and_not_graded_under_a_number(inbound, collect, caplog):
    hand_in(inbound, ADA, f"ada+calculator+{TIME.format(1)}+x", a="ada's")
    hand_in(inbound, GONE, f"gone+calculator+{TIME.format(2)}+x", a="left")
    hand_in(inbound, GONE, f"ada+calculator+{TIME.format(3)}+x", a="forged")
    assert collect() == {f"user-{ADA}: a.py": b"ada's"}
    left = [line for line in caplog.messages if "its owner is no longer in the class" in line]
    assert len(left) >= 2 and {line.partition("inbound/")[2].partition("+")[0] for line in left} == {"gone", "ada"}


def test_who_came_after_the_instructors_server_was_started_is_collected(inbound, collect, tmp_path):
    """Its users are those of its start; the members of now are in the course folder."""
    (tmp_path / "course").mkdir()
    members.write(tmp_path / "course", {ADA: "ada", GONE: "zoe"})
    hand_in(inbound, ADA, f"ada+calculator+{TIME.format(1)}+x", a="ada's")
    hand_in(inbound, GONE, f"zoe+calculator+{TIME.format(2)}+x", a="zoe's")
    hand_in(inbound, EVE, f"eve+calculator+{TIME.format(2)}+x", a="left")
    assert collect() == {"ada: a.py": b"ada's", "zoe: a.py": b"zoe's"}


@pytest.mark.matrix  # the next one counts lines in the same way
def test_a_student_with_thousands_of_folders_does_not_hide_the_other_lines(inbound, collect, caplog):
    for number in range(100):
        hand_in(inbound, EVE, f"eve+calculator+{TIME.format(1)}+{number}").rmdir()
        (inbound / f"eve+calculator+{TIME.format(1)}+{number}").symlink_to("nowhere")
        os.lchown(inbound / f"eve+calculator+{TIME.format(1)}+{number}", EVE, EVE)
    hand_in(inbound, ADA, f"ada+calculator+{TIME.format(1)}+x", a="ada's")
    assert collect() == {f"user-{ADA}: a.py": b"ada's"}
    assert sum("was left out" in line for line in caplog.messages) == exchange_collect.MOST_TOLD
    assert f"user-{EVE}: 80 more were left out" in caplog.text


def test_folders_with_the_names_of_others_do_not_hide_the_other_lines(inbound, collect, caplog):
    for number in range(100):
        hand_in(inbound, EVE, f"ada+calculator+{TIME.format(1)}+{number}", a="eve's")
    assert collect() == {f"user-{EVE}: a.py": b"eve's"}
    assert sum("and is collected as theirs" in line for line in caplog.messages) == exchange_collect.MOST_TOLD
    assert f"user-{EVE}: 80 more belong to them, and are collected as theirs" in caplog.text


@pytest.mark.parametrize("name", ["ends.json", "extensions.json", "members.json"])
def test_a_pipe_in_the_course_folder_is_not_waited_for(collect, tmp_path, name):
    """Somebody may have left one there who was an instructor."""
    (tmp_path / "course").mkdir()
    os.mkfifo(tmp_path / "course" / name)
    with pytest.raises(UsageError, match="not an ordinary file"):
        {"ends.json": ends, "extensions.json": extensions, "members.json": members}[name].read(tmp_path / "course")


@pytest.mark.parametrize("files", [ends, extensions, members])
def test_a_file_that_is_nested_too_deeply_is_named(tmp_path, files):
    (tmp_path / files.FILE).write_text("[" * 100_000)
    with pytest.raises(UsageError, match=f"{files.FILE} cannot be read: it is nested too deeply"):
        files.read(tmp_path)


@pytest.mark.parametrize("left", ["pipe", "huge"])
def test_what_is_no_secret_of_nbgraders_names_no_page(tmp_path, left):
    """Somebody may have left it there who was an instructor; the hub reads it, without a limit of memory."""
    secret = tmp_path / "submission_secret.txt"
    if left == "pipe":
        os.mkfifo(secret)
    else:
        (tmp_path / "sparse").touch()
        os.truncate(tmp_path / "sparse", 1 << 40)
        secret.symlink_to("sparse")
    assert course_files.page_key(tmp_path, "services") == ""


@contextlib.contextmanager
def reading_as_anybody():
    """Without the rights by which root reads what is closed (capabilities(7)), as an instructor in a box."""
    libc, header = ctypes.CDLL(None), struct.pack("Ii", CAPABILITIES_V3, 0)
    before = ctypes.create_string_buffer(24)
    assert libc.capget(header, before) == 0
    effective, *others = struct.unpack("6I", before.raw)
    assert libc.capset(header, struct.pack("6I", effective & ~READ_CLOSED, *others)) == 0
    try:
        yield
    finally:
        assert libc.capset(header, before.raw) == 0


def test_a_folder_that_its_owner_has_closed_is_left_out(inbound, collect, caplog):
    hand_in(inbound, EVE, f"eve+calculator+{TIME.format(1)}+x", b="eve's").chmod(0)
    hand_in(inbound, ADA, f"ada+calculator+{TIME.format(2)}+x", a="ada's")
    with reading_as_anybody():
        found = collect()
    assert found == {f"user-{ADA}: a.py": b"ada's"}
    assert "no permission to read it" in caplog.text


def test_after_the_end_nothing_is_collected_but_of_who_has_an_extension(inbound, collect, tmp_path, caplog):
    """The newest before the end counts; a time that is none, or a folder that was changed since, is no way around."""
    course = tmp_path / "course"
    course.mkdir()
    (course / "ends.json").write_text('{"calculator": "2026-01-02T12:00:00+02:00"}')
    (course / "extensions.json").write_text(f'{{"user-{BOB}": {{"calculator": 1}}}}')
    for uid in (ADA, BOB):
        for day in (1, 3):
            hand_in(inbound, uid, f"{uid}+calculator+{TIME.format(day)}+x", a=f"day {day}")
    hand_in(inbound, EVE, f"eve+calculator+{TIME.format(3)}+x", a="late")
    hand_in(inbound, EVE, "eve+calculator+never+x", a="late")
    assert collect() == {f"user-{ADA}: a.py": b"day 1", f"user-{BOB}: a.py": b"day 3"}
    left = [line.partition(" was left out: ")[2] for line in caplog.messages if " was left out: " in line]
    ended = "the exercise ended at 2026-01-02 10:00 UTC, and"
    assert left.count(f"{ended} user-{ADA} handed in at 2026-01-03 10:00 UTC") == 1
    assert left.count(f"{ended} user-{EVE} handed in at 2026-01-03 10:00 UTC") == 1
    assert len(left) == 3 and sum(f"{ended} user-{EVE} handed in at" in line for line in left) == 2
    (changed,) = (line for line in caplog.messages if f"{ADA}+calculator+{TIME.format(1)}" in line and "says" in line)
    assert "was last changed at" in changed and changed.endswith(", after the end")


def test_a_file_that_was_written_into_after_its_hand_in_is_told(inbound, collect, caplog, monkeypatch):
    """Writing into a file changes neither the folder nor a time that its owner cannot set back."""
    monkeypatch.setattr(exchange_collect, "SLOW", timedelta(0))
    claimed = datetime.now(UTC) + timedelta(seconds=1)
    folders = [
        hand_in(inbound, uid, f"{uid}+calculator+{claimed:%Y-%m-%d %H:%M:%S.%f} UTC+x", a="early") for uid in (ADA, EVE)
    ]
    # The times of files come from a clock that ticks some hundred times a second.
    later = claimed + timedelta(seconds=0.1)
    assert wait_until(lambda: datetime.now(UTC) > later, 5.0)
    with open(folders[1] / "a.py", "r+") as file:
        file.write("later")
    collect()
    (told,) = (line for line in caplog.messages if "was last changed at" in line)
    assert str(EVE) in told


def test_a_file_that_is_written_into_while_it_is_read_is_told(inbound, collect, caplog, monkeypatch):
    """Its time is that of what was copied, and not that of when it was opened."""
    monkeypatch.setattr(exchange_collect, "SLOW", timedelta(0))
    claimed = datetime.now(UTC) + timedelta(seconds=1)
    name = f"{EVE}+calculator+{claimed:%Y-%m-%d %H:%M:%S.%f} UTC+x"
    big = hand_in(inbound, EVE, name, a="early") / "a.py"
    look = os.fstat

    def look_and_be_late(descriptor):
        known = look(descriptor)
        if os.path.samestat(known, big.stat()):
            assert wait_until(lambda: datetime.now(UTC) > claimed + timedelta(seconds=0.1), 5.0)
            big.write_text("later")
        return known

    monkeypatch.setattr(exchange_collect.os, "fstat", look_and_be_late)
    assert b"later" in collect().values()
    (told,) = (line for line in caplog.messages if "was last changed at" in line)
    assert str(EVE) in told


@pytest.mark.parametrize("secret", [False, True])
def test_a_list_reads_regular_files_alone_and_names_the_others(inbound, tmp_path, caplog, secret):
    hand_in(inbound, ADA, f"ada+calculator+{TIME.format(1)}+x", a="ada's").joinpath("calculator.ipynb").write_text("{}")
    folder = hand_in(inbound, EVE, f"eve+calculator+{TIME.format(1)}+x")
    (folder / "calculator.ipynb").write_text("{}")
    os.mkfifo(folder / "pipe.ipynb")
    (folder / "folder.ipynb").mkdir()
    (folder / "link.ipynb").symlink_to("/etc/shadow")
    if secret:
        (folder / exchange_collect.SECRETS).write_text("s" * 32)
    (inbound / f"eve+calculator+{TIME.format(2)}+x").symlink_to(tmp_path)
    (folder / "\udcff.ipynb").write_text("{}")
    hand_in(inbound, EVE, "eve+calculator+\x1b[2J+x", b="eve's")
    if not secret:
        (folder / exchange_collect.SECRETS).write_bytes(b"\xff")
    closed = hand_in(inbound, BOB, f"bob+calculator+{TIME.format(1)}+x")
    (closed / "calculator.ipynb").write_text("{}")
    (closed / "calculator.ipynb").chmod(0)
    config = Config()
    config.Exchange.root = str(tmp_path / "exchange")
    config.CourseDirectory.course_id, config.CourseDirectory.assignment_id = "ros2", "calculator"
    own = CourseDirectory(config=config)
    listing = RegularList(coursedir=own, authenticator=Authenticator(config=config), config=config, inbound=True)
    with reading_as_anybody():
        found = {student["student_id"]: student["submissions"] for student in listing.start()}
    assert {name: [n["notebook_id"] for each in of for n in each["notebooks"]] for name, of in found.items()} == {
        "ada": ["calculator"],
        "eve": ["calculator"],
        "bob": [],
    }
    assert found["eve"][0]["notebooks"][0]["path"] == str(folder / "calculator.ipynb")
    told = [record.getMessage() for record in caplog.records if "cannot be read" in record.getMessage()]
    assert sorted(line.partition("+")[0].rpartition("/")[2] for line in told) == [
        "bob",
        *["eve"] * (4 if secret else 5),
    ]
    assert "\x1b" not in caplog.text and f"No notebooks found in {closed}" in caplog.text


@pytest.mark.parametrize("staff", [False, True])
def test_a_members_nbgrader_takes_its_classes_from_here(tmp_path, staff):
    said = box._configuration(Classroom(tmp_path, ()), Member("teacher", staff))["nbgrader_config.py"]
    config = Config()
    exec(said, {"get_config": lambda: config})
    chosen = config.ExchangeFactory
    assert (chosen.get("collect"), chosen.get("list")) == ((OwnersCollect, RegularList) if staff else (None, None))
    assert type(ExchangeFactory(config=config).Submit(config=config)) is WholeSubmit
    apply(config)  # as the course folder's own file does, and that comes first
    chosen = ExchangeFactory(config=config).Collect(config=config)
    assert isinstance(chosen, RegularCollect) and chosen.by_owner == staff
