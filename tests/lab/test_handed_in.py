"""The server's answers on hand-ins, from the receipts in the folder and its own work."""

from datetime import UTC, datetime, timedelta

import pytest

from course import hand_in
from course.errors import HandInError
from course.lab.server import handed_in
from course.notebook import file_record

NOW = datetime(2026, 11, 2, 9, 30, 5, tzinfo=UTC)
FILES = {"greeter.py": b"print('hello')\n", "greeter.ipynb": b"{}"}
WHAT = "greeter.py, greeter.ipynb."
GIVE = " Give the archive to your instructor; the newest counts."


@pytest.fixture(autouse=True)
def alone(monkeypatch):
    """No hand-ins of other tests, and no class."""
    monkeypatch.setattr(handed_in, "_latest", {})
    monkeypatch.delenv(hand_in.EXCHANGE, raising=False)


def write(folder, at=NOW, assignment="greeter", **checks):
    """An archive of the folder's files as `course hand-in` writes it; its name is returned."""
    for name, content in FILES.items():
        (folder / name).write_bytes(content)
    return hand_in.write(hand_in.HandIn(assignment, [], FILES, {}), folder, "ada", checks, at).name


def test_the_newest_archive_of_the_exercise_is_told(tmp_path):
    assert handed_in.told(tmp_path, "greeter") is None and handed_in.last_run(tmp_path, "greeter") is None
    write(tmp_path, NOW + timedelta(days=2), assignment="other-greeter-2")
    write(tmp_path, NOW - timedelta(days=1))
    name = write(tmp_path, greets="passed", waits="not yet")
    for junk in ("ada-greeter-20261202T093005Z.zip", "notes.zip"):
        (tmp_path / junk).write_bytes(b"PK")
    (tmp_path / "ada-greeter-20261203T093005Z.zip").mkdir()
    text = f"Packed on 2026-11-02 09:30 UTC: {WHAT} 1 of 2 public checks passed.{GIVE}"
    assert handed_in.told(tmp_path, "greeter") == {"text": text, "archive": name}
    ran = handed_in.last_run(tmp_path, "greeter")
    assert ran.outcomes == {"greets": "passed", "waits": "not yet"}
    assert ran.files == {name: file_record.digest(content) for name, content in FILES.items()}
    again = write(tmp_path)  # in the same second
    text = f"Packed on 2026-11-02 09:30 UTC: {WHAT}{GIVE}"
    assert handed_in.told(tmp_path, "greeter") == {"text": text, "archive": again}


def test_a_hand_in_under_way_and_one_that_failed_are_told(tmp_path):
    write(tmp_path)
    under_way = handed_in.begin(tmp_path)
    assert handed_in.told(tmp_path, "greeter") == {"text": "A hand-in is under way.", "archive": ""}
    with pytest.raises(HandInError, match="A hand-in is under way. Wait until it has finished"):
        handed_in.begin(tmp_path)  # from another tab of the browser
    with pytest.raises(HandInError, match="under way"):
        handed_in.expect_none(tmp_path)
    handed_in.expect_none(tmp_path.parent)
    under_way.ran, under_way.of = 1, 4
    assert "1 of 4 public checks have run" in handed_in.told(tmp_path, "greeter")["text"]
    under_way.end(failed="the disk is full")
    under_way.end(failed="later")
    told = handed_in.told(tmp_path, "greeter")
    assert told["text"].endswith(" UTC failed: the disk is full") and told["archive"] == ""
    handed_in.withdraw(tmp_path, handed_in.begin(tmp_path))  # the student is asked, and does not answer
    assert handed_in.told(tmp_path, "greeter") == told
    handed_in.withdraw(tmp_path.parent, handed_in.begin(tmp_path.parent))
    assert handed_in.told(tmp_path.parent, "greeter") is None
    name = write(tmp_path, datetime.now(UTC) + timedelta(seconds=2))  # in a terminal
    assert handed_in.told(tmp_path, "greeter")["archive"] == name


def test_in_a_class_handed_in_is_said_only_of_what_is_known_to_have_arrived(tmp_path, monkeypatch):
    name = write(tmp_path)
    monkeypatch.setenv(hand_in.EXCHANGE, "ros2")
    packed = {"text": f"Packed on 2026-11-02 09:30 UTC: {WHAT}", "archive": name}
    assert handed_in.told(tmp_path, "greeter") == packed
    handed_in.begin(tmp_path).end(sent=name)
    assert handed_in.told(tmp_path, "greeter")["text"] == f"Handed in on 2026-11-02 09:30 UTC: {WHAT}"


def test_files_that_have_changed_since_the_hand_in_are_told(tmp_path):
    name = write(tmp_path)
    (tmp_path / "greeter.ipynb").write_text("{ }")  # each run of a cell changes it
    assert "Since then" not in handed_in.told(tmp_path, "greeter")["text"]
    (tmp_path / "greeter.py").write_text("print('goodbye')\n")
    keeps = "The archive keeps what you handed in: to replace it, hand in again."
    assert handed_in.told(tmp_path, "greeter")["text"].endswith(f" Since then: greeter.py changed. {keeps}")
    (tmp_path / "greeter.py").unlink()
    told = handed_in.told(tmp_path, "greeter")
    assert told["text"].endswith(f" Since then: greeter.py gone. {keeps}") and told["archive"] == name
