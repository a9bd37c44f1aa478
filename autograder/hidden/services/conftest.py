"""The student's programs, all started before the first test waits for any of them."""

import pytest

from autograder.hidden.services.conversation import Asking, Motors, Relay
from autograder.suitekit import Bench
from autograder.suitekit.fixtures import used


@pytest.fixture(scope="session")
def motors(bench: Bench) -> Motors:
    """The student's motor service, running."""
    return Motors(bench)


@pytest.fixture(scope="session")
def alone(bench: Bench, motors: Motors) -> Motors:
    """The same once more: it is left alone after an emergency stop."""
    return Motors(bench, like=motors)


@pytest.fixture(scope="session")
def halted(bench: Bench, motors: Motors) -> Motors:
    """The same once more: it is left alone during an emergency stop."""
    return Motors(bench, like=motors)


@pytest.fixture(scope="session")
def asking() -> Asking:
    """Return what is known of the student's relay, wherever it runs."""
    return Asking()


@pytest.fixture(scope="session")
def relay(bench: Bench, asking: Asking) -> Relay:
    """The student's relay, running where the grader serves /add_two_ints."""
    return Relay(bench, bench.random("relay"), True, asking)


@pytest.fixture(scope="session")
def lonely(bench: Bench, asking: Asking) -> Relay:
    """The student's relay, running where nobody serves /add_two_ints."""
    return Relay(bench, bench.random("lonely"), False, asking)


@pytest.fixture(scope="session", autouse=True)
def begun(request: pytest.FixtureRequest) -> None:
    """Have the programs start at once that a test uses, but for one that is called at its start."""
    for name in ("motors", "relay"):
        if name in used(request):
            request.getfixturevalue(name).begin()
