"""The tests that this run has chosen, for fixtures that begin at once all that these tests will ask for."""

from collections.abc import Collection, Iterable
from typing import Any

import pytest


def parameters(request: pytest.FixtureRequest, name: str) -> list[dict[str, Any]]:
    """Return the parameters of each chosen test of the requesting file that has a parameter `name`."""
    every = [getattr(item, "callspec", None) for item in request.session.items if item.path == request.path]
    return [each.params for each in every if each and name in each.params]


def values(request: pytest.FixtureRequest, name: str) -> list[Any]:
    """Return the values of the parameter `name` in the chosen tests of the requesting file, each once, in their order.

    What begins in the order of the tests is there when its test waits for it.
    """
    return [*dict.fromkeys(each[name] for each in parameters(request, name))]


def cases(every: Iterable[Any], nightly: Collection[Any]) -> list[Any]:
    """Return parameters, of which the nightly ones belong to the matrix."""
    return [pytest.param(each, marks=pytest.mark.matrix if each in nightly else ()) for each in every]


def each_night(*case: Any) -> Any:
    """Return the parameters of a test for the matrix."""
    return pytest.param(*case, marks=pytest.mark.matrix)
