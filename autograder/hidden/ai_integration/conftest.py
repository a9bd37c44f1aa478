"""The student's agent; and their node, started at once for the scans and for each room, all in simulated time."""

import json
from collections.abc import Callable

import pytest

from autograder.hidden.ai_integration.conversation import ECHO, RIGHT_AGENT, SIMULATED, Agent, Eye, Follower
from autograder.hidden.ai_integration.rooms import KINDS
from autograder.suitekit import Bench, Renamed
from autograder.suitekit.fixtures import used

RULES = (
    ((0.2, 0.4), (0.5, 0.8)),
    ((2.0, 4.0), (2.0, 4.0)),
    ((2.0, 4.0), (0.7, 0.9)),
)  # m: of each rule a front and right


@pytest.fixture(scope="session")
def agent(bench: Bench) -> Agent:
    """The agent by itself."""
    return Agent(bench)


@pytest.fixture(scope="session")
def patient(bench: Bench, agent: Agent) -> Agent:
    """The agent by itself, which is asked for the same distances for some seconds, from the beginning on."""
    rng = bench.random("patient")
    agent.begin_long(*((round(rng.uniform(*front), 3), round(rng.uniform(*right), 3)) for front, right in RULES))
    return agent


@pytest.fixture(scope="session")
def renamed() -> Renamed:
    """The node's topics that have another name than the task says."""
    return Renamed()


@pytest.fixture(scope="session")
def follower(bench: Bench, renamed: Renamed) -> Follower:
    """The node that is shown scans, with an agent that tells what it was given."""
    return Follower(bench, *SIMULATED, renamed=renamed, program=ECHO)


@pytest.fixture(scope="session")
def eye(follower: Follower) -> Eye:
    """A scanner that the node reads right, and in which sectors."""
    return follower.find_eye()


@pytest.fixture(scope="session")
def drivers(bench: Bench, renamed: Renamed, follower: Follower) -> dict[str, Follower]:
    """The nodes that drive with their own agent, one for each kind of room."""
    return {kind: Follower(bench, *SIMULATED, renamed=renamed, like=follower) for kind in KINDS}


@pytest.fixture(scope="session")
def helped(bench: Bench, renamed: Renamed, follower: Follower) -> Callable[[Eye], Follower]:
    """Makes a node that drives with a right agent, for when the student's own decides wrongly."""

    def make(eye: Eye) -> Follower:
        manner = follower.manner(eye.scanner.flat(bench.random("manner"), front=1.0, right=1.0))
        files = {"manner.json": json.dumps(manner).encode()}
        return Follower(bench, *SIMULATED, renamed=renamed, program=RIGHT_AGENT, files=files)

    return make


@pytest.fixture(scope="session")
def by_the_wall(bench: Bench, renamed: Renamed) -> Follower:
    """The first node in real time, without a /clock until it turns out to keep its own time."""
    return Follower(bench, renamed=renamed, program=ECHO)


@pytest.fixture(scope="session", autouse=True)
def begun(request: pytest.FixtureRequest) -> None:
    """Have all nodes start at once that a test uses."""
    names = used(request)
    if "patient" in names:
        request.getfixturevalue("patient")
    nodes = [request.getfixturevalue("follower")] if "follower" in names else []
    nodes += request.getfixturevalue("drivers").values() if "drivers" in names else ()
    nodes += [request.getfixturevalue("by_the_wall")] if "by_the_wall" in names else []
    for node in nodes:
        node.begin()
