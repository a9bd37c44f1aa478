"""The nodes that a session sees: those that are there, not the ghosts that the middleware leaves on a busy machine."""

import time
from types import SimpleNamespace

import pytest
from rclpy.node import Node

from course.ros.rclpy_internals import NodeNameNonExistentError
from course.session import presence as module
from course.session.live import Session
from course.session.presence import EVENTS, Presence, difference

GHOST, WHOLE, QUIET = range(3)  # without endpoints; with all of them; without parameter events


class Graph:
    """Stands for the session's node: what the middleware lists, by program; the first of a name answers for it."""

    def __init__(self):
        self.programs: list[tuple[str, int]] = []  # a node's name, and which endpoints it has

    def get_node_names_and_namespaces(self):
        return [(name, "/") for name, _ in self.programs]

    def get_publishers_info_by_topic(self, topic):
        assert topic == EVENTS
        return [SimpleNamespace(node_name=name, node_namespace="/") for name, kind in self.programs if kind == WHOLE]

    def get_publisher_names_and_types_by_node(self, wanted, namespace):
        for name, kind in self.programs:
            if (name, "/") == (wanted, namespace):
                return [("/chatter", ["std_msgs/msg/String"])] if kind != GHOST else []
        raise NodeNameNonExistentError

    get_service_names_and_types_by_node = get_publisher_names_and_types_by_node


@pytest.fixture
def graph():
    return Graph()


@pytest.mark.parametrize(
    ("programs", "names"),
    [
        ([("a", WHOLE), ("b", WHOLE)], ["/a", "/b"]),
        ([("a", WHOLE), ("a", WHOLE)], ["/a", "/a"]),
        ([("a", GHOST), ("b", WHOLE)], ["/b"]),
        ([("a", GHOST), ("a", GHOST)], []),
        ([("a", GHOST), ("a", WHOLE)], ["/a"]),
        ([("a", WHOLE), ("a", GHOST), ("a", GHOST)], ["/a"]),
        ([("a", QUIET)], ["/a"]),
        ([("a", QUIET), ("a", GHOST)], ["/a"]),  # as a program looks that is just starting
    ],
)
def test_a_name_counts_for_each_node_that_has_endpoints(graph, programs, names):
    graph.programs = programs
    assert Presence(graph).names() == names


def test_what_another_program_starts_meanwhile_is_not_taken_for_ones_own(graph):
    graph.programs = [("there", QUIET), ("foreign", WHOLE), ("quiet", QUIET), ("ghost", GHOST)]
    assert Presence(graph).new_of_nobody(["/there"]) == ["/quiet"]


def test_nobody_waits_for_a_ghost(graph):
    graph.programs = [("server", GHOST), ("other", WHOLE)]
    began = time.monotonic()
    Presence(graph).wait_until_gone(["/server"], ["/other"])
    assert time.monotonic() - began < module.REMOVAL / 2


def test_a_program_with_endpoints_is_waited_for(graph, monkeypatch):
    monkeypatch.setattr(module, "REMOVAL", 0.5)
    graph.programs = [("server", WHOLE)]
    began = time.monotonic()
    Presence(graph).wait_until_gone(["/server"], [])
    assert time.monotonic() - began >= 0.5


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
