"""The student's node, started three times at once: with its defaults, and with overrides by command line and file."""

from typing import Any

import pytest

from autograder.hidden.parameters.conversation import PidNode, overrides
from autograder.suitekit import Bench


@pytest.fixture(scope="session")
def pid(bench: Bench) -> PidNode:
    """The node as it starts without any overrides."""
    return PidNode(bench)


@pytest.fixture(scope="session")
def by_start(pid: PidNode) -> dict[str, Any]:
    """The parameters that the node has just after its start."""
    return pid.get()


@pytest.fixture(scope="session")
def by_command_line(bench: Bench) -> tuple[PidNode, dict[str, Any]]:
    """The node with overrides on its command line, and these overrides."""
    values = overrides(bench, "command line")
    arguments = [word for name, value in values.items() for word in ("-p", f"{name}:={value}")]
    return PidNode(bench, "--ros-args", *arguments), values


@pytest.fixture(scope="session")
def by_file(bench: Bench) -> tuple[PidNode, dict[str, Any]]:
    """The node with a parameter file, and the values in that file."""
    values = overrides(bench, "file")
    lines = ["/**:", "  ros__parameters:", *(f"    {name}: {value}" for name, value in values.items()), ""]
    node = PidNode(bench, "--ros-args", "--params-file", "robot.yaml")
    node.files = {"robot.yaml": "\n".join(lines).encode()}
    return node, values


@pytest.fixture(scope="session", autouse=True)
def begun(
    pid: PidNode, by_command_line: tuple[PidNode, dict[str, Any]], by_file: tuple[PidNode, dict[str, Any]]
) -> None:
    """Have all start at once."""
    for node in (pid, by_command_line[0], by_file[0]):
        node.begin()
