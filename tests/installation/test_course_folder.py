"""nbgrader course folders, those made by earlier versions too: their configuration finds this package."""

import subprocess
import sys
from pathlib import Path

import pytest
from nbgrader.plugins import ExportPlugin
from traitlets.utils.importstring import import_item

from autograder.gradebook import late, plugins, release
from autograder.gradebook.config import COURSE_FILE
from autograder.paths import PACKAGE

CONFIGURATIONS = {
    "by the file's place": f"c = get_config()\nload_subconfig({str(PACKAGE / 'nbgrader_config.py')!r})\n",
    "by the module's name": COURSE_FILE,
}


@pytest.fixture(params=CONFIGURATIONS)
def course(request, tmp_path) -> Path:
    """A course folder with one of the configurations that `autograder release` has written, and a line of its own."""
    config = CONFIGURATIONS[request.param] + "c.LatePolicy.percent_per_day = 10\n"
    (tmp_path / "nbgrader_config.py").write_text(config)
    return tmp_path


def test_its_configuration_is_this_packages(course):
    for config in (release.api(course).config, late.course_config(course / "submitted")):
        assert plugins.GradeInSandbox in config.Autograde.autograde_preprocessors
        assert config.Autograde.exporter_class is plugins.HandedIn
        assert config.AssignLatePenalties.plugin_class is late.LatePolicy
        assert config.LatePolicy.percent_per_day == 10


def test_nbgraders_own_command_takes_it(course):
    command = [str(Path(sys.executable).with_name("nbgrader")), "export", "--exporter", "autograder.export.CsvExporter"]
    done = subprocess.run([*command, "--to", "grades.csv"], cwd=course, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0 and (course / "grades.csv").exists(), done.stderr


@pytest.mark.parametrize("name", ["CanvasExporter", "CsvExporter", "MoodleExporter"])
def test_the_exporters_are_where_they_were(name):
    assert issubclass(import_item(f"autograder.export.{name}"), ExportPlugin)
