"""The hint on a topic that already has another type in this kernel, where rclpy's error names neither."""

import sys
from types import TracebackType
from typing import Any, cast

from rclpy.node import Node

from course.ros.names import type_name
from course.ros.rclpy_internals import RCLError

VERBS = {"create_subscription": "subscribes to", "create_publisher": "publishes"}


def other_type(error: BaseException) -> str:
    """Return the hint on an endpoint that the middleware refuses because the topic has another type here, or ''.

    Seen in rclpy 7.1.6: the error that is raised is 'invalid allocator'; the one that it replaces is only printed.
    """
    trace: TracebackType | None = error.__traceback__ if isinstance(error, RCLError) else None
    while trace:
        function, values = trace.tb_frame.f_code.co_name, trace.tb_frame.f_locals
        if function in VERBS and "topic" in values and "msg_type" in values:
            session = sys.modules.get("course.session.live") and sys.modules["course.session.live"].current()
            # The node that failed may be destroyed by now.
            return _clash(session.node, str(values["topic"]), type_name(values["msg_type"])) if session else ""
        trace = trace.tb_next
    return ""


def _clash(node: Node, topic: str, kind: str) -> str:
    name = node.resolve_topic_name(topic)
    ends: list[Any] = [
        *((each, VERBS["create_publisher"]) for each in node.get_publishers_info_by_topic(name)),
        *((each, VERBS["create_subscription"]) for each in node.get_subscriptions_info_by_topic(name)),
    ]
    for end, verb in ends:
        if end.topic_type != kind:
            who = "this notebook" if end.node_name.startswith("_") else cast(str, end.node_name)
            return (
                f"{who} {verb} {name} with the type {end.topic_type}, and your line uses {kind}. A topic has one type: "
                "use the same on both sides, or another name."
            )
    return ""
