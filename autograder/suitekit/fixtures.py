"""The pytest fixtures that every hidden suite has."""

import random

import pytest

from autograder.suitekit.bench import Bench
from autograder.suitekit.judge import BENCH


@pytest.fixture(scope="session")
def bench(pytestconfig) -> Bench:
    """The submission being graded."""
    return pytestconfig.stash[BENCH]


@pytest.fixture(scope="session")
def submission(bench: Bench) -> dict[str, bytes]:
    """The handed-in files."""
    return bench.files


@pytest.fixture
def rng(bench: Bench, request) -> random.Random:
    """Random numbers of a test's own."""
    return bench.random(request.node.name)
