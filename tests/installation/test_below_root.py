"""A checkout below /root, its usual place in a container: it grades, and nothing else of /root can be seen."""

import os
import shutil
import tempfile
from pathlib import Path

import pytest

from autograder.sandbox.variables import OF_ROS

from .conftest import ITSELF, Installation, copy_checkout, copy_environment, install

ROOTS_HOME = Path("/root")
pytestmark = [
    pytest.mark.matrix,  # tests/attacks/test_spy.py knows the way to an environment below /root
    pytest.mark.skipif(
        os.geteuid() != 0 or not os.access(ROOTS_HOME, os.W_OK), reason="only root has a checkout below /root"
    ),
]


@pytest.fixture(scope="module")
def around(confinement):
    """A folder below /root with a secret, and with a checkout in it that has been set up."""
    folder = Path(tempfile.mkdtemp(prefix="ros2-course-test-", dir=ROOTS_HOME))
    try:
        (folder / "secret.txt").write_text("root's own")
        copy_checkout(folder / "course")
        copy_environment(folder / "course" / ".venv")
        install(folder / "course" / ".venv", "--editable", folder / "course")
        yield folder
    finally:
        shutil.rmtree(folder)


@pytest.fixture(scope="module")
def checkout(around) -> Installation:
    return Installation(around / "course" / ".venv", {"XDG_CACHE_HOME": str(around / "cache")})


def test_it_is_an_installation_of_its_own(checkout, around):
    found = checkout.run("python", "-c", "import autograder; print(autograder.__file__)").stdout.strip()
    assert found == str(around / "course" / "autograder" / "__init__.py")


def test_the_doctor_is_content(checkout):
    done = checkout.run("autograder", "doctor")
    assert done.returncode == 0 and " NO " not in done.stdout


def test_it_checks_a_submission(checkout):
    assert checkout.score() == ("graded", 10, [])


def test_a_program_sees_of_root_only_the_way_to_the_environment(checkout, around):
    seen = checkout.sees(folder=ROOTS_HOME, searched=[ROOTS_HOME])
    assert (seen["below"], seen["imported"], seen["found"]) == ([], [], [ITSELF])


def test_a_program_sees_no_checkout_inside_a_folder_that_ros_is_installed_in(checkout, around):
    """A checkout in /usr/src is inside /usr, which every program sees."""
    around.chmod(0o755)  # what every program sees, every user may read
    of_ros = around / OF_ROS
    of_ros.parent.mkdir(parents=True)
    of_ros.touch()
    inside = Installation(checkout.prefix, checkout.variables | {"AMENT_PREFIX_PATH": str(around)})
    seen = inside.sees(folder=around / "course", private=[around], searched=[around])
    assert (seen["below"], seen["imported"], seen["found"]) == ([], [], [ITSELF])
    assert "secret.txt" in seen["listed"][str(around)]  # as ROS's folders are: the view was another one
    done = inside.run("autograder", "doctor")
    assert done.returncode == 0 and " NO " not in done.stdout
