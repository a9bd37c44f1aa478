"""The student's node, started three times at once: with its defaults, and with overrides by command line and file."""

from typing import Any

import pytest

from autograder.hidden.parameters.conversation import (
    DEFAULTS,
    Early,
    PidNode,
    launch_arguments,
    meet_early,
    overrides,
    why_no_controller,
)
from autograder.suitekit import Bench, Renamed, Wrong
from autograder.suitekit.fixtures import used


@pytest.fixture(scope="session")
def renamed() -> Renamed:
    """The node's topics that have another name than the task says."""
    return Renamed()


@pytest.fixture(scope="session")
def pid(bench: Bench, renamed: Renamed) -> PidNode:
    """The node as it starts without any overrides."""
    return PidNode(bench, renamed=renamed)


@pytest.fixture(scope="session")
def by_start(pid: PidNode) -> dict[str, Any]:
    """The parameters that the node has just after its start."""
    return pid.get()


@pytest.fixture(scope="session")
def by_command_line(bench: Bench, renamed: Renamed) -> tuple[PidNode, dict[str, Any]]:
    """The node with overrides on its command line, and these overrides."""
    values = overrides(bench, "command line")
    return PidNode(bench, "--ros-args", *launch_arguments(values), renamed=renamed), values


@pytest.fixture(scope="session")
def by_file(bench: Bench, renamed: Renamed) -> tuple[PidNode, dict[str, Any]]:
    """The node with a parameter file, and the values in that file."""
    values = overrides(bench, "file", above=DEFAULTS["output_max"])
    lines = ["/**:", "  ros__parameters:", *(f"    {name}: {value}" for name, value in values.items()), ""]
    node = PidNode(bench, "--ros-args", "--params-file", "robot.yaml", renamed=renamed)
    node.files = {"robot.yaml": "\n".join(lines).encode()}
    return node, values


@pytest.fixture(scope="session")
def early(pid: PidNode, by_file: tuple[PidNode, dict[str, Any]]) -> Early | None:
    """The node with a parameter file, with its first errors; it gets the next one a good second later."""
    return meet_early(by_file[0]) if pid.has_answered else None


@pytest.fixture(scope="session")
def controls(pid: PidNode, by_command_line: tuple[PidNode, dict[str, Any]]) -> None:
    """The node is a controller: its effort depends on kp.  What it refuses and accepts counts only then."""
    if did := why_no_controller(pid, by_command_line[0]):
        raise Wrong(
            "This counts only in a node that controls: with kp set to 2 and then to 4, the same error must be "
            f"answered with an effort, and then with twice that. Here {did}."
        )


@pytest.fixture(scope="session", autouse=True)
def begun(request: pytest.FixtureRequest) -> None:
    """Have all nodes start at once that a test uses."""
    names = used(request)
    nodes = [request.getfixturevalue("pid")] if "pid" in names else []
    nodes += [request.getfixturevalue(name)[0] for name in ("by_command_line", "by_file") if name in names]
    for node in nodes:
        node.begin()
