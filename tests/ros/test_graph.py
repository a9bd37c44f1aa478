"""Looking at the graph: what is discovered late is waited for."""

import time

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
