"""The student's node, started at once for the scans and for each room, all in simulated time."""

import pytest

from autograder.hidden.ai_integration.conversation import SIMULATED, Avoider
from autograder.hidden.ai_integration.rooms import KINDS


@pytest.fixture(scope="session")
def avoider(bench) -> Avoider:
    """The node that is shown scans."""
    return Avoider(bench, *SIMULATED)


@pytest.fixture(scope="session")
def drivers(bench) -> dict[str, Avoider]:
    """The node that drives, for each kind of room."""
    return {kind: Avoider(bench, *SIMULATED) for kind in KINDS}


@pytest.fixture(scope="session")
def by_the_wall(bench) -> Avoider:
    """The node in real time; started only when it turns out to keep time by itself."""
    return Avoider(bench)


@pytest.fixture(scope="session", autouse=True)
def begun(avoider, drivers):
    """Have all start at once."""
    for node in (avoider, *drivers.values()):
        node.begin()
