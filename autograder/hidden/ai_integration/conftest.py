"""The student's node, started at once for the scans and for each room, all in simulated time."""

import pytest

from autograder.hidden.ai_integration.conversation import SIMULATED, Avoider
from autograder.hidden.ai_integration.rooms import KINDS
from autograder.suitekit import Bench


@pytest.fixture(scope="session")
def avoider(bench: Bench) -> Avoider:
    """The node that is shown scans."""
    return Avoider(bench, *SIMULATED)


@pytest.fixture(scope="session")
def drivers(bench: Bench) -> dict[str, Avoider]:
    """The nodes that drive, one for each kind of room."""
    return {kind: Avoider(bench, *SIMULATED) for kind in KINDS}


@pytest.fixture(scope="session")
def by_the_wall(bench: Bench) -> Avoider:
    """The node in real time; started only when the node turns out to keep its own time."""
    return Avoider(bench)


@pytest.fixture(scope="session", autouse=True)
def begun(avoider: Avoider, drivers: dict[str, Avoider]) -> None:
    """Have all start at once."""
    for node in (avoider, *drivers.values()):
        node.begin()
