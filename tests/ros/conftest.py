"""A node and a ROS domain of their own for the tests of rclpy's private parts and patches."""

import contextlib
from collections.abc import Iterator

import pytest
from rclpy.context import Context
from rclpy.node import Node

from course.session.domains import claim_domain


@pytest.fixture
def domain(monkeypatch):
    """A ROS domain of its own, also for the programs that a test starts."""
    claim, number = claim_domain()
    monkeypatch.setenv("ROS_DOMAIN_ID", str(number))
    yield number
    claim.close()


@contextlib.contextmanager
def node_of_a_context(name: str, domain: int) -> Iterator[Node]:
    """A node of a context of its own."""
    context = Context()
    context.init(args=[], domain_id=domain)
    node = Node(name, context=context)
    yield node
    node.destroy_node()
    context.try_shutdown()


@pytest.fixture
def node(domain):
    """A node of a context of its own."""
    with node_of_a_context("internals", domain) as node:
        yield node
