"""The pytest fixtures that every hidden suite has."""

import random

import pytest

from autograder.suitekit.bench import Bench
from autograder.suitekit.judge import BENCH


@pytest.fixture(scope="session")
def bench(pytestconfig: pytest.Config) -> Bench:
    """The submission being graded."""
    return pytestconfig.stash[BENCH]


@pytest.fixture(scope="session")
def submission(bench: Bench) -> dict[str, bytes]:
    """The handed-in files."""
    return bench.files


def used(request: pytest.FixtureRequest) -> set[str]:
    """Return the names of the fixtures that the chosen tests use, directly or through others.

    Their programs start before the first test.  In a whole suite all are used; a part starts only what it needs.
    """
    return {name for item in request.session.items if isinstance(item, pytest.Function) for name in item.fixturenames}


@pytest.fixture
def rng(bench: Bench, request: pytest.FixtureRequest) -> random.Random:
    """A test's own random numbers: the same whenever it runs again with the same seed."""
    return bench.random(request.node.name)
