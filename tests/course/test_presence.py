"""The nodes that a session sees: those that are there, not the ghosts that the middleware leaves on a busy machine."""

import time

import pytest
from rclpy.node import Node

from course.rclpy_internals import NodeNameNonExistentError
from course.session.live import Session
from course.session.presence import FORGOTTEN, GHOST, Presence, difference


class Graph:
    """Stands for the session's node: what the middleware lists, by participant; the first of a name answers for it."""

    def __init__(self):
        self.participants: list[tuple[str, bool]] = []  # a node's name, and whether it has endpoints

    def get_node_names_and_namespaces(self):
        return [(name, "/") for name, _ in self.participants]

    def get_publisher_names_and_types_by_node(self, wanted, namespace):
        for name, endpoints in self.participants:
            if (name, "/") == (wanted, namespace):
                return [("/parameter_events", ["rcl_interfaces/msg/ParameterEvent"])] if endpoints else []
        raise NodeNameNonExistentError

    get_service_names_and_types_by_node = get_publisher_names_and_types_by_node


@pytest.fixture
def graph():
    return Graph()


@pytest.fixture
def presence(graph):
    return Presence(graph)


def test_the_name_of_a_program_that_has_gone_and_has_no_endpoint_does_not_count(graph, presence):
    graph.participants = [("server", False), ("other", True)]
    began = time.monotonic()
    presence.wait_until_gone(["/server"], ["/other"])
    assert presence.names() == ["/other"]
    assert GHOST <= time.monotonic() - began < FORGOTTEN / 2


def test_a_ghost_hides_no_later_program_of_its_name(graph, presence):
    graph.participants = [("server", False)]
    presence.wait_until_gone(["/server"], [])
    for first in (False, True):  # whichever of the two the middleware lists first
        graph.participants = [("server", first), ("server", not first)]
        assert presence.names() == ["/server"]
    graph.participants = [("server", False)]
    began = time.monotonic()
    presence.wait_until_gone(["/server"], [])
    assert presence.names() == []
    assert time.monotonic() - began < GHOST  # it is known


def test_a_node_that_was_late_to_go_takes_no_other_with_it(graph, presence):
    graph.participants = [("server", False)]
    presence.wait_until_gone(["/server"], [])
    graph.participants = []
    assert presence.names() == []
    graph.participants = [("server", True)]
    assert presence.names() == ["/server"]


def test_a_program_with_endpoints_is_waited_for(graph, presence, monkeypatch):
    monkeypatch.setattr("course.session.presence.FORGOTTEN", 2 * GHOST)
    graph.participants = [("server", True)]
    presence.wait_until_gone(["/server"], [])
    assert presence.names() == ["/server"]


def test_a_node_of_the_same_name_elsewhere_is_still_there_after_a_stop():
    class Twin(Node):
        def __init__(self):
            super().__init__("twin")

    here = Session()
    there = Session(here.domain_id)
    try:
        for session in (here, there):
            session.start(Twin)
        assert here.until(lambda: here.nodes() == ["/twin", "/twin"])
        here.stop()
        assert here.nodes() == ["/twin"]
        there.stop()
        assert here.until(lambda: here.nodes() == [])
    finally:
        there.close()
        here.close()


@pytest.mark.parametrize(
    ("after", "before", "new"),
    [([], [], []), (["/b", "/a"], [], ["/a", "/b"]), (["/a", "/a"], ["/a"], ["/a"]), (["/a"], ["/a", "/b"], [])],
)
def test_difference_counts_names(after, before, new):
    assert difference(after, before) == new
