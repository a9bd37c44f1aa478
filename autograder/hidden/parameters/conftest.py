"""The student's node, started three times at once: by itself, with overrides on its command line, and in a file."""

import pytest

from autograder.hidden.parameters.conversation import PidNode, overrides


@pytest.fixture(scope="session")
def pid(grading) -> PidNode:
    """The node as it starts by itself."""
    return PidNode(grading)


@pytest.fixture(scope="session")
def by_start(pid) -> dict:
    """The parameters that the node has when it has just been started."""
    return pid.get()


@pytest.fixture(scope="session")
def by_command_line(grading) -> tuple[PidNode, dict]:
    """The node with overrides on its command line, and these."""
    values = overrides(grading, "command line")
    arguments = [word for name, value in values.items() for word in ("-p", f"{name}:={value}")]
    return PidNode(grading, "--ros-args", *arguments), values


@pytest.fixture(scope="session")
def by_file(grading) -> tuple[PidNode, dict]:
    """The node with a parameter file, and what stands in that."""
    values = overrides(grading, "file")
    lines = ["/**:", "  ros__parameters:", *(f"    {name}: {value}" for name, value in values.items()), ""]
    node = PidNode(grading, "--ros-args", "--params-file", "robot.yaml")
    node.files = {"robot.yaml": "\n".join(lines).encode()}
    return node, values


@pytest.fixture(scope="session", autouse=True)
def begun(pid, by_command_line, by_file):
    """Have all start at once."""
    for node in (pid, by_command_line[0], by_file[0]):
        node.begin()
