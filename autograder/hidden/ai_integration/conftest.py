"""The student's agent; and their node, started at once for the scans and for each room, all in simulated time."""

import pytest

from autograder.hidden.ai_integration.conversation import SIMULATED, Agent, Follower
from autograder.hidden.ai_integration.rooms import KINDS
from autograder.suitekit import Bench


@pytest.fixture(scope="session")
def agent(bench: Bench) -> Agent:
    """The agent by itself."""
    return Agent(bench)


@pytest.fixture(scope="session")
def follower(bench: Bench) -> Follower:
    """The node that is shown scans, with an agent that tells what it was given."""
    return Follower(bench, *SIMULATED, echo=True)


@pytest.fixture(scope="session")
def drivers(bench: Bench) -> dict[str, Follower]:
    """The nodes that drive with their own agent, one for each kind of room."""
    return {kind: Follower(bench, *SIMULATED) for kind in KINDS}


@pytest.fixture(scope="session")
def by_the_wall(bench: Bench) -> Follower:
    """The first node in real time; started only when it turns out to keep its own time."""
    return Follower(bench, echo=True)


@pytest.fixture(scope="session", autouse=True)
def begun(follower: Follower, drivers: dict[str, Follower]) -> None:
    """Have all start at once."""
    for node in (follower, *drivers.values()):
        node.begin()
