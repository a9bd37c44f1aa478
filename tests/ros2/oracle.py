"""Run ros2cli's own launch tests, unchanged, against this `ros2` command: what passes there must pass here.

    .venv/bin/python tests/ros2/oracle.py SOURCES [--prefix FOLDER] [--real] [--only TEXT] [--patience FACTOR]

SOURCES is a folder that holds, in any layout, the sources of ros2cli and of what its tests need: launch, launch_ros,
osrf_pycommon, rosidl_runtime_py, ament_lint, test_interface_files and rcl_interfaces, each on
its branch `jazzy` if it has one.  They are copied, installed beside the wheels into FOLDER (by default a temporary
one; a FOLDER of an earlier run is used as it is), and nothing of them gets into this repository.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from shutil import copytree
from typing import NamedTuple
from xml.etree import ElementTree

from course.environment import prepare
from course.interfaces.install import install as build
from course.ros.graph import participants_here

PYTHON_PACKAGES = (
    "osrf_pycommon", "launch", "launch_xml", "launch_yaml", "launch_testing", "launch_ros", "launch_testing_ros",
    "ros2launch", "rosidl_runtime_py", "ament_lint", "ament_copyright", "ros2cli", "ros2action", "ros2component",
    "ros2doctor", "ros2interface", "ros2lifecycle", "ros2multicast", "ros2node", "ros2param", "ros2pkg", "ros2run",
    "ros2service", "ros2topic",
)  # fmt: skip
INTERFACE_PACKAGES = (
    "composition_interfaces", "test_interface_files", "test_msgs", "ros2cli_test_interfaces",
)  # fmt: skip
# The commands that this `ros2` has; the tests of ros2lifecycle also need C++ nodes.
TESTED = (
    "ros2action", "ros2doctor", "ros2interface", "ros2node", "ros2param", "ros2pkg", "ros2service", "ros2topic",
)  # fmt: skip
SECONDS = 600  # until a test file that does not end is killed
# The tests give a command 2 to 10 s: on a busy machine that says nothing of the command.
PATIENT = """
import sys
from launch_testing.launch_test import main
from launch_testing.tools.process import ProcessProxy

def stretch(wait):
    def longer(*args, timeout=None, **more):
        return wait(*args, timeout=timeout and timeout * FACTOR, **more)
    return longer

ProcessProxy.wait_for_shutdown = stretch(ProcessProxy.wait_for_shutdown)
ProcessProxy.wait_for_output = stretch(ProcessProxy.wait_for_output)
sys.exit(main())
"""


class Outcome(NamedTuple):
    """The outcome of one test: `passed`, `skipped`, or why it failed."""

    name: str
    text: str


def find_packages(sources: Path) -> dict[str, Path]:
    """Return the folder of each package that the tests need; exits with the names of those that are missing."""
    found = {}
    for manifest in sorted(sources.rglob("package.xml")):
        name = (ElementTree.parse(manifest).getroot().findtext("name") or "").strip()
        found.setdefault(name, manifest.parent)
    needed = PYTHON_PACKAGES + INTERFACE_PACKAGES
    if missing := [name for name in needed if name not in found]:
        sys.exit(f"{sources} has no package {', '.join(missing)}")
    return {name: found[name] for name in needed}


def install(packages: dict[str, Path], prefix: Path) -> None:
    """Copy the packages to `prefix`/source and install them below `prefix`."""
    copies = {name: prefix / "source" / name for name in packages}
    for name, folder in packages.items():
        copytree(folder, copies[name], dirs_exist_ok=True)
    command = [sys.executable, "-m", "uv", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation"]
    folders = [str(copies[name]) for name in PYTHON_PACKAGES]
    subprocess.run([*command, "--python", sys.executable, "--target", str(prefix), *folders], check=True)
    for name in INTERFACE_PACKAGES:
        build(str(copies[name]), prefix)
    (prefix / "complete").touch()


def environment(prefix: Path, *, real: bool, domain: int) -> dict[str, str]:
    """Return the environment of the tests; the first `ros2` on PATH is this command, or with `real` ros2cli's."""
    python = next(prefix.glob("lib/python*/site-packages"))
    programs = [str(Path(sys.executable).parent), os.environ["PATH"]]
    changed = {
        "PATH": os.pathsep.join([str(prefix / "bin"), *programs] if real else programs),
        "PYTHONPATH": os.pathsep.join([str(prefix), str(python)]),
        "AMENT_PREFIX_PATH": os.pathsep.join([str(prefix), os.environ["AMENT_PREFIX_PATH"]]),
        "LD_LIBRARY_PATH": os.pathsep.join([str(prefix / "lib"), os.environ.get("LD_LIBRARY_PATH", "")]),
        "ROS_DOMAIN_ID": str(domain),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "XDG_RUNTIME_DIR": str(prefix),  # no session of this machine is known there
    }
    # The tests' nodes are to be those of any ROS 2 installation, without the course's profile.
    return {**{name: value for name, value in os.environ.items() if not name.startswith("FASTRTPS_")}, **changed}


