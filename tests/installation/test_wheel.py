"""The course installed from a wheel, not from a checkout: it grades, and its students' programs see none of it."""

import json
import shutil
from pathlib import Path

import pytest

from autograder.gradebook.release import COURSE_FILE

from .conftest import ITSELF, ROOT, Installation, copy_environment, install


@pytest.fixture(scope="module")
def installed(confinement, wheel, tmp_path_factory):
    """An environment with the wheel in it."""
    folder = tmp_path_factory.mktemp("installed")
    copy_environment(folder / "venv")
    install(folder / "venv", wheel)
    (folder / "link").symlink_to("venv")
    yield Installation(folder / "venv", {"XDG_CACHE_HOME": str(folder / "cache")})
    shutil.rmtree(folder / "venv")  # pytest would keep it


def package(installed: Installation) -> Path:
    """Return where the grader is installed."""
    return Path(installed.run("python", "-c", "import autograder; print(autograder.__file__)").stdout.strip()).parent


def test_it_is_an_installation_of_its_own(installed):
    assert package(installed).is_relative_to(installed.prefix / "lib")


@pytest.mark.matrix  # the tests below begin each of its parts
def test_it_grades_a_course_folder(installed, tmp_path):
    """As a batch: workers of Dask, page templates, the gradebook and the course's own configuration are all found."""
    (tmp_path / "source").mkdir()
    (tmp_path / "nbgrader_config.py").write_text(COURSE_FILE)
    shutil.copytree(ROOT / "solutions" / "services", tmp_path / "submitted" / "ada" / "services")
    (tmp_path / "submitted/ada/services/relay.py").write_text("def main(:\n")  # it ends at once
    done = installed.run("autograder", "grade", tmp_path / "submitted", "--output", tmp_path / "out", "--jobs", 1)
    assert (done.returncode, done.stderr) == (0, "")
    report = json.loads((tmp_path / "out" / "results.jsonl").read_text())
    assert (report["status"], report["score"], report["flags"]) == ("graded", 10, [])
    assert "10 of 20" in (tmp_path / "out" / "feedback" / "ada" / "services.html").read_text()
    assert (tmp_path / "gradebook.db").exists()


def test_it_checks_a_submission(installed):
    assert installed.score() == ("graded", 10, [])


@pytest.mark.parametrize("name", ["venv", "link"])
def test_a_program_sees_no_grader(installed, name):
    """Also where the environment is reached through a link."""
    place = installed.prefix.with_name(name)
    inside = package(installed).relative_to(installed.prefix)
    seen = Installation(place, installed.variables).sees(private=[place / inside, installed.prefix / inside])
    assert seen["prefix"] == str(place)
    assert not any(seen["listed"].values()) and (seen["imported"], seen["found"]) == ([], [ITSELF])


def test_the_doctor_is_content(installed):
    done = installed.run("autograder", "doctor")
    assert done.returncode == 0 and " NO " not in done.stdout


def test_release_needs_a_checkout_and_says_so(installed, tmp_path):
    done = installed.run("autograder", "release", "--course", tmp_path)
    assert done.returncode == 2 and done.stdout == "" and done.stderr.count("\n") == 1
    assert "without the course's notebooks and solutions" in done.stderr and list(tmp_path.iterdir()) == []
