"""A class over a term: drafts are seen by nobody, exercises are released at once or at a date, and have due dates."""

import contextlib
import io
import json
import os
import subprocess
import sys
import threading
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from nbgrader.api import Gradebook
from nbgrader.utils import notebook_hash

from autograder.classroom import accounts, assignments, box, calendar, course_files, dating, deadlines, homes, hub
from autograder.classroom.assignments import DATED, DRAFT, DUE, OPEN, OVER, Dates
from autograder.errors import ClassroomError, UsageError
from autograder.gradebook import ends, extensions
from tests.classroom.conftest import call_classroom

NOW = datetime.now(UTC).replace(microsecond=0)
DAY = timedelta(days=1)


def said(time: datetime) -> str:
    return f"{time:%Y-%m-%d %H:%M UTC}"


def enter_dates(classroom, asked):
    """Enter dates as the instructor by the code of `dating`, in a fork of this process, which has nbgrader loaded.

    The program in the instructor's box is proven by the class that the tests of this folder share.
    """
    instructor = classroom.instructors[0]

    def work(opened: int) -> bytes:
        os.fchdir(opened)
        os.umask(box.umask(instructor))
        with contextlib.redirect_stdout(io.StringIO()) as out:
            try:
                dating.main(Path(), json.loads(json.dumps(asked)))
            except SystemExit as error:
                raise ClassroomError(str(error)) from None
        return out.getvalue().encode()

    uid, gid = accounts.ids(classroom, instructor)
    everybody, own = json.loads(homes.act(classroom.grading, uid, gid, work, [accounts.staff_id(classroom)]))
    return everybody, own


@pytest.fixture
def classroom(quiet, monkeypatch):
    """A class as `up` leaves it, but for the hub."""
    monkeypatch.setattr(course_files, "enter_dates", enter_dates)
    accounts.make(quiet)
    course_files.make_shared(quiet)
    course_files.release(quiet, [])
    course_files.enrol(quiet)
    assert course_files.hand_out_notebooks(quiet) == []
    return quiet


def states(classroom) -> dict[str, str]:
    return {row.name: row.state for row in assignments.table(classroom, datetime.now(UTC))}


def row(classroom, name: str) -> tuple[int, int, int]:
    """Return the numbers of students who have handed in, are graded, and have their pages back."""
    (found,) = (each for each in assignments.table(classroom, datetime.now(UTC)) if each.name == name)
    return found.handed_in, found.graded, found.returned


def release(classroom, *arguments: str) -> subprocess.CompletedProcess[str]:
    return call_classroom("release", *arguments, "--folder", str(classroom.folder))


def has(classroom, name: str) -> bool:
    """Return True if ada has the exercise's notebook."""
    return (classroom.home(classroom.find("ada")) / "notebooks" / name / f"{name}.ipynb").exists()


MOVES = """
import os
while True:
    for name in ("a", "b"):
        os.rename(f"eve+{'b' if name == 'a' else 'a'}", f"eve+{name}")
"""


@contextlib.contextmanager
def moved_about(classroom, inbound):
    """While a student gives folders of theirs other names, all the time."""
    (inbound / "eve+b").mkdir()
    with subprocess.Popen([sys.executable, "-c", MOVES], cwd=inbound) as moving:
        yield
        assert moving.poll() is None
        moving.kill()


