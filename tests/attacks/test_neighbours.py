"""A grading beside one that takes all of the processor that it can get: a right answer keeps its points."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from autograder.sandbox import cgroup
from tests.hidden.answers import SOLUTIONS, solution

AUTOGRADER = str(Path(sys.executable).with_name("autograder"))
BUSY = """
import os
for _ in range(38):
    if not os.fork():
        while True:
            pass
"""
ONE_CORE = min(os.sched_getaffinity(0))


def busy(exercise: str) -> dict[str, bytes]:
    """The right answer, with 38 processes beside it that compute without end."""
    return {
        name: BUSY.encode() + content if name.endswith(".py") else content
        for name, content in solution(exercise).items()
    }


@pytest.mark.matrix
@pytest.mark.parametrize("exercise", sorted(path.name for path in SOLUTIONS.iterdir() if path.is_dir()))
def test_a_busy_neighbour_costs_nothing(confinement, exercise, tmp_path):
    group = cgroup.make()
    if group is None:
        pytest.skip("this machine gives no control groups")
    group.close()
    for student, files in (("busy", busy(exercise)), ("honest", solution(exercise))):
        folder = tmp_path / "submitted" / student / exercise
        folder.mkdir(parents=True)
        for name, content in files.items():
            (folder / name).write_bytes(content)
    subprocess.run(
        [
            *("taskset", "-c", str(ONE_CORE), AUTOGRADER, "grade", str(tmp_path / "submitted")),
            *("--output", str(tmp_path / "out"), "--jobs", "2", "--no-gradebook"),
        ],
        check=True,
        capture_output=True,
        timeout=280,
    )
    lines = map(json.loads, (tmp_path / "out" / "results.jsonl").read_text().splitlines())
    honest = next(line for line in lines if line["student"] == "honest")
    assert (honest["score"], [test["message"] for test in honest["tests"] if test["message"]]) == (20, [])
