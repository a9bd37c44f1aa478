"""Build the Python packages of a folder with `colcon build`, as a student does, and run each of their programs.

    .venv/bin/python tests/workspace/programs.py FOLDER... [--into WORKSPACE] [--only TEXT]

FOLDER holds ROS 2 packages in any layout: those of ros2/examples and ros2/demos, branch jazzy, say.  The packages in
Python (ament_python) and the interface packages are copied into a workspace, built there in the course's world, and
each of their console scripts is started by `ros2 run`, with its partner: a client with its server, a listener with its
talker, and the other way round.  A program is right when it ends by itself with status 0, or goes on until Ctrl-C
without a traceback and then ends within 10 s.  Prints a table, and exits with 1 if anything in it
is wrong.
"""

import argparse
import difflib
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from configparser import ConfigParser
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

from course.environment import prepare, session_variables, workspace_variables
from course.foundation.waiting import wait_until
from course.session.domains import claim_domain

# Who talks with whom, by a word in the names of their programs and packages.
PARTNERS = {
    "client": ("server", "service"),
    "server": ("client",),
    "service": ("client",),
    "listener": ("talker",),
    "talker": ("listener",),
    "subscriber": ("publisher",),
    "publisher": ("subscriber",),
    "monitor": ("publisher",),
}
INTERFACES = "rosidl_interface_packages"
# What no name tells: the partner of a program, and the arguments that it cannot do without.
GIVEN = {
    "async_param_client": ("demo_nodes_cpp", "parameter_blackboard"),
    "listener_serialized": ("demo_nodes_py", "talker"),
    "use_logger_service": None,
}
ARGUMENTS = {
    "incompatible_qos": ["durability"],
    "deadline": ["600", "--publish-for", "2000", "--pause-for", "1000"],
    "lifespan": ["1000", "--publish-count", "3", "--subscribe-after", "1000"],
    "liveliness": ["1000", "--kill-publisher-after", "2000"],
}
SHOWN = 12.0  # s that a program is watched
ENDED = 10.0  # s after Ctrl-C
TROUBLE = re.compile(r"^Traceback |^terminate called|Segmentation fault", re.MULTILINE)


class Program(NamedTuple):
    """A console script."""

    package: str
    name: str


class Verdict(NamedTuple):
    """The outcome of a build or of a program: whether it is right, and a few words."""

    right: bool
    text: str


def packages(folders: list[Path]) -> dict[str, Path]:
    """Return the folders of the packages in Python, and of interface packages, below the folders, by their names."""
    found = {}
    for manifest in sorted(path for folder in folders for path in folder.rglob("package.xml")):
        root = ElementTree.parse(manifest).getroot()
        interfaces = root.findtext("member_of_group") == INTERFACES and "rclcpp" not in {each.text for each in root}
        if interfaces or root.findtext("export/build_type") == "ament_python":
            found[(root.findtext("name") or "").strip()] = manifest.parent
    return found


def build(workspace: Path, variables: dict[str, str]) -> dict[str, Verdict]:
    """Build the workspace; return the verdict of each package."""
    command = ["colcon", "build", "--continue-on-error", "--event-handlers", "console_stderr-"]
    done = subprocess.run(command, cwd=workspace, env=variables, capture_output=True, text=True, check=False)
    verdicts = {}
    for name, seconds in re.findall(r"^Finished <<< (\S+) \[(.+?)\]", done.stdout, re.MULTILINE):
        log = workspace / "log/latest_build" / name / "stderr.log"
        said = log.read_text().strip() if log.exists() else ""
        verdicts[name] = Verdict(
            not said, f"built in {seconds}" + (f", and said: {said.splitlines()[0]}" if said else "")
        )
    for name in packages([workspace / "src"]):
        if name not in verdicts:
            log = workspace / "log/latest_build" / name / "stderr.log"
            said = log.read_text().strip() if log.exists() else done.stderr.strip()
            verdicts[name] = Verdict(False, f"not built: {(said or 'no reason').splitlines()[-1]}")
    return verdicts


def programs(workspace: Path) -> list[Program]:
    """Return the console scripts of all packages that were built."""
    found = []
    for file in sorted(workspace.glob("install/*/lib/python3*/site-packages/*.egg-info/entry_points.txt")):
        entries = ConfigParser(delimiters=("=",))
        entries.optionxform = str  # type: ignore[assignment,method-assign]  # names keep their capitals
        entries.read(file)
        if entries.has_section("console_scripts"):
            found += [Program(file.relative_to(workspace).parts[1], name) for name in entries["console_scripts"]]
    return found


