"""`nbgrader collect` in a plain exchange: what a student has put there costs nobody else a hand-in."""

import errno
import logging
import os
import pwd
import shutil
import stat
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from nbgrader.apps import NbGraderAPI
from nbgrader.auth import Authenticator
from nbgrader.coursedir import CourseDirectory
from nbgrader.exchange import ExchangeError, ExchangeFactory
from traitlets.config import Config

from autograder.gradebook.config import apply
from autograder.gradebook.exchange_collect import MOST_TOLD, SECRETS, TIMESTAMP
from course.environment import prepare
from course.foundation import storage

TIME = "2026-01-0{} 10:00:00.000000 UTC"
SECRET = "0123456789abcdef"

pytestmark = pytest.mark.timeout(60)  # s; a pipe would be waited for without an end


@pytest.fixture
def inbound(tmp_path):
    folder = tmp_path / "exchange" / "ros2" / "inbound"
    folder.mkdir(parents=True)
    (tmp_path / "course").mkdir()
    return folder


@pytest.fixture
def collect(tmp_path, inbound):
    """Collects as `nbgrader collect` does in a course folder, and returns the texts of the collected files by path."""

    def run(
        *, update: bool = False, formgrader: bool = False, check_owner: bool = True, **options: object
    ) -> dict[str, str]:
        config = configured(tmp_path)
        config.ExchangeCollect.check_owner = check_owner
        for name, value in options.items():
            config.CourseDirectory[name] = value
        own = CourseDirectory(config=config)
        factory = ExchangeFactory(config=config)
        if formgrader:
            assert NbGraderAPI(own, exchange=factory, config=config).collect("calculator", update)["success"]
        else:
            factory.Collect(coursedir=own, config=config, update=update).start()
        submitted = tmp_path / "course" / "submitted"
        return {str(path.relative_to(submitted)): path.read_text() for path in submitted.rglob("*") if path.is_file()}

    return run


def configured(place: Path) -> Config:
    """Return the configuration of a course folder in `place`, with an exchange beside it."""
    prepare()
    config = Config()
    apply(config)
    config.Exchange.root = str(place / "exchange")
    config.CourseDirectory.assignment_id, config.CourseDirectory.root = "calculator", str(place / "course")
    return config


def hand_in(inbound: Path, student: str, day: int = 1, by: str = "", time: str = "") -> Path:
    """Put a hand-in into the exchange as nbgrader does, and give it to the Unix user `by`."""
    time = time or TIME.format(day)
    folder = inbound / f"{student}+calculator+{time}+x{day}{by}"
    folder.mkdir()
    for file, text in (("a.py", f"{by or student}'s"), (TIMESTAMP, time), (SECRETS, SECRET)):
        (folder / file).write_text(text)
    if by:
        shutil.chown(folder, by)
    return folder


def as_collected(student: str, day: int = 1) -> dict[str, str]:
    place = f"{student}/calculator"
    return {f"{place}/a.py": f"{student}'s", f"{place}/{TIMESTAMP}": TIME.format(day), f"{place}/{SECRETS}": SECRET}


def test_a_hand_in_is_its_newest_under_the_name_of_its_student(inbound, collect):
    hand_in(inbound, "ada")
    assert collect() == as_collected("ada")
    hand_in(inbound, "ada", 3)
    hand_in(inbound, "ada", 2)
    hand_in(inbound, "zoe+1")
    assert collect() == as_collected("ada") | as_collected("zoe+1")
    assert collect(update=True) == as_collected("ada", 3) | as_collected("zoe+1")


as_root = pytest.mark.skipif(os.geteuid() != 0, reason="hand-ins of several users take root")


@as_root
@pytest.mark.parametrize("formgrader", [False, True])
@pytest.mark.parametrize("update", [False, True])
def test_a_hand_in_for_somebody_else_is_named_and_replaces_nothing(inbound, collect, caplog, formgrader, update):
    """`games` hands in as `daemon`, before and after daemon does, and as `bin`, who has handed in nothing."""
    if update:
        hand_in(inbound, "daemon", 1, "daemon")
        collect()
    hand_in(inbound, "daemon", 2, "daemon")
    forged = [hand_in(inbound, "daemon", 3, "games"), hand_in(inbound, "bin", 1, "games")]
    hand_in(inbound, "daemon", 4, "games", "9999-01-01 10:00:00.000000 UTC")
    hand_in(inbound, "games", 1, "games")
    assert collect(update=update, formgrader=formgrader) == as_collected("daemon", 2) | as_collected("games")
    for folder, named in zip(forged, ("daemon", "bin"), strict=True):
        said = f"it names {named}, but belongs to games: ask games why. If it is {named}'s work, {named} has to "
        said += "hand it in"
        assert f"{folder} was left out: {said}" in caplog.messages
    assert sum("names daemon, but belongs to games" in line for line in caplog.messages) == 2
    assert "c.ExchangeCollect.check_owner = False" in caplog.text


