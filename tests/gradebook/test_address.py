"""The gradebook lies in the folder that it is meant for, whatever the folder's name."""

from pathlib import Path

import pytest
from nbgrader.api import Gradebook
from sqlalchemy.engine import make_url

from autograder.classroom import dating, enrolling
from autograder.errors import UsageError
from autograder.gradebook import address, late, release
from autograder.gradebook.book import default_url, existing_url
from autograder.gradebook.entering import Entering

ODD = ["g?x=1", "g%41", "g#1 é", "g;'{}", "a@b:c", "100%"]
MISREAD = ["g?x=1", "g%41"]  # by nbgrader


@pytest.mark.parametrize("name", ODD)
def test_a_url_names_the_file_that_it_was_made_of(tmp_path, name):
    folder = tmp_path / name
    (folder / "submitted").mkdir(parents=True)
    url = default_url(folder / "submitted", folder / "out")
    assert make_url(url).database == str(folder / "out" / "gradebook.db")
    with pytest.raises(UsageError, match="there is no gradebook"):
        existing_url(None, folder / "submitted", folder / "out")
    (folder / "out").mkdir()
    with Entering(None, folder / "submitted", folder / "out"):
        pass
    assert [path.name for path in (folder / "out").iterdir()] == ["gradebook.db"]
    assert [path.name for path in tmp_path.iterdir()] == [name]
    assert existing_url(None, folder / "submitted", folder / "out") == url


@pytest.mark.parametrize("name", ODD)
def test_a_class_s_gradebook_lies_in_its_course_folder(tmp_path, name):
    course = tmp_path / name
    course.mkdir()
    enrolling.main(course, {"ada": {}}, {})
    dating.enter(course, {"calculator": {"due": "2026-11-20T10:00:00+00:00"}}, {})
    assert [path.name for path in tmp_path.iterdir()] == [name]
    with Gradebook(address.url(course / "gradebook.db")) as book:
        assert [student.id for student in book.students] == ["ada"]


@pytest.mark.parametrize("name", MISREAD)
def test_a_course_folder_that_nbgrader_would_misread_is_refused(tmp_path, name):
    """Its own commands and Formgrader take the path as plain text, and two courses could share one gradebook."""
    course = tmp_path / name / "course"
    why = r"with \? or % in its path, nbgrader puts the gradebook elsewhere. Rename the folder"
    with pytest.raises(UsageError, match=why):
        release.set_up(course)
    assert not course.exists()
    for folder in ("source", "submitted"):
        (course / folder).mkdir(parents=True)
    (course / "nbgrader_config.py").write_text(release.COURSE_FILE)
    with pytest.raises(UsageError, match=why):
        late.course_config(course / "submitted")


@pytest.mark.parametrize("name", sorted({*ODD} - {*MISREAD}))
def test_other_course_folders_are_fine(tmp_path, name):
    release.set_up(tmp_path / name)
    assert late.course_config(tmp_path / name / "submitted") is not None


def test_the_course_s_own_url_is_known_in_any_spelling(tmp_path):
    """A given URL with a plain space is the same as the one with a quoted space."""
    course = tmp_path / "my course"
    release.set_up(course)
    (course / "submitted").mkdir()
    with Entering(f"sqlite:///{course}/gradebook.db", course / "submitted", tmp_path / "out") as entering:
        assert entering._config is not None
    with Entering(f"sqlite:///{course}/other.db", course / "submitted", tmp_path / "out") as entering:
        assert entering._config is None


def test_what_is_no_url_is_told(tmp_path):
    with pytest.raises(UsageError, match="kept.db is not a database URL: one of a file is sqlite:///PATH"):
        existing_url("kept.db", Path(), tmp_path)
    assert address.file("postgresql://host/grades") is None
