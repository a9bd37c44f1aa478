"""A class over a term: drafts are seen by nobody, exercises are released at once or at a date, and have due dates."""

import os
import subprocess
import threading
from datetime import UTC, datetime, timedelta

import pytest
from nbgrader.api import Gradebook

from autograder.classroom import accounts, assignments, calendar, course_files, hub
from autograder.classroom.assignments import DATED, DRAFT, DUE, OPEN, OVER, Dates
from autograder.errors import UsageError
from tests.classroom.conftest import run_classroom

NOW = datetime.now(UTC).replace(microsecond=0)
DAY = timedelta(days=1)


def said(time: datetime) -> str:
    return f"{time:%Y-%m-%d %H:%M UTC}"


@pytest.fixture
def classroom(quiet):
    """A class as `up` leaves it, but for the hub."""
    accounts.make(quiet)
    course_files.make_shared(quiet)
    course_files.release(quiet, [])
    course_files.enrol(quiet)
    assert course_files.hand_out_notebooks(quiet) == []
    return quiet


def states(classroom) -> dict[str, str]:
    return {row.name: row.state for row in assignments.table(classroom, datetime.now(UTC))}


def release(classroom, *arguments: str) -> subprocess.CompletedProcess[str]:
    return run_classroom("release", *arguments, "--folder", str(classroom.folder))


def has(classroom, name: str) -> bool:
    """Return True if ada has the exercise's notebook."""
    return (classroom.home(classroom.find("ada")) / "notebooks" / name / f"{name}.ipynb").exists()


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
    rows = {row.name: row for row in assignments.table(classroom, datetime.now(UTC))}
    assert rows["parameters"].handed_in == 1

    done = release(classroom, "parameters", "--due", said(NOW + 2 * DAY), "--until", said(NOW + 3 * DAY))
    assert done.returncode == 0, done.stderr
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
        (["actions", "--at", said(NOW + DAY)], "actions is released already"),
        (["services", "--due", said(NOW - DAY)], "the release comes first"),
        (["nonsense"], "there is no exercise nonsense"),
        (["services", "--due", "tomorrow"], "'tomorrow' is not a time"),
        ([], "name an exercise, or give --all"),
    ):
        done = release(classroom, *arguments)
        assert (done.returncode, len(done.stderr.splitlines())) == (2, 1) and why in done.stderr
    assert states(classroom)["services"] == DRAFT

    status = run_classroom("status", "--folder", str(classroom.folder))
    lines = {line.split()[0]: line for line in status.stdout.splitlines() if line.startswith("  ")}
    assert "draft" in lines["services"] and f"due {said(NOW + 2 * DAY)}" in lines["parameters"]


def test_states_follow_from_the_dates():
    day = DAY.total_seconds()
    for seconds, state in ((-day, OPEN), (day / 2, DUE), (2 * day, OVER)):
        dates = Dates(due=NOW.isoformat(), until=(NOW + DAY).isoformat())
        assert assignments._state(dates, True, NOW + timedelta(seconds=seconds)) == state


def test_dates_are_in_their_order(quiet):
    with pytest.raises(UsageError, match="the release comes first, then the due date, then the end"):
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
        with pytest.raises(UsageError, match="is at work"), hub.alone(quiet):
            pass
        monkeypatch.setattr(hub, "PATIENCE", 60.0)
        threading.Timer(0.3, may_end.set).start()
        with hub.alone(quiet):
            assert may_end.is_set()
    finally:
        may_end.set()
        releasing.join(60)
