"""A workspace that real colcon builds once, and the terminals of somebody who works in it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from course.environment import prepare, workspace_variables
from course.session.domains import claim_domain

ROOT = Path(__file__).parents[2]
SOLUTIONS = ROOT / "solutions"


@pytest.fixture(scope="session")
def shell(tmp_path_factory):
    """The environment of the course's shell, in a domain of its own and without settings of the caller's."""
    prepare()
    callers = ("ROS_", "RMW_", "FASTDDS_")
    kept = {name: value for name, value in os.environ.items() if not name.startswith(callers)}
    system = [folder for folder in os.environ["PATH"].split(os.pathsep) if not Path(folder, "ros2").exists()]
    claim, domain = claim_domain()
    yield {
        **kept,
        **workspace_variables(),
        "PYTHONDONTWRITEBYTECODE": "1",  # as in some containers: no build may warn of it
        "PATH": os.pathsep.join([str(Path(sys.executable).parent), *system]),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_DOMAIN_ID": str(domain),
        "COLUMNS": "200",
        "XDG_RUNTIME_DIR": str(tmp_path_factory.mktemp("run")),
    }
    claim.close()


@pytest.fixture
def course_command(shell):
    """`course ...` in the folder `cwd`."""

    def run(*words, cwd, **environment: str) -> subprocess.CompletedProcess:
        return subprocess.run(
            ["course", *map(str, words)],
            cwd=cwd,
            env={**shell, **environment},
            capture_output=True,
            text=True,
            timeout=60,
            stdin=subprocess.DEVNULL,
        )

    return run