@pytest.mark.long("exercises are released, at once and at their dates, one after the other")
def test_exercises_are_drafts_until_each_is_released_and_have_their_dates(classroom):
    assert set(states(classroom).values()) == {DRAFT} and len(states(classroom)) >= 5
    assert not has(classroom, "parameters") and course_files.released(classroom) == set()

    done = release(classroom, "parameters", "--due", said(NOW + DAY))
    assert done.returncode == 0, done.stderr
    assert "Released parameters." in done.stdout and f"due {said(NOW + DAY)}, 0 handed in" in done.stdout
    assert has(classroom, "parameters") and not has(classroom, "actions")
    assert {name for name, state in states(classroom).items() if state != DRAFT} == {"parameters"}

    # Handed in: whose folder it is counts, not what its name says.
    inbound = classroom.exchange / "ros2" / "inbound"
    for name, owner in {"ada+parameters+1+x": "ada", "ada+parameters+2+x": "ada", "bob+parameters+3+x": "ada"}.items():
        (inbound / name).mkdir()
        os.chown(inbound / name, *accounts.ids(classroom, classroom.find(owner)))
    assert row(classroom, "parameters") == (1, 0, 0)

    # Graded and returned, as nbgrader lays it out.
    for folder in ("autograded/ada/parameters", "autograded/somebody/parameters", "feedback/ada/parameters"):
        (classroom.grading / folder).mkdir(parents=True)
    page = classroom.grading / "feedback/ada/parameters"
    (page / "submission_secret.txt").write_text("a secret")
    (page / "parameters.html").write_text("<p>")
    assert row(classroom, "parameters")[1:] == (1, 0)
    returned = f"{notebook_hash(secret='a secret', notebook_id='parameters')}.html"
    (classroom.exchange / "ros2/feedback" / returned).write_text("<p>")
    assert row(classroom, "parameters") == (1, 1, 1)

    done = release(classroom, "parameters", "--due", said(NOW + 2 * DAY), "--until", said(NOW + 3 * DAY))
    assert done.returncode == 0, done.stderr
    assert "1 handed in, 1 graded, 1 returned" in done.stdout

    # After the end, nobody has handed in; with an extension, in time again.
    late = inbound / f"bob+parameters+{NOW + 4 * DAY:%Y-%m-%d %H:%M:%S.%f} UTC+x"
    late.mkdir()
    os.chown(late, *accounts.ids(classroom, classroom.find("bob")))
    assert row(classroom, "parameters") == (1, 1, 1)
    extensions.change(classroom.grading, ["bob"], "parameters", 2.0)
    deadlines.publish(classroom)
    assert row(classroom, "parameters") == (2, 1, 1)
    late.rmdir()
    impossible = inbound / "bob+parameters+9999-12-31 23:59:59 -2300+x"
    impossible.mkdir()
    os.chown(impossible, *accounts.ids(classroom, classroom.find("bob")))
    assert row(classroom, "parameters") == (2, 1, 1)  # by the folder's own time
    impossible.rmdir()
    with moved_about(classroom, inbound):
        assert all(row(classroom, "parameters") == (1, 1, 1) for _ in range(8))
    extensions.change(classroom.grading, ["bob"], "parameters", None)  # which the next release tells
    with Gradebook(f"sqlite:///{classroom.grading / 'gradebook.db'}") as book:
        assert book.find_assignment("parameters").duedate == (NOW + 2 * DAY).replace(tzinfo=None, second=0)
        assert {one.id for one in book.students} == {"ada", "bob"}

    done = release(classroom, "actions", "--at", said(NOW + DAY), "--due", said(NOW + 2 * DAY))
    assert done.returncode == 0, done.stderr
    assert "The hub does not run" in done.stdout
    assert states(classroom)["actions"] == DATED and not has(classroom, "actions")
    assert calendar.release_what_is_due(classroom.folder) == []
    assignments.change(classroom, ["actions"], release={"actions": NOW - DAY})  # its date has come
    assert calendar.release_what_is_due(classroom.folder) == ["actions"]
    assert has(classroom, "actions") and states(classroom)["actions"] == OPEN
    assert calendar.release_what_is_due(classroom.folder) == []

    for arguments, why in (
        (["actions", "--at", said(NOW + DAY)], "actions is already released"),
        (["services", "--due", said(NOW - DAY)], "UTC, would come before the release, "),
        (["nonsense"], "there is no exercise nonsense"),
        (["services", "--due", "tomorrow"], "'tomorrow' is not a time"),
        ([], "name an exercise, or give --all"),
    ):
        done = release(classroom, *arguments)
        assert (done.returncode, len(done.stderr.splitlines())) == (2, 1) and why in done.stderr
    assert states(classroom)["services"] == DRAFT

    each_is_told_their_own_dates(classroom)
    (classroom.grading / "extensions.json").unlink()
    assert "until" not in release(classroom, "parameters", "--until", "none").stdout  # there is no end any more
    assert "parameters" not in ends.read(classroom.grading)
    told = json.loads((classroom.exchange / "ros2/dates/bob.json").read_text())["parameters"]
    assert {*told} == {"due"}
    status = call_classroom("status", "--folder", str(classroom.folder))
    lines = {line.split()[0]: line for line in status.stdout.splitlines() if line.startswith("  ")}
    assert "draft" in lines["services"] and f"due {said(NOW + 2 * DAY)}" in lines["parameters"]