@as_root
def test_who_collects_and_root_can_hand_in_for_a_student_and_with_check_owner_off_anybody(
    inbound, collect, monkeypatch
):
    games = pwd.getpwnam("games").pw_uid
    hand_in(inbound, "ada", 1, "root")
    hand_in(inbound, "bob", 1, "games")
    hand_in(inbound, "cat", 1, "daemon")
    monkeypatch.setattr(os, "geteuid", lambda: games)
    found = collect()
    assert {path.partition("/")[0] for path in found} == {"ada", "bob"}
    assert {path.partition("/")[0] for path in collect(check_owner=False)} == {"ada", "bob", "cat"}


@as_root
def test_a_hand_in_of_nobody_whom_this_machine_knows_is_named_by_the_number(inbound, collect, caplog):
    os.chown(hand_in(inbound, "ada"), 61009, 61009)
    assert collect() == {}
    assert "it names ada, but belongs to user id 61009: " in caplog.text


@as_root
def test_many_hand_ins_for_others_do_not_hide_what_is_said_of_the_others_own(inbound, collect, caplog):
    for number in range(MOST_TOLD + 5):
        hand_in(inbound, "daemon", 1, "games", f"2026-02-01 10:00:00.{number:06} UTC")
    hand_in(inbound, "daemon", 1, "daemon", "noon")
    os.mkfifo(hand_in(inbound, "daemon", 1, "daemon") / "pipe")
    assert collect() == as_collected("daemon")
    assert sum("belongs to games" in line for line in caplog.messages) == MOST_TOLD
    assert "games: 5 more were left out" in caplog.messages
    assert "noon" in caplog.text and "pipe was left out: it is not" in caplog.text


def test_a_time_that_is_still_to_come_hides_no_later_hand_in(inbound, collect, caplog):
    far = "9999-01-01 10:00:00.000000 UTC"
    hand_in(inbound, "ada", 1, time=far)
    hidden = as_collected("ada") | {f"ada/calculator/{TIMESTAMP}": far}
    assert collect() == collect(update=True) == hidden
    assert sum("which is still to come: a later hand-in counts" in line for line in caplog.messages) == 1
    now = datetime.now(UTC) + timedelta(seconds=30)  # after the folder's last change, on a clock that is not quite ours
    hand_in(inbound, "ada", 2, time=f"{now:%Y-%m-%d %H:%M:%S.%f} UTC")
    found = collect(update=True)
    assert found[f"ada/calculator/{TIMESTAMP}"].startswith(f"{now:%Y-%m-%d %H:%M:%S}")


@as_root
def test_a_list_tells_whose_a_hand_in_is_that_names_somebody_else(inbound, tmp_path, caplog):
    caplog.set_level(logging.INFO)
    for by in ("daemon", "games"):
        (hand_in(inbound, "daemon", 1, by) / "calculator.ipynb").write_text("{}")
    config = configured(tmp_path)
    own = CourseDirectory(config=config)
    ExchangeFactory(config=config).List(
        coursedir=own, authenticator=Authenticator(config=config), config=config, inbound=True
    ).start()
    lines = [line for line in caplog.messages if line.startswith("ros2 daemon calculator")]
    assert sorted(line.partition("(no feedback available)")[2] for line in lines) == ["", ", belongs to games"]


@pytest.mark.parametrize("what", ["a large file", "a pipe", "a link", "no files", "a strange time", "no time"])
def test_what_a_folder_holds_costs_nobody_else(inbound, collect, tmp_path, caplog, what):
    for student in ("ada", "eve", "zoe"):
        folder = hand_in(inbound, student)
        if student != "eve":
            continue
        if what == "a large file":
            (folder / "fill").touch()
            os.truncate(folder / "fill", 120_000_000)
        elif what == "a pipe":
            os.mkfifo(folder / "pipe")
        elif what == "a link":
            (tmp_path / "secret").write_text("the instructor's")
            (folder / "link").symlink_to(tmp_path / "secret")
        elif what == "no files":
            (folder / "a.py").unlink()
        else:
            (folder / TIMESTAMP).unlink()
            if what == "a strange time":
                (folder / TIMESTAMP).write_bytes(b"\xff not a time")
    wanted = as_collected("ada") | as_collected("eve") | as_collected("zoe")
    if what == "no files":
        del wanted["eve/calculator/a.py"]
    for _ in range(2):
        assert collect() == wanted
    told = {"a large file": "fill was left out: the submission is too large", "a pipe": "pipe was left out: it is not"}
    told["a link"] = "link was left out: it is a link"
    assert told.get(what, "") in caplog.text


