"""The student's node, started three times at once: by itself, with overrides on its command line, and in a file."""

import pytest

from autograder.hidden.parameters.conversation import PidNode, overrides


@pytest.fixture(scope="session")
def pid(bench) -> PidNode:
    """The node as it starts by itself."""
    return PidNode(bench)


@pytest.fixture(scope="session")
def by_start(pid) -> dict:
    """The parameters that the node has when it has just been started."""
    return pid.get()


@pytest.fixture(scope="session")
def by_command_line(bench) -> tuple[PidNode, dict]:
    """The node with overrides on its command line, and these."""
    values = overrides(bench, "command line")
    arguments = [word for name, value in values.items() for word in ("-p", f"{name}:={value}")]
    return PidNode(bench, "--ros-args", *arguments), values


@pytest.fixture(scope="session")
def by_file(bench) -> tuple[PidNode, dict]:
    """The node with a parameter file, and what stands in that."""
    values = overrides(bench, "file")
    lines = ["/**:", "  ros__parameters:", *(f"    {name}: {value}" for name, value in values.items()), ""]
    node = PidNode(bench, "--ros-args", "--params-file", "robot.yaml")
    node.files = {"robot.yaml": "\n".join(lines).encode()}
    return node, values


@pytest.fixture(scope="session", autouse=True)
def begun(pid, by_command_line, by_file):
    """Have all start at once."""
    for node in (pid, by_command_line[0], by_file[0]):
        node.begin()