def each_is_told_their_own_dates(classroom) -> None:
    """Also one with an extension, which is nobody else's business."""

    def told(name: str) -> dict[str, str]:
        times = json.loads((folder / f"{name}.json").read_text())["parameters"]
        return {which: said(datetime.fromisoformat(time)) for which, time in times.items()}

    folder = classroom.exchange / "ros2" / "dates"
    everybody = {"due": said(NOW + 2 * DAY), "until": said(NOW + 3 * DAY)}
    assert told("ada") == told("bob") == everybody
    assert folder.stat().st_mode & 0o777 == 0o711
    for name in ("ada", "bob"):
        status = (folder / f"{name}.json").stat()
        owner = (0, accounts.ids(classroom, classroom.find(name))[1])
        assert (status.st_uid, status.st_gid) == owner and status.st_mode & 0o777 == 0o640
    assert not deadlines.out_of_date(classroom)
    (classroom.grading / "extensions.json").write_text('{"ada": {"parameters": 2}}')
    assert deadlines.out_of_date(classroom)
    assert calendar.release_what_is_due(classroom.folder) == []
    assert told("ada") == {"due": said(NOW + 4 * DAY), "until": said(NOW + 5 * DAY)}
    assert told("bob") == everybody
    assert ends.read(classroom.grading)["parameters"] == (NOW + 3 * DAY).replace(second=0)
    (classroom.grading / "extensions.json").write_text("no JSON")  # a mistake, which stops nobody
    with pytest.raises(ClassroomError, match="cannot be read"):
        calendar.release_what_is_due(classroom.folder)
    assert told("ada") == {"due": said(NOW + 4 * DAY), "until": said(NOW + 5 * DAY)}


def test_states_follow_from_the_dates():
    day = DAY.total_seconds()
    for seconds, state in ((-day, OPEN), (day / 2, DUE), (2 * day, OVER)):
        dates = Dates(due=NOW.isoformat(), until=(NOW + DAY).isoformat())
        assert assignments._state(dates, True, NOW + timedelta(seconds=seconds)) == state


def test_dates_are_in_their_order(quiet):
    with pytest.raises(UsageError, match="services: the end, .* UTC, would come before the due date, .* UTC"):
        assignments.change(quiet, ["services"], due=NOW, until=NOW - DAY)
    assert assignments.read(quiet) == {}


def test_a_command_waits_for_a_release_at_its_date(quiet, monkeypatch):
    """`down` was refused while the hub released an exercise."""
    begun, may_end = threading.Event(), threading.Event()

    def other() -> None:
        with hub.alone(quiet):
            begun.set()
            assert may_end.wait(60)

    releasing = threading.Thread(target=other)
    releasing.start()
    try:
        assert begun.wait(60)
        monkeypatch.setattr(hub, "PATIENCE", 0.2)
        with pytest.raises(UsageError, match="command is running"), hub.alone(quiet):
            pass
        monkeypatch.setattr(hub, "PATIENCE", 60.0)
        threading.Timer(0.3, may_end.set).start()
        with hub.alone(quiet):
            assert may_end.is_set()
    finally:
        may_end.set()
        releasing.join(60)