@pytest.mark.parametrize(
    "name",
    [
        "eve+calculator+2026-13-41 10:00:00.000000 UTC",
        "eve+calculator+x",
        f"eve+calculator+{TIME.format(1)}+a+b+c",
        f"+calculator+{TIME.format(1)}",
        f"\x1b[31m+calculator+{TIME.format(1)}+x",
        f"\udcff+calculator+{TIME.format(1)}+x",
        "a link",
    ],
)
def test_a_name_that_nbgrader_does_not_give_costs_nobody_else(inbound, collect, tmp_path, caplog, name):
    for student in ("ada", "zoe"):
        hand_in(inbound, student)
    if name == "a link":
        (inbound / f"eve+calculator+{TIME.format(1)}+x").symlink_to(tmp_path)
    else:
        (inbound / name).mkdir()
    assert collect() == as_collected("ada") | as_collected("zoe")
    (told,) = (line for line in caplog.messages if "was left out" in line)
    assert "calculator" in told and told.isprintable()
    assert told.endswith(("its name is not one that nbgrader gives, STUDENT+EXERCISE+TIME", "it is not a folder"))


def test_many_such_names_are_counted(inbound, collect, caplog):
    for number in range(MOST_TOLD + 5):
        (inbound / f"eve+calculator+{number} o'clock").mkdir()
    hand_in(inbound, "eve")
    assert collect() == as_collected("eve")
    assert sum("was left out: its name" in line for line in caplog.messages) == MOST_TOLD
    assert "5 more were left out" in caplog.text


def test_what_was_collected_before_with_a_strange_time_is_named(inbound, collect, tmp_path, caplog):
    kept = tmp_path / "course/submitted/eve/calculator"
    kept.mkdir(parents=True)
    (kept / TIMESTAMP).write_text("noon")
    for student in ("ada", "eve", "zoe"):
        hand_in(inbound, student)
    assert collect(update=True) == as_collected("ada") | as_collected("zoe") | {f"eve/calculator/{TIMESTAMP}": "noon"}
    assert f"{kept / TIMESTAMP} is not a time: remove that folder, and collect again" in caplog.text


@pytest.fixture
def disk(monkeypatch):
    """Makes the disk fail with the file of a name in a student's folder, of which it still takes a part."""
    write, replace = Path.write_bytes, storage.replace

    def fail(student: str, name: str, number: int) -> None:
        def failing(path: Path, content: bytes) -> int:
            if path.name == name and student in path.parts:
                write(path, content[:2])
                raise OSError(number, os.strerror(number))
            return write(path, content)

        def failing_too(path: Path, content: bytes) -> None:
            replace(path, content) if path.name != name or student not in path.parts else failing(path, content)

        monkeypatch.setattr(Path, "write_bytes", failing)
        monkeypatch.setattr(storage, "replace", failing_too)

    return fail


@pytest.mark.parametrize("name", ["a.py", TIMESTAMP])
@pytest.mark.parametrize("update", [False, True])
def test_on_a_full_disk_a_submission_is_whole_or_not_there(inbound, collect, tmp_path, disk, monkeypatch, name, update):
    wanted = as_collected("ada") | as_collected("eve") | as_collected("zoe")
    before = as_collected("eve") if update else {}
    if update:
        hand_in(inbound, "eve")
        collect()
    for student in ("ada", "eve", "zoe"):
        folder = hand_in(inbound, student, 2 if update else 1)
        (folder / TIMESTAMP).unlink()
    if update:
        wanted = as_collected("ada", 2) | as_collected("eve", 2) | as_collected("zoe", 2)
    disk("eve", name, errno.ENOSPC)
    with pytest.raises(ExchangeError) as told:
        collect(update=update)
    submitted = tmp_path / "course" / "submitted"
    assert f"the disk with {submitted}/eve is full (No space left on device)" in str(told.value)
    assert "\n" not in str(told.value) and str(told.value).endswith("Free some space there, and collect again")
    found = {str(path.relative_to(submitted)): path.read_text() for path in submitted.rglob("*") if path.is_file()}
    assert {path: text for path, text in found.items() if path.startswith("eve/")} == before
    monkeypatch.undo()
    assert collect(update=update) == wanted
    assert not list(submitted.rglob(".*"))


def test_what_the_disk_cannot_take_of_one_student_costs_nobody_else(inbound, collect, tmp_path, disk, caplog):
    for student in ("ada", "eve", "zoe"):
        hand_in(inbound, student)
    disk("eve", "a.py", errno.EIO)
    with pytest.raises(ExchangeError, match="eve: not collected"):
        collect()
    submitted = tmp_path / "course" / "submitted"
    assert sorted(path.parent.name for path in submitted.glob("*/calculator")) == ["ada", "zoe"]
    assert f"eve calculator was not collected: {submitted}/eve/calculator: Input/output error" in caplog.text


