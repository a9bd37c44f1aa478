"""A folder that somebody has handed in is opened: nothing of it runs before a cell, or a command, asks for it."""

import subprocess
from pathlib import Path

import pytest

from autograder.paths import repository
from tests.kernels import Kernel

# What Python, IPython, JupyterLab or the course look for by these names.
NAMES = [
    "appnope",
    "comm",
    "course",
    "debugpy",
    "decorator",
    "ipykernel",
    "ipykernel_launcher",
    "IPython",
    "ipython_config",
    "jedi",
    "matplotlib",
    "nbgrader_config",
    "rclpy",
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
    return tmp_path


def ran(folder: Path) -> str:
    told = folder / "ran"
    return told.read_text() if told.exists() else ""


def test_a_kernel_takes_nothing_from_its_folder_but_what_a_cell_asks_for(folder):
    kernel = Kernel(folder)
    try:
        for ask in (kernel.client.complete, kernel.client.inspect):
            ask("import os\nos.pa", 15, reply=True, timeout=60)
        assert kernel.run("import course, typing, zmq\nprint(typing.Any)") == "typing.Any"
        assert ran(folder) == ""
        assert kernel.run("import wall_agent\nprint(wall_agent.answer)") == "42"
    finally:
        kernel.stop()
    assert ran(folder) == ""


@pytest.mark.parametrize("command", [["environment/shell", "true"], ["environment/shell", "--lab"]])
def test_a_terminal_takes_nothing_from_its_folder(folder, command):
    program, *arguments = command
    subprocess.run([repository() / program, *arguments], cwd=folder, check=True, timeout=60, stdin=subprocess.DEVNULL)
    assert ran(folder) == ""


def test_the_classes_command_takes_nothing_from_its_folder(folder):
    command = [repository() / "environment/classroom", "--help"]
    assert "autograder" not in subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True).stderr
    assert ran(folder) == ""
