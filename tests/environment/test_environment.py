"""The scripts in environment/, and the lock file."""

import fcntl
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
import urllib.request
from pathlib import Path

import pytest
import yaml

from course.foundation.waiting import wait_until
from tests.chosen import each_night
from tests.ports import free_port

ROOT = Path(__file__).parents[2]
LOCK = (ROOT / "environment/requirements.lock").read_text()


def run(*command: str) -> subprocess.CompletedProcess:
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120, stdin=subprocess.DEVNULL)


def normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", re.split(r"[\[<>=!~; ]", name.strip())[0]).lower()


def test_the_lock_pins_everything_that_pyproject_names():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    named = {
        normal(name)
        for group in (project["dependencies"], *project["optional-dependencies"].values())
        for name in group
    } - {"ros2-course"}
    assert named <= {normal(line) for line in LOCK.splitlines() if line and not line.startswith((" ", "#"))}


def test_every_pin_has_an_exact_version_and_hashes():
    pins = re.split(r"\n(?=\S)", LOCK.strip())
    assert [pin.splitlines()[0] for pin in pins if "==" not in pin.splitlines()[0] or "--hash=sha256:" not in pin] == []


def test_the_setuptools_of_colcon_is_pinned_too_and_no_other_programs():
    pin = (ROOT / "environment/colcon.lock").read_text()
    assert re.fullmatch(r"setuptools==[\d.]+( \\\n    --hash=sha256:[0-9a-f]{64})+\n", pin), pin
    version = pin.partition("==")[2].split()[0]
    program = "import setuptools; print(setuptools.__version__)"
    shared = run(".venv/bin/python", "-c", program).stdout.strip()
    assert shared != version and f"setuptools=={shared} " in LOCK
    installed = [path.name for path in (ROOT / ".venv/lib/colcon").glob("setuptools-*.dist-info")]
    assert installed == [f"setuptools-{version}.dist-info"]


def test_the_lock_is_for_all_the_pythons_that_pyproject_allows():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["requires-python"] == ">=3.11,<3.14"
    assert "python_full_version < '3.11'" not in LOCK


def test_install_does_nothing_when_all_is_there():
    done = run("environment/install")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


@pytest.mark.parametrize("script", ["start", "install", "test", "classroom"])
def test_help_is_printed_and_nothing_is_installed(script, tmp_path):
    (tmp_path / "environment").mkdir()
    for each in ("install", script):
        shutil.copy(ROOT / "environment" / each, tmp_path / "environment")
    for more in [["student"], []] if script == "start" else [[]]:
        command = [tmp_path / "environment" / script, *more, "--help"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=120, stdin=subprocess.DEVNULL)
        assert (done.returncode, done.stderr) == (0, "")
        assert f"environment/{script}" in done.stdout and "set -" not in done.stdout
        assert [path.name for path in tmp_path.iterdir()] == ["environment"]


def test_a_second_installation_waits_for_the_first(tmp_path):
    (tmp_path / "environment").mkdir()
    shutil.copy(ROOT / "environment/install", tmp_path / "environment")
    (tmp_path / "df").write_text("#!/bin/sh\necho Filesystem\necho disk 200000 1 100 1% /\n")
    (tmp_path / "df").chmod(0o755)
    with (tmp_path / ".venv.lock").open("w") as lock, (tmp_path / "said").open("w") as said:
        fcntl.flock(lock, fcntl.LOCK_EX)
        second = subprocess.Popen(
            [tmp_path / "environment/install", "student"],
            env={**os.environ, "PATH": f"{tmp_path}:{os.environ['PATH']}"},
            stderr=said,
            stdin=subprocess.DEVNULL,
        )
        waits = f"Another installation is at work in {tmp_path}: waiting for it to end"
        assert wait_until(lambda: waits in (tmp_path / "said").read_text(), 60)
        assert second.poll() is None
    assert second.wait(60) == 1
    assert "Only 100 MB are free on this disk" in (tmp_path / "said").read_text()  # its turn has come


def test_nobody_else_can_hold_the_locks_of_an_installation():
    """A class shows the folder to its students, and an installation would wait for whoever holds one."""
    run("environment/install", "developer")
    locks = [path for path in (ROOT / ".venv/.lock", ROOT / ".venv/lib/colcon/.lock") if path.exists()]
    assert locks and {lock.stat().st_mode & 0o077 for lock in locks} == {0}


def test_what_nobody_needs_is_not_kept():
    """Tests of large libraries, and a copy of each shared library under each of its names."""
    packages = next((ROOT / ".venv/lib").glob("python3*/site-packages"))
    large = ("matplotlib", "nbgrader", "numpy", "scipy", "sklearn")
    assert [path for name in large for path in (packages / name).rglob("tests") if path.is_dir()] == []
    names = [path for path in (ROOT / ".venv/lib").glob("libfastrtps.so*") if not path.is_symlink()]
    assert len(names) > 1 and len({path.stat().st_ino for path in names}) == 1


def test_install_says_how_much_it_needs_and_stops_where_the_disk_is_too_full(tmp_path):
    (tmp_path / "environment").mkdir()
    shutil.copy(ROOT / "environment/install", tmp_path / "environment")
    (tmp_path / "df").write_text("#!/bin/sh\necho Filesystem\necho disk 200000 1 100 1% /\n")
    (tmp_path / "df").chmod(0o755)
    done = subprocess.run(
        [tmp_path / "environment/install", "student"],
        env={**os.environ, "PATH": f"{tmp_path}:{os.environ['PATH']}"},
        capture_output=True,
        text=True,
        timeout=120,
        stdin=subprocess.DEVNULL,
    )
    assert done.returncode == 1 and not (tmp_path / ".venv").exists()
    size = re.search(rf"for a student in {tmp_path}/.venv: (\d+) MB on the disk", done.stderr)[1]
    assert done.stderr.endswith(
        f"\nOnly 100 MB are free on this disk, and {size} MB are needed: make room, and run this again\n"
    )


BUILDS = {"g++", "make"}  # interface packages, and programs in C++: all profiles have them
SANDBOX = {"bubblewrap", "iproute2", "util-linux", "mount"}  # for grading and for a class
BROUGHT = {
    "student": BUILDS,
    "instructor": BUILDS | SANDBOX,
    "classroom": BUILDS | SANDBOX,
    "developer": BUILDS | SANDBOX | {"chromium-headless-shell"},
}


@pytest.mark.parametrize("profile", BROUGHT)
def test_install_brings_each_tool_that_a_bare_machine_lacks(profile, tmp_path):
    """On a PATH that has what every Debian has, and no apt-get."""
    (tmp_path / "environment").mkdir()
    shutil.copy(ROOT / "environment/install", tmp_path / "environment")
    bare = tmp_path / "bin"
    bare.mkdir()
    for name in ("bash", "cat", "dirname", "find", "id", "ls", "readlink", "sed", "sha256sum", "sort", "xargs"):
        (bare / name).symlink_to(shutil.which(name))
    done = subprocess.run(
        [tmp_path / "environment/install", profile],
        env={"PATH": str(bare), "PYTHON": sys.executable},
        capture_output=True,
        text=True,
        timeout=120,
        stdin=subprocess.DEVNULL,
    )
    said = re.search(r"^Please have an administrator install: (.*)$", done.stderr, re.MULTILINE)
    assert done.returncode == 1 and said, done.stderr
    assert {*said[1].split()} - {"python3", "python3-venv", "python3-dev"} == BROUGHT[profile]


OF_ROOT = "can change anything on this machine"


def test_start_passes_its_arguments_to_jupyter_lab_and_warns_root(tmp_path):
    """Of a copy of the script, with stand-ins for what it calls."""
    for name in ("environment/install", ".venv/bin/jupyter"):
        (tmp_path / name).parent.mkdir(parents=True)
        (tmp_path / name).write_text(f'#!/bin/sh\necho {name} "$@"\n')
        (tmp_path / name).chmod(0o755)
    shutil.copy(ROOT / "environment/start", tmp_path / "environment")
    (tmp_path / "notebooks").mkdir()
    done = run(tmp_path / "environment/start", "student", "--no-browser", "--port=1")
    root = os.geteuid() == 0
    lab = ".venv/bin/jupyter lab --LabApp.default_url=/lab/tree/index.ipynb"
    assert done.returncode == 0
    assert done.stdout.splitlines() == [
        "environment/install student",
        f"{lab} {'--allow-root ' * root}--no-browser --port=1",
    ]
    assert (OF_ROOT in done.stderr) is root


@pytest.mark.parametrize("way", [each_night("moved"), "copied", "reached by a link"])
def test_install_makes_a_moved_environment_anew_and_keeps_one_in_its_place(way, tmp_path):
    """The first line of each program in it names the folder that it was made in."""
    first, now = tmp_path / "my course", tmp_path / "now"
    (first / "environment").mkdir(parents=True)
    shutil.copy(ROOT / "environment/install", first / "environment")  # without a lock: it ends before it downloads
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", first / ".venv"], check=True)
    if way == "moved":
        first.rename(now)
    elif way == "copied":
        shutil.copytree(first, now, symlinks=True)
    else:
        now.symlink_to(first)
    (now / ".venv/kept").touch()
    done = subprocess.run(
        [now / "environment/install", "student"], capture_output=True, text=True, timeout=120, stdin=subprocess.DEVNULL
    )
    anew = way != "reached by a link"
    assert f"{'2 of 4' if anew else '1 of 3'}: Installing the locked dependencies" in done.stderr, done
    assert ("was made in another folder" in done.stderr) is anew, done
    assert (now / ".venv/kept").exists() is not anew
    assert f"{now if anew else first}/.venv" in (now / ".venv/bin/activate").read_text()


ORDINARY = 65534  # nobody's


@pytest.fixture
def home():
    """A home folder that an ordinary user may enter; pytest's own are closed to others."""
    folder = Path(tempfile.mkdtemp(prefix="ros2-course-home-"))
    yield folder
    shutil.rmtree(folder)


AS_ORDINARY = ("setpriv", f"--reuid={ORDINARY}", f"--regid={ORDINARY}", "--clear-groups", "--")


@pytest.mark.parametrize("ordinary", [True, each_night(False)], ids=["as an ordinary user", "as who runs this"])
def test_start_serves_the_start_page_to_this_machine_alone(ordinary, home):
    """As who runs this also where that is no ordinary user, and cannot become one that may enter this checkout."""
    become, root = [], os.geteuid() == 0
    if ordinary and root and not subprocess.run([*AS_ORDINARY, "test", "-x", ROOT]).returncode:
        become, root = AS_ORDINARY, False
        os.chown(home, ORDINARY, ORDINARY)
    port = free_port()
    command = [*become, ROOT / "environment/start", "--no-browser", f"--port={port}", "--ServerApp.port_retries=0"]
    with open(home / "log", "w+b") as log:
        process = subprocess.Popen(
            list(map(str, command)),
            env={"PATH": os.environ["PATH"], "HOME": str(home), "LANG": "C.UTF-8"},
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.STDOUT,
        )
        try:
            begun = rf"http://127\.0\.0\.1:{port}(/lab/tree/index\.ipynb)\?token=\w+"

            def address() -> re.Match[str] | None:
                return re.search(begun, (home / "log").read_text())

            found = wait_until(address, 60, unless=lambda: process.poll() is not None, alert=False)
            assert found, (home / "log").read_text()
            assert (ROOT / "notebooks/index.ipynb").exists()
            assert wait_until(lambda: listening(port), 20, alert=False), "it says where it is before it listens"
            with urllib.request.urlopen(found[0], timeout=30) as answer:
                page = answer.read().decode()
            assert answer.geturl().partition("?")[0].endswith(found[1]) and "jupyter-config-data" in page
            assert listening(port) <= {"0100007F", "00000000000000000000000001000000"}
        finally:
            process.terminate()
            process.wait(20)
    said = (home / "log").read_text()
    assert (OF_ROOT in said) is root, said
    assert "Installing" not in said, "it set up again what was there"


def listening(port: int) -> set[str]:
    """The addresses, as the kernel writes them, at which somebody listens at a TCP port."""
    lines = [line.split() for table in ("tcp", "tcp6") for line in Path("/proc/net", table).read_text().splitlines()]
    return {words[1].split(":")[0] for words in lines if words[1].endswith(f":{port:04X}") and words[3] == "0A"}


def test_an_unknown_profile_is_a_usage_error():
    done = run("environment/install", "teacher")
    assert done.returncode == 2 and done.stderr.startswith("Usage: environment/install")


@pytest.mark.parametrize("script", ["environment/start", "environment/test", "environment/check", "environment/site"])
def test_every_command_begins_with_install(script):
    lines = [line for line in (ROOT / script).read_text().splitlines() if "environment/" in line and line[0] != "#"]
    assert "environment/install" in lines[0]


def test_ci_runs_readmes_test_command():
    assert "environment/test" in (ROOT / ".ci/run").read_text()
    assert "environment/test" in (ROOT / "README.md").read_text()
    assert "environment/start" in (ROOT / "README.md").read_text()


def test_the_test_command_runs_the_guards_beside_the_tests_unless_tests_are_named(tmp_path):
    """Of a copy of the script, with stand-ins for what it calls."""
    (tmp_path / ".venv/bin").mkdir(parents=True)
    (tmp_path / "environment").mkdir()
    shutil.copy(ROOT / "environment/test", tmp_path / "environment")
    for name in ("environment/install", "environment/check", ".venv/bin/python"):
        (tmp_path / name).write_text(f'#!/bin/sh\necho {name} "$@"\n')
        (tmp_path / name).chmod(0o755)

    def called(*arguments):
        done = run(tmp_path / "environment/test", *arguments)
        assert done.returncode == 0, done.stderr
        first, *rest = done.stdout.splitlines()
        assert first == "environment/install developer"
        return {*rest}

    python = ".venv/bin/python -m pytest"
    assert called() == {"environment/check", f"{python} -n 4"}
    assert called("--all") == {"environment/check", f"{python} -n 4 -m "}
    assert called("tests/course", "-k", "a b") == {f"{python} tests/course -k a b"}
    for failing, status in (("environment/check", 1), (".venv/bin/python", 3)):
        fine = (tmp_path / failing).read_text()
        (tmp_path / failing).write_text(f"#!/bin/sh\nexit {status}\n")
        done = run(tmp_path / "environment/test")
        assert done.returncode == status and ("found something" in done.stderr) == (failing == "environment/check")
        (tmp_path / failing).write_text(fine)


def guards() -> list[str]:
    """The commands of environment/check."""
    lines = (ROOT / "environment/check").read_text().splitlines()
    return [line.removesuffix(" || status=1") for line in lines if line.startswith(".venv/bin/")]


def test_the_guards_are_style_types_and_arrows():
    assert [command.split()[0] for command in guards()] == [
        f".venv/bin/{tool}" for tool in ("ruff", "ruff", "mypy", "lint-imports")
    ]


def test_style_is_not_asked_of_what_cells_have_written_where_no_git_ignores_it(tmp_path):
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    for name in ("notebooks/services/relay.py", "notebooks/calculator/ros2_ws/src/calculator/setup.py"):
        (tmp_path / name).parent.mkdir(parents=True)
        (tmp_path / name).write_text("import sys, os\n")
    ruff = Path(sys.prefix) / "bin/ruff"
    for words in (["check"], ["format", "--check"]):
        done = subprocess.run([ruff, *words, "."], cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout


def test_pre_commit_runs_the_guards_and_downloads_nothing():
    repositories = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text())["repos"]
    assert [repository["repo"] for repository in repositories] == ["local"]
    hooks = repositories[0]["hooks"]
    assert [hook["entry"] for hook in hooks] == guards()
    assert {(hook["language"], hook["pass_filenames"]) for hook in hooks} == {("system", False)}
    assert run(".venv/bin/pre-commit", "validate-config").returncode == 0


def test_the_workflow_calls_guards_and_tests_on_all_the_pythons_that_pyproject_allows():
    workflow = yaml.safe_load((ROOT / ".github/workflows/ci.yml").read_text())
    job = workflow["jobs"]["test"]
    steps = [step["run"] for step in job["steps"] if "run" in step]
    tests = "environment/test ${{ github.event_name == 'schedule' && '--all' || '' }}"
    assert steps[-3:-1] == ["environment/check", tests]
    by_root = steps[-1].removeprefix("sudo environment/test -n 4 ").split()
    here = Path(__file__).parents[1]
    for_root = {
        path.relative_to(here).parts[0] for path in here.rglob("test_*.py") if "geteuid() != 0" in path.read_text()
    }
    assert {f"tests/{folder}" for folder in for_root} <= {*by_root}
    assert all((ROOT / folder).is_dir() for folder in by_root)
    assert {"push", "schedule"} <= {*workflow[True]}  # YAML 1.1 reads `on` so
    assert job["strategy"]["matrix"]["python"] == ["3.11", "3.12", "3.13"]
