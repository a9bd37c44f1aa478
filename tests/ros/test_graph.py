"""Looking at the graph: what is discovered late is waited for."""

import time

import pytest

from course.foundation.waiting import wait_until
from course.ros.graph import CERTAIN, Graph
from tests.ros.conftest import node_of_a_context

TYPE = "std_msgs/msg/String"


def test_a_topic_that_is_discovered_later_than_the_others_is_found(domain):
    """On a busy machine a node's topics come one after the other, with pauses."""
    begun = []

    def look():
        begun.append(time.monotonic())
        return [("/late", [TYPE])] if begun[-1] - begun[0] > CERTAIN / 2 else []

    with node_of_a_context("other", domain), Graph() as graph:
        assert graph.types_of("/late", look) == [TYPE]


def test_a_topic_that_is_not_there_is_told_soon(domain):
    with node_of_a_context("other", domain), Graph() as graph:
        begun = []
        assert graph.types_of("/none", lambda: begun.append(time.monotonic()) or []) == []
        assert begun[-1] - begun[0] >= CERTAIN


@pytest.mark.parametrize("fails", [1, 10**6], ids=["comes late", "leaves nothing but its name"])
def test_a_node_that_is_listed_and_cannot_be_looked_at_ends_no_command(domain, monkeypatch, fails):
    with node_of_a_context("other", domain), Graph() as graph:
        assert wait_until(lambda: graph.of_node("publisher", "/other", hidden=True), 10)
        look, tries = graph._look_at_node, []

        def fail(*asked):
            tries.append(asked)
            if len(tries) <= fails:
                raise RuntimeError
            return look(*asked)

        monkeypatch.setattr(graph, "_look_at_node", fail)
        assert bool(graph.of_node("publisher", "/other", hidden=True)) == (fails == 1)
