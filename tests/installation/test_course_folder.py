"""nbgrader course folders: their configuration finds this package."""

import subprocess
import sys
from pathlib import Path

import pytest

from autograder.gradebook import late, plugins, release
from autograder.gradebook.release import COURSE_FILE


@pytest.fixture
def course(tmp_path) -> Path:
    """A course folder with the configuration that `autograder release` writes, and a line of its own."""
    (tmp_path / "source").mkdir()
    (tmp_path / "nbgrader_config.py").write_text(COURSE_FILE + "c.LatePolicy.percent_per_day = 10\n")
    return tmp_path


def test_its_configuration_is_this_packages(course):
    for config in (release.api(course).config, late.course_config(course / "submitted")):
        assert plugins.GradeInSandbox in config.Autograde.autograde_preprocessors
        assert config.Autograde.exporter_class is plugins.HandedInNotebook
        assert config.AssignLatePenalties.plugin_class is late.LatePolicy
        assert config.LatePolicy.percent_per_day == 10


def test_nbgraders_own_command_takes_it(course):
    command = [
        str(Path(sys.executable).with_name("nbgrader")),
        "export",
        "--exporter",
        "autograder.gradebook.csv_export.CsvExporter",
    ]
    done = subprocess.run([*command, "--to", "grades.csv"], cwd=course, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0 and (course / "grades.csv").exists(), done.stderr
