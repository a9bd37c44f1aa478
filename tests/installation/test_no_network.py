"""Once it is installed, the course needs no network: a section's cells, terminals and a build, with loopback alone."""

import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from course.workspace.export import export

ROOT = Path(__file__).parents[2]
CELLS = 8  # of section 3.3: a session, nodes in the kernel, programs beside it, and `ros2`
# As on a computer without a cable: loopback as the system brings it up, and nothing else.
UNPLUGGED = ["unshare", "--net", *([] if os.geteuid() == 0 else ["--user", "--map-root-user"])]
GRAPH = "ros2 run demo_nodes_py introspection & ros2 topic echo --once /rosout; kill $!; wait"
BEGIN = 'ip link set lo up; [ -z "$(ip route)" ]; exec "$@"'


def alone(folder: Path, *command: object) -> subprocess.CompletedProcess:
    """Run a command where there is no network."""
    words = [*UNPLUGGED, "sh", "-ec", BEGIN, "sh", *map(str, command)]
    return subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=200, stdin=subprocess.DEVNULL)


@pytest.fixture(scope="module", autouse=True)
def namespaces():
    if subprocess.run([*UNPLUGGED, "true"], capture_output=True).returncode:
        pytest.skip("this machine makes no network namespace")


@pytest.fixture
def section(tmp_path) -> Path:
    """The first cells of a section's notebook, with their stored outputs."""
    notebook = json.loads((ROOT / "notebooks/parameters/parameters.ipynb").read_text())
    code = [index for index, cell in enumerate(notebook["cells"]) if cell["cell_type"] == "code"]
    notebook["cells"] = notebook["cells"][: code[CELLS]]
    folder = tmp_path / "parameters"
    folder.mkdir()
    (folder / "parameters.ipynb").write_text(json.dumps(notebook))
    return folder


@pytest.mark.timeout(300)
def test_cells_terminals_and_builds_work_without_a_network(section, tmp_path):
    workspace = tmp_path / "ros2_ws"
    export("services", workspace, ROOT / "solutions/services")
    shell = ROOT / "environment/shell"
    sanitized = ["--nbval", f"--nbval-sanitize-with={ROOT}/tests/measured.cfg", f"--rootdir={section}"]
    jobs = {
        "notebook": (section, sys.executable, "-m", "pytest", "-q", "-p", "no:xdist", *sanitized, "parameters.ipynb"),
        "build": (workspace, shell, "colcon", "build"),
        "graph": (tmp_path, shell, "sh", "-c", GRAPH),
        "start": (ROOT, "environment/start", "developer", "--no-browser", "--version"),
    }
    with ThreadPoolExecutor(len(jobs)) as pool:
        done = dict(zip(jobs, pool.map(lambda job: alone(*job), jobs.values()), strict=True))
    assert f"{CELLS} passed" in done["notebook"].stdout, done["notebook"].stdout + done["notebook"].stderr
    assert "1 package finished" in done["build"].stdout and done["build"].stderr == "", done["build"]
    assert "name: introspection_" in done["graph"].stdout, done["graph"]
    assert done["start"].returncode == 0 and done["start"].stdout.startswith("4."), done["start"]