def test_on_a_full_disk_an_exercise_is_released_whole_or_not_at_all(tmp_path, monkeypatch):
    prepare()
    (tmp_path / "course/release/calculator").mkdir(parents=True)
    for name in ("a.ipynb", "b.ipynb"):
        (tmp_path / "course/release/calculator" / name).write_text(name)
    copy = shutil.copy2

    def full(source: str, target: str, **options: object) -> object:
        if Path(source).name == "b.ipynb":
            Path(target).write_text("")
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), target)
        return copy(source, target)

    config = Config()
    apply(config)
    config.Exchange.root = str(tmp_path / "exchange")
    config.CourseDirectory.assignment_id, config.CourseDirectory.root = "calculator", str(tmp_path / "course")
    own = CourseDirectory(config=config)
    outbound = tmp_path / "exchange/ros2/outbound"
    monkeypatch.setattr(shutil.copytree, "__defaults__", (False, None, full, False, False))
    with pytest.raises(
        ExchangeError, match="outbound/calculator could not be written, so nothing is released: .*No sp"
    ):
        ExchangeFactory(config=config).ReleaseAssignment(coursedir=own, config=config).start()
    assert not list(outbound.iterdir())
    monkeypatch.undo()
    ExchangeFactory(config=config).ReleaseAssignment(coursedir=own, config=config).start()
    assert {path.name: path.read_text() for path in outbound.rglob("*.ipynb")} == {
        "a.ipynb": "a.ipynb",
        "b.ipynb": "b.ipynb",
    }


def test_on_a_full_disk_feedback_is_released_to_the_others_and_an_earlier_page_stays(tmp_path, monkeypatch):
    prepare()
    for student in ("ada", "bob", "cat", "zoe"):
        folder = tmp_path / "course/feedback" / student / "calculator"
        folder.mkdir(parents=True)
        for name, text in (("calculator.html", student), (TIMESTAMP, TIME.format(1)), (SECRETS, SECRET + student)):
            (folder / name).write_text(text)
    (tmp_path / "exchange").mkdir()
    config = Config()
    apply(config)
    config.Exchange.root = str(tmp_path / "exchange")
    config.CourseDirectory.assignment_id, config.CourseDirectory.root = "calculator", str(tmp_path / "course")
    own = CourseDirectory(config=config)

    def release() -> list[str]:
        ExchangeFactory(config=config).ReleaseFeedback(coursedir=own, config=config).start()
        return sorted(path.read_text() for path in (tmp_path / "exchange/ros2/feedback").iterdir())

    (tmp_path / "course/feedback/zoe/calculator/calculator.html").rename(tmp_path / "later.html")
    assert release() == ["ada", "bob", "cat"]
    (tmp_path / "later.html").rename(tmp_path / "course/feedback/zoe/calculator/calculator.html")
    for student in ("ada", "bob", "cat"):
        (tmp_path / "course/feedback" / student / "calculator/calculator.html").write_text(f"{student}, again")
    copy = shutil.copy

    def full(source: str, target: str) -> object:
        if "/bob/" in source or "/zoe/" in source:
            Path(target).write_text("")
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), target)
        return copy(source, target)

    monkeypatch.setattr(shutil, "copy", full)
    with pytest.raises(ExchangeError) as told:
        release()
    said = "not released: feedback/bob/calculator, feedback/zoe/calculator (No space left on device); a page that"
    assert str(told.value).startswith(said) and "\n" not in str(told.value)
    released = tmp_path / "exchange/ros2/feedback"
    assert sorted(path.read_text() for path in released.iterdir()) == ["ada, again", "bob", "cat, again"]
    monkeypatch.undo()
    assert release() == ["ada, again", "bob, again", "cat, again", "zoe"]


def test_the_course_folders_choice_of_files_and_its_group_are_kept(inbound, collect, tmp_path):
    folder = hand_in(inbound, "ada")
    (folder / "parts").mkdir()
    (folder / "parts" / "b.py").write_text("ada's")
    (folder / "__pycache__").mkdir()
    (folder / "__pycache__" / "c.py").write_text("ada's")
    (folder / "notes.txt").write_text("ada's")
    (folder / "large.py").write_text("x" * 2000)
    found = collect(include=["*.py", TIMESTAMP, SECRETS], max_file_size=1, groupshared=True)
    assert found == as_collected("ada") | {"ada/calculator/parts/b.py": "ada's"}
    for path in (tmp_path / "course/submitted/ada/calculator").rglob("*"):
        wanted = 0o2770 if path.is_dir() else 0o660
        assert stat.S_IMODE(path.stat().st_mode) & wanted == wanted
