"""A node of its own for the tests of rclpy's private parts and patches."""

import pytest
from rclpy.context import Context
from rclpy.node import Node

from course.session.domains import claim_domain


@pytest.fixture
def node():
    """A node of a context of its own."""
    claim, domain = claim_domain()
    context = Context()
    context.init(args=[], domain_id=domain)
    node = Node("internals", context=context)
    yield node
    node.destroy_node()
    context.try_shutdown()
    claim.close()
