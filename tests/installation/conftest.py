"""Other installations of this course, made in seconds: their `.venv` is a copy of this one's by hard links."""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from autograder.submissions import exercises

ROOT = Path(__file__).parents[2]
HERE = Path(sys.prefix)
SECRET = exercises.load("services").tests[0].id  # only in the hidden suite; an installation's probe searches for it

# A program in the sandbox that sees ROS 2, and searches for the grader: by import, and by whatever can be opened.
# `below` is what it sees in FOLDER that is neither VENV nor on the way there.
PROBE = """
import importlib.util, json, os, subprocess, sys
import rclpy

def below(folder):
    for path in (os.path.join(folder, name) for name in os.listdir(folder)):
        if not VENV.startswith(path + '/') and path != VENV:
            yield path
        elif path != VENV:
            yield from below(path)

def listed(folder):
    return os.listdir(folder) if os.path.isdir(folder) else []

def find(name):
    try:
        return importlib.util.find_spec(name)
    except ModuleNotFoundError:
        return None

kinds = [f'--include={kind}' for kind in ('*.py', '*.pyc', '*.toml', '*.txt', '*.ipynb', 'RECORD')]
found = subprocess.run(['grep', '-rlsF', *kinds, SECRET, '.', *SEARCHED], capture_output=True, text=True).stdout
print(json.dumps(dict(
    found=sorted(found.split()), below=sorted(below(FOLDER)) if FOLDER else [], prefix=sys.prefix,
    listed={path: listed(path) for path in PRIVATE},
    imported=[name for name in ('autograder.cli', 'autograder.hidden', 'autograder.hidden.services') if find(name)],
)))
"""
ITSELF = "./probe.py"  # what the search finds at least: PROBE has its word in it
# What an installation's own interpreter runs to confine PROBE, which it reads from its standard input.
CONFINE = """
import subprocess, sys
from autograder.sandbox import sandbox

with sandbox.Sandbox(chosen := sandbox.choose(), {'probe.py': sys.stdin.buffer.read()}) as confined:
    command = [*sandbox.CONFINEMENTS[chosen], *confined.command(['probe.py'], domain=0)]
    raise SystemExit(subprocess.run(command, pass_fds=confined.descriptors, timeout=60).returncode)
"""


@dataclass
class Installation:
    """An environment with the course in it."""

    prefix: Path
    variables: dict[str, str] = field(default_factory=dict)

    def run(self, program: str, *arguments: object, given: str | None = None) -> subprocess.CompletedProcess[str]:
        """Run one of its programs somewhere else, without what this process has set for its own environment."""
        own = {"LD_LIBRARY_PATH", "AMENT_PREFIX_PATH", "PATH"}
        variables = {}
        for name, value in os.environ.items():
            if name in own:
                parts = [part for part in value.split(os.pathsep) if not part.startswith(str(HERE))]
                variables |= {name: os.pathsep.join(parts)} if parts else {}
            elif not name.startswith(("_ROS_WHEELS", "FASTRTPS_", "PYTHON", "VIRTUAL_ENV")):
                variables[name] = value
        return subprocess.run(
            [str(self.prefix / "bin" / program), *map(str, arguments)],
            input=given,
            capture_output=True,
            text=True,
            timeout=120,
            cwd="/",
            env=variables | self.variables,
        )

    def sees(self, folder: Path | None = None, private: list[Path] | None = None, searched: list[Path] | None = None):
        """Return the findings of PROBE in its sandbox."""
        known = {
            "SECRET": SECRET,
            "VENV": str(self.prefix),
            "FOLDER": folder and str(folder),
            "PRIVATE": list(map(str, private or [])),
            "SEARCHED": list(map(str, searched or [self.prefix])),
        }
        probe = "".join(f"{name} = {value!r}\n" for name, value in known.items()) + PROBE
        done = self.run("python", "-c", CONFINE, given=probe)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    def score(self) -> tuple[str, float | None, list[str]]:
        """Status, score and flags of the services' motors; the relay, worth 10 of 20 points, ends at once."""
        with tempfile.TemporaryDirectory() as folder:
            shutil.copy(ROOT / "solutions/services/motor_service.py", folder)
            (Path(folder) / "relay.py").write_text("def main(:\n")
            done = self.run("autograder", "check", folder, "--assignment", "services", "--json")
        assert done.returncode == 0, done.stderr
        report = json.loads(done.stdout)
        return report["status"], report["score"], report["flags"]


def copy_checkout(target: Path) -> None:
    """The files of this checkout that an installation is made of, and those that a student must not see."""
    for name in ("autograder", "course", "notebooks", "solutions"):
        ignored = shutil.ignore_patterns("__pycache__", ".ipynb_checkpoints")
        shutil.copytree(ROOT / name, target / name, ignore=ignored)
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, target)


def copy_environment(target: Path) -> None:
    """This process's environment, at another place: its programs name their interpreter in their first line."""
    linked = subprocess.run(["cp", "-al", HERE, target], capture_output=True)
    if linked.returncode:  # another file system
        shutil.rmtree(target, ignore_errors=True)
        subprocess.run(["cp", "-a", HERE, target], check=True)
    for program in (target / "bin").iterdir():
        first, _, rest = program.read_bytes().partition(b"\n") if program.is_file() else (b"", b"", b"")
        if first.startswith(b"#!%s/" % os.fsencode(HERE)):
            mode = program.stat().st_mode
            program.unlink()  # the link: this process's own program stays as it is
            program.write_bytes(first.replace(os.fsencode(HERE), os.fsencode(target)) + b"\n" + rest)
            program.chmod(mode)


def install(target: Path, *what: object) -> None:
    """Replace the course in the environment `target`, as `uv pip install` does."""
    options = ["--quiet", "--offline", "--no-deps", "--no-build-isolation", "--reinstall-package", "ros2-course"]
    uv = [HERE / "bin" / "uv", "pip", "install", "--python", target / "bin" / "python", *options, *what]
    subprocess.run(list(map(str, uv)), check=True, timeout=120)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """This repository as a wheel."""
    folder = tmp_path_factory.mktemp("wheel")
    copy_checkout(folder / "source")  # building leaves files in the source
    command = [HERE / "bin" / "uv", "build", "--quiet", "--offline", "--wheel", "--no-build-isolation"]
    command += ["--python", sys.executable, "--out-dir", folder / "out", folder / "source"]
    subprocess.run(list(map(str, command)), check=True, timeout=120)
    return next((folder / "out").glob("*.whl"))
