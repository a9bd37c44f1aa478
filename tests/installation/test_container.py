"""The container's recipe: what it installs is kept when a notebook changes, and the students' work when it ends.

Each of its steps, each command of `.devcontainer` and the one of Binder is run in a bare Debian.
"""

import json
import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
RECIPE = (ROOT / "environment/Dockerfile").read_text()
STEPS = [line.split() for line in RECIPE.replace("\\\n", " ").splitlines() if line and not line.startswith("#")]


def test_what_is_installed_comes_before_what_students_edit():
    place = STEPS.index(["RUN", "environment/install", "student"])
    before = [word for step in STEPS[:place] if step[0] == "COPY" for word in step[2:-1]]
    assert set(before) == {"pyproject.toml", "LICENSE", "README.md", "environment", "course"}
    assert STEPS[place + 1] == ["COPY", "--chown=student:student", ".", "."]
    assert {".venv", ".git"} <= set((ROOT / ".dockerignore").read_text().split())


def test_the_work_outlives_the_container_as_the_readme_says():
    folder = [where for step, where in (step[:2] for step in STEPS) if step == "WORKDIR"][-1]
    readme = (ROOT / "docs/student/README.md").read_text()
    (run,) = re.findall(r"^docker run .*", readme, re.MULTILINE)
    assert f"-v ros2-course:{folder} " in run and " --init " in run and " -p 127.0.0.1:8888:8888 " in run
    assert run in RECIPE and re.findall(r"^docker build .*", readme, re.MULTILINE)[0] in RECIPE


def test_a_codespace_runs_commands_that_are_there_and_shows_the_port():
    described = json.loads((ROOT / "environment/devcontainer.json").read_text())
    for key in ("onCreateCommand", "postAttachCommand"):
        assert os.access(ROOT / described[key].split()[0], os.X_OK)
    assert described["forwardPorts"] == [8888] and "bookworm" in described["image"]


@pytest.mark.matrix
@pytest.mark.long("installs the course in a bare Debian")
@pytest.mark.timeout(1800)
@pytest.mark.skipif(
    os.getuid() != 0 or shutil.which("debootstrap") is None, reason="making a bare Debian needs root and debootstrap"
)
@pytest.mark.parametrize("who", ["container", "codespace"])
def test_each_step_works_in_a_bare_debian(who, tmp_path_factory):
    folder = tmp_path_factory.getbasetemp() / "bare"
    done = subprocess.run([ROOT / "tests/installation/bare", folder, "bookworm", who], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    for last in {"container": ("CMD", "Binder"), "codespace": ("postAttachCommand",)}[who]:
        assert re.search(rf"bookworm {who}: {last} +exit status 0", done.stdout)
