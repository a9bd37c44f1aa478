"""Submitting to nbgrader's exchange: a hand-in is there whole, with the student's own copy, or not at all."""

import errno
import os
import shutil
from pathlib import Path

import pytest
from nbgrader.auth import Authenticator
from nbgrader.coursedir import CourseDirectory
from nbgrader.exchange import ExchangeError, ExchangeFactory
from traitlets.config import Config

from course import hand_in
from course.environment import prepare
from course.errors import HandInError
from course.submitting import WholeSubmit

FULL = os.strerror(errno.ENOSPC)


@pytest.fixture
def place(tmp_path):
    """An exchange with a released exercise, and the exercise's folder at the student's."""
    for folder in ("exchange/ros2/inbound", "exchange/ros2/outbound/calculator", "home/calculator"):
        (tmp_path / folder).mkdir(parents=True)
    for name in ("calculator_client.py", "calculator_server.py"):
        (tmp_path / "home/calculator" / name).write_text(name)
    return tmp_path


@pytest.fixture
def submit(place):
    """Submits as `nbgrader submit` does."""

    def run() -> None:
        prepare()
        config = Config()
        config.Exchange.root, config.Exchange.cache = str(place / "exchange"), str(place / "cache")
        config.Exchange.assignment_dir = str(place / "home")
        config.CourseDirectory.course_id, config.CourseDirectory.assignment_id = "ros2", "calculator"
        config.ExchangeFactory.submit = WholeSubmit
        own = CourseDirectory(config=config)
        anybody = Authenticator(config=config)
        ExchangeFactory(config=config).Submit(coursedir=own, authenticator=anybody, config=config).start()

    return run


def hand_ins(folder: Path) -> dict[str, dict[str, str]]:
    """Return the files of each hand-in in a folder by the hand-in's time, with anything that was left there."""
    return {
        entry.name.split("+")[2] if "+" in entry.name else entry.name: {
            path.name: path.read_text() for path in entry.iterdir()
        }
        for entry in folder.iterdir()
    }


@pytest.mark.parametrize("name", ["calculator_server.py", "timestamp.txt", "submission_secret.txt"])
@pytest.mark.parametrize("full", ["exchange", "cache"])
def test_on_a_full_disk_a_hand_in_is_whole_with_its_copy_or_nowhere(place, submit, monkeypatch, full, name):
    submit()
    inbound, cache = place / "exchange/ros2/inbound", place / "cache/ros2"
    before = hand_ins(inbound)
    assert len(before) == 1 and hand_ins(cache) == before
    copy, write = shutil.copy2, Path.write_text

    def fail(target: Path) -> None:
        if target.name == name and place / full in target.parents:
            write(target, "")
            raise OSError(errno.ENOSPC, FULL, str(target))

    def copying(source: str, target: str, **options: object) -> object:
        fail(Path(target))
        return copy(source, target, **options)

    def writing(target: Path, text: str) -> int:
        fail(target)
        return write(target, text)

    monkeypatch.setattr(shutil.copytree, "__defaults__", (False, None, copying, False, False))
    monkeypatch.setattr(Path, "write_text", writing)
    with pytest.raises(
        ExchangeError, match=f"^nothing was handed in, because it could not be copied to {place}.*: {FULL}"
    ):
        submit()
    assert hand_ins(inbound) == before and hand_ins(cache) == before
    monkeypatch.undo()
    submit()
    assert len(hand_ins(inbound)) == 2 and hand_ins(cache) == hand_ins(inbound)
    for folder in inbound.iterdir():
        assert folder.stat().st_mode & 0o777 == 0o777
        assert {path.stat().st_mode & 0o777 for path in folder.iterdir()} == {0o644}


def test_what_the_exchange_refuses_is_told_with_its_reason(place, monkeypatch):
    (place / "data/nbgrader_cache").mkdir(parents=True)
    (place / "data/nbgrader_cache/ros2").touch()  # the student's own copy cannot be written
    (place / "config").mkdir()
    (place / "config/nbgrader_config.py").write_text(f"get_config().Exchange.root = {str(place / 'exchange')!r}\n")
    monkeypatch.setenv("JUPYTER_CONFIG_DIR", str(place / "config"))
    monkeypatch.setenv("JUPYTER_DATA_DIR", str(place / "data"))
    monkeypatch.setenv(hand_in.EXCHANGE, "ros2")
    found = hand_in.HandIn("calculator", [], {"calculator_server.py": b""}, {})
    with pytest.raises(
        HandInError, match=r"ada\.zip is written, but .* refused it: nothing was handed in, because .* copied to .*: F"
    ):
        hand_in.submit(found, Path("ada.zip"))
    assert list((place / "exchange/ros2/inbound").iterdir()) == []
    (place / "data/nbgrader_cache/ros2").unlink()
    hand_in.submit(found, Path("ada.zip"))
    assert hand_ins(place / "data/nbgrader_cache/ros2") == hand_ins(place / "exchange/ros2/inbound") != {}


def test_without_room_for_the_files_the_archive_alone_is_written(monkeypatch):
    def full(**_: object) -> None:
        raise OSError(errno.ENOSPC, FULL)

    monkeypatch.setenv(hand_in.EXCHANGE, "ros2")
    monkeypatch.setattr(hand_in.tempfile, "TemporaryDirectory", full)
    with pytest.raises(HandInError, match=f"^ada.zip is written, but could not be handed in: {FULL}$"):
        hand_in.submit(hand_in.HandIn("calculator", [], {}, {}), Path("ada.zip"))
