"""A course folder's configuration is run, and no other file of that name, which a student may have put there."""

import os
from pathlib import Path

import pytest
from typer.testing import CliRunner

from autograder.cli import app
from autograder.errors import UsageError
from autograder.gradebook import book, course_folder, extensions, late, release
from autograder.submissions import provenance
from tests.collecting.test_collect import EARLY, handed_in

NOT_OF_A_COURSE = "beside it is neither source nor gradebook.db"
NOBODY = 65534


@pytest.fixture(autouse=True)
def said_again():
    """Each command gives a warning once: here each test is one."""
    course_folder._warn.cache_clear()


@pytest.fixture
def around(tmp_path) -> Path:
    """A folder with a configuration that notes that it was run."""
    folder = tmp_path / "around"
    folder.mkdir()
    write(folder)
    return folder


def write(folder: Path) -> None:
    ran = os.fspath(folder.parent / "ran")
    (folder / "nbgrader_config.py").write_text(f"{release.COURSE_FILE}open({ran!r}, 'w').close()\n")


def ran(around: Path) -> bool:
    return (around.parent / "ran").exists()


def collected(*sources: Path, into: Path) -> str:
    return CliRunner().invoke(app, ["collect", *map(str, sources), "--into", str(into)]).output


@pytest.mark.parametrize("made", ["source", "gradebook.db"])
def test_a_course_folder_made_by_hand_or_by_nbgrader_is_one(around, made):
    (around / made).mkdir()
    assert late.course_config(around / "submitted") and ran(around)
    assert book.default_url(around / "submitted", around.parent / "out") == f"sqlite:///{around / 'gradebook.db'}"


def test_the_course_folder_of_a_release_is_one(tmp_path):
    release.release(tmp_path / "course", ["calculator"])
    assert course_folder.around(tmp_path / "course/submitted") == tmp_path / "course"


def test_without_the_signs_of_a_course_folder_nothing_is_run_and_a_line_says_what_to_do(around, caplog):
    extensions.change(around, ["ada"], None, 3.0)
    submitted = around / "submitted"
    collected(handed_in(around.parent / "in"), into=submitted)
    (around / "out").mkdir()
    url = book.default_url(submitted, around / "out")
    with book.Scores(url, submitted):
        pass
    assert not ran(around) and url == f"sqlite:///{around / 'out/gradebook.db'}"
    (line,) = caplog.messages
    assert line.startswith(f"{around / 'nbgrader_config.py'} is not run: {NOT_OF_A_COURSE}")
    assert line.endswith(f"If it is the course's own, make the folder {around / 'source'}")
    (around / "source").mkdir()
    assert late.course_config(submitted) and ran(around)


@pytest.mark.parametrize("source", [".", "..", "link"])
def test_nothing_beside_the_hand_ins_is_run_whatever_else_is_there(around, caplog, source):
    """Not in later commands either: the signs of a course folder may come from a student, too."""
    handed_in(around, "ada", EARLY)
    (around / "source").mkdir()
    (around / "gradebook.db").touch()
    (around.parent / "link").symlink_to(around)
    submitted = around / "submitted"
    named = around.parent / "link" if source == "link" else around / source
    assert "ada/services" in collected(named, into=submitted)
    assert (submitted / "ada/services/relay.py").exists()
    assert not late.course_config(submitted) and not ran(around)
    assert book.default_url(submitted, around / "out") == f"sqlite:///{around / 'out/gradebook.db'}"
    noted = provenance.among_hand_ins(submitted)
    (line,) = caplog.messages
    assert f"hand-ins were collected from {around}" in line and line.endswith(f"and delete {noted}")
    noted.unlink()
    assert late.course_config(submitted) and ran(around)


def test_hand_ins_in_a_folder_of_the_course_folder_do_not_hinder_it(around):
    (around / "source").mkdir()
    collected(handed_in(around / "downloads").parent, into=around / "submitted")
    assert ran(around)


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a file away")
def test_the_configuration_of_another_user_is_not_run(around, caplog, monkeypatch):
    monkeypatch.delenv("SUDO_UID", raising=False)
    (around / "source").mkdir()
    os.chown(around / "nbgrader_config.py", NOBODY, NOBODY)
    assert not late.course_config(around / "submitted") and not ran(around)
    (line,) = caplog.messages
    assert "is not run: it belongs to nobody. If it is the course's own, give the command as that user" in line
    with pytest.raises(UsageError, match="it belongs to nobody"):
        release.api(around)
    monkeypatch.setenv("SUDO_UID", str(NOBODY))
    assert late.course_config(around / "submitted") and ran(around)


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a file away")
@pytest.mark.parametrize(("mode", "runs"), [(0o2770, True), (0o2755, False), (0o2777, False)])
def test_instructors_who_share_a_folder_run_each_other_s(around, monkeypatch, mode, runs):
    monkeypatch.delenv("SUDO_UID", raising=False)
    (around / "source").mkdir()
    os.chown(around / "nbgrader_config.py", NOBODY, os.getegid())
    os.chown(around, 0, os.getegid())
    around.chmod(mode)
    assert bool(late.course_config(around / "submitted")) == runs == ran(around)
