"""A folder that somebody has handed in is opened: nothing of it runs before a cell, or a command, asks for it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from autograder.paths import repository
from course import interfaces
from course.notebook import own_path
from course.ros import packages
from tests import chosen
from tests.kernels import Kernel

# What Python, IPython, JupyterLab or the course look for by these names.
NAMES = [
    "appnope",
    "argcomplete",
    "atomicwrites",
    "colorama",
    "comm",
    "course",
    "ctags",
    "debugpy",
    "decorator",
    "django",
    "future_builtins",
    "ipykernel",
    "ipykernel_launcher",
    "IPython",
    "ipython_config",
    "jedi",
    "matplotlib",
    "nbgrader_config",
    "numpydoc",
    "rclpy",
    "regex",
    "sitecustomize",
    "tornado",
    "traitlets",
    "trio",
    "typing",
    "usercustomize",
    "zmq",
]


@pytest.fixture
def folder(tmp_path) -> Path:
    """A folder with a module of each name, which tells when it is run, and with an answer."""
    for name in NAMES:
        (tmp_path / f"{name}.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'a').write({name!r} + chr(10))\n")
    (tmp_path / "wall_agent.py").write_text("answer = 42\n")
    (tmp_path / "asked.py").write_text("answer = 1\n")
    (tmp_path / "asks.py").write_text("from asked import answer\n")
    (tmp_path / "magic.py").write_text(
        "def load_ipython_extension(shell):\n"
        "    shell.register_magic_function(lambda line: print('said'), magic_name='magic_word')\n"
    )
    return tmp_path


def ran(folder: Path) -> str:
    told = folder / "ran"
    return told.read_text() if told.exists() else ""


def without_configuration(folder: Path) -> None:
    """Remove what nbgrader and Jupyter run in any folder, and what is never collected."""
    for configuration in folder.glob("*_config.py"):
        configuration.unlink()


def test_a_kernel_takes_nothing_from_its_folder_but_what_a_cell_asks_for(folder):
    kernel = Kernel(folder)
    try:
        for ask in (kernel.client.complete, kernel.client.inspect):
            ask("import os\nos.pa", 15, reply=True, timeout=60)
        kernel.client.complete("from colorama import ", reply=True, timeout=60)
        kernel.client.inspect("print", 5, 1, reply=True, timeout=60)
        assert kernel.run("import course, typing, zmq\nprint(typing.Any)") == "typing.Any"
        kernel.run("ros = course.live()\ncourse.check()")
        assert ran(folder) == ""
        assert kernel.run("import wall_agent\nprint(wall_agent.answer)") == "42"
        assert (
            kernel.run("import asks, importlib\nprint(importlib.import_module('asked').answer, asks.answer)") == "1 1"
        )
        assert kernel.run("%load_ext magic\n%magic_word") == "said"
    finally:
        kernel.stop()
    assert ran(folder) == ""


@pytest.mark.parametrize("command", [["environment/shell", "true"], ["environment/shell", "--lab"]])
def test_a_terminal_takes_nothing_from_its_folder(folder, command):
    program, *arguments = command
    subprocess.run([repository() / program, *arguments], cwd=folder, check=True, timeout=60, stdin=subprocess.DEVNULL)
    assert ran(folder) == ""


@pytest.mark.parametrize("program", ["nbgrader", "jupyter-nbconvert", "jupyter-dejavu"])
def test_each_program_that_would_search_its_folder_for_modules_is_started_without_it(program):
    text = Path(sys.executable).with_name(program).read_text()
    assert f"-P -m {own_path.__name__} {program} " in text


# Belong to the matrix: another command of the same kind is called in each run.
ALIKE = {"jupyter dejavu --help", "nbgrader list"}
COMMANDS = [
    "autograder --help",
    "course sessions",
    "ipython -c print(1)",
    "jupyter dejavu --help",
    "jupyter nbconvert --to markdown book.ipynb",
    "jupyter kernelspec list",
    "nbgrader list",
    "nbgrader zip_collect calculator",
    "ros2 pkg executables course",
]


@pytest.mark.parametrize("command", chosen.cases(COMMANDS, ALIKE))
def test_a_command_takes_nothing_from_its_folder(folder, command):
    without_configuration(folder)
    (folder / "book.ipynb").write_text('{"cells": [], "metadata": {}, "nbformat": 4, "nbformat_minor": 5}')
    program, *arguments = command.split()
    environment = os.environ | {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    done = subprocess.run(
        [program, *arguments], cwd=folder, env=environment, capture_output=True, text=True, timeout=60
    )
    assert ran(folder) == "" and "Traceback" not in done.stderr


def test_a_server_with_formgrader_takes_nothing_from_its_folder(folder):
    without_configuration(folder)
    program = """
from course.lab.server import formgrader
formgrader.guard()
from nbgrader.server_extensions.formgrader.formgrader import FormgradeExtension
FormgradeExtension().initialize([])
import argcomplete
"""
    subprocess.run([sys.executable, "-P", "-c", program], cwd=folder, check=True, timeout=60)
    assert ran(folder) == ""


def test_an_interface_is_built_with_nothing_of_the_folder(folder, monkeypatch, tmp_path_factory):
    """As `course doctor` does, and a cell with a `.srv`."""
    monkeypatch.chdir(folder)
    cache = tmp_path_factory.mktemp("cache")
    built = interfaces.build("opened_interfaces", {"Ping.srv": "int32 a\n---\nint32 b\n"}, cache=cache, use=False)
    assert built.site_packages.is_dir() and ran(folder) == ""


def test_a_node_of_the_course_is_run_with_nothing_of_the_folder(folder, monkeypatch):
    """As by `ros2 run`, also where the course's package is not registered."""
    monkeypatch.setattr(packages, "installed_paths", lambda name: None)
    commands = (packages.find_executables(packages.COURSE) or {})["add_two_ints_client"]
    python = commands[0][:-1]  # its last word names the node
    subprocess.run([*python, "course.nodes"], cwd=folder, timeout=60, stdin=subprocess.DEVNULL, capture_output=True)
    assert ran(folder) == ""


def test_the_classes_command_takes_nothing_from_its_folder(folder):
    command = [repository() / "environment/classroom", "--help"]
    assert "autograder" not in subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True).stderr
    assert ran(folder) == ""