def partner(program: Program, everybody: list[Program]) -> Program | None:
    """Return whom a program talks with; None for one that is alone."""
    if program.name in GIVEN:
        given = GIVEN[program.name]
        return Program(*given) if given else None
    for word, others in PARTNERS.items():
        if word not in program.name:
            continue
        for other in others:
            name, package = program.name.replace(word, other), program.package.replace(word, other)
            near = [each for each in everybody if other in each.name and each.package in (program.package, package)]
            names = difflib.get_close_matches(name, [each.name for each in near], 1, 0)
            if names:
                return next(each for each in near if each.name == names[0])
    return None


@contextmanager
def running(program: Program, variables: dict[str, str], log: Path) -> Iterator[subprocess.Popen]:
    """Have `ros2 run` run a program in a process group of its own, all that it says going to a file."""
    command = ["ros2", "run", *program, *ARGUMENTS.get(program.name, [])]
    with log.open("w") as said:
        child = subprocess.Popen(
            command,
            env={**variables, "PYTHONUNBUFFERED": "1"},
            stdin=subprocess.DEVNULL,
            stdout=said,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
    try:
        yield child
    finally:
        end(child)


def end(child: subprocess.Popen) -> bool:
    """Press Ctrl-C, as a terminal does for all that runs in it; return True if the program ends of it."""
    for number in (signal.SIGINT, signal.SIGKILL):
        if child.poll() is None:
            os.killpg(child.pid, number)
            if wait_until(lambda: child.poll() is not None, ENDED):
                return number == signal.SIGINT
    return True


def watch(program: Program, other: Program | None, variables: dict[str, str], folder: Path) -> Verdict:
    """Run a program beside its partner; return what became of it."""
    log, others = folder / "program.log", folder / "partner.log"
    asks = other is not None and re.search("client|listener|subscriber|monitor", program.name)
    order = [other, program] if asks else [program, other]
    with (
        running(order[0], variables, log if order[0] == program else others) as first,  # type: ignore[arg-type]
        running(order[1], variables, others if order[0] == program else log) if order[1] else _nobody() as second,
    ):
        child = first if order[0] == program else second
        assert child is not None
        by_itself = wait_until(lambda: child.poll() is not None or TROUBLE.search(log.read_text()) is not None, SHOWN)
        ended = by_itself or end(child)
        said = log.read_text()
    complaint = ""
    if trouble := TROUBLE.search(said):
        told = [
            line for line in said[trouble.start() :].splitlines() if line and not line.startswith((" ", "[ros2run]"))
        ]
        if by_itself:
            return Verdict(False, told[-1])
        complaint = f", then {told[-1]}"  # examples often catch no Ctrl-C, or shut down what Ctrl-C has shut down
    if not ended:
        return Verdict(False, f"went on for {ENDED:.0f} s after Ctrl-C")
    if by_itself and child.returncode:
        return Verdict(False, f"ended with status {child.returncode}: {(said.splitlines() or [''])[-1]}")
    how = "ended by itself" if by_itself else f"ran until Ctrl-C{complaint}"
    return Verdict(True, f"{how}, {len(said.splitlines())} lines")


@contextmanager
def _nobody() -> Iterator[None]:
    yield None


def main() -> int:
    """Build, run, print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("folders", type=Path, nargs="+", metavar="FOLDER")
    parser.add_argument("--into", type=Path, help="the workspace (default: a temporary one)")
    parser.add_argument("--only", default="", help="run the programs that have this text in `package program`")
    args = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # leaves no program behind
    prepare()
    claim, domain = claim_domain()
    variables = {**os.environ, **workspace_variables(), **session_variables(domain)}
    with tempfile.TemporaryDirectory() as temporary:
        workspace = (args.into or Path(temporary, "ros2_ws")).absolute()
        for name, folder in packages(args.folders).items():
            shutil.copytree(folder, workspace / "src" / name, dirs_exist_ok=True)
        built = build(workspace, variables)
        for name, verdict in built.items():
            print(f"{'ok  ' if verdict.right else 'NO  '} {name}: {verdict.text}", flush=True)
        sourced = [". install/setup.bash && env -0"]
        words = ["bash", "--norc", "-c", *sourced]
        said = subprocess.run(words, cwd=workspace, env=variables, capture_output=True, text=True, check=True).stdout
        variables = dict(line.partition("=")[::2] for line in said.split("\0") if line)
        everybody = programs(workspace)
        ran = []
        for program in everybody:
            if args.only not in " ".join(program):
                continue
            other = partner(program, everybody)
            verdict = watch(program, other, variables, Path(temporary))
            ran.append(verdict)
            beside = f" beside {' '.join(other)}" if other else ""
            print(f"{'ok  ' if verdict.right else 'NO  '} {' '.join(program)}{beside}: {verdict.text}", flush=True)
    claim.close()
    good, well = sum(each.right for each in built.values()), sum(each.right for each in ran)
    print(f"{good} of {len(built)} packages were built without a word, {well} of {len(ran)} programs run")
    return 0 if good == len(built) and well == len(ran) else 1


if __name__ == "__main__":
    sys.exit(main())