def run(file: Path, prefix: Path, variables: dict[str, str], patience: float = 1) -> Iterator[Outcome]:
    """Run one file of launch tests, whose waits are `patience` times as long; yields the outcome of each test in it."""
    label = f"{file.parents[1].name}/{file.name}"
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder, "report.xml")
        patient = PATIENT.replace("FACTOR", str(patience))
        command = [sys.executable, "-c", patient, str(file), "--junit-xml", str(report)]
        try:
            done = subprocess.run(
                command, capture_output=True, text=True, timeout=SECONDS * patience, env=variables, cwd=file.parent
            )
        except subprocess.TimeoutExpired:
            yield Outcome(label, f"did not end within {SECONDS * patience:.0f} s")
            return
        finally:  # some tests start ros2cli's daemon, which outlives them
            stop = [sys.executable, str(prefix / "bin" / "ros2"), "daemon", "stop"]
            subprocess.run(stop, env=variables, capture_output=True, check=False)
        if not report.exists():
            yield Outcome(label, (done.stderr.strip() or "no report").splitlines()[-1])
            return
        for case in ElementTree.parse(report).iter("testcase"):
            wrong = case.find("failure") if case.find("error") is None else case.find("error")
            text = "skipped" if case.find("skipped") is not None else "passed"
            if wrong is not None:
                text = (wrong.get("message") or wrong.text or "failed").strip()
            yield Outcome(f"{label}: {case.get('classname', '').rpartition('.')[2]}.{case.get('name')}", text)


def main() -> int:
    """Install what is needed, run the tests and print the failures; 1 if there are any."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("sources", type=Path, help="folder with the sources")
    parser.add_argument("--prefix", type=Path, help="folder to install them in (default: a temporary one)")
    parser.add_argument("--real", action="store_true", help="run the tests against ros2cli itself, for comparison")
    parser.add_argument("--only", default="", help="run the test files that have this text in their path")
    parser.add_argument("--jobs", type=int, default=1, help="run this number of test files side by side")
    parser.add_argument("--patience", type=float, default=1, help="make the tests' own limits as many times as long")
    args = parser.parse_args()
    prepare()
    with tempfile.TemporaryDirectory() as temporary, ThreadPoolExecutor(args.jobs) as pool:
        prefix = (args.prefix or Path(temporary)).absolute()
        if not (prefix / "complete").exists():
            install(find_packages(args.sources), prefix)
        files = [
            file
            for name in TESTED
            for file in sorted((prefix / "source" / name / "test").glob("test_*.py"))
            if "generate_test_description" in file.read_text() and args.only in str(file)
        ]
        domains = [domain for domain in range(80, 101) if participants_here(domain) == 0]
        tasks = []
        for number, file in enumerate(files):
            variables = environment(prefix, real=args.real, domain=domains[number % len(domains)])
            tasks.append(pool.submit(list, run(file, prefix, variables, args.patience)))
        outcomes = []
        for task in tasks:
            outcomes += task.result()
            for outcome in task.result():
                if outcome.text not in ("passed", "skipped"):
                    print(f"FAILED {outcome.name}\n{outcome.text[:2000]}".replace("\n", "\n    "), flush=True)
    counted = [outcome for outcome in outcomes if outcome.text != "skipped"]
    passed = sum(outcome.text == "passed" for outcome in counted)
    print(f"{passed} of {len(counted)} tests passed, {len(outcomes) - len(counted)} were skipped")
    return 0 if passed == len(counted) else 1


if __name__ == "__main__":
    sys.exit(main())
