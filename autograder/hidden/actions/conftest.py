"""The student's programs, all started before the first test waits for any of them."""

from typing import Any

import pytest
from course_interfaces.action import Lift

from autograder.hidden.actions.busy import Busy
from autograder.hidden.actions.conversation import ACTION, STEP, Cancelled, Quick, Server, Slow
from autograder.hidden.actions.each_way import EachWay
from autograder.hidden.actions.encounter import CLIENT, LONG, WIDE, Called, Encounter
from autograder.hidden.actions.idle import Idle
from autograder.suitekit import Bench, serve
from autograder.suitekit.fixtures import used

FOR_ROS = ("--ros-args", "--log-level", "info")
# Feedback messages after which a client is to cancel: a goal that is not cancelled is over before so many seconds.
MESSAGES = (7, 10)
NEVER = 9  # feedback messages after which a client is to cancel, of a goal that has fewer
POSSIBLE = (1, 10)  # floors that every lift has, without the one where it begins


@pytest.fixture(scope="session")
def quick(bench: Bench) -> Quick:
    """The student's lift with a short step period and more floors."""
    return Quick(bench, bench.random("quick"))


@pytest.fixture(scope="session")
def busy(bench: Bench) -> Busy:
    """The student's lift, to which something happens while a goal runs."""
    return Busy(bench, bench.random("busy"))


@pytest.fixture(scope="session")
def cancelled(bench: Bench) -> Cancelled:
    """The student's lift with the default step period, and a goal that is cancelled."""
    return Cancelled(bench, bench.random("cancelled"))


@pytest.fixture(scope="session")
def slow(bench: Bench) -> Slow:
    """The student's lift with long steps, and a goal that another one takes over from."""
    return Slow(bench)


@pytest.fixture(scope="session")
def each_way(bench: Bench) -> EachWay:
    """The student's lift, to which something happens on the way up and down, near a stop and far from it."""
    return EachWay(bench, bench.random("each way"))


@pytest.fixture(scope="session")
def idle(bench: Bench) -> Idle:
    """The student's lift, to which nothing happens for some seconds."""
    return Idle(bench)


@pytest.fixture(scope="session")
def one_floor(bench: Bench) -> Server:
    """The student's lift with floor 0 alone."""
    return Server(bench, STEP, "--ros-args", "-p", "top:=0")


@pytest.fixture(scope="session")
def clients(bench: Bench) -> dict[str, Encounter]:
    """The client's runs with a server."""
    after = bench.random("cancel").randrange(*MESSAGES)
    return {
        "succeed": Encounter(bench, "succeed", ahead=True),
        "reject": Encounter(bench, "reject", POSSIBLE),
        "abort": Encounter(bench, "abort"),
        "cancel": Encounter(bench, "cancel", cancel_after=after, ahead=True),
        "at the answer": Encounter(bench, "cancel", cancel_after=1, ahead=True),
        "at once": Encounter(bench, "stopped", cancel_after=0),
        "late": Encounter(bench, "late", cancel_after=2, lasts=LONG),
        "few": Encounter(bench, "succeed", cancel_after=NEVER, lasts=LONG),
        "wide": Encounter(bench, "at once", WIDE),
    }


@pytest.fixture(scope="session")
def called(bench: Bench) -> Called:
    """The client's runs whose command lines are judged."""
    commands: dict[str, list[str]] = {
        "without FLOOR": [],
        "with a word in the place of FLOOR": ["5", "two"],
        "with --cancel-after but no number": ["5", "--cancel-after"],
        "with a word in the place of N": ["5", "--cancel-after", "two"],
    }
    ros = bench.enter(bench.new_domain(), threads=len(commands) + 2)
    serve(ros, ACTION, Lift, succeed)
    return Called(
        {about: bench.run(CLIENT, *args, domain=ros.domain) for about, args in commands.items()},
        bench.run(CLIENT, "5", *FOR_ROS, domain=ros.domain),
    )


def succeed(handle: Any) -> Any:
    """An execute callback that has nothing to do."""
    handle.succeed()
    return Lift.Result()


@pytest.fixture(scope="session", autouse=True)
def begun(request: pytest.FixtureRequest) -> None:
    """Have all programs start at once that a test uses."""
    names = used(request)
    for name in ("cancelled", "quick", "busy", "slow", "idle", "each_way", "one_floor"):
        if name in names:
            request.getfixturevalue(name).begin()
    for name in ("clients", "called"):
        if name in names:
            request.getfixturevalue(name)
