"""A process leaves its ROS domain without the wait in which Fast DDS can hang for good."""

import pytest

from autograder.suitekit import ros
from course.foundation.waiting import wait_until
from course.ros import fast_dds, graph
from course.session import live
from tests.ros.conftest import node_of_a_context


def test_who_is_about_to_leave_hears_of_nobody_any_more_and_is_still_heard_of(node, domain):
    """If this fails, check whether the version of Fast DDS has another interface, and still needs this."""
    assert fast_dds.ignore_discovery(domain)
    with node_of_a_context("other", domain) as other:
        assert wait_until(lambda: other.count_publishers("/rosout") == 2, 10)
        assert wait_until(lambda: "other" in node.get_node_names(), 10)
        assert node.count_publishers("/rosout") == 1


def test_a_process_that_has_two_participants_keeps_hearing(node, domain):
    """Only one of them may be about to leave, and nobody says which."""
    with node_of_a_context("other", domain):
        assert not fast_dds.ignore_discovery(domain)
        assert wait_until(lambda: node.count_publishers("/rosout") == 2, 10)


def test_another_middleware_is_left_alone(monkeypatch, domain):
    monkeypatch.setattr(fast_dds, "LIBRARY", "libddsc.so.0")
    assert not fast_dds.ignore_discovery(domain)


@pytest.mark.parametrize(
    ("module", "leave"),
    [
        (graph, lambda domain: graph.Graph().__exit__()),
        (live, lambda domain: live.Session(domain).close()),
        (ros, lambda domain: ros.Ros(domain).close()),
    ],
    ids=["command", "session", "grader"],
)
def test_each_that_leaves_ignores_the_others_first(module, leave, monkeypatch, domain):
    done = []
    monkeypatch.setattr(module, "ignore_discovery", lambda number: done.append(fast_dds.ignore_discovery(number)))
    leave(domain)
    assert done == [True]
