"""The container's recipe: what it installs is kept when a notebook changes, and the students' work when it ends."""

import re
from pathlib import Path

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
    folder = dict(step[:2] for step in STEPS if len(step) == 2)["WORKDIR"]
    readme = (ROOT / "docs/student/README.md").read_text()
    (run,) = re.findall(r"^docker run .*", readme, re.MULTILINE)
    assert f"-v ros2-course:{folder}/notebooks " in run and " --init " in run and " -p 127.0.0.1:8888:8888 " in run
    assert run in RECIPE and re.findall(r"^docker build .*", readme, re.MULTILINE)[0] in RECIPE
