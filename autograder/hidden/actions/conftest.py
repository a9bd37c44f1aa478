"""The student's programs, all started before the first test waits for any of them."""

import pytest
from course_interfaces.action import Fibonacci

from autograder.hidden.actions.conversation import ACTION, CLIENT, Cancelled, Encounter, Quick
from autograder.suitekit.actions import serve
from autograder.suitekit.bench import Run


@pytest.fixture(scope="session")
def quick(bench) -> Quick:
    """The student's server with a short step period."""
    return Quick(bench, bench.random("quick"))


@pytest.fixture(scope="session")
def cancelled(bench) -> Cancelled:
    """The student's server with the default step period, and a goal that is cancelled."""
    return Cancelled(bench)


@pytest.fixture(scope="session")
def clients(bench) -> dict[str, Encounter]:
    """The client's runs with a server, by what the server does."""
    after = bench.random("cancel").randrange(2, 5)
    return {
        "succeed": Encounter(bench, "succeed"),
        "reject": Encounter(bench, "reject"),
        "abort": Encounter(bench, "abort"),
        "cancel": Encounter(bench, "cancel", "--cancel-after", str(after)),
    }


@pytest.fixture(scope="session")
def misused(bench) -> dict[str, Run]:
    """The client's runs with a wrong command line, by what is wrong."""
    commands = {
        "without ORDER": [],
        "with a word in the place of ORDER": ["ten"],
        "with --cancel-after but no number": ["5", "--cancel-after"],
    }
    ros = bench.enter(bench.new_domain(), threads=4)
    serve(ros, ACTION, Fibonacci, succeed)
    return {about: Run(bench, CLIENT, *args, domain=ros.domain) for about, args in commands.items()}


def succeed(handle):
    """An execute callback that has nothing to do."""
    handle.succeed()
    return Fibonacci.Result()


@pytest.fixture(scope="session", autouse=True)
def begun(cancelled, quick, request):
    """Have all programs start at once."""
    cancelled.begin()
    quick.begin()
    request.getfixturevalue("clients")
    request.getfixturevalue("misused")
